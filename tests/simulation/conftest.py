"""Controllers, plants and an integration by SciPy that shares no code with the engine."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ground_motions import Record, el_centro_1940
from isolation_sim.laws import CurrentDependence, Device, law
from isolation_sim.simulation.control import Schedule
from isolation_sim.structures import reference_building, reference_isolators


class Scheduled:
    """Commands known before the run."""

    name = "scheduled"
    period = None

    def __init__(self, current, time=0.0):
        self.time = np.atleast_1d(np.asarray(time, float))
        self.amperes = np.asarray(current, float).reshape(len(self.time), -1)

    def measures(self, nominal):
        return ()

    def prepare(self, context, trial):
        pass

    def schedule(self, context):
        return Schedule(self.time, self.amperes)

    def reset(self, context):
        pass


class Rule:
    """Plain Python controller that applies a function and keeps what it saw and did."""

    name = "rule"

    def __init__(self, function, period, measured=("base_displacement_m", "base_velocity_m_s")):
        self.function, self.period, self.measured = function, period, measured

    def measures(self, nominal):
        return self.measured

    def prepare(self, context, trial):
        pass

    def schedule(self, context):
        return None

    def compiled(self, context):
        return None

    def reset(self, context):
        self.times, self.seen, self.commands = [], [], []

    def current(self, t, measurement):
        command = self.function(t, measurement)
        self.times.append(t)
        self.seen.append(measurement)
        self.commands.append(command)
        return command


def simulate_by_scipy(isolated, records, current, breaks=(), at_break=None, rtol=1e-11):
    """Integrate by DOP853 from break to break; ground samples are breaks too.

    ``current(start, t)`` gives the coil currents at t on the piece that begins at start;
    ``at_break(t, q, v, states)`` is called at each of the breaks. Returns displacements,
    velocities and internal states (all elements', in a row) at the samples.
    """
    structure, elements = isolated.structure, isolated.elements
    n = structure.n_dofs
    inverse = np.linalg.inv(structure.mass)
    ground = np.stack([r.acceleration for r in records], axis=1)
    samples = records[0].time
    inner = np.asarray([b for b in breaks if b < samples[-1]], float)
    knots = np.unique(np.round(np.concatenate([samples, inner]), 12))
    sizes = [len(e.device.law.states) for e in elements]
    ends = 2 * n + np.cumsum([0, *sizes])
    scale = np.full(ends[-1], 1e-3)
    scale[2 * n :] = 1e-4

    def rate(t, y, a, start, slope):
        q, v = y[:n], y[n : 2 * n]
        force, rates = np.zeros(n), []
        amperes = current(start, t)
        for e, low, high in zip(elements, ends[:-1], ends[1:], strict=True):
            i = 0.0 if e.channel is None else amperes[e.channel]
            x, dx, s = e.direction @ q, e.direction @ v, tuple(y[low:high])
            force += e.direction * e.device.force(x, dx, s, i)
            rates += e.device.rates(x, dx, s, i)
        pushed = structure.damping @ v + structure.stiffness @ q + force
        ground_now = a + slope * (t - start)
        return np.concatenate([v, -structure.influence @ ground_now - inverse @ pushed, rates])

    y, results = np.zeros(ends[-1]), [np.zeros(ends[-1])]
    stops = set(np.round(inner, 12).tolist())
    for start, stop in pairwise(knots):
        if at_break is not None and start in stops:
            at_break(start, y[:n], y[n : 2 * n], y[2 * n :])
        a, b = (np.array([np.interp(t, samples, g) for g in ground.T]) for t in (start, stop))
        slope = (b - a) / (stop - start)
        y = solve_ivp(
            rate, (start, stop), y, method="DOP853", rtol=rtol, atol=rtol * scale,
            args=(a, start, slope), first_step=(stop - start) / 2,
        ).y[:, -1]  # fmt: skip
        if np.min(np.abs(samples - stop)) < 1e-9:
            results.append(y)
    results = np.array(results)
    return results[:, :n], results[:, n : 2 * n], results[:, 2 * n :]


@pytest.fixture(scope="session")
def by_scipy():
    return simulate_by_scipy


@pytest.fixture(scope="session")
def scheduled():
    return Scheduled


@pytest.fixture(scope="session")
def rule():
    return Rule


@pytest.fixture(scope="session")
def held(scheduled):
    """A constant current on a one-channel plant."""
    return lambda amperes=1.5: scheduled([amperes])


@pytest.fixture(scope="session")
def no_coil(scheduled):
    """The controller of a plant without coils."""
    return scheduled(np.zeros((1, 0)))


@pytest.fixture(scope="session")
def el_centro():
    return el_centro_1940()


@pytest.fixture(scope="session")
def strong_motion(el_centro):
    """The first four seconds of El Centro, which hold its strongest shaking."""
    return el_centro.cut(0.0, 4.0)


@pytest.fixture(scope="session")
def stiffening():
    """The reference building on the strain-stiffening isolators."""
    return reference_building().on(reference_isolators())


@pytest.fixture(scope="session")
def hybrid():
    """The reference building on the hybrid law's isolators, printed numbers: the reference's."""
    return reference_building().on(reference_isolators(law("hybrid", "generalised_printed")))


@pytest.fixture(scope="session")
def viscous():
    """The reference building on springs and dashpots of 2.4 s and 10 %."""
    total = reference_building().total_mass
    k = total * (2 * np.pi / 2.4) ** 2
    numbers = {"k": k, "c": 0.2 * np.sqrt(k * total)}
    return reference_building().on(law("kelvin_voigt", parameters=numbers))


@pytest.fixture(scope="session")
def constant_device():
    """Device of a law with constant numbers."""
    return lambda law, **numbers: Device(
        law, CurrentDependence.constant(numbers, law.parameter_names)
    )


@pytest.fixture(scope="session")
def worst():
    """Largest error of all columns, relative to each column's peak."""

    def error(values, exact):
        values, exact = (np.asarray(a, float).reshape(len(a), -1) for a in (values, exact))
        return float(np.max(np.abs(values - exact).max(0) / np.abs(exact).max(0)))

    return error


@pytest.fixture(scope="session")
def motion():
    """Displacements and velocities of a run side by side."""
    return lambda run: np.concatenate(
        [run.history.displacement.values, run.history.velocity.values], axis=1
    )


@pytest.fixture(scope="session")
def sine():
    """A smooth ground motion sampled every 0.08 s, linear in between, at a finer step."""

    def record(dt):
        t = np.arange(53) * 0.08
        coarse = 3.0 * np.sin(2 * np.pi * 0.9 * t) * np.sin(np.pi * t / 4.16) ** 2
        fine = np.arange(round(4.16 / dt) + 1) * dt
        return Record(np.interp(fine, t, coarse), dt)

    return record
