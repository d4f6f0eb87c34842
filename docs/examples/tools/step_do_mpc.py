"""The same decision in do-mpc."""

import casadi
import do_mpc
import numpy as np
from step_here import at, controller, record, run

h, n_horizon = 0.02, 30  # s
m = casadi.DM([300e3, 250e3])  # kg, slab and floor
k1, c1 = 1.1e8, 2 * 0.02 * np.sqrt(1.1e8 * 250e3)  # storey
lag, slew, high = 0.05, 30.0, 3.0  # coil
x0, a0, _ = controller.units  # m and m/s^2, peaks without current
omega = controller.frequency  # rad/s, without current

model = do_mpc.model.Model("discrete")
y = model.set_variable("_x", "y", (5, 1))  # displacements, velocities, coil current
u = model.set_variable("_u", "u")
now, after = (model.set_variable("_tvp", name) for name in ("now", "after"))


def accelerations(y):
    """Absolute accelerations of slab and floor, m/s^2."""
    storey = k1 * (y[1] - y[0]) + c1 * (y[3] - y[2])
    isolator = (3e6 + 3e6 * y[4]) * y[0] + (3e5 + 1e5 * y[4]) * y[2]
    return casadi.vertcat(storey - isolator, -storey) / m


def rates(y, ground):
    """Rates of the states."""
    return casadi.vertcat(y[2:4], accelerations(y) - ground, (u - y[4]) / lag)


half = (now + after) / 2
s1 = rates(y, now)
s2 = rates(y + h / 2 * s1, half)
s3 = rates(y + h / 2 * s2, half)
s4 = rates(y + h * s3, after)
model.set_rhs("y", y + h / 6 * (s1 + 2 * s2 + 2 * s3 + s4))
model.setup()

mpc = do_mpc.controller.MPC(model)
mpc.settings.n_horizon, mpc.settings.t_step = n_horizon, h
mpc.settings.supress_ipopt_output()
squares = 0.5 * (y[0] / x0) ** 2 + 0.5 * casadi.sumsqr(accelerations(y) / a0) / 2
terminal = 0.25 * ((y[0] / x0) ** 2 + (y[2] / (x0 * omega)) ** 2)
mpc.set_objective(
    lterm=(squares + 0.1 * (u / high) ** 2) / n_horizon,
    mterm=squares / n_horizon + terminal,
)
mpc.set_rterm(u=0.05 / high**2)
mpc.bounds["lower", "_u", "u"], mpc.bounds["upper", "_u", "u"] = 0.0, high
mpc.set_nl_cons("rising", u - y[4], slew * lag)
mpc.set_nl_cons("falling", y[4] - u, slew * lag)
mpc.scaling["_x", "y"] = np.array([0.1, 0.1, 0.5, 0.5, 1.0])

ahead = record.acceleration[at : at + n_horizon + 2]  # m/s^2
template = mpc.get_tvp_template()
for step in range(n_horizon + 1):
    template["_tvp", step, "now"], template["_tvp", step, "after"] = ahead[step : step + 2]
mpc.set_tvp_fun(lambda t: template)
mpc.setup()

names = [f"{level}_{what}" for what in ("displacement_m", "velocity_m_s")
         for level in ("base", "floor1")]  # fmt: skip
mpc.x0 = np.array([*(run.output(name)[at] for name in names), run.current[at, 0]])
mpc.u0 = run.command[at - 1]
mpc.set_initial_guess()
command = mpc.make_step(mpc.x0)[0, 0]  # A
