"""Storeys that yield: the elements are elastic first and flat then, and the study says when."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

import isolation_sim as iso
from studies import yielding_storeys as study
from studies.study import EL_CENTRO, perform

pytestmark = pytest.mark.usefixtures("no_drawing")


@pytest.fixture(scope="module")
def elastic():
    return iso.reference_building()


@pytest.fixture(scope="module")
def drift(elastic):
    return study.yield_drift(elastic)


def test_it_yields_at_the_strength_that_is_declared(elastic, drift):
    stiffness = elastic.stiffness[-1, -1]  # the roof hangs on one storey
    assert stiffness * drift == pytest.approx(0.15 * 9.80665 * 5 * 250e3)


def test_small_drifts_meet_the_elastic_building(elastic):
    fixed = elastic.fixed_base()
    record = study.motion(EL_CENTRO).scaled(0.01)
    run = iso.simulate(study.yielding(fixed), record).output("floor5_displacement_m")
    n = fixed.n_dofs
    rates = -np.linalg.solve(fixed.mass, np.hstack([fixed.stiffness, fixed.damping]))
    A = np.vstack([np.eye(2 * n)[n:], rates])
    B = np.concatenate([np.zeros(n), -fixed.influence[:, 0]])[:, np.newaxis]
    roof = np.eye(2 * n)[n - 1 : n]
    _, expected, _ = lsim((A, B, roof, [[0.0]]), record.acceleration, record.time)
    assert np.abs(run - expected.ravel()).max() < 1e-5 * np.abs(expected).max()


def test_shear_beyond_yielding_is_that_of_the_hardening_line(elastic, drift):
    plant = study.yielding(elastic.fixed_base())
    run = iso.simulate(plant, study.motion(EL_CENTRO).scaled(2.0))
    shear, moved = (run.output(name) for name in ("storey1_hysteresis_force_N", "storey1_drift_m"))
    soft = 0.95 * elastic.stiffness[-1, -1] * drift
    assert np.abs(moved).max() > 5 * drift
    assert np.abs(shear).max() == pytest.approx(soft, rel=1e-3)
    assert abs(run.energy.final["device_dissipation_J"]) > 0.2 * run.energy.final["input_J"]


def test_short_form(tmp_path):
    outcome, path = perform("yielding_storeys", tmp_path / "study", True)
    assert (path / "figures" / "ductility.png").is_file() and (path / "runs.csv").is_file()
    rows = {(row["motion"], row["building"]): row for row in outcome.table}
    assert len(rows) == 8
    fixed, off = (rows["El Centro", name] for name in (study.FIXED, "passive_off"))
    assert fixed["yields at scale"] < off["yields at scale"]
    for row in outcome.table:
        assert row["yields at scale"] < row["ductility 3 at scale"]
    assert "None" not in outcome.finding
