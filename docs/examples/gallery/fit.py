"""A fitted law.

Measured and fitted loops. The device of this example is simulated, with noise of 1 % added.
[Fit your tests](tutorials/fit_your_tests.ipynb) does this from files.
"""

import numpy as np

import isolation_sim as iso
from isolation_sim.identification.campaign import Campaign, TestRun

rng = np.random.default_rng(0)
time = np.arange(0.0, 4.0, 1 / 128)
runs = []
for current in (0.0, 1.0, 2.0):
    for amplitude in (2e-3, 4e-3):
        x = amplitude * np.sin(2 * np.pi * time)
        v = 2 * np.pi * amplitude * np.cos(2 * np.pi * time)
        force = (3e4 + 2e4 * current) * x + (900 + 300 * current) * v
        force += 0.01 * force.std() * rng.standard_normal(time.size)
        name = f"{1e3 * amplitude:g} mm, {current:g} A"
        runs.append(TestRun(name, time, x, v, force, np.full(time.size, current)))
fit = iso.fit(Campaign("example", "simulated", tuple(runs)), law="kelvin_voigt")
figure = fit.plot()
