"""Cases of the second family: other tests, other files, effects at sizes that a fit leaves visible.

Metres, kilonewtons and 200 Hz; runs with rests, chirps and ground motions. A size is the share of
the force, RMS, that the law's own coefficients, quadratic in the current, cannot take up to first
order. The noise of both channels is 1 %.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq
from scipy.signal import butter, sosfiltfilt

from .cases import SIZES, Truth
from .second_device import SECOND_FORMS, Effects, SecondForm, Signals, second_device, with_effects

RATE, FINE, COARSE = 200, 1600, 800
DURATION = 8.0
ROOM = 20.0
PAIR_SIZE = 0.03
LAWS = ("bouc_wen", "strain_stiffening")


@dataclass(frozen=True, eq=False)
class Test:
    """A run of the programme: motion (m) and current (A) on a grid of 1600 Hz."""

    name: str
    x: np.ndarray
    current: np.ndarray
    room: float
    hold_out: bool

    def signals(self, rate: int) -> Signals:
        """Signals with two points for each step of an integration at a rate."""
        time = np.arange(self.x.size) / FINE
        points = np.arange(int(DURATION * rate) * 2 - 1) / (2 * rate)
        spline = make_interp_spline(time, self.x, k=5)
        current = np.interp(points, time, self.current)
        return Signals(
            0.5 / rate, spline(points), spline(points, 1), spline(points, 2), current,
            self.room - ROOM,
        )  # fmt: skip


def programme(seed: int) -> list[Test]:
    """Twelve tests, three of them held out."""
    rng = np.random.default_rng([seed, 40])
    t = np.arange(int(DURATION * FINE)) / FINE

    def window(begin: float, end: float) -> np.ndarray:
        return 0.25 * (1 + np.tanh((t - begin) / 0.12)) * (1 - np.tanh((t - end) / 0.12))

    def sine(millimetres: float, frequency: float) -> np.ndarray:
        return millimetres * window(0.4, 9.0) * np.sin(2 * np.pi * frequency * (t - 0.4))

    def ground(millimetres: float, period: float) -> np.ndarray:
        noise = sosfiltfilt(butter(2, [0.25, 5.0], "band", fs=FINE, output="sos"),
                            rng.standard_normal(t.size))  # fmt: skip
        swing = sosfiltfilt(butter(2, [0.8 / period, 1.2 / period], "band", fs=FINE,
                                   output="sos"), rng.standard_normal(t.size))  # fmt: skip
        x = (noise / np.std(noise) + 2 * swing / np.std(swing)) * (t / 2) ** 2 * np.exp(-t / 1.5)
        x *= window(0.3, 7.6)
        return millimetres * x / np.max(np.abs(x))

    def switched(most: float) -> np.ndarray:
        edges = np.sort(rng.uniform(0.5, 7.7, 9))
        levels = most * rng.uniform(0.0, 1.0, 10)
        levels[rng.permutation(10)[:4]] = [0.0, 0.0, most, most]
        jumps = np.diff(levels)[:, np.newaxis] * (1 + np.tanh((t - edges[:, np.newaxis]) / 0.01))
        return np.maximum(levels[0] + jumps.sum(axis=0) / 2, 0.0)

    steps = 8 + 12 * window(2.0, 4.5) - 3 * window(6.0, 9.0)
    chirp = 10 * window(0.3, 7.7) * np.sin(2 * np.pi * (0.3 * t + 0.23 * t**2))
    bursts = (window(0.3, 2.8) + window(5.3, 7.8)) * 26 * np.sin(2 * np.pi * 0.9 * t)
    plan = [
        ("a", sine(6, 2.0), 0.0), ("b", sine(15, 1.0), 2.0), ("c", sine(26, 0.6), 1.0),
        ("d", chirp, 1 - np.cos(np.pi * t / 2)), ("e", ground(20, 1.1), 0.5),
        ("f", ground(28, 1.6), 2.0),
        ("g", steps * np.sin(2 * np.pi * 1.2 * t) * window(0.3, 9), 1.5),
        ("h", sine(14, 1.3), switched(2.0)), ("i", ground(22, 1.3), switched(2.0)),
        ("j", bursts, 1.0), ("k", sine(36, 0.5), 0.5), ("l", sine(36, 0.4), 1.5),
    ]  # fmt: skip
    rooms = rng.permutation(np.linspace(5.0, 35.0, len(plan)))
    return [
        Test(name, 1e-3 * x, current + np.zeros(t.size), float(room), name in "eil")
        for (name, x, current), room in zip(plan, rooms, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class SecondCampaign:
    """Measured runs: columns by name, in the file's units."""

    tests: list[Test]
    columns: list[dict[str, np.ndarray]]

    def write(self, folder: Path) -> Path:
        """Write ``campaign.toml`` and one CSV file per run; the folder must not exist."""
        folder.mkdir(parents=True)
        lines = ['name = "second family"']
        for test, columns in zip(self.tests, self.columns, strict=True):
            lines += ["", "[[run]]", f'file = "{test.name}.csv"']
            lines += ["hold_out = true"] if test.hold_out else []
            table, names = np.column_stack(list(columns.values())), ",".join(columns)
            np.savetxt(folder / f"{test.name}.csv", table, "%.8g", ",", header=names, comments="")
        (folder / "campaign.toml").write_text("\n".join(lines) + "\n")
        return folder


@dataclass(frozen=True)
class SecondCase:
    """One case of the second family: hidden (cause, form), and the visible size of each."""

    kind: str
    law: str
    hidden: tuple[tuple[str, str], ...] = ()
    seed: int = 0
    size: float = SIZES[1]

    @property
    def name(self) -> str:
        """Unique in its list."""
        hidden = "+".join(".".join(one) for one in self.hidden) or "nothing"
        return f"{self.kind}-{self.law}-{hidden}-{self.size:g}-{self.seed}"

    @cached_property
    def device(self):
        """The law with its own numbers."""
        return second_device(self.law, np.random.default_rng([self.seed, 41]))

    @cached_property
    def tests(self) -> list[Test]:
        """The programme."""
        return programme(self.seed)

    @cached_property
    def _calibrated(self) -> list[tuple[SecondForm, float, float, float]]:
        """Form, severity, visible size and whole change of each effect, one after another."""
        motions = [test.signals(COARSE) for test in self.tests]
        result: list[tuple[SecondForm, float, float, float]] = []
        for number, (cause, name) in enumerate(self.hidden):
            form = SECOND_FORMS[cause][name].draw(np.random.default_rng([self.seed, 42, number]))
            before = with_effects([one[:2] for one in result])

            def answer(device, effects, motions=motions):
                return np.concatenate([device.respond(m, effects)[::4] for m in motions])

            clean = answer(self.device, before)
            rows = range(len(self.device.coefficients))
            columns = [
                answer(self.device.shifted(row, power), before) - clean
                for row in rows for power in range(3)
                if not (row == 3 and self.law == "bouc_wen")
            ]  # fmt: skip
            matrix = np.column_stack(columns)
            reach, sizes, _ = np.linalg.svd(matrix / np.linalg.norm(matrix, axis=0), False)
            reach = reach[:, sizes > 1e-7 * sizes[0]]

            def shares(severity, form=form, before=before, clean=clean, reach=reach, answer=answer):
                change = answer(self.device, form.at(severity, before)) - clean
                rest = change - reach @ (reach.T @ change)
                return np.linalg.norm([rest, change], axis=1) / np.linalg.norm(clean)

            end = min(form.limit, 1e9)
            size = min(self.size, 0.95 * shares(end)[0]) if form.limit < np.inf else self.size
            low = 1e-6
            while shares(10 * low)[0] < size and 10 * low < end:
                low *= 10

            def excess(logarithm, size=size, shares=shares):
                return shares(np.exp(logarithm))[0] / size - 1

            severity = np.exp(brentq(excess, np.log(low), np.log(min(10 * low, end)), xtol=1e-2))
            result.append((form, float(severity), *map(float, shares(severity))))
        return result

    @property
    def effects(self) -> Effects:
        """The numbers of all hidden effects."""
        return with_effects([one[:2] for one in self._calibrated])

    @property
    def truth(self) -> Truth:
        """What a diagnosis is scored against."""
        columns = list(zip(*self._calibrated, strict=True)) or [()] * 4
        causes, forms = zip(*self.hidden, strict=True) if self.hidden else ((), ())
        return Truth(self.law, causes, forms, columns[1], columns[2], columns[3],
                     frozenset(), frozenset())  # fmt: skip

    def campaign(self) -> SecondCampaign:
        """The data."""
        rng = np.random.default_rng([self.seed, 43])
        every = slice(None, None, FINE // RATE)
        forces = [self.device.respond(t.signals(FINE), self.effects)[every] for t in self.tests]
        motions = [test.x[every] for test in self.tests]
        levels = [0.01 * np.sqrt(np.mean(np.concatenate(one) ** 2)) for one in (forces, motions)]
        columns = []
        for test, force, x in zip(self.tests, forces, motions, strict=True):
            noise = rng.standard_normal((3, x.size))
            columns.append(
                {
                    "time_s": np.arange(x.size) / RATE,
                    "displacement_m": x + levels[1] * noise[0],
                    "force_kN": 1e-3 * (force + levels[0] * noise[1]),
                    "current_A": test.current[every],
                    "temperature_C": test.room + 0.1 * noise[2],
                }
            )
        return SecondCampaign(self.tests, columns)

    def true_form_error(self, campaign: SecondCampaign) -> float:
        """Held-out error of the true form under the measured motion, smoothed below 15 Hz."""
        smoother = butter(4, 15.0, fs=RATE, output="sos")
        misfit, size = 0.0, 0.0
        for test, columns in zip(campaign.tests, campaign.columns, strict=True):
            if test.hold_out:
                time = columns["time_s"]
                spline = make_interp_spline(time, sosfiltfilt(smoother, columns["displacement_m"]))
                x = spline(np.minimum(np.arange(test.x.size) / FINE, time[-1]))
                driven = Test(test.name, x, test.current, test.room, True)
                force = self.device.respond(driven.signals(FINE), self.effects)[:: FINE // RATE]
                misfit += np.sum((force - 1e3 * columns["force_kN"]) ** 2)
                size += np.sum((1e3 * columns["force_kN"]) ** 2)
        return float(np.sqrt(misfit / size))


def _unseen(form: str, law: str) -> bool:
    """Whether a law's own numbers take a form up."""
    return law == "bouc_wen" and form in ("drifting", "arctan")


def second_singles(sizes: Sequence[float] = SIZES, seed: int = 20000) -> Iterator[SecondCase]:
    """Each form in each law at each size."""
    for law in LAWS:
        for cause, forms in SECOND_FORMS.items():
            for form in forms:
                for size in () if _unseen(form, law) else sizes:
                    seed += 1
                    yield SecondCase("single", law, ((cause, form),), seed, size)


def second_pairs(count: int, seed: int = 22000) -> Iterator[SecondCase]:
    """Random pairs of causes whose forms use different states."""
    rng = np.random.default_rng([seed, 44])
    for number in range(count):
        law = LAWS[number % 2]
        pair: dict[str, tuple[str, str]] = {}
        while len(pair) < 2:
            cause = str(rng.choice(sorted(SECOND_FORMS)))
            form = str(rng.choice(sorted(SECOND_FORMS[cause])))
            if cause not in {one[0] for one in pair.values()} and not _unseen(form, law):
                pair[SECOND_FORMS[cause][form].severity] = cause, form
        yield SecondCase("pair", law, tuple(pair.values()), seed + number, PAIR_SIZE)


def second_clean(count: int, seed: int = 24000) -> Iterator[SecondCase]:
    """Nothing hidden."""
    for number in range(count):
        yield SecondCase("clean", LAWS[number % 2], (), seed + number)
