"""Sensitivity indices of a sampled sweep, by SALib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, not_installed
from .axes import problem_of, sample_of

if TYPE_CHECKING:
    import pandas

    from .plan import SweepPlan


def indices(plan: SweepPlan, values: np.ndarray, place: str, label: str) -> pandas.DataFrame:
    """Indices of every sampled quantity; see `Sweep.sensitivity`.

    References
    ----------
    A. Saltelli et al., Computer Physics Communications 181 (2010) 259-270 (saltelli); M. D. Morris,
    Technometrics 33 (1991) 161-174 (morris); J.-Y. Tissot and C. Prieur, Reliability Engineering
    and System Safety 107 (2012) 205-213 (random balance designs).
    """
    import pandas

    if plan.sample is None:
        raise InputError(f"{place}: nothing was sampled; expected: a plan with a [sample] section")
    sampled = [each for each in plan.vary if each.sampled]
    problem = problem_of(sampled)
    points = sample_of(plan.sample, sampled)
    for column, each in zip(points.T, sampled, strict=True):
        if each.spacing == "log":
            column[:] = np.log(column)
    if len(values) != len(points):
        raise InputError(
            f"{place}: {len(values)} runs of {label} for {len(points)} points; expected: a "
            "finished sweep in which only the sample varies"
        )
    failed = int(np.isnan(values).sum())
    if failed:
        raise InputError(
            f"{place}: {failed} runs of {label} failed; expected: limits within which all succeed"
        )
    result = _analyse(plan.sample.method, problem, points, values, plan.sample.seed)
    names = {name: result[name] for name in ("S1", "ST", "mu_star", "sigma") if name in result}
    columns = {}
    for name, numbers in names.items():
        columns[name] = np.asarray(numbers, float)
        if f"{name}_conf" in result:
            columns[f"{name}_conf"] = np.asarray(result[f"{name}_conf"], float)
    return pandas.DataFrame(columns, index=pandas.Index(problem["names"], name="quantity"))


def _analyse(method: str, problem: dict, points: np.ndarray, values: np.ndarray, seed: int):
    try:
        from SALib.analyze import morris, rbd_fast, sobol
    except ImportError:
        raise not_installed("sensitivity", "SALib", "sweeps") from None
    if not np.ptp(values) > 0:
        raise InputError("sensitivity: all runs have the same value; expected: another criterion")
    if method == "saltelli":
        return sobol.analyze(problem, values, calc_second_order=False, seed=seed)
    if method == "morris":
        return morris.analyze(problem, points, values, seed=seed)
    return rbd_fast.analyze(problem, points, values, seed=seed)
