"""Figures of Li & Li: the stiffening element, the parameter study and Table 2's loops."""

from __future__ import annotations

from typing import TYPE_CHECKING

from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws.published import CURRENTS_A

from .loops import draw_loops
from .paper_000 import AMPLITUDES_MM, STUDY, STUDY_MM, base_model, generalised

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_UNITS = {"alpha": "N/mm³", "c0": "N s/mm", "c1": "N s/mm", "k0": "N/mm", "k1": "N/mm"}
_SIGNS = {"alpha": r"$\alpha$"}


def figures() -> dict[str, Figure]:
    """Draw the figures that text and tables determine."""
    element = base_model("four_parameter", k1=0.0)
    x = 1e-3 * STUDY_MM / 2
    drawn = {
        "000_fig13_element": draw_loops(
            [("", {"": sinusoidal(element, [x], 0.0, 1.0, 1).last_cycle(0)})],
            title=rf"Strain-stiffening element, $\alpha$ = 0.5 N/mm³, {1e3 * x:g} mm, 1 Hz",
        )
    }
    for number, (name, values, others) in STUDY.items():
        loops = {
            f"{_SIGNS.get(name, name)} = {value:g} {_UNITS[name]}": sinusoidal(
                base_model(**others, **{name: value}), [1e-3 * STUDY_MM], 0.0, 1.0, 8, 1024
            ).last_cycle(0)
            for value in values
        }
        beside = "".join(
            f", {_SIGNS.get(key, key)} = {value:g} {_UNITS[key]}" for key, value in others.items()
        )
        drawn[f"000_fig{number}_{name}"] = draw_loops(
            [("", loops)], title=f"Base model{beside}; {STUDY_MM:g} mm, 1 Hz"
        )
    motion = generalised()
    rows = [
        (
            f"{amplitude:g} mm",
            {f"{current:g} A": motion.last_cycle(i, j) for j, current in enumerate(CURRENTS_A)},
        )
        for i, amplitude in enumerate(AMPLITUDES_MM)
    ]
    drawn["000_table2_loops"] = draw_loops(rows, title="Table 2's model, 1 Hz")
    return drawn
