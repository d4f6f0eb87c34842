"""The Bouc-Wen benchmark of nonlinearbenchmark.org: from a linear model to hysteresis.

A mass on a hysteretic spring is driven by a known force, and its displacement is measured with
noise. The training multisine is periodic, so that its periods are averaged and differentiated
exactly within its band. A linear model gives the mass, and with it the loops of the spring. The
diagnosis names what the linear law lacks in them, and says which of all laws fits best. That law is
put under the mass again, refined on the displacement, and predicts both test signals. Published
results are those of Noël, Fakhrizadeh Esfahani, Kerschen and Schoukens 2017 for polynomial
nonlinear state-space models of the same system.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.errors import PlausibilityWarning
from isolation_sim.identification.campaign import Campaign, TestRun
from isolation_sim.laws import Device
from isolation_sim.structures import from_matrices

from .study import Outcome, Step, data_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "The Bouc-Wen benchmark: from a linear model to hysteresis"
DT = 1 / 750
PERIOD = 8192
"""Samples of a period of the training multisine; its first period has the transient."""
BAND = (5.0, 150.0)
"""Frequencies that the multisine excites, Hz."""
HIGHEST = 200.0
"""Highest frequency of the averaged displacement that is kept, Hz."""
LINEAR, BOUC_WEN = "kelvin_voigt", "bouc_wen"
REFINED = {LINEAR: ("k", "c"), BOUC_WEN: ("k", "c", "alpha", "beta", "gamma", "n", "F0")}
"""Parameters refined on the displacement, with the mass; the others are scales."""
PUBLISHED = {
    "published: polynomial state space, degree 2 (34 parameters)": 10 ** (-85.32 / 20),
    "published: polynomial state space, degrees 3, 5, 7 (217 parameters)": 10 ** (-98.32 / 20),
}
"""RMS error on a validation multisine, m (Noël et al. 2017, in dB there)."""
TESTS = {"multisine": "RMS error, multisine, um", "sinesweep": "sine sweep, um"}


@dataclass(frozen=True, eq=False)
class Training:
    """An averaged period of the training signal, (PERIOD,) each: N, m, m/s, m/s2."""

    force: NDArray
    x: NDArray
    v: NDArray
    a: NDArray


def training(data: Mapping[str, NDArray]) -> Training:
    """Average the periods after the first, and differentiate within the band."""
    force = data["train_force_N"][:PERIOD]
    x = data["train_displacement_m"].reshape(-1, PERIOD)[1:].mean(axis=0)
    spectrum, frequency = np.fft.rfft(x), np.fft.rfftfreq(PERIOD, DT)
    spectrum[(frequency > HIGHEST) | (frequency == 0)] = 0.0
    x, v, a = (
        np.fft.irfft(spectrum * (2j * np.pi * frequency) ** order, PERIOD) for order in range(3)
    )
    return Training(force, x, v, a)


def linear_model(signal: Training) -> tuple[float, Device]:
    """Mass, spring and dashpot by least squares over the excited frequencies."""
    frequency = np.fft.rfftfreq(PERIOD, DT)
    excited = (frequency > BAND[0]) & (frequency < BAND[1])
    columns = [np.fft.rfft(one)[excited] for one in (signal.a, signal.v, signal.x, signal.force)]
    a, v, x, force = (np.concatenate([one.real, one.imag]) for one in columns)
    m, c, k = np.linalg.lstsq(np.column_stack([a, v, x]), force, rcond=None)[0].tolist()
    return m, iso.law(LINEAR, {"k": k, "c": c})


def response(mass: float, device: Device, force: NDArray) -> NDArray:
    """Displacement of the mass on a device under a force, from rest, m."""
    held = from_matrices([[mass]], [[0.0]], [[0.0]])
    # a force on the mass moves it as a ground acceleration of the other sign does
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlausibilityWarning)  # a mass of 2 kg is no building
        run = iso.simulate(held.on(device), Record(-force / mass, DT, "force"))
    return run.output("base_displacement_m")


def refine(mass: float, device: Device, signal: Training) -> tuple[float, Device]:
    """Fit the mass and the law's parameters to the displacement of the second period."""
    from scipy.optimize import least_squares

    law = device.law
    start = dict(zip(law.parameter_names, device.parameters_at(0.0), strict=True))
    free = REFINED[law.name]
    scale = np.array([mass, *(start[name] for name in free)])

    def model(q: NDArray) -> tuple[float, Device]:
        m, *values = (q * scale).tolist()
        return m, iso.law(law.name, start | dict(zip(free, values, strict=True)))

    def residual(q: NDArray) -> NDArray:
        moved = response(*model(q), np.tile(signal.force, 2))[PERIOD:]
        return (moved - signal.x) / np.std(signal.x)

    quantities = [next(q for q in law.parameters if q.name == name) for name in free]
    limits = np.array([(0.0, np.inf), *((q.lower, q.upper) for q in quantities)])
    bounds = np.sort(limits / scale[:, np.newaxis], axis=1).T
    solution = least_squares(
        residual, np.ones(len(scale)), diff_step=1e-4, bounds=bounds, ftol=1e-6, xtol=1e-6
    )
    return model(solution.x)


def campaign(mass: float, signal: Training) -> Campaign:
    """Loops of the spring, if the mass is right: half a period to fit, half to validate."""
    force, time = signal.force - mass * signal.a, DT * np.arange(PERIOD // 2)
    halves = {"first half": slice(None, PERIOD // 2), "second half": slice(PERIOD // 2, None)}
    runs = [
        TestRun(
            name, time, signal.x[part], signal.v[part], force[part], np.zeros(len(time)),
            hold_out=part.start is not None, velocity_measured=True,
        )
        for name, part in halves.items()
    ]  # fmt: skip
    return Campaign("Bouc-Wen benchmark", "hysteretic spring", tuple(runs))


def errors(mass: float, device: Device, data: Mapping[str, NDArray]) -> dict[str, float]:
    """RMS errors under both test signals, um; the multisine in its second period."""
    result = {}
    for name, column in TESTS.items():
        force, measured = data[f"{name}_force_N"], data[f"{name}_displacement_m"]
        n = len(measured) if name == "multisine" else 0
        moved = response(mass, device, np.concatenate([force[len(force) - n :], force]))[n:]
        result[column] = 1e6 * float(np.sqrt(np.mean((moved - measured) ** 2)))
    return result


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    with np.load(data_folder("bouc_wen_benchmark") / "data.npz") as file:
        data = dict(file)
    signal = training(data)
    step("linear model", 0.0)
    models = {"linear": refine(*linear_model(signal), signal)}
    mass = models["linear"][0]
    loops = campaign(mass, signal)
    causes, best = "", BOUC_WEN
    if not short:
        step("diagnosing the linear law", 0.1)
        diagnosis = iso.diagnose(loops, LINEAR, tiers="causes", consequence=False)
        diagnosis.save(folder / "diagnosis_linear")
        causes = ", ".join(f"{c.label} ({c.form})" for c in diagnosis.causes)
        if diagnosis.extended is not None:
            added = ", ".join(f"{c.name} ({c.form})" for c in diagnosis.causes)
            models[f"linear with {added}"] = mass, diagnosis.extended
        step("comparing all laws", 0.4)
        family = iso.diagnose(loops, "auto", tiers="causes", consequence=False)
        family.save(folder / "diagnosis_auto")
        assert family.nominal is not None
        best = family.nominal.law.name
    step("hysteretic law", 0.4)
    fitted = iso.fit(loops, best).device
    models[f"{fitted.law.title}, fitted to the loops"] = mass, fitted
    if best in REFINED:
        models[f"{fitted.law.title}, refined on the displacement"] = refine(mass, fitted, signal)
    step("test signals", 0.1)
    rows: list[dict[str, Any]] = [
        {"model": name, "mass, kg": model[0]} | errors(*model, data)
        for name, model in models.items()
    ]
    multisine = TESTS["multisine"]
    rows += [{"model": name, multisine: 1e6 * rms} for name, rms in PUBLISHED.items()]
    return Outcome(rows, finding(rows, causes), {"sine_sweep": _figure(models, data)})


def finding(rows: list[dict[str, Any]], causes: str) -> str:
    """Describe the results of the table."""
    multisine, sweep = TESTS.values()
    own = [row for row in rows if sweep in row]
    first, last = own[0], own[-1]
    said = f" The diagnosis of the linear law: {causes}." if causes else ""
    return (
        f"The linear model misses the test multisine by {first[multisine]:.0f} um and the sine "
        f"sweep by {first[sweep]:.0f} um (RMS).{said} {last['model']}: {last[multisine]:.1f} and "
        f"{last[sweep]:.1f} um. Published models of the same system without its equations: "
        f"{min(1e6 * rms for rms in PUBLISHED.values()):.0f} um on a multisine of their own."
    )


def _figure(models: Mapping[str, tuple[float, Device]], data: Mapping[str, NDArray]) -> Figure:
    """Sine sweep: measured displacement, and what the first and the last model miss of it."""
    from matplotlib.figure import Figure as New

    figure = New(figsize=(6.3, 3.0), layout="constrained")
    axes = figure.subplots()
    measured = data["sinesweep_displacement_m"]
    time = DT * np.arange(len(measured))
    axes.plot(time, 1e3 * measured, color="0.8", label="measured", linewidth=0.5, rasterized=True)
    for name, color in zip((next(iter(models)), list(models)[-1]), ("C1", "C0"), strict=True):
        missed = response(*models[name], data["sinesweep_force_N"]) - measured
        axes.plot(time, 1e3 * missed, color, label=f"error, {name}", linewidth=0.5, rasterized=True)
    axes.set(xlabel="time, s", ylabel="displacement, mm", xlim=(0, time[-1]))
    axes.legend(frameon=False, loc="upper left")
    return figure
