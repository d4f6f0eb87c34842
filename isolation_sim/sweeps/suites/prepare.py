"""Preparation of a suite's records: read, select, scale or match, and write them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ground_motions import (
    MatchedRecord,
    Record,
    SuiteRecord,
    SuiteRule,
    combined_spectrum,
    match_spectrum,
    read_csv,
    scale_suite,
    select_best,
    write_csv,
)
from ground_motions.component_names import component_end

from ...code_check import Motions
from ...errors import InputError, several, warn
from ...io.files import json_text, write_text
from ...io.results_folder import file_name
from ...scenario import Scenario
from ...scenario.job import with_place
from ...scenario.suite import RecordSuite
from ...scenario.targets import Target
from ...structures import IsolatedStructure
from ...structures.modes import translational_period
from ...version import __version__
from ...workers import in_processes, processors

INDEX = "suite.json"
MOTIONS = "motions"
_PLOTTED = (0.02, 60)  # shortest period, s, and number of periods of the suite's spectra


def prepare(
    section: RecordSuite,
    isolated: IsolatedStructure,
    folder: Path,
    step: Callable[[str], None] = lambda _: None,
    workers: int | None = 1,
    records: list[SuiteRecord] | None = None,
) -> dict[str, Any]:
    """Write the processed motions of a suite, and an index of their processing.

    ``records``: in place of those that the section names.
    """
    inputs = _inputs(section, isolated)
    try:
        index = json.loads((folder / INDEX).read_bytes())
    except (OSError, ValueError):
        index = {}
    if index.get("inputs") == inputs:
        return index
    if index:
        raise InputError(
            f"{folder}: the suite has changed since; expected: the same records and keys, or a "
            "new folder"
        )
    rule = section.suite_rule
    period = section.isolated_period_s or translational_period(isolated)
    step("reading records")
    unscaled, left_out = section.records() if records is None else (records, [])
    unscaled, unusable = _usable(section, isolated, unscaled)
    left_out = [*left_out, *unusable]
    if section.target is not None:
        _warn_of_single_components(unscaled, rule)
    # first, since quiet ground behind a last sample other than 0 changes the spectrum
    unscaled = [_pad(record, section.quiet_after_s) for record in unscaled]
    records, changes = _scale(section, rule, period, unscaled, step, workers)
    motions = []
    written: dict[str, Record] = {}
    for record, change in zip(records, changes, strict=True):
        for name, components in _shaking(section, isolated, record):
            files = [f"{MOTIONS}/{file_name(name)}_{k + 1}.csv" for k in range(len(components))]
            written |= dict(zip(files, components, strict=True))
            motions.append({
                "name": name, "record": record.name,
                "components": ", ".join(each.name for each in components), "files": files,
                "pga_m_s2": max(each.pga for each in components[: len(record.components)]),
                **change[name],
            })  # fmt: skip
    step("spectra")
    index = {
        "inputs": inputs,
        "n_records": len(records),
        "left_out": left_out,
        "isolated_period_s": period,
        "scaling": section.scaled_by,
        "motions": motions,
        "spectra": _spectra(section, rule, period, records),
    }
    # after all that can be refused, so that nothing is left of a suite that cannot begin
    (folder / MOTIONS).mkdir(parents=True, exist_ok=True)
    for file, each in written.items():
        write_csv(each, folder / file)
    write_text(json_text(index, indent=1), folder / INDEX)
    return index


def prepare_of(
    scenario: Scenario,
    section: RecordSuite,
    folder: Path,
    step: Callable[[str], None],
    workers: int | None = 1,
) -> dict[str, Any]:
    """Write the processed motions of a scenario's suite; see `prepare`."""
    plant = scenario.under_one_motion().build().isolated
    try:
        return prepare(section, plant, folder, step, workers)
    except InputError as error:
        raise with_place(error, scenario._source, "ground") from None


def read_motion(folder: Path, motion: dict[str, Any]) -> tuple[Record, ...]:
    """Components of a processed motion of the index."""
    return tuple(read_csv(folder / file) for file in motion["files"])


def motions_of(scenario: Scenario, step: Callable[[str], None]) -> Motions | None:
    """Processed motions of a scenario's suite for a code check; None without a suite."""
    section = scenario.suite
    if section is None:
        return None
    with TemporaryDirectory() as folder:
        index = prepare_of(scenario, section, Path(folder), step)
        records = [read_motion(Path(folder), motion) for motion in index["motions"]]
    statistic = section.suite_rule.design_statistic(index["n_records"])
    return Motions(records, mean=statistic == "mean")


def _inputs(section: RecordSuite, isolated: IsolatedStructure) -> dict[str, Any]:
    # a missing file is told by its reader, together with all that cannot be read
    digests = {
        str(path): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in section.sources()
        if path.is_file()
    }
    return {
        "section": section.model_dump(mode="json"),
        "period_s": section.isolated_period_s or translational_period(isolated),
        "directions": list(isolated.structure.directions),
        "files": digests,
        "software": f"isolation-sim {__version__}",
    }


def _usable(
    section: RecordSuite, isolated: IsolatedStructure, records: list[SuiteRecord]
) -> tuple[list[SuiteRecord], list[str]]:
    """Records that have the components of the structure, and the reason for each left out."""
    if section.components in ("first", "second") and len(isolated.structure.directions) > 1:
        raise InputError(
            "components", f"'{section.components}' for a structure with several directions",
            "'both', or 'swapped' for the second component along x",
        )  # fmt: skip
    usable: list[SuiteRecord] = []
    errors: list[InputError] = []
    for record in records:
        try:
            _shaking(section, isolated, record)
        except InputError as error:
            errors.append(error)
        else:
            usable.append(record)
    if errors and not (usable and section.leave_out_unreadable):
        what = f"{len(errors)} of {len(records)} records cannot be used"
        hint = "; leave_out_unreadable = true in [ground] runs the others" if usable else ""
        raise several(what, errors, hint)
    return usable, [f"{error.place}: {error.given or 'not usable'}" for error in errors]


def _warn_of_single_components(records: list[SuiteRecord], rule: SuiteRule) -> None:
    """Warn of records with one component beside pairs, whose combined spectra are larger."""
    single = [record.name for record in records if len(record.components) == 1]
    if single and len(single) < len(records) and rule.combination != "mean":
        combined = "SRSS" if rule.combination == "srss" else rule.combination.upper()
        warn(
            f"{len(single)} of {len(records)} records have one component, whose own spectrum is "
            f"used beside the {combined} spectrum of pairs, which is larger: {', '.join(single)}; "
            "scale records of one component and pairs in separate suites",
            UserWarning,
        )


def _scale(
    section: RecordSuite,
    rule: SuiteRule,
    period: float,
    records: list[SuiteRecord],
    step: Callable[[str], None],
    workers: int | None,
) -> tuple[list[SuiteRecord], list[dict[str, dict[str, float]]]]:
    """The processed records, and the changes of each motion."""
    limits = section.scale_limits[0], section.scale_limits[1]
    periods = rule.periods(period)
    target = None if section.target is None else section.target.spectrum()
    if section.select is not None and target is not None:
        step("selecting records")
        fitted = periods[periods > 0.0]
        spectra = np.array([combined_spectrum(r.components, fitted, rule.combination)
                            for r in records])  # fmt: skip
        chosen = select_best(spectra, target.psa(fitted), section.select, limits)
        records = [records[k] for k in sorted(chosen)]
    by = section.scaled_by
    if by == "matched" and section.target is not None:
        low, high = rule.low * period, rule.high * period
        section.target.spectrum().psa([low, high])
        fit = _Fit(section.target, low, high, section.match_tolerance, limits)
        return _match(records, fit, step, workers)
    factors = [record.scale_factor if by == "peer" else 1.0 for record in records]
    if by == "amplitude" and target is not None:
        step("scaling records")
        spectra = np.array([combined_spectrum(r.components, periods, rule.combination)
                            for r in records])  # fmt: skip
        factors = scale_suite(spectra, target.psa(periods), rule.floors, limits).factors.tolist()
    scaled = [r.scaled(factor) for r, factor in zip(records, factors, strict=True)]
    return scaled, [
        _by_motion(r, [{"scale_factor": factor}] * len(r.components))
        for r, factor in zip(records, factors, strict=True)
    ]


@dataclass(frozen=True)
class _Fit:
    """Target of matching, its range and its tolerance."""

    target: Target
    low: float
    high: float
    tolerance: float
    limits: tuple[float, float]


@dataclass(frozen=True, eq=False)
class _Match:
    """Match of one component, as a task of a worker."""

    place: tuple[int, int]
    component: Record
    fit: _Fit

    def __str__(self) -> str:
        return f"match of {self.component.name}"

    def __call__(self) -> tuple[tuple[int, int], str, MatchedRecord | InputError]:
        """Return the matched component, or the reason for none."""
        fit = self.fit
        try:
            matched = match_spectrum(
                self.component, fit.target.spectrum(), fit.low, fit.high, fit.tolerance, fit.limits
            )
        except InputError as error:
            return self.place, self.component.name, error
        return self.place, self.component.name, matched


def _match(
    records: list[SuiteRecord], fit: _Fit, step: Callable[[str], None], workers: int | None
) -> tuple[list[SuiteRecord], list[dict[str, dict[str, float]]]]:
    """The matched records, and the changes of each motion."""
    tasks = [
        _Match((i, k), component, fit)
        for i, record in enumerate(records)
        for k, component in enumerate(record.components)
    ]
    step(f"matching {len(tasks)} components")
    matches, failed = {}, {}
    count = min(processors(workers), len(tasks))
    # processes even for one worker: there alone the linear algebra has a single thread
    for place, name, result in in_processes(iter(tasks), count):
        if isinstance(result, MatchedRecord):
            matches[place] = result
        else:
            failed[place] = f"{name} {result.given or result}"
        step(f"matching: {len(matches) + len(failed)} of {len(tasks)} components")
    if failed:
        raise InputError(
            f"matching, {len(failed)} of {len(tasks)} components",
            ", ".join(text for _, text in sorted(failed.items())),
            f"{fit.tolerance:.1%}; other records, a narrower range, or a larger match_tolerance",
        )
    matched, changes = [], []
    for i, record in enumerate(records):
        parts = [matches[i, k] for k in range(len(record.components))]
        components = tuple(each.record for each in parts)
        factor = float(np.mean([each.scale_factor for each in parts]))
        matched.append(SuiteRecord(record.name, components, _beside(record, components, factor)))
        changes.append(
            _by_motion(record, [
                {
                    "scale_factor": each.scale_factor,
                    "largest_misfit": each.largest_misfit,
                    "arias_ratio": each.arias_ratio,
                    "duration_change_s": each.duration_change,
                }
                for each in parts
            ])
        )  # fmt: skip
    return matched, changes


def _beside(record: SuiteRecord, matched: tuple[Record, ...], factor: float) -> Record | None:
    """The vertical component for matched horizontal ones; it has no target."""
    if record.vertical is None:
        return None
    room = (matched[0].duration - record.components[0].duration) / 2  # added by matching
    return record.vertical.scaled(factor).padded(room, room).resampled(matched[0].dt)


def _by_motion(record: SuiteRecord, changes: list[dict[str, float]]) -> dict[str, dict[str, float]]:
    """Changes, by the name of each motion from a record."""
    worst = {
        key: max((each[key] for each in changes), key=lambda value: abs(value))
        for key in changes[0]
    }
    names = {_component(record, k): change for k, change in enumerate(changes)}
    return {record.name: worst, **names}


def _component(record: SuiteRecord, k: int) -> str:
    """Name of a component: with the end of its own name, such as FN or 090, or with H1 or H2."""
    if len(record.components) == 1:
        return record.name
    ends = [component_end(each.name) for each in record.components]
    distinct = all(ends) and len(set(ends)) == len(ends)
    return f"{record.name} {ends[k] if distinct else f'H{k + 1}'}"


def _shaking(
    section: RecordSuite, isolated: IsolatedStructure, record: SuiteRecord
) -> list[tuple[str, tuple[Record, ...]]]:
    """Motions of a record: single components, or all together for several directions."""
    structure = isolated.structure
    directions = structure.horizontal
    if len(structure.directions) == 1:
        if section.components == "second" and len(record.components) == 1:
            raise InputError(
                f"record {record.name}", "1 horizontal component", '2 with components = "second"'
            )
        target = {"first": [0], "second": [1]}
        every = range(len(record.components))
        return [
            (_component(record, k), (record.components[k],))
            for k in target.get(section.components, every)
        ]
    count = len(record.components)
    if len(directions) != count:
        raise InputError(
            f"record {record.name}",
            f"{count} horizontal component{'s' * (count != 1)}",
            f"{len(directions)}, one per direction of the structure ({', '.join(directions)}), "
            'such as files = [["one_H1.AT2", "one_H2.AT2"], ...], or a pair of records in Python',
        )
    order = -1 if section.components == "swapped" else 1
    horizontal = record.components[::order]
    if not structure.vertical:
        return [(record.name, _as_long(record.name, *horizontal))]
    if record.vertical is None:
        raise InputError(
            f"record {record.name}", "no vertical component",
            "one with vertical_period_s: in the PEER download, or as the third file of a record in "
            "files",
        )  # fmt: skip
    return [(record.name, _as_long(record.name, *horizontal, record.vertical))]


def _as_long(name: str, *components: Record) -> tuple[Record, ...]:
    """Components padded with zeros to one length; those of PEER often differ by some samples."""
    if len({each.dt for each in components}) > 1:
        steps = ", ".join(f"{each.dt:g}" for each in components)
        raise InputError(f"record {name}: steps of its components", f"{steps} s",
            "one step; the method resampled of a record changes it, and write_csv writes the file",
        )  # fmt: skip
    longest = max(len(each) for each in components)
    return tuple(each.padded(after=(longest - len(each)) * each.dt) for each in components)


def _pad(record: SuiteRecord, after: float) -> SuiteRecord:
    if not after:
        return record
    components = tuple(each.padded(after=after) for each in record.components)
    vertical = record.vertical and record.vertical.padded(after=after)
    return SuiteRecord(record.name, components, vertical, record.scale_factor)


def _spectra(
    section: RecordSuite, rule: SuiteRule, period: float, records: list[SuiteRecord]
) -> dict[str, Any]:
    """Spectra of the processed records, over the plotted periods and over the rule's range."""
    shortest, count = _PLOTTED
    plotted = np.geomspace(shortest, max(4.0, 1.2 * rule.high * period), count)
    checked = rule.periods(period)
    target = None if section.target is None else section.target.spectrum()

    def of_all(periods: np.ndarray) -> np.ndarray:
        return np.array([combined_spectrum(r.components, periods, rule.combination)
                         for r in records])  # fmt: skip

    def target_psa(periods: np.ndarray) -> list[float | None]:
        if target is None:
            return [None] * len(periods)
        inside = (periods >= target.shortest_period) & (periods <= target.longest_period)
        values = np.full(len(periods), np.nan)
        values[inside] = target.psa(periods[inside])
        return [None if np.isnan(value) else float(value) for value in values]

    return {
        "combination": rule.combination,
        "target": None if target is None else {"name": target.name, "clause": target.clause},
        "plotted": {
            "period_s": plotted.tolist(),
            "psa_m_s2": {
                r.name: row.tolist() for r, row in zip(records, of_all(plotted), strict=True)
            },
            "target_m_s2": target_psa(plotted),
        },
        "range": {
            "period_s": checked.tolist(),
            "mean_m_s2": of_all(checked).mean(axis=0).tolist(),
            "target_m_s2": target_psa(checked),
            "floor": rule.floors.tolist(),
        },
    }
