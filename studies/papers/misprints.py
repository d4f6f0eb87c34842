"""Misprinted equations of Yu et al. and of the linearised Bouc-Wen paper.

Where it can be done, the equation as printed is evaluated beside the one that follows from the
paper's other equations, and the difference is reported.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import hybrid, law
from isolation_sim.laws import linearised_bouc_wen as lbw

from .paper_000 import base_model
from .search_002 import FAST
from .table import Check, Equation, Verdict, note, read, reading


def yu() -> Iterator[Check]:
    """Equations 1, 3, 21 and 23 of Yu et al."""
    x = 8e-3 * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 257))  # half a cycle of samples
    device = hybrid.condition(8, 4, 1.0)  # the loop of Figure 4
    upper, lower = (device.force(x, v, (), 1.0) for v in (FAST, -FAST))
    mean = (upper + lower) / 2
    printed = np.sum(upper + lower) / len(x)
    yield Equation(
        "mean of the loop at 8 mm, printed over meant",
        "Eq 1",
        100 * (printed / mean[-1] - 1),
        "%",
        read("1/N and a sum over the samples are printed for 1/2 at every displacement"),
    )
    thickness = np.abs(upper - mean) + np.abs(lower - mean)
    middle = len(x) // 2
    yield Equation(
        "thickness of the loop at 0 mm, printed over meant",
        "Eq 3",
        100 * (np.mean(thickness) / (thickness[middle] / 2) - 1),
        "%",
        read("1/N and a sum over the samples are printed for 1/2 at every displacement"),
    )
    printed, meant = identifiable_lugre_parameters()
    yield Equation(
        "LuGre force, parameters lost",
        "Eq 21",
        2 - printed,
        "",
        note("beta and epsilon both multiply y; with a dot on the last y {} of 2 count", meant),
    )
    peaks = [
        float(np.max(sinusoidal(base_model(name), [8e-3]).last_cycle(0)[2]))
        for name in ("four_parameter", "strain_stiffening")
    ]
    yield Equation(
        "strain-stiffening force, peak at 8 mm, printed over meant",
        "Eq 23",
        100 * (peaks[0] / peaks[1] - 1),
        "%",
        read("alpha x³ is printed for alpha z³ of Eq 25; of the base model of Li & Li at 1 Hz"),
    )


def identifiable_lugre_parameters() -> tuple[int, int]:
    """Rank of the force's derivatives by beta and epsilon of the LuGre model over a loop."""
    numbers = {"k0": 2e4, "c0": 300.0, "alpha": 800.0, "beta": 5e4, "epsilon": 40.0, "F0": 0.0}
    device = law("lugre", numbers)
    motion = sinusoidal(device, 4e-3, cycles=2)
    y = motion.states[:, 0]
    (rate,) = device.rates(motion.displacement, motion.velocity, (y,), 0.0)
    columns = [np.column_stack([y, other / np.max(np.abs(other))]) for other in (y, rate)]
    printed, meant = (int(np.linalg.matrix_rank(each)) for each in columns)
    return printed, meant


def linearised_bouc_wen() -> Iterator[Check]:
    """Equations 2, 7, 9-13 and two sentences of the linearised Bouc-Wen paper."""
    v, z = 1.0, 1.0  # with A, beta and gamma 1 and n 2
    printed = [
        sign * v - abs(sign * v) * abs(sign * z) - sign * v * (sign * z) ** 2 for sign in (1, -1)
    ]
    yield Equation(
        "dz/dt at (v, z) plus dz/dt at (-v, -z)",
        "Eq 2",
        sum(printed),
        "",
        read("z is missing after |z|^(n-1); an odd equation gives 0"),
    )
    yield from _transfer_function()
    yield reading(
        "parameter that is zero",
        "Linearization",
        Verdict.MISPRINT,
        "S_e is meant, which multiplies x: Eq 6 leaves it out, Table 1 has C_e",
        "the parameter C_e should be zero",
    )
    yield reading(
        "least amplitude",
        "Introduction",
        Verdict.MISPRINT,
        "0.1 mm is meant, as in Table 1",
        r"0.1 \mathrm{nm}",
    )


def _transfer_function() -> Iterator[Check]:
    """Equations 7 and 9-13 against Eq 8, over all 48 columns of Table 1."""
    table = lbw.columns()
    C, k1, k2, C_e, k_e = (table[name] for name in ("C", "k1", "k2", "C_e", "k_e"))
    omega = 2 * np.pi * table["frequency_Hz"]
    exact = k1 + k2 * 1j * omega * C_e / (1j * omega - k_e) + 1j * omega * C
    shared = k2 * k_e * omega * C_e
    storage = k1 + k2 * omega**2 * C_e / (omega**2 + k2)
    for name, place, printed, meant, why in (
        (
            "force over displacement",
            "Eq 7",
            k1 + k2 * 1j * omega * C_e / (1j * omega - k1) + 1j * omega * C,
            exact,
            "k1 is printed for ke",
        ),
        ("G_real", "Eqs 9, 10", storage, exact.real, "prints ω² + k2 for ω² + ke²"),
        ("G_img", "Eq 9", omega * (C - shared / (k_e**2 + omega**2)), exact.imag, "an ω too many"),
        (
            "G_img",
            "Eq 11",
            omega * (C - shared / (k_e + omega**2)),
            exact.imag,
            "prints ke + ω² for ω² + ke², and an ω too many",
        ),
        ("G_eq", "Eq 12", exact.real + exact.imag, exact, "lacks i"),
    ):
        off = 100 * np.max(np.abs(printed - meant) / np.abs(meant))
        yield Equation(f"{name} as printed, largest error of 48", place, off, "%", read(why))
    force = np.sin(np.linspace(0, 2 * np.pi, 100, endpoint=False)) + 0.5
    scale = float(np.linalg.norm(force - np.mean(force)))
    yield Equation(
        "denominator of the fitness, printed over meant",
        "Eq 13",
        100 * (float(np.linalg.norm(force - force)) / scale - 1),
        "%",
        read("F_m - F_m is printed for F_m less its mean"),
    )
