"""A campaign of tests on a device with hidden effects: arrays, and the folder a user would have.

Sensors add white noise of one standard deviation a channel for the whole campaign, a share of the
channel's RMS over it, as a transducer of one range does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

from .devices import Device
from .motion import RATE, Run, motions
from .response import Hidden, respond

SUBSTEPS = 4
TEMPERATURE_NOISE = 0.1
"""Of the room's thermometer, kelvin."""


@dataclass(frozen=True, eq=False)
class BlindRun:
    """What the rig recorded, and beside it what nobody sees: the true force."""

    name: str
    time: np.ndarray
    displacement: np.ndarray
    current: np.ndarray
    temperature: np.ndarray
    force: np.ndarray
    velocity: np.ndarray | None
    true_force: np.ndarray
    hold_out: bool


@dataclass(frozen=True, eq=False)
class BlindCampaign:
    """Runs in s, mm, A, degree Celsius, N (mm/s)."""

    name: str
    runs: tuple[BlindRun, ...]

    def noise_floor(self, hold_out: bool = True) -> float:
        """RMS of the force's own noise over the RMS of the measured force.

        A lower bound of what the true form can reach: the noise of the displacement comes on top,
        as far as a reader does not smooth it away.
        """
        runs = [run for run in self.runs if run.hold_out == hold_out]
        noise = np.concatenate([run.force - run.true_force for run in runs])
        force = np.concatenate([run.force for run in runs])
        return float(np.linalg.norm(noise) / np.linalg.norm(force))

    def write(self, folder: Path) -> Path:
        """Write ``campaign.toml`` and one CSV file per run; the folder must not exist."""
        folder.mkdir(parents=True)
        lines = [f'name = "{self.name}"', 'source = "blind test rig"']
        for run in self.runs:
            lines += ["", "[[run]]", f'file = "{run.name}.csv"']
            lines += ["hold_out = true"] if run.hold_out else []
            columns = {
                "time_s": run.time,
                "displacement_mm": run.displacement,
                "current_A": run.current,
                "force_N": run.force,
                "temperature_C": run.temperature,
            }
            if run.velocity is not None:
                columns["velocity_mm_s"] = run.velocity
            rows = np.column_stack(list(columns.values())).tolist()
            text = "\n".join(",".join(f"{value:.8g}" for value in row) for row in rows)
            (folder / f"{run.name}.csv").write_text(f"{','.join(columns)}\n{text}\n")
        (folder / "campaign.toml").write_text("\n".join(lines) + "\n")
        return folder


def make_campaign(
    device: Device,
    hidden: Sequence[Hidden] = (),
    *,
    programme: str = "quick",
    seed: int = 0,
    force_noise: float = 0.01,
    displacement_noise: float = 0.01,
    velocity_noise: float | None = None,
) -> BlindCampaign:
    """Run a programme (``quick`` or ``full``) on the device; noise as shares of a channel's RMS.

    The velocity is written only if ``velocity_noise`` is given.
    """
    rng = np.random.default_rng([seed, 20])
    tests = motions(programme, seed, SUBSTEPS)
    every = slice(None, None, SUBSTEPS)
    forces = [respond(device, test, hidden)[every] for test in tests]
    shares = {"force": force_noise, "x": displacement_noise, "v": velocity_noise or 0.0}
    level = {
        "force": _rms(forces),
        "x": _rms([t.x for t in tests]),
        "v": _rms([t.v for t in tests]),
    }

    def noise(channel: str, size: int) -> np.ndarray:
        return shares[channel] * level[channel] * rng.standard_normal(size)

    runs = []
    for test, force in zip(tests, forces, strict=True):
        n = force.size
        room = test.temperature + TEMPERATURE_NOISE * rng.standard_normal(n)
        runs.append(
            BlindRun(
                name=test.name,
                time=np.arange(n) / RATE,
                displacement=test.x[every] + noise("x", n),
                current=test.current[every],
                temperature=room,
                force=force + noise("force", n),
                velocity=None if velocity_noise is None else test.v[every] + noise("v", n),
                true_force=force,
                hold_out=test.hold_out,
            )
        )
    return BlindCampaign(f"blind {programme} {seed}", tuple(runs))


def true_form_error(
    campaign: BlindCampaign, device: Device, hidden: Sequence[Hidden] = (), cutoff: float = 15.0
) -> float:
    """Held-out error of the true device with the true effects, driven by what was measured.

    The deformation is the measured one, smoothed without phase below ``cutoff`` (Hz): what a fit of
    the true form to endless data would leave. RMS over the RMS of the measured force.
    """
    smoother = butter(4, cutoff, fs=RATE, output="sos")
    misfit, force = [], []
    for number, run in enumerate(campaign.runs):
        if not run.hold_out:
            continue
        x = make_interp_spline(run.time, sosfiltfilt(smoother, run.displacement), k=5)
        current = make_interp_spline(run.time, run.current, k=1)
        room = float(np.mean(run.temperature))
        motion = Run(run.name, x, current, room).on_grid(number, run.time.size / RATE, SUBSTEPS)
        predicted = respond(device, motion, hidden)[::SUBSTEPS]
        misfit.append(predicted - run.force)
        force.append(run.force)
    return _rms(misfit) / _rms(force)


def _rms(signals: Sequence[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(signals) ** 2)))
