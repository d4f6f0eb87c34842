"""Several controllers on one plant under several records, from Python objects."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Literal

from ground_motions import Record, SuiteRecord
from ground_motions.argument_types import checked

from ...criterion import Criterion, selected_criteria
from ...errors import Diverged, InputError
from ...io.columns import columns_bytes
from ...progress_lines import occasional_lines
from ...registry import named_controllers
from ...scenario.job import Job
from ...scenario.suite import RecordSuite
from ...simulation.control import CoilDriver, Control, Sensors
from ...structures import IsolatedStructure
from ..chunk import Finished, alone, floors_of, side_by_side
from ..design import CaseSpec
from ..rows import Row, table_columns
from ..store import Store
from .prepare import prepare, read_motion
from .result import SWEEP, Suite
from .run import MOTION

Records = (
    str
    | Path
    | Mapping[str, Record | Sequence[Record]]
    | Sequence[Record | SuiteRecord | Sequence[Record]]
)


@checked
def compare_records(
    isolated: IsolatedStructure,
    records: Records,
    controllers: Sequence[str | Control] | Mapping[str, str | Control],
    *,
    ground: Mapping[str, Any] | None = None,
    nominal: IsolatedStructure | None = None,
    driver: CoilDriver | None = None,
    sensors: Sensors | None = None,
    computation_delay: float = 0.0,
    tolerance: float = 1e-6,
    current_outside: Literal["refuse", "clamp"] = "refuse",
    criteria: Sequence[str | Criterion] = (),
    threads: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Suite:
    """Simulate several controllers on one plant under several records.

    Parameters
    ----------
    isolated : IsolatedStructure
        The plant.
    records : mapping, sequence, str or pathlib.Path
        Records by name, or a list of them, or a folder as of `ground_motions.read_folder`. A
        record is one `Record`, or two for its horizontal components and a third one for the
        vertical component. For a plant with one direction each component is a motion of its own.
    controllers : sequence or mapping of str or Control
        Names or controllers; a mapping's keys are the names to print. Each run has a copy of its
        own.
    ground : mapping, optional
        Further keys of a suite's ``[ground]``, such as ``{"rule": "en1998_1_2004", "target":
        {...}}``, which scales the records. Without them the records are used as they are.
        ``{"floors": True}`` also computes `Suite.floors`.
    nominal, driver, sensors, computation_delay, tolerance, current_outside, criteria
        As in `isolation_sim.simulate`.
    threads : int, optional
        Number of threads; one per processor by default.
    progress : callable, optional
        Called with the number of runs finished since the last call. Without it a line on standard
        error says every 30 s how many runs are finished; ``lambda done: None`` says nothing.

    Returns
    -------
    Suite
        Its ``table`` has a row per run and ``statistics`` mean, spread and the number of motions
        in which a controller is better than ``passive_off``. ``save(folder)`` keeps it.

    Raises
    ------
    InputError
        If a name or an argument cannot be used, two records or two controllers share a name, or
        every run is refused.
    Diverged
        If every run diverges.
    """
    section, loaded = _section(records, dict(ground or {}))
    named = named_controllers(controllers)
    options = {
        "nominal": nominal, "driver": driver, "sensors": sensors,
        "computation_delay": computation_delay, "tolerance": tolerance,
        "current_outside": current_outside, "criteria": criteria,
    }  # fmt: skip
    folder = Path(mkdtemp(prefix="isolation_sim_"))
    try:
        suite = _simulated(folder, section, loaded, isolated, named, options, threads, progress)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(suite, shutil.rmtree, folder, ignore_errors=True)
    return suite


def _simulated(
    folder: Path,
    section: RecordSuite,
    records: list[SuiteRecord] | None,
    isolated: IsolatedStructure,
    named: Mapping[str, Control],
    options: dict[str, Any],
    threads: int | None,
    progress: Callable[[int], None] | None,
) -> Suite:
    """Run all motions under all controllers, with the motions and the table in a folder."""
    further = selected_criteria(options["criteria"])
    index = prepare(section, isolated, folder, records=records)
    rows = []
    for number, motion in enumerate(index["motions"]):
        motions = read_motion(folder, motion)
        # a controller has a state: another one for every run
        for label, each in named.items():
            control = deepcopy(each)
            job = Job("", isolated, motions, {label: control}, options)
            case = CaseSpec(number, {MOTION: motion["name"]}, ())
            rows.append(Row(case, label, job, control))
    step = progress or _lines(len(rows))
    floors: dict[str, bytes] = {}
    if section.floors:
        for row in rows:
            run = alone(row)
            floors |= {} if run is None else floors_of(run, row)
            step(1)
    else:
        side_by_side(rows, threads, step)
    failed = [row for row in rows if row.status != "ok"]
    if len(failed) == len(rows):
        diverged = all(row.status == "diverged" for row in failed)
        raise (Diverged if diverged else InputError)(failed[0].reason)
    registered = {label: each.name for label, each in named.items()}
    columns = table_columns(
        rows, {MOTION: str}, list(registered.values()), False, [one.name for one in further]
    )
    store = Store(folder / SWEEP)
    name = f"{isolated.structure.name}, {index['n_records']} records"
    store.begin({"name": name, "controllers": registered}, len(rows), further)
    store.chunks.mkdir()
    store.put(Finished(0, columns_bytes(columns), len(rows), len(failed), floors))
    store.close()
    return Suite(folder)


def _lines(n_runs: int) -> Callable[[int], None]:
    """Progress of runs as lines."""
    step = occasional_lines(n_runs)
    step("running")  # begins with the first run
    return lambda done: step("running", done)


def _section(
    records: Records, ground: dict[str, Any]
) -> tuple[RecordSuite, list[SuiteRecord] | None]:
    """Keys of a suite's ``[ground]``, and the records if they are objects."""
    ground = {"floors": False, **ground}  # each run alone would take longer
    if isinstance(records, str | Path):
        return RecordSuite(**{"folder": Path(records), **ground}), None
    for key in ("folder", "files", "peer"):
        if key in ground:
            raise InputError(f"ground has {key}, and records are given; expected: one of them")
    named = isinstance(records, Mapping)
    pairs = records.items() if isinstance(records, Mapping) else [("", each) for each in records]
    suite_records = [_record(name, each) for name, each in pairs]
    names = [each.name for each in suite_records]
    if not names:
        raise InputError("records", "none", "one or more")
    for each in names:
        if names.count(each) > 1 and not named:
            raise InputError("records", f"two called {each}", "a mapping of names to records")
    section = RecordSuite(**{"files": names, **ground})
    return section.model_copy(update={"files": None}), suite_records


def _record(name: str, record: Record | SuiteRecord | Sequence[Record]) -> SuiteRecord:
    """A record with its components."""
    if isinstance(record, SuiteRecord):
        return record
    parts = (record,) if isinstance(record, Record) else tuple(record)
    if not 1 <= len(parts) <= 3:
        raise InputError(f"components of record {name or parts}", f"{len(parts)}", "1 to 3")
    vertical = parts[2] if len(parts) == 3 else None
    return SuiteRecord(name or parts[0].name, parts[:2], vertical)
