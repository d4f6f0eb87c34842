"""Structures from OpenSeesPy: its own periods, and its own response on a linear isolator."""

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.structures import from_opensees
from studies.benchmarks.peers import load_opensees

ops = load_opensees()
needs_opensees = pytest.mark.skipif(ops is None, reason="OpenSeesPy does not load here")

STIFFNESS, DAMPER, SPAN, STOREY = 4e6, 1e5, 6.0, 3.2


@pytest.fixture
def frame():
    """A plane frame of two storeys on a base beam; masses at the joints, none against turning."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    for floor in range(3):
        for side in range(2):
            tag = 10 * floor + side + 1
            ops.node(tag, side * SPAN, floor * STOREY)
            ops.mass(tag, 2e4, 0.0, 0.0)
            ops.fix(tag, 0, 1, 0)
        if floor == 0:
            ops.equalDOF(1, 2, 1)
    ops.geomTransf("Linear", 1)
    numbers = (0.12, 3e10, 1.6e-3, 1)
    for floor in range(3):
        if floor:
            ops.element("elasticBeamColumn", 10 * floor, 10 * floor + 1, 10 * floor + 2, *numbers)
        else:
            ops.element("elasticBeamColumn", 100, 1, 2, *numbers)
    for floor in range(2):
        for side in range(2):
            below = 10 * floor + side + 1
            ops.element("elasticBeamColumn", 200 + below, below, below + 10, *numbers)
    ops.rayleigh(0.1, 0.0, 0.0, 0.0)
    yield
    ops.wipe()


def on_springs():
    """Put the OpenSees model on its own linear isolator."""
    ops.node(99, 0.0, 0.0)
    ops.fix(99, 1, 1, 1)
    ops.uniaxialMaterial("Elastic", 1, STIFFNESS, DAMPER)
    ops.element("zeroLength", 999, 99, 1, "-mat", 1, "-dir", 1)


@needs_opensees
def test_periods_and_response_are_those_of_opensees(frame):
    building = from_opensees(1, floors=[11, 21], opensees=ops)
    assert building.names[building.base[0]] == "node1_x"
    assert building.n_dofs == 5  # the base beam's ends move as one; the other joints by themselves
    assert building.storeys == ("storey1", "storey2")
    np.testing.assert_allclose(building.heights, STOREY)
    device = iso.law("kelvin_voigt", parameters={"k": STIFFNESS, "c": DAMPER})
    isolated = building.on(device)
    record = el_centro_1940().cut(0.0, 6.0)
    run = iso.simulate(isolated, record, "passive_off")
    on_springs()
    # of the whole on its springs, by OpenSees' own eigenvalues
    computed = np.sort(np.array(ops.eigen("-fullGenLapack", 3)))
    rows = isolated.element_rows
    stiffness = building.stiffness + STIFFNESS * rows.T @ rows
    expected = np.sort(np.linalg.eigvals(np.linalg.solve(building.mass, stiffness)).real)[:3]
    np.testing.assert_allclose(computed, expected, rtol=1e-6)
    # and the response, by Newmark's rule at a tenth of the sample
    ops.wipeAnalysis()
    n, dt = 10, record.dt
    fine = np.interp(np.arange((len(record) - 1) * n + 1) * dt / n, record.time,
                     record.acceleration)  # fmt: skip
    ops.timeSeries("Path", 1, "-dt", dt / n, "-values", *fine.tolist())
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    ops.constraints("Transformation")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.algorithm("Linear")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient", "-noWarnings")
    ops.setTime(0.0)
    path = {"node1_x": [0.0], "node21_x": [0.0]}
    for _ in range(len(record) - 1):
        assert ops.analyze(n, dt / n) == 0
        path["node1_x"].append(ops.nodeDisp(1, 1))
        path["node21_x"].append(ops.nodeDisp(21, 1))
    for name, values in path.items():
        own = run.output(f"{name}_displacement_m")
        assert np.max(np.abs(own - values)) < 1e-3 * np.max(np.abs(own))


@needs_opensees
def test_a_slab_that_turns_has_its_isolators_positions():
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    corners = [(-4.0, -3.0), (4.0, -3.0), (4.0, 3.0), (-4.0, 3.0)]
    for level in range(2):
        ops.node(100 * level + 50, 0.5, 0.2, 4.0 * level)
        ops.mass(100 * level + 50, 1e5, 1e5, 0.0, 0.0, 0.0, 1e6)
        ops.fix(100 * level + 50, 0, 0, 1, 1, 1, 0)
        for k, (x, y) in enumerate(corners):
            ops.node(100 * level + k + 1, x, y, 4.0 * level)
            ops.fix(100 * level + k + 1, 0, 0, 1, 1, 1, 0)
        ops.rigidDiaphragm(3, 100 * level + 50, *(100 * level + k + 1 for k in range(4)))
    ops.geomTransf("Linear", 1, 1.0, 0.0, 0.0)
    for k in range(4):
        ops.element("elasticBeamColumn", k + 1, k + 1, 101 + k, 0.1, 3e10, 1.2e10, 2e-3, 1e-3,
                    1.5e-3, 1)  # fmt: skip
    building = from_opensees(
        50, floors=[150], directions="xy", isolators=[1, 2, 3, 4], opensees=ops
    )
    ops.wipe()
    assert building.n_dofs == 6
    assert building.directions == ("x", "y")
    assert [building.names[i] for i in building.base] == ["node50_x", "node50_y", "node50_rz"]
    np.testing.assert_allclose(building.isolator_positions, np.array(corners) - [0.5, 0.2])
    np.testing.assert_allclose(np.diag(building.mass), [1e5, 1e5, 1e6] * 2)
    # four clamped columns, in each direction
    k = {axis: 4 * 12 * 3e10 * i / 4.0**3 for axis, i in (("x", 1e-3), ("y", 1.5e-3))}
    names = list(building.names)
    for axis, value in k.items():
        a, b = names.index(f"node50_{axis}"), names.index(f"node150_{axis}")
        result = sorted([building.stiffness[a, a], -building.stiffness[a, b]])
        np.testing.assert_allclose(result, value, rtol=1e-9)
    np.testing.assert_allclose(building.influence.sum(axis=0), 2.0)


@needs_opensees
def test_what_is_refused(frame):
    with pytest.raises(iso.InputError, match="has no node 7"):
        from_opensees(7, opensees=ops)
    with pytest.raises(iso.InputError, match="node 1 is fixed or tied along y"):
        from_opensees(1, directions="y", opensees=ops)
    with pytest.raises(iso.InputError, match="node 2 is fixed or tied along x"):
        from_opensees(2, opensees=ops)
    with pytest.raises(iso.InputError, match="directions: given 'z'"):
        from_opensees(1, directions="z", opensees=ops)
