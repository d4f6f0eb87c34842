"""The table of a sweep: its columns, and the rows of a chunk."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..comparison import UNCONTROLLED
from ..criteria import QUANTITIES, benchmark_criteria
from ..errors import Diverged, InputError
from ..simulation.ledger import Ledger
from ..simulation.validity import Validity

if TYPE_CHECKING:
    from ..scenario import Job
    from ..simulation.control import Control
    from ..simulation.result import Run
    from .design import CaseSpec

_TYPES = {bool: np.bool_, int: np.int64, float: np.float64, str: np.str_}


@dataclass
class Row:
    """One run of a chunk; the results are filled in step by step."""

    case: CaseSpec  # The case
    controller: str  # Label of the controller
    job: Job | None = None  # The case ready to run; None if it is invalid
    control: Control | None = None  # A new controller
    # criteria, energy: Results, SI units
    criteria: dict[str, float] = field(default_factory=dict)
    energy: dict[str, float] = field(default_factory=dict)
    validity: Validity = field(default_factory=Validity)  # Of the run
    # {"ok", "diverged", "refused", "error"}; refused: input that cannot be used, such as a current
    # outside the limits
    status: str = "ok"
    reason: str = ""  # Reason for a missing result

    def fail(self, error: Exception) -> None:
        """Record the reason for a missing result."""
        known = isinstance(error, InputError | Diverged)
        self.status = "diverged" if isinstance(error, Diverged) else "refused" if known else "error"
        self.reason = str(error) if known else f"{type(error).__name__}: {error}"


def criteria_names() -> tuple[str, ...]:
    """Names of a run's criteria, without ratios."""
    return tuple(f"{kind}_{each.name}" for kind in ("peak", "rms") for each in QUANTITIES)


def optional_names() -> tuple[str, ...]:
    """Names of the criteria that some structures lack."""
    optional = [each.name for each in QUANTITIES if each.optional]
    return tuple(f"{kind}_{name}" for kind in ("peak", "rms") for name in optional)


def _energy_names() -> tuple[str, ...]:
    names = (name for name in Ledger.__dataclass_fields__ if name.endswith("_J"))
    return "energy_closure_error", *(f"energy_{name}" for name in names)


def energy_record(run: Run) -> dict[str, float]:
    """Energies of a run at its end, J, and the closure error, as the table's columns."""
    ledger = run.energy
    final = {f"energy_{name}": value for name, value in ledger.final.items()}
    return {"energy_closure_error": float(ledger.closure_error), **final}


def place_of_reference(names: Iterable[str]) -> int | None:
    """Place of the controller that ratios refer to, by its registered name."""
    return next((k for k, name in enumerate(names) if name == UNCONTROLLED), None)


def table_columns(
    rows: Sequence[Row],
    parameters: Mapping[str, type],
    controllers: Sequence[str],
    energy: bool,
    further: Sequence[str] = (),
) -> dict[str, np.ndarray]:
    """Rows as columns; ``controllers``: registered names, ``further``: selected criteria."""
    reference = place_of_reference(controllers)
    columns = {"case": np.array([row.case.number for row in rows], np.int64)}
    for label, kind in parameters.items():
        columns[label] = np.array([kind(row.case.shown[label]) for row in rows], _TYPES[kind])
    for key in ("controller", "status", "reason"):
        columns[key] = np.array([getattr(row, key) for row in rows], str)
    for key, default in Validity()._asdict().items():
        values = [getattr(row.validity, key) for row in rows]
        columns[key] = np.array(values, _TYPES[type(default)])
    results = {
        name: np.array([row.criteria.get(name, np.nan) for row in rows])
        for name in (*criteria_names(), *further)
    }
    names = _energy_names() if energy else ()
    energies = {name: np.array([row.energy.get(name, np.nan) for row in rows]) for name in names}
    ratios: dict[str, np.ndarray] = {}
    if reference is not None:
        ratios = _ratios(results | energies, reference, len(controllers))
    return columns | results | ratios | energies


def _ratios(
    results: Mapping[str, np.ndarray], reference: int, n_controllers: int
) -> dict[str, np.ndarray]:
    """Ratios to the uncontrolled run of each case; ratios of energies if there are energies."""
    by_case = {name: values.reshape(-1, n_controllers) for name, values in results.items()}
    uncontrolled = {name: values[:, [reference]] for name, values in by_case.items()}
    energy = {
        name.removeprefix("energy_"): values
        for name, values in by_case.items()
        if name.startswith("energy_")
    }
    ratios = benchmark_criteria(by_case, uncontrolled, energy or None)
    return {name: values.ravel() for name, values in ratios.items()}
