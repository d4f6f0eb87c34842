"""Every controller under noise, delay and a wrong nominal model."""

import numpy as np
import pytest

from controllers import available_controllers
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building, reference_isolators

from .conftest import build, noisy_sensors

CASES = [(name, factor) for name in available_controllers() for factor in (0.8, 1.2)]
LONG = [("clairvoyant", 0.8), ("clairvoyant", 1.2)]


@pytest.mark.parametrize(
    ("name", "factor"),
    [pytest.param(*one, marks=[pytest.mark.slow] if one in LONG else []) for one in CASES],
)
def test_stays_bounded(name, isolated, record, factor):
    """Of the size of what constant currents lead to, and dying out when the ground is quiet."""
    nominal_device = reference_building().on(reference_isolators().scaled(force=factor))
    one, driver = build(name), CoilDriver(lag=0.05)
    ground = record.padded(after=8.0)
    run, off, on = (
        simulate(isolated, ground, each, nominal=nominal_device, driver=driver, sensors=inputs)
        for each, inputs in (
            (one, noisy_sensors(one, isolated)),
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
