"""The next tests of a device: those that tell rival causes apart, and conditions not yet tested."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from ..identification.measured.loop_cycles import find_frequency
from ..identification.measured.run_table import TestRun
from ..io.csv_table import write_table
from ..io.files import plain
from ..rendering import Printed, render
from .decisions import BEYOND_TESTED, GRID_CELLS, RIG_MARGIN, SINUSOIDAL, STEADY_CURRENT
from .device.conditions import same_values

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class PlannedTest:
    """A sinusoidal test to make.

    Attributes
    ----------
    amplitude : float
        Of the displacement, m.
    frequency : float
        Hz.
    currents : tuple of float
        The current, or two between which it steps, A.
    duration : float
        Of the motion, s.
    sample_rate : float
        Hz.
    why : str
        What it is for.
    step : float
        Time between steps of the current, s; 0 for a constant one.
    rest : float
        Rest in the middle, between two equal parts, s; 0 for none.
    tells : tuple of str
        Cause and rival that it tells apart; empty for a condition that was not tested.
    difference : float
        RMS difference of their predicted forces over the noise of the force; NaN without rivals.
    words : str
        The test in words; empty for a condition that was not tested.
    """

    __test__ = False  # not a test class to pytest

    amplitude: float
    frequency: float
    currents: tuple[float, ...]
    duration: float
    sample_rate: float
    why: str
    step: float = 0.0
    rest: float = 0.0
    tells: tuple[str, ...] = ()
    difference: float = float("nan")
    words: str = ""

    @property
    def sentence(self) -> str:
        """The test of two rivals in a sentence."""
        cause, rival = self.tells
        return (
            f"To distinguish {cause} from {rival}: {self.words}; their predictions differ there by "
            f"{self.difference:.3g} times the force's noise (RMS). Only tests up to "
            f"{BEYOND_TESTED:g} times the tested velocity, acceleration and force were compared."
        )

    def to_dict(self) -> dict[str, Any]:
        """A row of a test matrix, units in the names; None where a number does not apply."""
        return {
            "waveform": "sine",
            "amplitude_mm": float(f"{1e3 * self.amplitude:.3g}"),
            "frequency_Hz": float(f"{self.frequency:.3g}"),
            "cycles": max(round(self.duration * self.frequency), 1),
            "current_A": float(f"{self.currents[0]:.4g}"),
            "second_current_A": float(f"{self.currents[1]:.4g}") if self.step else None,
            "current_step_s": self.step or None,
            "rest_in_the_middle_s": self.rest or None,
            "sample_rate_Hz": float(f"{self.sample_rate:.4g}"),
            "why": self.why,
            "difference_over_noise": plain(float(f"{self.difference:.3g}")),
        }


@dataclass(frozen=True)
class TestPlan(Printed):
    """Tests to make next.

    Attributes
    ----------
    name : str
        The data for which they were planned.
    tests : tuple of PlannedTest
        Those that tell rival causes apart, then conditions that were not tested.
    notes : tuple of str
        What the tests made so far cannot show.
    """

    __test__ = False  # not a test class to pytest

    name: str
    tests: tuple[PlannedTest, ...]
    notes: tuple[str, ...] = ()

    @property
    def matrix(self) -> tuple[PlannedTest, ...]:
        """Each test once, also if it tells several causes apart; their least difference."""
        tests: dict[Any, PlannedTest] = {}
        for one in self.tests:
            same = tests.setdefault(one.words or id(one), one)
            if same is not one:
                tests[one.words] = replace(
                    same,
                    why=f"{same.why}, {one.why.removeprefix('tells ')}",
                    difference=min(same.difference, one.difference),
                )
        return tuple(tests.values())

    def to_records(self) -> list[dict[str, Any]]:
        """List the tests as rows of a test matrix.

        Returns
        -------
        list of dict
            With a number each, ``test``.
        """
        return [{"test": k} | one.to_dict() for k, one in enumerate(self.matrix, 1)]

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as plain numbers and text.

        Returns
        -------
        dict
        """
        return {"data": self.name, "tests": self.to_records(), "notes": list(self.notes)}

    def to_pandas(self) -> pandas.DataFrame:
        """Return the test matrix, a row per test.

        Returns
        -------
        pandas.DataFrame
        """
        import pandas

        return pandas.DataFrame(self.to_records())

    @checked
    def to_csv(self, path: str | Path) -> Path:
        """Write the test matrix as CSV.

        Parameters
        ----------
        path : str or pathlib.Path
            File to write, replaced whole or not at all.

        Returns
        -------
        pathlib.Path
            The file.
        """
        records = [
            {key: "" if value is None else value for key, value in row.items()}
            for row in self.to_records()
        ]
        write_table(records, path)
        return Path(path)

    def __repr__(self) -> str:
        return f"TestPlan({self.name!r}, {len(self.matrix)} tests)"

    def _shown(self) -> Iterator[Any]:
        if self.tests:
            yield render("diagnosis:plan_table", self)
        else:
            yield f"{self.name}: no test is proposed"
        yield from self.notes


def missing_conditions(
    runs: Sequence[TestRun],
) -> tuple[tuple[PlannedTest, ...], tuple[str, ...]]:
    """Combinations of tested amplitudes, frequencies and currents without a test; notes.

    The first lie farthest from what was tested.
    """
    largest = max(float(np.max(np.abs(run.current))) for run in runs)
    sinusoids = [
        (run, *one) for run in runs
        if np.ptp(run.current) <= STEADY_CURRENT * largest and (one := _sinusoid(run)) is not None
    ]  # fmt: skip
    if len(sinusoids) < 2:
        return (), ("Fewer than two tests are sinusoids at a constant current: there is no grid.",)
    amplitudes, frequencies = (np.array([one[k] for one in sinusoids]) for k in (1, 2))
    currents = np.array([float(np.mean(run.current)) for run, *_ in sinusoids])
    groups = [
        same_values(amplitudes, 0.15), same_values(frequencies, 0.15),
        same_values(currents, 0.0, STEADY_CURRENT * largest),
    ]  # fmt: skip
    notes = tuple(
        f"All sinusoids have one {what}: they cannot show the dependence on it."
        for what, group in zip(("amplitude", "frequency", "current"), groups, strict=True)
        if len(group) == 1 and (what != "current" or largest > 0)
    )
    speed = 2 * np.pi * frequencies
    fastest, hardest = (float(np.max(amplitudes * speed**n)) for n in (1, 2))
    cycles = float(np.median([np.ptp(run.time) * f for run, _, f in sinusoids]))
    rate = float(np.median([1 / run.step for run, *_ in sinusoids]))
    cells = list(product(*groups))
    if len(cells) > GRID_CELLS * len(sinusoids):
        grid = " x ".join(str(len(group)) for group in groups)
        return (), (*notes, f"The tests are no grid of amplitudes, frequencies, currents ({grid}).")
    tests = []
    for a, f, i in cells:
        amplitude, omega = float(np.mean(amplitudes[a])), float(np.mean(speed[f]))
        within = amplitude * omega <= RIG_MARGIN * fastest
        within &= amplitude * omega**2 <= RIG_MARGIN * hardest
        if within and not (a & f & i).any():
            frequency = omega / (2 * np.pi)
            current = np.mean(currents[i])
            if abs(current) <= STEADY_CURRENT * largest:
                current = 0.0  # noise or an offset of the sensor
            tests.append(PlannedTest(
                amplitude, frequency, (float(current),), cycles / frequency, rate,
                "this combination was not tested",
            ))  # fmt: skip
    untested = np.array([(t.amplitude, t.frequency, t.currents[0]) for t in tests])
    order = _farthest_first(np.column_stack([amplitudes, frequencies, currents]), untested)
    return tuple(tests[k] for k in order), notes


def _farthest_first(tested: NDArray, untested: NDArray) -> list[int]:
    """Order of untested conditions: each lies farthest from the tests and from those before it.

    ``tested``, ``untested``: amplitude, frequency and current, (n, 3). Distances are over the range
    of each, of amplitude and frequency by their logarithms.
    """
    if not len(untested):
        return []
    both = np.vstack([tested, untested])
    both[:, :2] = np.log(both[:, :2])
    both /= np.maximum(np.ptp(both, axis=0), 1e-9)
    done, left = both[: len(tested)], both[len(tested) :]
    nearest = np.min(np.linalg.norm(left[:, np.newaxis] - done, axis=2), axis=1)
    order = []
    for _ in range(len(left)):
        order.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(left - left[order[-1]], axis=1))
        nearest[order] = -1.0
    return order


def _sinusoid(run: TestRun) -> tuple[float, float] | None:
    """Amplitude, m, and frequency, Hz, of a sinusoidal test of three cycles or more."""
    frequency = find_frequency(run.time, run.displacement)
    if frequency * np.ptp(run.time) < 3:
        return None
    n = len(run.time)
    middle = slice(n // 4, n - n // 4)
    x = run.displacement[middle]
    phase = 2 * np.pi * frequency * (run.time[middle] - run.time[0])
    columns = np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)], axis=1)
    values: NDArray = np.linalg.lstsq(columns, x, rcond=None)[0]
    if np.var(x - columns @ values) > SINUSOIDAL * np.var(x):
        return None
    return float(np.hypot(*values[1:])), frequency
