"""Fixtures that every test folder may use."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from isolation_sim.discrepancy.adapters import device_tests
from isolation_sim.discrepancy.building.search import cause_search
from isolation_sim.discrepancy.device import observable_effects
from isolation_sim.effects import EFFECTS
from isolation_sim.identification.law_choice import choose_law

REPOSITORY = Path(__file__).resolve().parents[1]
FIRST = tuple(
    f"tests/studies/test_{name}.py"
    for name in ("papers", "controllers_study", "benchmark_building", "sweep_studies")
)
"""What begins. Two workers that compile the same at the same time would do it twice."""
SLOW = (
    "tests/studies", "tests/test_docs.py", "tests/sweeps", "tests/reports", "tests/blind",
    "tests/discrepancy", "tests/controllers", "tests/identification", "tests/export",
)  # fmt: skip
"""What takes longest of the others; what comes last is quick, so that both workers end together."""
QUICK = (
    "tests/ground_motions", "tests/literature", "tests/test_architecture.py",
    "tests/test_criteria.py", "tests/test_docstrings.py", "tests/test_generated.py",
    "tests/test_old_names.py", "tests/test_packaging.py",
)  # fmt: skip
"""What ``-m quick`` runs: files that take seconds, since they compile little or nothing."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is quick; slow files first, so that no worker is left alone with one at the end."""
    order = [*FIRST, *SLOW]

    def place(item: pytest.Item) -> int:
        path = item.path.relative_to(REPOSITORY).as_posix()
        return next((k for k, name in enumerate(order) if path.startswith(name)), len(order))

    quick = tuple(str(REPOSITORY / name) for name in QUICK)
    for item in items:
        if str(item.path).startswith(quick):
            item.add_marker(pytest.mark.quick)
    items.sort(key=place)


def pytest_collection_finish() -> None:
    """What is loaded by now stays: looking through it for garbage took an eighth of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 1000)


@pytest.fixture(scope="module")
def few_laws() -> Iterator[None]:
    """A diagnosis that compares laws compares two: all of them take most of its time."""
    compared = partial(choose_law, laws=("kelvin_voigt", "linear"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(device_tests, "choose_law", compared)
        yield


FEW_EFFECTS = (
    "amplitude_softening", "coulomb_friction", "end_stop", "force_offset", "inertia_force",
    "self_heating", "stress_softening", "weak_rate_dependence",
)  # fmt: skip


@pytest.fixture
def few_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """A diagnosis asks eight effects, in all their forms: all of them take most of its time."""
    asked = {name: EFFECTS[name] for name in FEW_EFFECTS}
    monkeypatch.setattr(observable_effects, "EFFECTS", asked)


FEW_CAUSES = {
    "base_mass_error", "floor_mass_error", "storey_stiffness_loss", "isolator_stiffness_error",
    "isolator_force_error", "extra_isolator_damping", "moat_impact", "sensor_bias", "sensor_gain",
}  # fmt: skip
"""Of the structure, of the isolators and of the sensors."""

FEW_WALLS = {"dissipating", "linear", "one_side_linear"}
"""Walls have many starts."""


@pytest.fixture
def few_causes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask nine causes in all places: to simulate all of them takes most of the time."""
    every = cause_search.candidates

    def fewer(model: Any, records: Any) -> list[Any]:
        return [
            cause for cause in every(model, records)
            if cause.name in FEW_CAUSES and (cause.name != "moat_impact" or cause.form in FEW_WALLS)
        ]  # fmt: skip

    monkeypatch.setattr(cause_search, "candidates", fewer)


@pytest.fixture
def no_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files of figures are written without being drawn, which takes two seconds a diagnosis."""

    def write(figure: Figure, file: Any, **options: Any) -> None:
        if isinstance(file, str | os.PathLike):
            Path(file).write_text("<svg></svg>")
        else:
            file.write("<svg></svg>")

    monkeypatch.setattr(Figure, "savefig", write)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of measured data and reference trajectories; skips where it is absent."""
    place = os.environ.get("ISOLATION_SIM_DATA")
    folder = Path(place) if place else REPOSITORY.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"shared data not found at {folder}; set ISOLATION_SIM_DATA to its folder")
    return folder
