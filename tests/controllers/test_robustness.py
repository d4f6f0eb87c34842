"""Every controller under noise, delay and a wrong belief."""

import numpy as np
import pytest

from isolation_sim.simulation.control import CoilDriver, Sensors
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building, reference_isolators

from .conftest import build

NOISE = {
    "displacement_m": 5e-4, "velocity_m_s": 5e-3, "acceleration_m_s2": 0.02, "deformation_m": 5e-4,
    "force_N": 5e3,
}  # fmt: skip


def sensors(one, isolated):
    """Noise of every quantity that the controller measures, and 20 ms of delay."""
    measured = one.measures(isolated)
    noise = {key: size for key, size in NOISE.items() if any(n.endswith(key) for n in measured)}
    return Sensors(noise=noise, delay=0.02, seed=1)


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_stays_bounded(name, isolated, record, factor):
    """Of the size of what constant currents lead to, and dying out when the ground is quiet."""
    believed = reference_building().on(reference_isolators().scaled(force=factor))
    one, driver = build(name), CoilDriver(lag=0.05)
    ground = record.padded(after=8.0)
    run, off, on = (
        simulate(isolated, ground, each, belief=believed, driver=driver, sensors=given)
        for each, given in (
            (one, sensors(one, isolated)),
            (build("passive_off"), None),
            (build("passive_on"), None),
        )
    )
    base, roof = "base_displacement_m", "floor5_acceleration_m_s2"
    peak = np.abs(run.output(base)).max()
    assert peak <= 1.5 * np.abs(off.output(base)).max()
    assert np.abs(run.output(roof)).max() <= 3 * np.abs(on.output(roof)).max()
    assert np.abs(run.output(base)[-100:]).max() <= 0.5 * peak
    assert run.command.min() >= 0 and run.command.max() <= 3
