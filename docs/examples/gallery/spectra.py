"""Response spectra.

Spectral acceleration of a record, a random motion and a near-fault pulse at 5 % damping.
[Suites](suites.md) compares records with design spectra.
"""

import matplotlib.pyplot as plt
import numpy as np

from ground_motions import (
    el_centro_1940,
    kanai_tajimi_motion,
    mavroeidis_papageorgiou_pulse,
    response_spectrum,
)

motions = {
    "El Centro 1940": el_centro_1940(),
    "Kanai-Tajimi, soft soil": kanai_tajimi_motion("soft", dt=0.02, seed=1, pga=3.0),
    "pulse of 2 s": mavroeidis_papageorgiou_pulse(0.4, 2.0, 1.5, 0.0, dt=0.02),
}
periods = np.linspace(0.05, 4.0, 200)
figure, axes = plt.subplots(figsize=(5.5, 3.0), layout="constrained")
for label, motion in motions.items():
    axes.plot(periods, response_spectrum(motion, periods, damping=0.05).psa, label=label)
axes.set(xlabel="period (s)", ylabel="pseudo-acceleration (m/s²)")
axes.legend()
