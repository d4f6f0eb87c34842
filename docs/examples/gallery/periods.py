"""Period and damping against the current.

First mode of the reference building for small vibrations. [Isolation](ideas/isolation.md) has the
numbers of the reference building.
"""

import matplotlib.pyplot as plt
import numpy as np

import isolation_sim as iso

isolated = iso.reference_building().on(iso.reference_isolators())
currents = np.linspace(0.0, 3.0, 31)
figure, axes = plt.subplots(1, 2, figsize=(7.2, 2.6), layout="constrained")
axes[0].plot(currents, [isolated.periods(i)[0] for i in currents])
axes[0].set(xlabel="current (A)", ylabel="first period (s)", ylim=(0, None))
axes[1].plot(currents, [isolated.damping_ratio(i) for i in currents])
axes[1].set(xlabel="current (A)", ylabel="damping ratio", ylim=(0, None))
