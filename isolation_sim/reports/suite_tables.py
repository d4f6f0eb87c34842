"""Tables of a suite of records, in engineering units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pandas as pd
from numpy.typing import NDArray

from ..criteria import is_gain
from ..errors import check_name
from ..simulation.floors import SPECTRA
from ..sweeps.suites.result import STATISTICS, statistics_of
from ..written_names import as_written, capital, number_text
from .sweep_tables import heading
from .tables import RATIOS, TextTable, is_reference, mark_best, title_of
from .units import unit_of

if TYPE_CHECKING:
    import xarray

    from ..sweeps.suites.result import Suite

_NAMED = 8  # records in a sentence
_NAMES = dict(zip(STATISTICS, ("mean", "median", "84 %", "maximum"), strict=True))


def tables_and_verdict(suite: Suite, criterion: str | None = None) -> Iterator[TextTable | str]:
    """All tables, with a criterion also those of its records, and the sentences of the verdict."""
    several = len(suite.controllers) > 1
    if several:
        yield comparison_table(suite)
    for label in suite.controllers if suite.by_rule or not several else ():
        yield statistics_table(suite, label, brief=several)
    if criterion is not None:
        yield records_table(suite, criterion)
    yield from verdict(suite)


def comparison_table(suite: Suite) -> TextTable:
    """Means and spreads of every criterion, one column per controller."""
    reference = suite.sweep.reference
    statistics = suite.statistics
    rows = []
    for name in suite.criteria:
        unit, factor = unit_of(name)
        of_all = [statistics.loc[(label, name)] for label in suite.controllers]
        means = mark_best(
            [float(one["mean"]) * factor for one in of_all], max if is_gain(name) else min
        )
        rows.append((title_of(name), unit, *(
            f"{text}{'*' * best}{_spread(one, factor)}"
            for (text, best), one in zip(means, of_all, strict=True)
        )))  # fmt: skip
    headings = ("criterion", "unit", *map(as_written, suite.controllers))
    caption = "mean ± standard deviation over the motions"
    if any("*" in cell for row in rows for cell in row[2:]):
        caption += "; * best mean of the row"
    if reference is not None:
        caption += f"; n/N: better than {as_written(reference)} in n of N motions"
    return TextTable(
        f"{suite.name}: {motions_text(suite)}", headings, rows, keys=2, caption=caption
    )


def _spread(statistics: pd.Series, factor: float) -> str:
    """Standard deviation, and in how many motions the controller is better."""
    deviation, better = statistics["standard_deviation"], statistics["better"]
    if deviation < 1e-9 * abs(statistics["mean"]):  # round-off
        deviation = 0.0
    text = "" if pd.isna(deviation) else f" ± {number_text(deviation * factor)}"
    return text if pd.isna(better) else f"{text} {better:.0f}/{statistics['runs']:.0f}"


def statistics_table(suite: Suite, controller: str, brief: bool = False) -> TextTable:
    """Statistics of every criterion with a controller; if brief, without ratios and RMS values."""
    rows = []
    statistics = suite.statistics.loc[controller]
    without_ratios = brief or is_reference(statistics["mean"])
    for name, row in statistics.iterrows():
        if (without_ratios and name in RATIOS) or (brief and str(name).startswith("rms_")):
            continue
        unit, factor = unit_of(str(name))
        none = pd.isna(row["governing"]) or row["maximum"] == 0
        governing = "" if none else str(row["governing"])
        numbers = [_number(row[key], factor) for key in STATISTICS]
        rows.append(
            (title_of(str(name)), unit, *numbers, governing, _number(row["design"], factor))
        )
    headings = ["criterion", "unit", *_NAMES.values(), "governs", "design"]
    shown = len(headings) - bool(statistics["design"].isna().all())
    rows = [row[:shown] for row in rows]
    headings = headings[:shown]
    return TextTable(f"{as_written(controller)}: {motions_text(suite)}", headings, rows, keys=2)


def _number(value: float, factor: float) -> str:
    return "" if pd.isna(value) else number_text(value * factor)


def over_motions(values: xarray.DataArray) -> pd.DataFrame:
    """Statistics over the motions; a row for each combination of the other coordinates."""
    others = [str(name) for name in values.dims if name != "motion"]
    runs = values.rename(None).to_series().groupby(level=others, sort=False)
    return pd.DataFrame(statistics_of(runs))


def floor_columns(values: xarray.DataArray, factor: float = 1.0) -> dict[str, NDArray]:
    """Values at each place by heading: statistics of one controller, or the mean of each."""
    values = factor * values
    labels = values.controller.to_numpy().tolist()
    if len(labels) == 1:
        table = over_motions(values.isel(controller=0, drop=True))
        return {_NAMES[name]: table[name].to_numpy() for name in STATISTICS}
    means = values.mean("motion")
    return {as_written(name): means.sel(controller=name).to_numpy() for name in labels}


def floor_tables(suite: Suite) -> list[TextTable]:
    """Peaks of each level and storey, from the top; none without floors."""
    result = []
    caption = "mean over the motions" if len(suite.controllers) > 1 else ""
    for name, values in (suite.floors or {}).items():
        if name == SPECTRA:
            continue
        unit, factor = unit_of(str(name))
        (place,) = {*values.dims} - {"controller", "motion"}
        columns = floor_columns(values, factor)
        places = values[place].to_numpy().tolist()
        rows = [
            (each, *(_number(value, 1.0) for value in row))
            for each, *row in zip(places, *columns.values(), strict=True)
        ]
        title = f"{capital(title_of(str(name)))}, {unit}"
        result.append(TextTable(title, (str(place), *columns), rows[::-1], caption=caption))
    return result


def records_table(suite: Suite, criterion: str) -> TextTable:
    """A criterion for every motion and controller."""
    check_name("criterion", criterion, suite.criteria)
    _, factor = unit_of(criterion)
    result = suite.table.set_index(["motion", "controller"])
    governing = {
        label: suite.statistics.loc[(label, criterion), "governing"] for label in suite.controllers
    }
    rows = []
    for motion in suite.table["motion"].unique():
        cells = []
        for label in suite.controllers:
            run = result.loc[(motion, label)]
            if run["status"] != "ok":
                cells.append(str(run["status"]))
            else:
                mark = "†" if governing[label] == motion else " "
                cells.append(f"{number_text(run[criterion] * factor)}{mark}")
        rows.append((str(motion), *cells))
    title = f"{heading(criterion)}, one row per motion"
    headings = ("motion", *map(as_written, suite.controllers))
    return TextTable(title, headings, rows, caption="† governs under this controller")


def motions_text(suite: Suite) -> str:
    """Numbers of motions and records."""
    motions, records = len(suite.index["motions"]), suite.index["n_records"]
    left_out = f", {len(suite.left_out)} left out" if suite.left_out else ""
    return f"{motions} motions of {records} record{'s' * (records != 1)}{left_out}"


def verdict(suite: Suite) -> list[str]:
    """Whether the suite fulfils its rule, in sentences."""
    rule, statistic = suite.rule, suite.design_statistic
    sentences = [f"A record cannot be used and is left out: {each}." for each in suite.left_out]
    ratio = suite.mean_ratio
    period = suite.index["isolated_period_s"]
    if ratio is not None:
        target = suite.index["spectra"]["target"]
        met = "meets" if suite.meets_rule else "does not meet"
        sentences.append(
            f"The mean spectrum is {ratio[0]:.3f} to {ratio[1]:.3f} times the target "
            f"({target['name']}; {target['clause']}) over {rule.low:g} to {rule.high:g} times the "
            f"isolated period of {period:.3g} s; it {met} the least mean of {rule.floor:g} "
            f"({rule.clause})."
        )
        sentences += _at_limits(suite)
        if suite.index["inputs"]["section"]["isolated_period_s"] is None:
            sentences.append(
                "The isolated period is that of small vibrations. For softening isolators set "
                "isolated_period_s, the effective period at the design displacement."
            )
        target_keys = suite.index["inputs"]["section"]["target"]
        if rule.clause.startswith("ASCE 7-22") and target_keys.get("level") == "design":
            sentences.append(
                "The target is the design spectrum. ASCE 7-22, 16.2 and 17.3, ask for MCE_R, "
                '1.5 times it: set level = "mce_r" in the target.'
            )
    records = suite.index["n_records"]
    if not suite.by_rule:
        pass
    elif statistic is None:
        needed = rule.mean_from if rule.maximum_from is None else rule.maximum_from
        sentences.append(
            f"{rule.response_clause}: {needed} records or more are required; the suite has "
            f"{records} and has no design value."
        )
    else:
        sentences.append(
            f"With {records} records the {statistic} is the response to design for "
            f"({rule.response_clause})."
        )
    sentences += _contacts(suite)
    failed = len(suite.sweep.failed)
    if failed:
        sentences.append(
            f"{failed} of {len(suite.table)} runs failed. The statistics leave them out, and their "
            "controllers have no design value."
        )
    return sentences


def _at_limits(suite: Suite) -> list[str]:
    """Records whose factors scale_limits hold back, so that their spectra miss the target."""
    if suite.index["scaling"] != "amplitude":
        return []
    limits = suite.index["inputs"]["section"]["scale_limits"]
    held = {
        each["record"]: each["scale_factor"]
        for each in suite.index["motions"]
        if any(math.isclose(each["scale_factor"], limit) for limit in limits)
    }
    if not held:
        return []
    named = ", ".join(f"{name} {factor:.3g}" for name, factor in [*held.items()][:_NAMED])
    more = f" and {len(held) - _NAMED} more" if len(held) > _NAMED else ""
    return [
        f"The factors of {len(held)} of {suite.index['n_records']} records are at a limit of "
        f"scale_limits, {limits[0]:g} and {limits[1]:g}, and their spectra need not fit the "
        f"target: {named}{more}."
    ]


def _contacts(suite: Suite) -> list[str]:
    """Runs of each controller that touch a moat wall or an end stop."""
    if "contacts" not in suite.table:
        return []
    touching = suite.table["contacts"].gt(0).groupby(suite.table["controller"], sort=False)
    listed = [
        f"{as_written(str(label))} {count} of {touching.size()[label]}"
        for label, count in touching.sum().items()
        if count
    ]
    if not listed:
        return []
    return [
        f"Motions in which a moat wall or an end stop is touched: {', '.join(listed)}. Their peaks "
        "come from the impact and can raise the mean far above the median."
    ]
