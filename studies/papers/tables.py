"""Printed tables of the papers that only studies and tests compare with, in the papers' units."""

from __future__ import annotations

LI_LI_STIFFNESS_N_PER_MM = {
    2.0: (4.96, 27.13, 52.22, 66.13),
    4.0: (4.69, 20.72, 38.15, 48.74),
    8.0: (4.62, 17.72, 31.44, 39.31),
}
"""Li & Li, Table 1: measured effective stiffness at 1 Hz; amplitude in mm to a row."""

LI_LI_DAMPING_RATIO = {
    2.0: (0.220, 0.240, 0.218, 0.201),
    4.0: (0.223, 0.228, 0.206, 0.189),
    8.0: (0.205, 0.204, 0.188, 0.179),
}
"""Li & Li, Table 1: measured damping ratio at 1 Hz; amplitude in mm to a row."""

TAO_COMPLEX_MODULUS: dict[int, tuple[float, ...]] = {
    1: (1.0, 0.1, 0.0, 3.115e6, 5.468e6, 6.09e5, 4.73e6),
    2: (1.0, 0.5, 0.0, 3.121e6, 3.019e6, 1.43e5, 2.24e6),
    3: (1.0, 1.0, 0.0, 3.167e6, 5.327e6, 7.13e4, 4.46e5),
    4: (1.0, 5.0, 0.0, 3.272e6, 5.622e6, 1.76e4, 9.44e4),
    5: (1.0, 10.0, 0.0, 3.338e6, 5.623e6, 9.29e3, 4.81e4),
    6: (3.0, 0.1, 0.0, 2.874e6, 3.332e6, 3.50e5, 2.14e6),
    7: (3.0, 0.5, 0.0, 2.897e6, 2.406e6, 7.79e4, 1.19e6),
    8: (3.0, 1.0, 0.0, 2.917e6, 3.383e6, 4.31e4, 2.20e5),
    9: (5.0, 0.1, 0.0, 2.811e6, 3.005e6, 2.82e5, 1.43e6),
    10: (5.0, 0.5, 0.0, 2.864e6, 2.384e6, 6.36e4, 1.05e6),
    11: (5.0, 1.0, 0.0, 2.888e6, 3.129e6, 3.36e4, 1.55e5),
    12: (1.0, 0.1, -3.5, 3.839e6, 6.368e6, 7.27e5, 3.81e6),
    13: (1.0, 0.5, -3.5, 3.815e6, 3.849e6, 1.80e5, 2.15e6),
    14: (1.0, 1.0, -3.5, 3.846e6, 5.849e6, 9.00e4, 3.74e5),
    15: (1.0, 5.0, -3.5, 4.081e6, 6.481e6, 1.93e4, 7.55e4),
    16: (1.0, 10.0, -3.5, 4.215e6, 6.598e6, 1.08e4, 4.26e4),
    17: (3.0, 0.1, -3.5, 3.432e6, 3.944e6, 4.63e5, 2.06e6),
    18: (3.0, 0.5, -3.5, 3.481e6, 2.803e6, 1.03e5, 1.45e6),
    19: (3.0, 1.0, -3.5, 3.500e6, 4.006e6, 5.41e4, 2.10e5),
}
"""Tao et al., Tables 2 and 3, by scheme: amplitude (mm), frequency (Hz), initial position (mm);
stiffness at 0 and 2 A (N/m), damping at 0 and 2 A (N s/m). The 0.5 Hz, 2 A values are corrupt."""

LINEARISED = (
    "A study of the frequency, amplitude and magnetic field dependence of the dynamic stiffness "
    "of magnetorheological elastomers"
)
