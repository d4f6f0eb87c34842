"""The table of a sweep: its columns, and a chunk's rows as Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..comparison import UNCONTROLLED
from ..criteria import GEOMETRIC, Response, benchmark_criteria, response_criteria
from ..errors import Diverged, InputError
from ..simulation.ledger import Ledger
from ..simulation.tested_range import OVER_TESTED

if TYPE_CHECKING:
    from ..scenario import Job
    from ..simulation.control import Control
    from ..simulation.result import Run
    from .design import CaseSpec

_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}
FORMAT: dict[str, Any] = {"compression": "zstd", "write_page_checksum": True}
"""How Parquet is written; readers may check the pages."""


@dataclass
class Row:
    """One run of a chunk, as it comes to be known.

    Attributes
    ----------
    case : CaseSpec
        The case.
    controller : str
        Label of the controller.
    job : Job or None
        The case made ready; None where it cannot be.
    control : Controller or None
        The controller, a fresh one.
    criteria, energy : dict of str to float
        What came of it, SI units.
    clamped : int
        Commands that were clamped.
    deformation_over_tested, current_over_tested : float
        Peaks over those of the tests behind the laws; 0 where there are none.
    status : {"ok", "diverged", "refused", "error"}
        Refused is input that cannot be used, a current outside the limits for one.
    reason : str
        Why there is no result.
    """

    case: CaseSpec
    controller: str
    job: Job | None = None
    control: Control | None = None
    criteria: dict[str, float] = field(default_factory=dict)
    energy: dict[str, float] = field(default_factory=dict)
    clamped: int = 0
    deformation_over_tested: float = np.nan
    current_over_tested: float = np.nan
    status: str = "ok"
    reason: str = ""

    def fail(self, error: Exception) -> None:
        """Record why there is no result."""
        known = isinstance(error, InputError | Diverged)
        self.status = "diverged" if isinstance(error, Diverged) else "refused" if known else "error"
        self.reason = str(error) if known else f"{type(error).__name__}: {error}"


@cache
def criteria_names() -> tuple[str, ...]:
    """Names of a run's criteria, without ratios."""
    nothing = np.zeros((2, 2))
    per_item = (each.name for each in fields(Response))
    still = Response(**{name: nothing for name in per_item} | {"time": np.arange(2.0)})
    return tuple(response_criteria(still))


def geometric_names() -> tuple[str, ...]:
    """Names of the criteria that only a structure of known geometry has."""
    return tuple(f"{kind}_{name}" for kind in ("peak", "rms") for name in GEOMETRIC)


def _energy_names() -> tuple[str, ...]:
    names = (name for name in Ledger.__dataclass_fields__ if name.endswith("_J"))
    return "energy_closure_error", *(f"energy_{name}" for name in names)


def _ratio_names(energy: bool) -> tuple[str, ...]:
    one = dict.fromkeys(criteria_names(), 1.0)
    names = ("control_device_work_J", "absolute_input_J", "device_dissipation_J", "input_J")
    return tuple(benchmark_criteria(one, one, dict.fromkeys(names, 1.0) if energy else None))


def energy_record(run: Run) -> dict[str, float]:
    """Energies of a run at its end, J, and the closure error, as the table's columns."""
    ledger = run.energy
    final = {f"energy_{name}": value for name, value in ledger.final.items()}
    return {"energy_closure_error": float(ledger.closure_error), **final}


def result_names(controllers: Sequence[str], energy: bool) -> tuple[str, ...]:
    """Names of the columns that hold results."""
    ratios = _ratio_names(energy) if UNCONTROLLED in controllers else ()
    return (*criteria_names(), *ratios, *(_energy_names() if energy else ()))


def schema(parameters: Mapping[str, type], controllers: Sequence[str], energy: bool) -> pa.Schema:
    """Columns of the table."""
    columns = [("case", pa.int64())]
    columns += [(label, _TYPES[kind]) for label, kind in parameters.items()]
    columns += [(name, pa.string()) for name in ("controller", "status", "reason")]
    columns.append(("clamped", pa.int64()))
    columns += [(name, pa.float64()) for name in OVER_TESTED]
    columns += [(name, pa.float64()) for name in result_names(controllers, energy)]
    return pa.schema(columns)


def table_bytes(
    rows: Sequence[Row], parameters: Mapping[str, type], controllers: Sequence[str], energy: bool
) -> bytes:
    """Write rows as Parquet."""
    columns: dict[str, Sequence[Any]] = {
        "case": [row.case.number for row in rows],
        **{
            label: [kind(row.case.shown[label]) for row in rows]
            for label, kind in parameters.items()
        },
        **{key: [getattr(row, key) for row in rows] for key in ("controller", "status", "reason")},
        "clamped": [row.clamped for row in rows],
        **{name: [getattr(row, name) for row in rows] for name in OVER_TESTED},
    }
    results = {
        name: np.array([row.criteria.get(name, np.nan) for row in rows])
        for name in criteria_names()
    }
    if energy:
        results |= {
            name: np.array([row.energy.get(name, np.nan) for row in rows])
            for name in _energy_names()
        }
    if UNCONTROLLED in controllers:
        results |= _ratios(results, list(controllers).index(UNCONTROLLED), len(controllers))
    wanted = schema(parameters, controllers, energy)
    table = pa.table({name: (columns | results)[name] for name in wanted.names}, schema=wanted)
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, **FORMAT)
    return sink.getvalue().to_pybytes()


def _ratios(
    results: Mapping[str, np.ndarray], reference: int, n_controllers: int
) -> dict[str, np.ndarray]:
    """Ratios to the uncontrolled run of each case; those of energies where there are energies."""
    by_case = {name: values.reshape(-1, n_controllers) for name, values in results.items()}
    uncontrolled = {name: values[:, [reference]] for name, values in by_case.items()}
    energy = {
        name.removeprefix("energy_"): values
        for name, values in by_case.items()
        if name.startswith("energy_")
    }
    ratios = benchmark_criteria(by_case, uncontrolled, energy or None)
    return {name: values.ravel() for name, values in ratios.items()}
