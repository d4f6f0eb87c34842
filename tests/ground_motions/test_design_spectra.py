"""Design spectra at points computed by hand from the clauses."""

import numpy as np
import pytest

from ground_motions import (
    STANDARD_GRAVITY,
    InputError,
    asce7_22_multi_period,
    asce7_22_two_period,
    en1998_1_1_2022,
    en1998_1_2004,
    nzs1170_5,
    table_spectrum,
)

G = STANDARD_GRAVITY


def check(spectrum, points):
    periods, expected = np.array(points).T
    np.testing.assert_allclose(spectrum.psa(periods), expected, rtol=1e-4)


def test_asce7_22_two_period():
    # T_S = 0.6 s, T_0 = 0.12 s
    points = [(0, 0.4), (0.06, 0.7), (0.12, 1.0), (0.3, 1.0), (0.6, 1.0), (1, 0.6), (2, 0.3),
              (8, 0.075), (10, 0.048)]  # fmt: skip
    check(asce7_22_two_period(G, 0.6 * G, 8.0), [(t, a * G) for t, a in points])
    check(asce7_22_two_period(G, 0.6 * G, 8.0, "mce_r"), [(t, 1.5 * a * G) for t, a in points])


def test_asce7_22_multi_period():
    values = [(0, 0.6), (0.2, 1.5), (1, 0.9), (10, 0.06)]
    periods, mce_r = np.array(values).T
    design = asce7_22_multi_period(periods, mce_r, 12.0)
    # linear between the points, 10 / T to T_L, then 10 T_L / T^2; two thirds of MCE_R
    check(design, [(0, 0.4), (0.1, 0.7), (0.6, 0.8), (10, 0.04), (11, 0.04 * 10 / 11),
                   (20, 0.04 * 10 * 12 / 400)])  # fmt: skip
    check(asce7_22_multi_period(periods, mce_r, 12.0, "mce_r"), values)
    # no step at 10 s where T_L is shorter
    check(asce7_22_multi_period(periods, mce_r, 4.0), [(10, 0.04), (10.0001, 0.04), (20, 0.01)])


@pytest.mark.parametrize(
    ("spectrum_type", "ground", "a_g", "points"),
    [
        (1, "C", 2.0, [(0, 2.3), (0.1, 4.025), (0.2, 5.75), (0.4, 5.75), (1.2, 2.875), (2, 1.725),
                       (3, 0.766667), (4, 0.43125), (8, 0.0744847), (10, 0.0272401)]),
        (1, "A", 1.0, [(0.15, 2.5), (0.8, 1.25), (4, 0.125)]),
        (1, "E", 1.0, [(0.3, 3.5), (1.0, 1.75)]),
        (2, "D", 1.0, [(0, 1.8), (0.2, 4.5), (0.6, 2.25), (1.2, 1.125), (2.4, 0.28125)]),
        (2, "B", 2.0, [(0.05, 6.75), (0.5, 3.375)]),
    ],
)  # fmt: skip
def test_en1998_1_2004(spectrum_type, ground, a_g, points):
    check(en1998_1_2004(a_g, ground, spectrum_type), points)


def test_en1998_1_2004_type_2_ends_at_4_s():
    with pytest.raises(InputError, match=r"4.5; expected: 0 to 4"):
        en1998_1_2004(1.0, "A", 2).psa([4.5])


def test_en1998_1_1_2022():
    # S_alpha = 6, S_beta = 3.2 m/s2: T_B = 0.1 s, T_C = 0.5333 s, T_D = 1 + 2 s
    spectrum = en1998_1_1_2022(5.0, 2.0, f_alpha=1.2, f_beta=1.6)
    check(spectrum, [(0, 2.4), (0.02, 2.4), (0.06, 4.2), (0.1, 6), (0.3, 6), (1, 3.2), (2, 1.6),
                     (4, 0.6)])  # fmt: skip
    # T_C / 4 = 0.075 s, and T_D = 2 s for S_beta up to 1 m/s2
    check(en1998_1_1_2022(3.0, 0.9), [(0.0475, 2.1), (0.075, 3), (2, 0.45), (4, 0.1125)])


# NZS 1170.5:2004, Table 3.1, values for numerical integration, rounded as printed
NZS_TABLE = {
    "A": [(0, 1.0), (0.1, 2.35), (0.4, 1.89), (1, 0.95), (2, 0.53), (3, 0.35), (4.5, 0.16)],
    "C": [(0, 1.33), (0.2, 2.93), (0.4, 2.36), (0.5, 2.0), (1, 1.19), (1.5, 0.88), (2, 0.66),
          (3, 0.44), (4.5, 0.20)],
    "D": [(0, 1.12), (0.4, 3.0), (0.6, 2.84), (1, 1.93), (1.5, 1.43), (2, 1.07), (3, 0.71),
          (4.5, 0.32)],
    "E": [(0, 1.12), (1, 3.0), (1.5, 2.21), (2, 1.66), (3, 1.11), (4.5, 0.49)],
}  # fmt: skip


@pytest.mark.parametrize("subsoil", NZS_TABLE)
def test_nzs1170_5_against_its_table(subsoil):
    periods, printed = np.array(NZS_TABLE[subsoil]).T
    shape = nzs1170_5(0.4, 1.0, subsoil).psa(periods) / (0.4 * G)
    np.testing.assert_allclose(shape, printed, rtol=0, atol=0.0061)


def test_nzs1170_5_near_fault():
    far = nzs1170_5(0.4, 1.0, "C").psa([3.0])
    for distance, factor in ((0.0, 1.36), (2.0, 1.36), (11.0, 1.18), (20.0, 1.0), (50.0, 1.0)):
        near = nzs1170_5(0.4, 1.0, "C", fault_distance_km=distance).psa([3.0])
        np.testing.assert_allclose(near, factor * far)
    with pytest.raises(InputError, match=r"0.7 or below"):
        nzs1170_5(0.5, 1.8, "C")


def test_a_table_is_linear_and_ends():
    spectrum = table_spectrum([0.1, 1.0, 3.0], [3.0, 2.0, 1.0])
    check(spectrum, [(0.1, 3), (0.55, 2.5), (2, 1.5), (3, 1)])
    with pytest.raises(InputError, match=r"0.1 to 3"):
        spectrum.psa([3.1])
    with pytest.raises(InputError, match="increasing"):
        table_spectrum([1.0, 0.5], [1.0, 1.0])
