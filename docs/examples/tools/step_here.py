"""A decision of predictive control in isolation-sim."""

import isolation_sim as iso
from ground_motions import el_centro_1940

building = iso.shear_building([250e3], [1.1e8], base_mass=300e3)
isolator = iso.law(
    "kelvin_voigt",
    {"k": [3e6, 3e6], "c": [3e5, 1e5]},  # N/m and N s/m; ascending powers of the current
    current_range=(0.0, 3.0),
)
isolated = building.on(isolator)
settings = {
    "preview": 1.0,  # s, ground motion known
    "horizon": 0.6,  # s
    "blocks": 30,  # a command every 0.02 s
    "displacement": 0.5,
    "acceleration": 0.5,
    "end": 0.25,
    "effort": 0.1,
    "roughness": 0.05,
    "iterations": 20,  # to convergence
    # quadratic costs alone
    "displacement_excess": 0.0,
    "regret": 0.0,
    "acceleration_excess": 0.0,
    "stop": 0.0,
    "stiff_start": 0.0,
}
controller = iso.controller("mpc", **settings)
driver = iso.CoilDriver(lag=0.05, slew=30.0, high=3.0)  # s, A/s, A

record = el_centro_1940()
run = iso.simulate(isolated, record.cut(0.0, 7.2), controller, driver=driver)
command = run.command[:, 0]  # A, at run.time
at = 320  # the decision at 6.4 s: the peaks without current have been reached
