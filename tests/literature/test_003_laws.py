"""003: regression of the linearised Bouc-Wen's stiffness, and what one corrupt column does."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.laws import linearised_bouc_wen as lbw
from studies.papers.misprints import linearised_bouc_wen


def test_coefficients_to_a_thousandth():
    result = lbw.regression()
    printed = {
        "storage": ({"A": 1.4147, "B": 3.7001, "f": 0.01421, "constant": 5.3377}, 0.28),
        "loss": ({"A": -0.8257, "B": 0.64736, "f": 0.001091, "constant": 1.01798}, 0.04),
    }
    for name, (slopes, share) in printed.items():
        for key, value in slopes.items():
            assert result[name][0][key] == pytest.approx(value, rel=1e-3)
        assert result[name][1] == pytest.approx(share, abs=5e-3)
    # and the paper's own digits
    for key, value in {"A": -0.825, "B": 0.6469, "f": 0.00109, "constant": 1.017441}.items():
        assert result["loss"][0][key] == pytest.approx(value, rel=1.2e-3)


@pytest.mark.parametrize(
    ("field", "sums"),
    [
        (0.0, (0.173917, 72.663557, 0.49171, 0.493078, 338.218831)),
        (0.2, (0.1667975, 68.073862, 0.6175394, 0.6157004, 204.892711)),
        (0.3, (0.186846, 84.937137, 0.656682, 0.755872, 214.777227)),
        (0.4, (0.234697, 88.907935, 0.617421, 0.621219, 196.729962)),
    ],
)
def test_table_1_adds_up_to_the_printed_numbers(field, sums):
    """Sums over the twelve columns of a field, added up from the paper's text."""
    table = lbw.columns()
    chosen = table["field_T"] == field
    for name, printed in zip(("C", "k1", "k2", "C_e", "k_e"), sums, strict=True):
        assert np.sum(table[name][chosen]) == pytest.approx(printed, rel=0, abs=2e-8)


def test_corrupt_column_flips_a_sign():
    slopes, share = lbw.regression(drop=[lbw.CORRUPT])["storage"]
    assert slopes["A"] == pytest.approx(-2.39, abs=5e-3)
    assert share == pytest.approx(0.76, abs=5e-3)


def test_known_oddities_of_the_table():
    table = lbw.columns()
    key = np.column_stack([table[n] for n in ("field_T", "amplitude_mm", "frequency_Hz")])

    def column(*at):
        (k,) = np.flatnonzero(np.all(key == at, axis=1))
        return [table[n][k] for n in ("C", "k1", "k2", "C_e", "k_e")]

    assert len(key) == 48
    assert column(0.3, 0.1, 14) == column(0.0, 0.1, 14)
    assert column(*lbw.CORRUPT)[1] == 0.999958
    assert np.all(table["k_e"] > 0)


def test_split_is_the_transfer_function():
    table = lbw.columns()
    omega = 2 * np.pi * table["frequency_Hz"]
    C, k1, k2, C_e, k_e = (table[n] for n in ("C", "k1", "k2", "C_e", "k_e"))
    storage = lbw.storage_stiffness(k1, k2, C_e, k_e, omega)
    np.testing.assert_allclose(storage, table["storage"], rtol=1e-12)
    np.testing.assert_allclose(
        lbw.loss_stiffness(C, k2, C_e, k_e, omega), table["loss"], rtol=1e-12
    )


@pytest.mark.parametrize(("field", "amplitude", "frequency"), [(0.0, 0.15, 10.0), (0.4, 0.2, 6.0)])
def test_stable_law_keeps_storage_and_gains_loss(field, amplitude, frequency):
    device = lbw.condition(field, amplitude, frequency)
    C, k1, k2, C_e, k_e = device.parameters_at(0.0)
    omega = 2 * np.pi * frequency
    stiffness = device.linearised(0.0, frequency)
    published = lbw.published_stiffness(C, k1, k2, C_e, k_e, omega)
    assert stiffness == pytest.approx(lbw.published_stiffness(C, k1, k2, C_e, -k_e, omega))
    assert stiffness.real == pytest.approx(published.real, rel=1e-12)
    assert stiffness.imag > published.imag
    assert device.rates(0.0, 0.0, (1.0,), 0.0)[0] < 0


def test_refuses_conditions_that_were_not_tested():
    with pytest.raises(InputError, match="no test at"):
        lbw.condition(0.1, 0.1, 6.0)
    with pytest.raises(InputError, match="no column"):
        lbw.regression(drop=[(0.2, 0.1, 21.0)])


def test_the_meant_bouc_wen_equation_is_odd_and_the_printed_one_is_not():
    """Eq 2 prints no z after |z|^(n-1); the law has it."""
    values = dict(k=0.0, c=0.0, alpha=1.0, A=1.0, beta=1.0, gamma=1.0, n=2.0, F0=0.0)
    device = law("bouc_wen", values)
    (there,), (back,) = (device.rates(0.0, way, (way,), 0.0) for way in (1.0, -1.0))
    assert there + back == pytest.approx(0.0, abs=1e-12)
    row = next(row for row in linearised_bouc_wen() if row.where == "Eq 2")
    assert row.computed == -2.0


def test_printed_transfer_functions_differ_from_eq_8():
    """Eq 7 to 12 evaluated apart from the study, at one column of Table 1 each."""
    rows = {row.where: row.computed for row in linearised_bouc_wen()}
    # 0.4 T, 0.15 mm, 6 Hz: k1, k2, C_e, k_e, ω
    k1, k2, C_e, k_e, w = 6.803768, 0.217612, 0.217615, 1.030825, 12 * np.pi
    C = 0.000459
    exact = k1 + k2 * 1j * w * C_e / (1j * w - k_e) + 1j * w * C
    eq_7 = k1 + k2 * 1j * w * C_e / (1j * w - k1) + 1j * w * C
    assert 0 < 100 * abs(eq_7 / exact - 1) <= rows["Eq 7"] < 1
    eq_11 = w * (C - k2 * k_e * w * C_e / (k_e + w**2))
    assert 10 < 100 * abs(eq_11 / exact.imag - 1) <= rows["Eq 11"]
    assert 0 < 100 * abs((exact.real + exact.imag) / exact - 1) <= rows["Eq 12"]
