"""Structures from matrices and from files."""

import warnings

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array

from ground_motions import el_centro_1940
from isolation_sim import simulate
from isolation_sim.errors import InputError, PlausibilityWarning
from isolation_sim.laws import law
from isolation_sim.structures import (
    from_fixed_base,
    from_matrices,
    read_matrices,
    reference_isolators,
    shear_building,
)
from isolation_sim.structures import reference_building as reference

M, C, K = np.diag([2.0, 1.0]), np.zeros((2, 2)), np.array([[1.0, -1.0], [-1.0, 1.0]])


def benchmark(shared_data):
    """The smart base-isolated benchmark building: 8 storeys of x, y and rotation on a base."""
    data = np.load(shared_data / "benchmark_8_storey" / "structure.npz")
    mega = {key: 1e3 * data[key] for key in ("M", "C", "K", "m")}
    floors = ["base", *(f"floor{i}" for i in range(1, 9))]
    axes = ("x", "y", "rotation")
    return from_fixed_base(
        mega["M"],
        mega["C"],
        mega["K"],
        base_mass=mega["m"],
        rigid_motion=data["R"],
        shaken=(0, 1),
        names=[f"{floor}_{axis}" for floor in floors for axis in axes],
        heights=np.repeat(data["dh"], 3),
        name="benchmark",
    )


def test_benchmark_building(shared_data):
    building = benchmark(shared_data)
    assert building.n_dofs == 27 and building.base == (0, 1, 2)
    assert building.directions == ("x", "y") and len(building.storeys) == 24
    expected = [0.897, 0.780, 0.658, 0.283, 0.267, 0.214]
    # printed to 3 decimals: agree to the last one
    np.testing.assert_allclose(building.fixed_base_periods()[:6], expected, atol=6e-4)
    data = np.load(shared_data / "benchmark_8_storey" / "structure.npz")
    total = 1e3 * (data["m"][0, 0] + np.trace(data["M"][0::3, 0::3]))
    assert building.total_mass == pytest.approx(total)


def test_benchmark_on_isolators_in_two_directions(shared_data):
    building = benchmark(shared_data)
    isolated = building.on(law("hybrid").scaled(length=20), count=1000)
    assert isolated.element_names == ("isolator_x", "isolator_y")
    expected = np.zeros((2, 27))
    expected[0, 0] = expected[1, 1] = 1.0
    np.testing.assert_array_equal(isolated.element_rows, expected)
    assert isolated.n_channels == 1


def test_with_the_base_and_on_the_base_agree():
    whole = reference()
    above = np.ix_(range(1, 6), range(1, 6))
    again = from_fixed_base(
        whole.mass[above], whole.damping[above], whole.stiffness[above], base_mass=3e5
    )
    for field in ("mass", "damping", "stiffness", "influence", "drift_rows"):
        np.testing.assert_allclose(
            getattr(again, field), getattr(whole, field), rtol=1e-12, atol=1e-6
        )


def test_defaults():
    structure = from_matrices(M, C, K)
    assert structure.names == ("base", "floor1") and structure.storeys == ("storey1",)
    np.testing.assert_array_equal(structure.drift_rows, [[-1.0, 1.0]])
    np.testing.assert_array_equal(structure.influence, [[1.0], [1.0]])
    other = from_matrices(M, C, K, base=1)
    assert other.names == ("dof0", "dof1") and other.storeys == ()


def test_several_directions_of_ground_motion():
    structure = from_matrices(M, C, K, influence=np.eye(2), base=(0, 1))
    assert structure.directions == ("x", "y")
    np.testing.assert_array_equal(structure.base_shear_rows(above_base=False), M)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"mass": np.diag([2.0, -1.0])}, "mass of 'floor1': given -1 kg"),
        ({"mass": np.array([[2.0, 0.5], [0.0, 1.0]])}, "mass is not symmetric between"),
        ({"mass": np.array([[1.0, 2.0], [2.0, 1.0]])}, "not positive definite"),
        ({"mass": 3.0}, "square matrix"),
        ({"mass": [[1.0, "a"], [0.0, 1.0]]}, "mass: given .*; expected: an array of numbers"),
        ({"damping": np.zeros((3, 3))}, r"damping has shape \(3, 3\)"),
        ({"damping": [[0.0, np.inf], [0.0, 0.0]]}, r"damping\[0, 1\]: given inf"),
        ({"stiffness": np.array([[1.0, -1.0], [0.0, 1.0]])}, "stiffness is not symmetric"),
        ({"influence": np.ones(3)}, "influence has shape"),
        ({"influence": "x"}, "expected: an array of numbers"),
        ({"base": 2}, "expected: different dofs, 0 to 1"),
        ({"base": (0, 0)}, "different dofs"),
        ({"base": "bottom"}, "base: given .bottom.; expected: a whole number"),
        ({"names": ["a", "a"]}, "twice"),
        ({"names": ["a"]}, "shape"),
        ({"drift_rows": [[1.0, 0.0, 0.0]]}, "drift_rows has shape"),
        ({"heights": [3.0, 3.0]}, "heights has shape"),
    ],
)
def test_refuses(arguments, message):
    with pytest.raises(InputError, match=message) as refused:
        from_matrices(**({"mass": M, "damping": C, "stiffness": K} | arguments))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"base_mass": -1.0}, "mass of 'base': given -1 kg"),
        ({"rigid_motion": np.ones((2, 2))}, "rigid_motion has shape"),
        ({"shaken": (1,)}, "base dofs, 0 to 0"),
        ({"shaken": ()}, "base dofs"),
        ({"base_mass": np.ones((1, 2))}, "base_mass has shape"),
    ],
)
def test_fixed_base_refuses(arguments, message):
    with pytest.raises(InputError, match=message):
        from_fixed_base(M, C, K, **({"base_mass": 1.0} | arguments))


def test_read_matrices(tmp_path, shared_data):
    file = shared_data / "engine_reference" / "building.npz"
    building = read_matrices(file)
    np.testing.assert_allclose(building.stiffness, reference().stiffness, rtol=1e-12)
    assert building.name == "building" and building.names[1] == "floor1"
    own = tmp_path / "tower.npz"
    np.savez(own, M=M, C=C, K=K, influence=np.array([1.0, 1.0]), base=np.array([0]))
    assert read_matrices(own, name="tower 2").name == "tower 2"


def test_bad_files(tmp_path):
    file = tmp_path / "tower.npz"
    cases = [
        ({"M": M, "K": K}, "tower.npz: array 'C' is missing"),
        ({"M": M, "C": C, "K": K, "influense": np.ones(2)}, "looks like 'influence'"),
        ({"M": M, "C": C, "K": K, "heights": [3.0]}, "'heights'; expected: 'storey_heights_m', in"),
        ({"M": -M, "C": C, "K": K}, "tower.npz: mass of 'base': given -2 kg"),
        ({"M": np.array([{}], dtype=object), "C": C, "K": K}, "tower.npz: not a NumPy"),
    ]
    for arrays, message in cases:
        np.savez(file, **arrays)
        with pytest.raises(InputError, match=message):
            read_matrices(file)
    with pytest.raises(InputError, match="no such file"):
        read_matrices(tmp_path / "missing.npz")
    for name, content in (
        ("text.npz", b"not a zip"),
        ("empty.npz", b""),
        ("cut.npz", b"PK\x03\x04"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=f"{name}: not a NumPy"):
            read_matrices(tmp_path / name)
    np.save(tmp_path / "one.npy", M)
    with pytest.raises(InputError, match=r"one.npy: not a NumPy .npz"):
        read_matrices(tmp_path / "one.npy")


def warnings_of(call):
    """PlausibilityWarnings of a call, and what it returns."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = call()
    return [str(one.message) for one in caught if one.category is PlausibilityWarning], result


@pytest.mark.parametrize("what", ["stiffness", "damping"])
def test_a_spring_or_damper_to_the_ground_is_reported(what):
    """At construction and in the run, by the dof and its value; files alike."""
    whole = reference()
    matrices = {key: getattr(whole, key).copy() for key in ("mass", "damping", "stiffness")}
    matrices[what][0, 0] += 2e7
    (line,), building = warnings_of(lambda: from_matrices(**matrices, name="frame"))
    for part in ("frame: rigid motion along x", f"a {what} of 2e+07 N", "at base 2e+07 N"):
        assert part in line
    isolated = building.on(reference_isolators())
    lines, run = warnings_of(lambda: simulate(isolated, el_centro_1940().cut(0, 0.5)))
    assert line in lines and line in run.warnings()


def test_foreign_matrices_without_such_parts_are_silent():
    whole = reference()
    matrices = [whole.mass, whole.damping, whole.stiffness]
    six_digits = [np.array([[float(f"{x:.6g}") for x in row] for row in each]) for each in matrices]
    lines, _ = warnings_of(lambda: from_matrices(*six_digits))
    assert lines == []


def test_damping_and_stiffness_exchanged_are_reported():
    whole = reference()
    (line,), _ = warnings_of(lambda: from_matrices(whole.mass, whole.stiffness, whole.damping))
    assert "the order of the matrices, M, C, K" in line and "% in the first mode" in line


def test_matlab_files(tmp_path):
    path = tmp_path / "tower.mat"
    heights = {"storey_heights_m": [3.0], "influence": np.ones((2, 1)), "base": 0.0}
    savemat(path, {"M": M, "C": C, "K": csc_array(K)} | heights)
    tower = read_matrices(path)
    np.testing.assert_array_equal(tower.stiffness, K)
    assert tower.heights.tolist() == [3.0] and tower.name == "tower" and tower.base == (0,)
    savemat(path, {"M": M, "K": K})
    with pytest.raises(InputError, match=r"tower\.mat: array 'C' is missing"):
        read_matrices(path)
    version_7_3 = b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + bytes(400)
    for content, message in (
        (version_7_3, "not a MATLAB .mat file"),
        (b"", "not a MATLAB .mat file"),
        (b"hello", "not a MATLAB .mat file"),
        (path.read_bytes()[:300], "not a MATLAB .mat file"),
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match=message):
            read_matrices(path)
    with pytest.raises(InputError, match="no such file"):
        read_matrices(tmp_path / "missing.mat")


def test_matlab_files_of_version_7_3(tmp_path):
    # as MATLAB writes them: columns first, a sparse matrix as a group
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "tower.mat"
    skew = np.array([[0.0, 1e3], [-1e3, 0.0]])
    sparse = csc_array(K)
    with h5py.File(path, "w", userblock_size=512) as file:
        file["M"], file["C"], file["storey_heights_m"] = M, (C + skew).T, [[3.0]]
        group = file.create_group("K")
        group.attrs["MATLAB_sparse"] = np.uint64(2)
        group["data"], group["ir"], group["jc"] = sparse.data, sparse.indices, sparse.indptr
    header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM"
    path.write_bytes(header + path.read_bytes()[128:])
    tower = read_matrices(path)
    np.testing.assert_array_equal(tower.damping, C + skew)
    np.testing.assert_array_equal(tower.stiffness, K)
    assert tower.heights.tolist() == [3.0]


def with_damper(floor):
    """M, C, K of a base with three floors and a mass damper on one of them, the last dof."""
    links = [(0, 1, 2e8), (1, 2, 2e8), (2, 3, 2e8), (floor, 4, 1.2e4 * np.pi**2)]
    k = np.zeros((5, 5))
    for i, j, spring in links:
        k[np.ix_([i, j], [i, j])] += spring * np.array([[1, -1], [-1, 1]])
    return np.diag([3e5] * 4 + [1.2e4]), 3e-3 * k, k


THREE_STOREYS = np.eye(5)[1:4] - np.eye(5)[:3]


def test_floors_that_no_stiffness_connects_have_no_storey():
    with pytest.warns(PlausibilityWarning, match="no stiffness between floor3 and floor4"):
        building = from_matrices(*with_damper(2))
    np.testing.assert_array_equal(building.drift_rows, THREE_STOREYS)
    assert building.storeys == ("storey1", "storey2", "storey3")


def test_a_mass_damper_of_no_storey_is_no_floor(tmp_path):
    np.savez(tmp_path / "s.npz", **dict(zip("MCK", with_damper(3), strict=True)),
             drift_rows=THREE_STOREYS)  # fmt: skip
    isolators = reference_isolators()
    chain = from_matrices(*with_damper(3)).on(isolators, target_period_s=2.5)
    building = read_matrices(tmp_path / "s.npz").on(isolators, target_period_s=2.5)
    with pytest.warns(PlausibilityWarning, match="floor4, 1.2e.04 kg with a period of 2 s of its"):
        wrong = simulate(chain, el_centro_1940())
    with warnings.catch_warnings():
        warnings.simplefilter("error", PlausibilityWarning)
        run = simulate(building, el_centro_1940())
    same, also = run.history["displacement"], wrong.history["displacement"]
    np.testing.assert_allclose(same, also, atol=1e-9)
    for quantity, floors in (("acceleration", ["base", "floor1", "floor2", "floor3"]),
                             ("drift", building.structure.storeys)):  # fmt: skip
        history = run.history[quantity]
        peak = float(np.abs(history.sel({history.dims[1]: list(floors)})).max())
        key = "peak_floor_acceleration_m_s2" if quantity == "acceleration" else "peak_drift_m"
        assert run.criteria[key] == pytest.approx(peak, rel=2e-3)
        assert wrong.criteria[key] > 1.2 * run.criteria[key]


@pytest.mark.parametrize("floors", [1, 2, 3, 5, 10])
def test_a_light_top_floor_is_no_mass_damper(floors):
    stiff = 2e8 * np.ones(floors + 1)
    stiff[-1] = 4e7
    masses = [2e5] * floors + [2e4]
    top = shear_building(masses, stiff, base_mass=2e5)
    run = simulate(top.on(reference_isolators(), target_period_s=2.5), el_centro_1940())
    assert not any("mass damper" in line for line in run.warnings())
