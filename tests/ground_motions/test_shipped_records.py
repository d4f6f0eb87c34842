import numpy as np
import pytest

from ground_motions import STANDARD_GRAVITY, available_records, el_centro_1940, load_record


def test_el_centro_is_the_version_of_chopra():
    record = el_centro_1940()
    assert (len(record), record.dt) == (1560, 0.02)
    peak = int(np.argmax(np.abs(record.acceleration)))
    assert record.pga / STANDARD_GRAVITY == pytest.approx(0.31882, rel=1e-12)
    assert record.time[peak] == pytest.approx(2.04, rel=1e-12)
    assert record.file_unit == "g"


def test_el_centro_is_the_ground_of_the_reference_trajectories(shared_data):
    with np.load(shared_data / "engine_reference" / "building.npz") as building:
        np.testing.assert_allclose(
            el_centro_1940().acceleration, building["ground_m_s2"], rtol=1e-14, atol=0
        )
        assert building["dt_s"] == el_centro_1940().dt


@pytest.mark.parametrize("name", available_records())
def test_every_shipped_record_loads_under_its_own_name(name):
    record = load_record(name)
    assert record.name == name
    assert record.pga > 0.0
    assert record.source


def test_an_unknown_name_is_refused_with_the_nearest(refused):
    with refused("record name", "'el_centro'", "did you mean 'el_centro_1940_ns'?"):
        load_record("el_centro")
    with refused("name: given None", "expected: text"):
        load_record(None)
