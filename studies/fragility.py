"""Incremental dynamic analysis and fragility curves with confidence bounds.

Far-field motions (El Centro and random ones of Clough and Penzien on three soils) and near-fault
pulses are scaled to levels of spectral acceleration at the isolation period. The level at which a
motion first reaches a limit state is its capacity; capacities are taken as lognormal, fitted by
maximum likelihood, those beyond the highest level as no more than that. Bounds come from drawing
the motions anew.

Source: J. W. Baker, "Efficient analytical fragility function fitting using dynamic structural
analysis", Earthquake Spectra 31 (2015) 579-599 (analysis truncated at the highest level).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from isolation_sim.fragility import Fragility
from isolation_sim.structures.reference import ISOLATED_PERIOD
from isolation_sim.written_names import as_written, capital

from .study import EL_CENTRO, Outcome, Step, along_motions, far_field, published_entry, swept

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

TITLE = "Incremental dynamic analysis and fragility"
CONTROLLERS = ("passive_off", "passive_on", "clipped_lqr")
LIMITS = {
    "peak_base_displacement_m": (0.25, "base displacement 250 mm"),
    "peak_floor_acceleration_m_s2": (3.0, "floor acceleration 3 m/s²"),
}
"""Limit states: room around the base, and what overturns furniture."""
SOILS = ("firm", "medium", "soft")
LEAST_SPREAD = 0.02
"""Lower bound on the lognormal standard deviation: capacities that happen to be equal."""


def motions(short: bool) -> dict[str, dict[str, Any]]:
    """Ground sections by name, the far-field ones first."""
    seeds = range(1) if short else range(6)
    far = {"El Centro": EL_CENTRO} | {
        f"random {soil} {seed}": far_field(seed, soil) for soil in SOILS for seed in seeds
    }
    periods = (2.0,) if short else (1.0, 1.5, 2.0, 3.0)
    near = {
        f"pulse {period:g} s, {degrees}°": {
            "kind": "mavroeidis_papageorgiou_pulse", "peak_velocity_m_s": 0.6,
            "pulse_period_s": period, "phase_rad": float(np.radians(degrees)),
            "quiet_after_s": 15.0,
        }
        for period in periods
        for degrees in (0, 90)
    }  # fmt: skip
    return far | near


def plan(short: bool) -> dict[str, Any]:
    """Return the sweep's plan."""
    records = motions(short)
    scaled = {"sa_period_s": ISOLATED_PERIOD, "scale_to_sa_g": 0.1}
    levels = [0.1, 0.3, 0.6] if short else np.geomspace(0.03, 0.9, 18).round(4).tolist()
    return {
        "name": "fragility",
        "scenario": {"controller": [published_entry(name) for name in CONTROLLERS]},
        "vary": [
            along_motions({name: section | scaled for name, section in records.items()}),
            {"field": "ground.scale_to_sa_g", "label": "sa_g", "values": levels},
        ],
    }  # fmt: skip


def capacity(levels: NDArray, demands: NDArray, limit: float) -> float:
    """Level at which a motion first reaches a limit."""
    demands = np.where(np.isnan(demands), np.inf, demands)
    attained = np.flatnonzero(demands >= limit)
    if not attained.size:
        return np.inf
    k = int(attained[0])
    low, below = (levels[k - 1], demands[k - 1]) if k else (0.0, 0.0)
    if np.isinf(demands[k]):
        return float(levels[k])
    return float(low + (levels[k] - low) * (limit - below) / (demands[k] - below))


def fit_lognormal(capacities: NDArray, highest: float) -> Fragility:
    """Fit a lognormal distribution by maximum likelihood."""
    from scipy.optimize import minimize
    from scipy.stats import norm

    known = np.log(capacities[np.isfinite(capacities)])
    beyond = len(capacities) - len(known)
    if not known.size:
        return Fragility(np.inf, 1.0)
    start = np.array([known.mean(), max(known.std(), LEAST_SPREAD)])
    if not beyond:
        return Fragility(float(np.exp(start[0])), float(start[1]))

    def minus_likelihood(parameterisation: NDArray) -> float:
        mean, dispersion = parameterisation[0], np.exp(parameterisation[1])
        above = norm.logsf((np.log(highest) - mean) / dispersion)
        return -float(norm.logpdf(known, mean, dispersion).sum() + beyond * above)

    bounds = [(None, np.log(highest) + 5.0), (np.log(LEAST_SPREAD), np.log(5.0))]
    result = minimize(minus_likelihood, [start[0], np.log(start[1])], bounds=bounds).x
    return Fragility(float(np.exp(result[0])), float(np.exp(result[1])))


def bootstrap_fits(capacities: NDArray, highest: float, count: int) -> list[Fragility]:
    """Fit again to motions drawn with replacement, by ``scipy.stats.bootstrap``."""
    from scipy.stats import bootstrap

    drawn = bootstrap(
        (capacities,),
        lambda sample: np.array(fit_lognormal(sample, highest)),
        n_resamples=count,
        vectorized=False,
        method="percentile",
        random_state=np.random.default_rng(0),
    )
    return [Fragility(*pair) for pair in drawn.bootstrap_distribution.T]


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    runs = swept(plan(short), folder, step).table
    highest = float(runs["sa_g"].max())
    names = list(motions(short))
    curves: dict[tuple[str, str], tuple[Fragility, list[Fragility]]] = {}
    table = []
    for key, (limit, _) in LIMITS.items():
        for controller in CONTROLLERS:
            rows = runs[runs["controller"] == controller]
            demands = rows.pivot(index="motion", columns="sa_g", values=key).loc[names]
            levels = demands.columns.to_numpy()
            capacities = np.array([capacity(levels, row, limit) for row in demands.to_numpy()])
            fit = fit_lognormal(capacities, highest)
            drawn = bootstrap_fits(capacities, highest, 40 if short else 400)
            curves[key, controller] = fit, drawn
            # of medians as they are, since some may be infinite
            low, high = np.percentile(
                [each.median for each in drawn], [2.5, 97.5], method="inverted_cdf"
            )
            near = np.array([name.startswith("pulse") for name in names])
            table.append({
                "limit": LIMITS[key][1], "controller": controller,
                "median Sa, g": _known(fit.median),
                "from": _known(low), "to": _known(high), "spread": fit.dispersion,
                "far field": _known(fit_lognormal(capacities[~near], highest).median),
                "near fault": _known(fit_lognormal(capacities[near], highest).median),
                "not reached": int(np.isinf(capacities).sum()),
            })  # fmt: skip
    return Outcome(table, _finding(table, len(names)), {"fragility": _figure(runs, curves)})


def _known(level: float) -> float | None:
    return float(level) if np.isfinite(level) else None


def _said(level: float | None) -> str:
    return "none that was run" if level is None else f"{level:.2f} g"


def _finding(table: list[dict[str, Any]], count: int) -> str:
    sentences = [
        f"{count} motions, scaled by their spectral acceleration at {ISOLATED_PERIOD:g} s and 5 %."
    ]
    for _, what in LIMITS.values():
        rows = [row for row in table if row["limit"] == what]
        best = max(rows, key=lambda row: row["median Sa, g"] or np.inf)
        medians = ", ".join(
            f"{as_written(row['controller'])} {_said(row['median Sa, g'])} "
            f"({_said(row['from'])} to {_said(row['to'])}; spread {row['spread']:.2f})"
            for row in rows
        )
        clear = best["from"] is None or all(
            row["to"] is not None and row["to"] < best["from"] for row in rows if row is not best
        )
        sentences.append(
            f"Half of the motions reach the limit, {what}, at: {medians}. "
            f"{capital(as_written(best['controller']))} is "
            f"{'clearly ' if clear else ''}best"
            f"{'' if clear else ', within the bounds of another'}; near-fault pulses alone give it "
            f"{_said(best['near fault'])}, far-field motions {_said(best['far field'])}."
        )
    return "\n".join(sentences)


def _figure(
    runs: pandas.DataFrame, curves: dict[tuple[str, str], tuple[Fragility, list[Fragility]]]
) -> Figure:
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, new_figure, style

    with style():
        figure = new_figure(DOUBLE_COLUMN, 5.0)
        panels = figure.subplots(2, 2)
        for (upper, lower), (key, (limit, title)) in zip(panels.T, LIMITS.items(), strict=True):
            _draw_analysis(upper, runs, key, limit, title)
            of_all = {name: curves[key, name] for name in CONTROLLERS}
            _draw_fragility(lower, of_all, runs["sa_g"].max(), title)
        legend(figure, panels[1, 0], "outside lower center")
    return figure


def _draw_analysis(axes: Axes, runs: pandas.DataFrame, key: str, limit: float, title: str) -> None:
    """Demand against level for one controller: every motion, and the median."""
    from isolation_sim.reports.units import unit_of

    unit, factor = unit_of(key)
    rows = runs[runs["controller"] == CONTROLLERS[-1]]
    demands = rows.pivot(index="motion", columns="sa_g", values=key)
    for name, row in demands.iterrows():
        near = str(name).startswith("pulse")
        axes.plot(factor * row, row.index, color="0.45" if near else "0.7", linewidth=0.6,
                  linestyle="--" if near else "-")  # fmt: skip
    axes.plot(factor * demands.median(), demands.columns, color="black", linewidth=1.5)
    axes.axvline(factor * limit, color="black", linewidth=0.8, linestyle=":")
    axes.set(xlabel=f"{title.rsplit(' ', 2)[0]}, {unit}", ylabel="spectral acceleration, g",
             xlim=(0, 3.5 * factor * limit),
             title=f"{as_written(CONTROLLERS[-1])}, all motions; dashed: near fault")  # fmt: skip


def _draw_fragility(
    axes: Axes, curves: dict[str, tuple[Fragility, list[Fragility]]], highest: float, title: str
) -> None:
    """Probability of reaching a limit against level, with its bounds, for each controller."""
    from isolation_sim.reports.style import line_styles

    levels = np.linspace(0.005, highest, 200)
    looks = line_styles(len(curves))
    for (name, (fit, drawn)), look in zip(curves.items(), looks, strict=True):
        bounds = np.percentile([each.probability(levels) for each in drawn], [2.5, 97.5], axis=0)
        axes.fill_between(levels, *bounds, color=look["color"], alpha=0.15, linewidth=0)
        axes.plot(levels, fit.probability(levels), label=as_written(name), **look)
    axes.set(xlabel="spectral acceleration, g", ylabel="probability of reaching it", ylim=(0, 1),
             title=title)  # fmt: skip
