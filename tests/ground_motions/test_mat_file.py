"""Ground motions in MATLAB files."""

import numpy as np
import pytest
from scipy.io import savemat

from ground_motions import STANDARD_GRAVITY, read, read_folder, read_mat

A = 0.1 * np.sin(np.arange(50.0))
T = 0.02 * np.arange(50)


@pytest.mark.parametrize(
    ("variables", "options", "factor"),
    [
        ({"t": T, "acc_g": A}, {}, STANDARD_GRAVITY),
        ({"dt": 0.02, "ag": A, "vel": A, "disp": A}, {"unit": "cm/s^2"}, 0.01),
        ({"fs": 50.0, "a_g": A[:, None], "unit": "m/s2"}, {}, 1.0),
        ({"record": np.column_stack((T, A))}, {"unit": "g"}, STANDARD_GRAVITY),
        ({"gm": {"time": T, "acc": A, "units": "gal"}, "other": {"time": T[:9]}}, {}, 0.01),
        ({"t": T, "accel": A, "v_m_s": A}, {"unit": "m/s2"}, 1.0),
        ({"t": T, "Ch1": A, "vel_cm_s": A, "disp_mm": A}, {"unit": "g"}, STANDARD_GRAVITY),
        ({"t": T, "acc_in": A}, {"unit": "m/s2"}, 1.0),
        ({"x": A, "y": 2 * A}, {"column": "x", "dt": 0.02, "unit": "m/s2"}, 1.0),
    ],
)
def test_variables_are_recognised(tmp_path, variables, options, factor):
    savemat(tmp_path / "motion.mat", variables)
    record = read(tmp_path / "motion.mat", **options)
    assert record.dt == pytest.approx(0.02)
    np.testing.assert_allclose(record.acceleration, A * factor)


@pytest.mark.parametrize(
    ("variables", "options", "parts"),
    [
        ({"t": T, "a_g": A}, {}, ("variable a_g, unit", "the unit, for example")),
        ({"acc": A}, {"unit": "g"}, ("no times and no step", "dt_s in a scenario")),
        ({"dt": 0.02, "x": A, "y": A}, {"unit": "g"}, ("2 vectors", "column= one of x, y")),
        ({"dt": 0.02, "x": A}, {"unit": "g", "column": "z"}, ("column", "'z'", "x")),
        ({"dt": 0.02, "acc_g": A}, {"dt": 0.01}, ("dt", "0.01 s", "0.02 s, as in the file")),
        ({"dt": 0.02, "acc_g": A}, {"unit": "gal"}, ("unit", "'gal'", "g, as in the file")),
        ({"dt": 0.02, "acc": A, "unit": "yd"}, {}, ("unit", "'yd'", "gal")),
        ({"dt": 0.02, "acc_g": A * np.nan}, {}, ("acc_g, sample 1", "finite")),
        ({"dt": 0.02, "vel_m_s": A}, {"unit": "g"}, ("variables dt, vel_m_s", "a vector of acc")),
        ({"dt": 0.02, "vel_m_s": A}, {"unit": "g", "column": "vel_m_s"}, ("another quantity",)),
        ({"dt": 0.02, "m": np.ones((9, 9))}, {}, ("variables dt, m", "a vector of acc")),
    ],
)
def test_unclear_files_are_refused(tmp_path, refused, variables, options, parts):
    savemat(tmp_path / "motion.mat", variables)
    with refused(tmp_path / "motion.mat", *parts):
        read_mat(tmp_path / "motion.mat", **options)


def test_version_7_3_is_read_or_told_in_one_line(tmp_path, monkeypatch):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "new.mat", "w", userblock_size=512) as file:
        file["acc"], file["dt"] = A[None, :], [[0.02]]
    head = b"MATLAB 7.3 MAT-file".ljust(124) + bytes([0, 2]) + b"IM"
    with (tmp_path / "new.mat").open("r+b") as file:
        file.write(head)
    np.testing.assert_allclose(read_folder(tmp_path, unit="m/s2")[0].components[0].acceleration, A)
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(ValueError, match=r"new\.mat: MATLAB's format 7\.3 needs h5py"):
        read_mat(tmp_path / "new.mat")


@pytest.mark.parametrize("factor", [30.0, 1e-5])
def test_an_implausible_peak_is_told(tmp_path, factor):
    savemat(tmp_path / "motion.mat", {"dt": 0.02, "acc_g": factor * A / A.max()})
    with pytest.warns(UserWarning, match=r"motion\.mat: the peak is .* g, read in g; .*the unit$"):
        read(tmp_path / "motion.mat")


def test_times_in_another_unit_are_told(tmp_path):
    savemat(tmp_path / "motion.mat", {"time": 20.0 * np.arange(A.size), "acc_g": A / A.max()})
    with pytest.warns(UserWarning, match=r"motion\.mat: the step is 20 s; .* unit of the times$"):
        read(tmp_path / "motion.mat")
