"""Loops of a law under a sinusoidal deformation: integrated, measured and drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isolation_sim.identification.loop_measures import LoopMeasures, loop_measures
from isolation_sim.reports.style import legend, line_styles, new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from isolation_sim.laws import Device


class Motion(NamedTuple):
    """Histories of a sinusoidal test; a column a case.

    Attributes
    ----------
    time : numpy.ndarray, shape (n,), s
        From rest.
    displacement, velocity, force : numpy.ndarray, shape (n, ...), m, m/s and N
        Of the device.
    states : numpy.ndarray, shape (n, n_states, ...)
        Internal states of the law, in their own units.
    frequency : float, Hz
        Of the motion.
    points : int
        Samples a cycle.
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    states: np.ndarray
    frequency: float
    points: int

    def last_cycle(self, *case: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement, velocity and force of a case's last cycle, closed."""
        chosen: tuple = (slice(-self.points - 1, None), *case)
        return self.displacement[chosen], self.velocity[chosen], self.force[chosen]

    def measured(self, *case: int, skip: int = 0) -> LoopMeasures:
        """Measure a case's loops, without the first ``skip`` cycles."""
        chosen: tuple = (slice(None), *case)
        x, force = self.displacement[chosen], self.force[chosen]
        return loop_measures(self.time, x, force, frequency=self.frequency, skip=skip)


def sinusoidal(
    device: Device,
    amplitude: Any,
    current: Any = 0.0,
    frequency: float = 1.0,
    cycles: int = 20,
    points: int = 512,
) -> Motion:
    """Move a device sinusoidally from rest, many amplitudes and currents at once.

    Parameters
    ----------
    device : Device
        Its law is integrated by the classical Runge-Kutta method, apart from the library's engine.
    amplitude : array_like, m
        Amplitudes.
    current : array_like, A
        Coil currents, broadcast against the amplitudes.
    frequency : float, Hz
        Of the motion.
    cycles, points : int
        Cycles, and steps to a cycle.

    Returns
    -------
    Motion
    """
    amplitude, current = np.asarray(amplitude, dtype=float), np.asarray(current, dtype=float)
    size = np.broadcast(amplitude, current).shape
    omega, h = 2 * np.pi * frequency, 1 / (frequency * points)
    parameters = device.parameters_at(current)

    n, law = points * cycles + 1, device.law
    # at the ends of the steps and half way
    phase = (omega * h / 2 * np.arange(2 * n - 1)).reshape(-1, *(1,) * len(size))
    x, v = amplitude * np.sin(phase) + 0 * current, amplitude * omega * np.cos(phase) + 0 * current

    states = np.zeros((n, len(law.states), *size))

    def rates(half_step: int, y: np.ndarray) -> np.ndarray:
        return np.array(law.rates(x[half_step], v[half_step], tuple(y), parameters))

    for k in range(n - 1 if law.states else 0):
        y = states[k]
        a = rates(2 * k, y)
        b = rates(2 * k + 1, y + h / 2 * a)
        c = rates(2 * k + 1, y + h / 2 * b)
        d = rates(2 * k + 2, y + h * c)
        states[k + 1] = y + h / 6 * (a + 2 * b + 2 * c + d)
    x, v = x[::2], v[::2]
    force = law.force(x, v, tuple(np.moveaxis(states, 1, 0)), parameters)
    return Motion(h * np.arange(n), x, v, force, states, frequency, points)


Loops = Mapping[str, tuple[np.ndarray, ...]]


def draw_loops(rows: Sequence[tuple[str, Loops]], force_unit: str = "N", title: str = "") -> Figure:
    """Draw force against displacement and velocity.

    Parameters
    ----------
    rows : sequence of tuple
        Title of a row of two panels, and displacement (m), velocity (m/s) and force (N) by label;
        the labels are those of the first row.
    force_unit : {"N", "kN"}
        Unit to draw in.
    title : str
        Above everything, empty for none.

    Returns
    -------
    matplotlib.figure.Figure
    """
    factor = {"N": 1.0, "kN": 1e-3}[force_unit]
    with style():
        figure = new_figure(7.2, 0.7 + 2.5 * len(rows))
        panels = figure.subplots(len(rows), 2, squeeze=False)
        for (name, loops), (left, right) in zip(rows, panels, strict=True):
            for (label, (x, v, force)), line in zip(
                loops.items(), line_styles(len(loops)), strict=True
            ):
                line = line | {"marker": ""} if len(loops) <= 4 else line
                line["markevery"] = max(len(x) // 12, 1)
                left.plot(1e3 * x, factor * force, label=label, **line)
                right.plot(1e3 * v, factor * force, **line)
            left.set(xlabel="displacement (mm)", ylabel=f"force ({force_unit})", title=name)
            right.set(xlabel="velocity (mm/s)", ylabel=f"force ({force_unit})", title=name)
        finish(figure, panels[0, 0], title)
    return figure


def finish(figure: Figure, explained: Axes, title: str = "") -> None:
    """Put a figure's title above and the legend of one panel below.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        A figure two columns wide.
    explained : matplotlib.axes.Axes
        The panel whose lines are those of all.
    title : str
        Empty for none.
    """
    if title:
        figure.suptitle(title, fontsize=9)
    if explained.get_legend_handles_labels()[1]:
        legend(figure, explained, "outside lower center")
