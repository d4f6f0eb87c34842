"""Printed tables of the papers, in the papers' own units."""

from __future__ import annotations

LI_LI = "Li & Li, On rate-dependent mechanical model for adaptive MR elastomer base isolator"
YU = "Yu et al., A new hybrid model for MR elastomer device and parameter identification"

CURRENTS_A = (0.0, 1.0, 2.0, 3.0)
"""Columns of every table below."""

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

LI_LI_GENERALISED = {
    "c0": (14.521, -0.9687),
    "k0": (22.108, 38.565),
    "c1": (1.4895, 0.0489),
    "k1": (35.927, 55.439),
    "alpha": (0.1332, -0.0256),
}
"""Li & Li, Table 2: ascending powers of the current; N, mm, s."""

LI_LI_BASE_MODEL = {"c0": 2.0, "k0": 0.2, "c1": 12.0, "k1": 7.0, "alpha": 0.5}
"""Li & Li, Section 4.1: base model of the parameter study; N, mm, s."""

YU_ALPHA_N = {
    (2.0, 1.0): (32.02, 43.75, 41.77, 56.87),
    (2.0, 2.0): (37.66, 42.49, 54.92, 68.33),
    (2.0, 4.0): (6.51, 54.57, 59.39, 50.99),
    (4.0, 1.0): (40.74, 43.81, 44.21, 53.76),
    (4.0, 2.0): (48.34, 20.55, 60.76, 79.26),
    (4.0, 4.0): (44.69, 64.26, 66.78, 66.35),
    (8.0, 1.0): (26.06, 52.82, 64.31, 44.67),
    (8.0, 2.0): (50.61, 36.13, 33.47, 72.97),
    (8.0, 4.0): (36.82, 41.14, 56.97, 69.04),
}
"""Yu et al., Table 1: alpha in N; (amplitude in mm, frequency in Hz) to a row."""

YU_BETA_PER_MM = {
    (2.0, 1.0): (0.75, 0.67, 0.86, 0.82),
    (2.0, 2.0): (0.47, 0.67, 0.72, 0.72),
    (2.0, 4.0): (0.85, 0.58, 0.69, 0.88),
    (4.0, 1.0): (0.38, 0.43, 0.51, 0.52),
    (4.0, 2.0): (0.39, 0.38, 0.42, 0.42),
    (4.0, 4.0): (0.31, 0.44, 0.41, 0.46),
    (8.0, 1.0): (0.25, 0.28, 0.27, 0.34),
    (8.0, 2.0): (0.29, 0.27, 0.35, 0.28),
    (8.0, 4.0): (0.25, 0.29, 0.28, 0.28),
}
"""Yu et al., Table 2: beta in 1/mm; (amplitude in mm, frequency in Hz) to a row."""

YU_GAMMA_N = {
    (2.0, 1.0): (1.54, 15.41, 24.73, 24.56),
    (2.0, 2.0): (2.26, 16.87, 27.77, 28.99),
    (2.0, 4.0): (2.88, 19.78, 31.19, 31.97),
    (4.0, 1.0): (3.07, 21.92, 32.51, 35.78),
    (4.0, 2.0): (4.47, 24.87, 37.04, 38.08),
    (4.0, 4.0): (6.41, 28.39, 42.62, 44.49),
    (8.0, 1.0): (5.99, 30.87, 45.67, 48.01),
    (8.0, 2.0): (9.09, 36.55, 52.51, 55.77),
    (8.0, 4.0): (12.75, 44.69, 61.99, 66.36),
}
"""Yu et al., Table 3: gamma in N; (amplitude in mm, frequency in Hz) to a row."""

YU_SIGMA_SQUARED_MM2 = {
    (2.0, 1.0): (2.83, 1.87, 1.73, 1.63),
    (2.0, 2.0): (3.13, 2.03, 1.89, 1.88),
    (2.0, 4.0): (4.23, 2.42, 2.13, 2.07),
    (4.0, 1.0): (8.57, 6.85, 6.49, 6.11),
    (4.0, 2.0): (10.18, 7.61, 7.28, 6.98),
    (4.0, 4.0): (10.92, 9.96, 8.53, 8.99),
    (8.0, 1.0): (23.25, 25.64, 24.89, 23.98),
    (8.0, 2.0): (22.89, 28.13, 28.23, 27.82),
    (8.0, 4.0): (28.59, 34.01, 34.02, 33.25),
}
"""Yu et al., Table 4: sigma squared in mm^2; (amplitude in mm, frequency in Hz) to a row."""

YU_GENERALISED_PRINTED = {
    "alpha": (35.42, 9.121),
    "beta": (0.4235, 0.0034),
    "gamma": (5.234, 26.72, -4.892),
    "sigma_squared": (12.8059,),
}
"""Yu et al., Eqs 26-29 as printed: ascending powers of the current; N, mm."""

YU_GENERALISED_REFITTED = {
    "alpha": (35.78, 8.883),
    "beta": (0.4299, 0.03156),
    "gamma": (5.248, 26.557, -4.803),
    "sigma_squared": (12.8058,),
}
"""Least squares through the means of Yu et al., Tables 1-4; the printed slope of beta, .0034, is a
misprint of about .034. Ascending powers of the current; N, mm."""
