"""Many plants side by side: each as if it were alone, whenever it starts."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.simulator import Simulator
from isolation_sim.simulation.vector_simulator import VectorSimulator

MEASURED = ("base_displacement_m", "base_velocity_m_s", "floor5_acceleration_m_s2",
            "isolator_force_N", "ground_acceleration_m_s2")  # fmt: skip


@pytest.mark.parametrize("parts", [1, 5])
@pytest.mark.parametrize("driver", [CoilDriver(), CoilDriver(lag=0.03, slew=100.0)])
def test_each_has_the_bits_of_a_plant_alone(parts, driver, stiffening):
    """20 plants, two blocks; some are put to rest on the way, under other motions."""
    dt, n, n_steps = 0.02, 20, 60
    period = parts * dt
    vector = VectorSimulator(stiffening, n, period=period, dt=dt, measures=MEASURED, driver=driver)
    rng = np.random.default_rng(7)
    motions = rng.normal(0, 2, (n, n_steps * parts + 1, 1))
    currents = rng.choice([0.0, 1.0, 3.0], (n, n_steps, 1))
    begun = np.where(np.arange(n) % 3 == 0, 23, 0)
    seen = [vector.reset(ground_acceleration=motions[:, 0])]
    for k in range(n_steps):
        if k == 23:
            seen[-1] = vector.reset(begun == 23, motions[:, k * parts])
        ground = motions[:, k * parts + 1 : (k + 1) * parts + 1]
        seen.append(vector.step(currents[:, k], ground))
    seen = np.array(seen)
    for lane in (0, 1, 2, 15, 17, 18):
        alone = Simulator(
            stiffening,
            period=period,
            dt=dt,
            duration=n_steps * period,
            measures=MEASURED,
            driver=driver,
        )
        start = begun[lane]
        first = motions[lane, start * parts]
        np.testing.assert_array_equal(seen[start, lane], alone.reset(ground_acceleration=first))
        for k in range(start, n_steps):
            ground = motions[lane, k * parts + 1 : (k + 1) * parts + 1]
            result = alone.step(currents[lane, k], ground)
            np.testing.assert_array_equal(seen[k + 1, lane], result)


def test_a_plant_that_diverges_leaves_the_others_alone(stiffening):
    vector = VectorSimulator(stiffening, 3, period=0.02, measures=MEASURED)
    ground = np.array([0.1, 1e5, 0.1]).reshape(3, 1, 1)
    while vector.alive.all():
        last = vector.step(np.ones((3, 1)), ground)
    assert vector.alive.tolist() == [True, False, True]
    np.testing.assert_array_equal(last[0], last[2])
    rest = vector.reset(~vector.alive)
    assert vector.alive.all()
    assert not rest[1, :5].any()
    assert vector.step(np.ones((3, 1)), ground)[1, 4] == 1e5


def test_what_is_refused(stiffening):
    with pytest.raises(InputError, match="n: given 0; expected: 1 or more"):
        VectorSimulator(stiffening, 0, period=0.02)
    with pytest.raises(InputError, match=r"dt: given 0.03 s; expected: the period"):
        VectorSimulator(stiffening, 2, period=0.02, dt=0.03)
    vector = VectorSimulator(stiffening, 2, period=0.02)
    with pytest.raises(InputError, match="currents contain NaN"):
        vector.step([[0.0], [np.nan]], np.zeros((2, 1, 1)))
