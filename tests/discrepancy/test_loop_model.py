"""Laws fitted to a loop table: what they give is the law's, and not the numerics'."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from isolation_sim.discrepancy.loops import effect_search
from isolation_sim.discrepancy.loops.effect_search import LoopSearch
from isolation_sim.discrepancy.loops.model import FittedLoops, loop_motion
from isolation_sim.discrepancy.loops.table import LoopTable
from isolation_sim.laws.registry import LAWS

AMPLITUDE, CURRENT = np.meshgrid([2e-3, 4e-3, 8e-3], [0.0, 1.5, 3.0], indexing="ij")
TABLE = LoopTable(
    "stiffer and more damped with current, softer with amplitude",
    amplitude=AMPLITUDE.ravel(),
    frequency=np.ones(9),
    current=CURRENT.ravel(),
    stiffness=((2e4 + 1.5e4 * CURRENT) * (AMPLITUDE / 4e-3) ** -0.2).ravel(),
    damping=(0.15 + 0.02 * CURRENT).ravel(),
    held_out=np.zeros(9, bool),
)


def fitted(law: str, table: LoopTable = TABLE) -> FittedLoops:
    with ThreadPoolExecutor(2) as pool:
        return LoopSearch(table, pool, 0, lambda: None).fit_law(LAWS[law], None, 1)


# stiff, with a sharp step in velocity, and one that diverges with long integration steps
@pytest.mark.parametrize("law", ["strain_stiffening", "hyperbolic_tangent", "spring_pot"])
def test_fitted_loops_do_not_depend_on_steps_and_samples(law):
    result = fitted(law)
    ratios = result.ratios
    assert np.isfinite(ratios).all()
    data = result.model.data
    fine = replace(
        result.model, data=loop_motion(TABLE, 4 * result.model.samples, 4 * int(data.n_steps[0]))
    )
    assert fine.loops(result.optimum.x)[0] == pytest.approx(ratios, abs=0.02)


@pytest.mark.parametrize("law", [pytest.param("bouc_wen", marks=pytest.mark.slow), "hybrid"])
def test_offset_that_no_loop_shows_stays_small(law):
    # times the rounding of velocities it reached 1e16 N, and that passed for damping
    result = fitted(law)
    largest = np.max(TABLE.stiffness * TABLE.amplitude)
    force = result.model.forces(result.optimum.x, derivatives=False)[0]
    assert np.abs(force).max() < 10 * largest


def test_a_purely_elastic_law_has_no_damping():
    result = fitted("linear", replace(TABLE, damping=np.full(9, 0.1)))
    assert result.ratios[9:] == pytest.approx(0, abs=1e-12)


def test_a_large_table_is_searched_on_some_rows(monkeypatch):
    small = fitted("kelvin_voigt")
    monkeypatch.setattr(effect_search, "LOOP_WHOLE", 8)
    monkeypatch.setattr(effect_search, "LOOP_ROWS", 6)
    with ThreadPoolExecutor(2) as pool:
        space = LoopSearch(TABLE, pool, 0, lambda: None)
        result = space.fit_law(LAWS["kelvin_voigt"], None, 1)
        (whole,) = space.on_all(result)
    assert len(space.table.amplitude) == 6 and len(space.judging.amplitude) == 3
    # the corners of the conditions are among them
    corners = set(zip(space.table.amplitude, space.table.current, strict=True))
    assert {(x, i) for x in (2e-3, 8e-3) for i in (0.0, 3.0)} <= corners
    assert whole.model.table is TABLE and whole.model.cycles > result.model.cycles
    assert whole.ratios == pytest.approx(small.ratios, rel=1e-2)
