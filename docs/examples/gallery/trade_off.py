"""Constant currents, side by side.

Peak floor acceleration against peak base displacement for 31 constant currents and two ground
motions, in one batch. [Sweeps](sweeps.md) run thousands of cases.
"""

import matplotlib.pyplot as plt
import numpy as np

import isolation_sim as iso
from ground_motions import el_centro_1940, mavroeidis_papageorgiou_pulse

isolated = iso.reference_building().on(iso.reference_isolators())
motions = {
    "El Centro 1940": el_centro_1940(),
    "pulse of 2 s": mavroeidis_papageorgiou_pulse(0.4, 2.0, 1.5, 0.0, dt=0.02),
}
currents = np.linspace(0.0, 3.0, 31)
figure, axes = plt.subplots(figsize=(4.5, 3.0), layout="constrained")
for label, motion in motions.items():
    controllers = [iso.controller("constant", amperes=i) for i in currents]
    batch = iso.simulate_many([iso.Case(isolated, motion, one) for one in controllers])
    base = 1e3 * batch.criteria["peak_base_displacement_m"]
    axes.plot(base, batch.criteria["peak_floor_acceleration_m_s2"], ".-", label=label)
axes.set(xlabel="peak base displacement (mm)", ylabel="peak floor acceleration (m/s²)")
axes.legend()
