"""What a test rig does to a device: deformation, current and ambient temperature against time.

Every campaign of a size uses the same programme, whatever is hidden in it, so that the programme
tells nothing; only frequencies' phases, random signals and temperatures follow the seed. Every run
starts at rest with a virgin device at ambient temperature (no memory from the run before): a reader
of the folder could not know otherwise. The supply needs 60 ms for a change of current and the
current is measured, so that how a reader interpolates between samples hardly matters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

RATE = 256
"""Samples a second."""
AMBIENT = 22.0
"""Temperature at which the devices' parameters hold, degree Celsius."""
LARGEST = 12.0
"""Largest amplitude of the programme, mm; a run of it is fitted and another held out."""

Signal = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Motion:
    """One run on a uniform grid: mm, mm/s, mm/s^2, A; ``temperature`` is the room's."""

    name: str
    time: np.ndarray
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray
    current: np.ndarray
    temperature: float
    hold_out: bool
    number: int

    @property
    def step(self) -> float:
        """Grid step, s."""
        return float(self.time[1] - self.time[0])


@dataclass(frozen=True)
class Run:
    """A run of the programme before it is put on a grid."""

    name: str
    deformation: Signal
    current: Signal
    temperature: float
    hold_out: bool = False

    def on_grid(self, number: int, duration: float, substeps: int) -> Motion:
        """Sample on ``substeps`` points a sample; derivatives by a quintic spline."""
        step = 1 / (RATE * substeps)
        time = np.arange(round(duration / step)) * step
        spline = make_interp_spline(time, self.deformation(time), k=5)
        return Motion(
            name=self.name,
            time=time,
            x=spline(time),
            v=spline(time, 1),
            a=spline(time, 2),
            current=np.maximum(self.current(time), 0.0),
            temperature=self.temperature,
            hold_out=self.hold_out,
            number=number,
        )


def ease(u: np.ndarray) -> np.ndarray:
    """From 0 to 1 with three continuous derivatives."""
    u = np.clip(u, 0.0, 1.0)
    return u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3)


def sine(amplitude: float, frequency: float) -> Signal:
    """Sinusoid (Hz) that grows from rest within half a second."""
    return lambda t: amplitude * ease(t / 0.5) * np.sin(2 * np.pi * frequency * t)


def swelling(amplitude: float, frequency: float, duration: float) -> Signal:
    """A sinusoid that swells to its amplitude and dies away again."""
    return lambda t: (
        amplitude * np.sin(np.pi * t / duration) ** 2 * np.sin(2 * np.pi * frequency * t)
    )


def triangle(amplitude: float, frequency: float) -> Signal:
    """A triangle as an actuator makes it: seven odd harmonics."""
    odd = np.arange(1, 14, 2)
    height = 8 / np.pi**2 * (-1.0) ** (odd // 2) / odd**2
    return lambda t: (
        amplitude * ease(t / 0.5) * (np.sin(2 * np.pi * frequency * np.outer(t, odd)) @ height)
    )


def random(rms: float, low: float, high: float, rng: np.random.Generator) -> Signal:
    """Sixty sinusoids of random frequency and phase, weaker where faster."""
    frequency = rng.uniform(low, high, 60)
    phase = rng.uniform(0, 2 * np.pi, 60)
    weight = 1 / np.maximum(frequency, 1.0)
    weight *= rms / np.sqrt(np.sum(weight**2) / 2)
    return lambda t: ease(t / 0.5) * (np.sin(2 * np.pi * np.outer(t, frequency) + phase) @ weight)


def hold(amplitude: float, duration: float) -> Signal:
    """Out, wait, half back, wait, home: what shows relaxation."""
    part = duration / 8
    stops = ((0.2, amplitude), (3 * part, -amplitude / 2), (6 * part, -amplitude / 2))
    return lambda t: sum(size * ease((t - start) / 0.4) for start, size in stops)


def steady(current: float) -> Signal:
    """Constant current, A."""
    return lambda t: np.full_like(t, current)


def steps(every: float, duration: float, rng: np.random.Generator) -> Signal:
    """The current jumps to a random level, within 60 ms, at random times."""
    count = max(3, round(duration / every))
    times = np.sort(rng.uniform(0.05, 0.98, count)) * duration
    levels = rng.permutation(np.linspace(0.0, 3.0, count + 1))
    return lambda t: (
        levels[0]
        + sum(
            (after - before) * ease((t - start) / 0.06)
            for start, before, after in zip(times, levels, levels[1:], strict=False)
        )
    )


def ramps(period: float) -> Signal:
    """The current goes up and down slowly, with a smaller cycle within."""
    return lambda t: (
        1.5 * (1 - np.cos(2 * np.pi * t / period)) * (0.8 + 0.2 * np.cos(6 * np.pi * t / period))
    )


def full_programme(seed: int) -> tuple[list[Run], float]:
    """Thirty runs of 12 s, eight of them held out."""
    rng = np.random.default_rng([seed, 30])
    duration = 12.0
    pairs: list[tuple[str, Signal, Signal]] = []
    for j, amplitude in enumerate((2.0, 4.0, 8.0)):
        for current in range(4):
            # the actuator's speed limits large amplitudes to 2 Hz
            choices = (0.5, 1.0, 2.0, 4.0) if amplitude < 8 else (0.5, 1.0, 2.0)
            frequency = choices[(j + current) % len(choices)]
            name = f"sine_{amplitude:g}mm_{frequency:g}Hz_{current}A"
            pairs.append((name, sine(amplitude, frequency), steady(current)))
    for current in (0.0, 1.5, 3.0):
        pairs.append((f"swelling_{current:g}A", swelling(8.0, 1.5, duration), steady(current)))
    for frequency, current in ((0.5, 2.0), (1.0, 0.5)):
        pairs.append((f"triangle_{frequency:g}Hz", triangle(5.0, frequency), steady(current)))
    for current in (0.0, 1.0, 2.0, 3.0):
        pairs.append((f"random_{current:g}A", random(2.5, 0.2, 8.0, rng), steady(current)))
    for name, signal in (
        ("4mm_1Hz", sine(4.0, 1.0)),
        ("2mm_3Hz", sine(2.0, 3.0)),
        ("random_a", random(2.5, 0.2, 5.0, rng)),
        ("random_b", random(2.5, 0.2, 5.0, rng)),
    ):
        pairs.append((f"switched_{name}", signal, steps(0.9, duration, rng)))
    pairs.append(("current_cycle", sine(3.0, 2.0), ramps(duration)))
    for current in (0.5, 1.5, 2.5):
        pairs.append((f"large_{current:g}A", sine(LARGEST, 0.5), steady(current)))
    pairs.append(("hold_2A", hold(6.0, duration), steady(2.0)))
    held = {
        "sine_2mm_2Hz_2A",
        "sine_4mm_2Hz_1A",
        "sine_8mm_1Hz_2A",
        "swelling_1.5A",
        "triangle_1Hz",
        "random_2A",
        "switched_random_b",
        "large_1.5A",
    }
    return _runs(pairs, held, rng), duration


def quick_programme(seed: int) -> tuple[list[Run], float]:
    """Ten runs of 6 s, three of them held out."""
    rng = np.random.default_rng([seed, 10])
    duration = 6.0
    pairs = [
        ("sine_2mm_2Hz_0A", sine(2.0, 2.0), steady(0.0)),
        ("sine_4mm_1Hz_3A", sine(4.0, 1.0), steady(3.0)),
        ("sine_8mm_0.5Hz_1A", sine(8.0, 0.5), steady(1.0)),
        ("swelling_2A", swelling(8.0, 1.5, duration), steady(2.0)),
        ("random_1A", random(3.0, 0.2, 8.0, rng), steady(1.0)),
        ("random_3A", random(3.0, 0.2, 8.0, rng), steady(3.0)),
        ("switched_4mm_1Hz", sine(4.0, 1.0), steps(0.7, duration, rng)),
        ("switched_random", random(3.0, 0.2, 5.0, rng), steps(0.7, duration, rng)),
        ("large_1.5A", sine(LARGEST, 0.5), steady(1.5)),
        ("large_0.5A", sine(LARGEST, 0.5), steady(0.5)),
    ]
    return _runs(pairs, {"random_1A", "switched_random", "large_0.5A"}, rng), duration


def _runs(pairs, held, rng) -> list[Run]:
    """Room temperatures spread evenly, in random order, so that their effect is determinable."""
    rooms = rng.permutation(np.linspace(14.0, 32.0, len(pairs)))
    runs = [
        Run(f"{number:02d}_{name}", x, current, round(float(room), 1), name in held)
        for number, ((name, x, current), room) in enumerate(zip(pairs, rooms, strict=True), 1)
    ]
    assert sum(run.hold_out for run in runs) == len(held)
    return runs


PROGRAMMES = {"full": full_programme, "quick": quick_programme}


def motions(programme: str, seed: int, substeps: int) -> list[Motion]:
    """Every run of a programme on its grid."""
    runs, duration = PROGRAMMES[programme](seed)
    return [run.on_grid(i, duration, substeps) for i, run in enumerate(runs)]
