"""The isolated storey in OpenSeesPy."""

import numpy as np
import openseespy.opensees as ops

from ground_motions import el_centro_1940

FINER = 40  # steps per sample of the record

ops.wipe()
ops.model("basic", "-ndm", 1, "-ndf", 1)
ops.node(0, 0.0)
ops.fix(0, 1)
ops.node(1, 0.0, "-mass", 300e3)
ops.node(2, 0.0, "-mass", 250e3)
# alpha, ko, n, gamma, beta, Ao, deltaA, deltaNu, deltaEta
shape = 0.5 / 5.5e-3**2
ops.uniaxialMaterial("BoucWen", 1, 0.1, 54e6, 2.0, shape, shape, 1.0, 0.0, 0.0, 0.0)
dashpot = 2 * 0.02 * np.sqrt(1.1e8 * 250e3)
ops.uniaxialMaterial("Elastic", 2, 1.1e8, dashpot)
ops.element("zeroLength", 1, 0, 1, "-mat", 1, "-dir", 1)
ops.element("zeroLength", 2, 1, 2, "-mat", 2, "-dir", 1, "-doRayleigh", 0)

record = el_centro_1940()
ops.timeSeries("Path", 1, "-dt", record.dt, "-values", *record.acceleration.tolist())
ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
ops.constraints("Plain")
ops.numberer("Plain")
ops.system("BandGeneral")
ops.test("NormUnbalance", 1e-3, 30)
ops.algorithm("Newton")
ops.integrator("Newmark", 0.5, 0.25)
ops.analysis("Transient")

rows = [(0.0, 0.0, 0.0)]
for _ in range(len(record) - 1):
    if ops.analyze(FINER, record.dt / FINER) != 0:
        raise RuntimeError("OpenSees did not converge")
    rows.append((ops.nodeDisp(1, 1), ops.nodeDisp(2, 1), -ops.eleForce(1, 1)))

base, floor, force = np.array(rows).T
drift = floor - base
