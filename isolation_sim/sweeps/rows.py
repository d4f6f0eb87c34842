"""The table of a sweep: its columns, and a chunk's rows as Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..comparison import UNCONTROLLED
from ..criteria import Response, benchmark_criteria, response_criteria
from ..simulation.ledger import Ledger

if TYPE_CHECKING:
    from ..simulation.result import Run
    from .chunk import Row

_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}
FORMAT: dict[str, Any] = {"compression": "zstd", "write_page_checksum": True}
"""How Parquet is written; readers may check the pages."""


@cache
def criteria_names() -> tuple[str, ...]:
    """Names of a run's criteria, without J1 to J9.

    Returns
    -------
    tuple of str
    """
    nothing = np.zeros((2, 1))
    still = Response(np.arange(2.0), nothing, nothing, nothing, *np.zeros((3, 2)))
    return tuple(response_criteria(still))


def _energy_names() -> tuple[str, ...]:
    names = (name for name in Ledger.__dataclass_fields__ if name.endswith("_J"))
    return "energy_closure_error", *(f"energy_{name}" for name in names)


def _ratio_names(energy: bool) -> tuple[str, ...]:
    # J9 is a ratio of energies
    return tuple(f"J{k}" for k in range(1, 10 if energy else 9))


def energy_record(run: Run) -> dict[str, float]:
    """Energies of a run at its end, J, and the closure error, as the table's columns.

    Parameters
    ----------
    run : Run
        A run.

    Returns
    -------
    dict of str to float
    """
    ledger = run.energy
    final = {f"energy_{name}": value for name, value in ledger.final.items()}
    return {"energy_closure_error": float(ledger.closure_error), **final}


def result_names(controllers: Sequence[str], energy: bool) -> tuple[str, ...]:
    """Names of the columns that hold results.

    Parameters
    ----------
    controllers : sequence of str
        Labels of the controllers; J1 to J8 are there if one is ``passive_off``.
    energy : bool
        Whether the ledger, and J9 with it, is wanted.

    Returns
    -------
    tuple of str
    """
    ratios = _ratio_names(energy) if UNCONTROLLED in controllers else ()
    return (*criteria_names(), *ratios, *(_energy_names() if energy else ()))


def schema(
    parameters: Mapping[str, type], controllers: Sequence[str], energy: bool
) -> pa.Schema:
    """Columns of the table.

    Parameters
    ----------
    parameters : mapping of str to type
        Varied quantities and their types.
    controllers : sequence of str
        Labels of the controllers.
    energy : bool
        Whether the ledger is wanted.

    Returns
    -------
    pyarrow.Schema
    """
    columns = [("case", pa.int64())]
    columns += [(label, _TYPES[kind]) for label, kind in parameters.items()]
    columns += [(name, pa.string()) for name in ("controller", "status", "reason")]
    columns.append(("clamped", pa.int64()))
    columns += [(name, pa.float64()) for name in result_names(controllers, energy)]
    return pa.schema(columns)


def table_bytes(
    rows: Sequence[Row], parameters: Mapping[str, type], controllers: Sequence[str], energy: bool
) -> bytes:
    """Write rows as Parquet.

    Parameters
    ----------
    rows : sequence of Row
        All controllers of one case after another.
    parameters : mapping of str to type
        Varied quantities and their types.
    controllers : sequence of str
        Labels of the controllers, in the rows' order.
    energy : bool
        Whether the ledger is wanted.

    Returns
    -------
    bytes
    """
    columns: dict[str, Sequence[Any]] = {
        "case": [row.case.number for row in rows],
        **{
            label: [kind(row.case.shown[label]) for row in rows]
            for label, kind in parameters.items()
        },
        **{key: [getattr(row, key) for row in rows] for key in ("controller", "status", "reason")},
        "clamped": [row.clamped for row in rows],
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
    """J1 to J8, and J9 where there are energies, against the uncontrolled run of each case."""
    by_case = {name: values.reshape(-1, n_controllers) for name, values in results.items()}
    uncontrolled = {name: values[:, [reference]] for name, values in by_case.items()}
    nothing = np.nan * by_case["peak_drift_m"]
    energies = [
        by_case.get(f"energy_{name}", nothing) for name in ("device_dissipation_J", "input_J")
    ]
    return {
        name: values.ravel()
        for name, values in benchmark_criteria(by_case, uncontrolled, *energies).items()
    }
