"""Lists, ranges, samples and files of cases, against NumPy, SciPy and SALib."""

import numpy as np
import pytest
from scipy.stats import qmc

from isolation_sim.errors import InputError
from isolation_sim.sweeps.axes import axes_of, sample_of

from .conftest import plan_of


def points_of(**keys):
    (axis,) = axes_of(plan_of(**keys))
    return np.array([[*axis.shown(k).values()] for k in range(len(axis))])


def test_ranges():
    base = {"field": "isolator.count", "low": 0.5, "high": 2.0}
    for entry, expected in (
        ({**base, "count": 4}, np.linspace(0.5, 2.0, 4)),
        ({**base, "count": 3, "spacing": "log"}, [0.5, 1.0, 2.0]),
        ({**base, "step": 0.5}, [0.5, 1.0, 1.5, 2.0]),
        ({**base, "step": 0.4}, [0.5, 0.9, 1.3, 1.7]),
    ):
        np.testing.assert_allclose(points_of(vary=[entry])[:, 0], expected, rtol=1e-14)


def sampled(method, count, **more):
    return {
        "vary": [
            {"field": "isolator.count", "low": 0.5, "high": 2.0, "spacing": "log"},
            {"field": "ground.scale_factor", "low": -1.0, "high": 3.0},
        ],
        "sample": {"method": method, "count": count, **more},
    }


def unit(points):
    """Samples as shares of their limits."""
    return np.column_stack([np.log(points[:, 0] / 0.5) / np.log(4.0), (points[:, 1] + 1.0) / 4.0])


def test_a_latin_hypercube_has_one_point_in_every_row_and_column():
    shares = unit(points_of(**sampled("latin_hypercube", 50, seed=3)))
    for column in shares.T:
        assert sorted(np.floor(column * 50).astype(int)) == list(range(50))


def test_a_sobol_sample_fills_the_square_better_than_chance():
    shares = unit(points_of(**sampled("sobol", 64, seed=1)))
    random = np.random.default_rng(1).random((64, 2))
    assert qmc.discrepancy(shares) < 0.1 * qmc.discrepancy(random)
    # a net: one point in every one of 8 x 8 squares
    assert len({tuple(cell) for cell in np.floor(shares * 8).astype(int)}) == 64


def test_the_same_seed_gives_the_same_sample_and_another_another():
    for method in ("latin_hypercube", "sobol"):
        first, same, other = (points_of(**sampled(method, 16, seed=k)) for k in (1, 1, 2))
        np.testing.assert_array_equal(first, same)
        assert not np.array_equal(first, other)


@pytest.mark.parametrize(("method", "count", "size"), [("saltelli", 8, 32), ("morris", 5, 15)])
def test_samples_for_sensitivity(method, count, size):
    pytest.importorskip("SALib")
    points = points_of(**sampled(method, count))
    shares = unit(points)
    assert shares.shape == (size, 2)
    assert shares.min() > -1e-12 and shares.max() < 1 + 1e-12


def test_a_count_that_does_not_suit_the_method_is_refused():
    with pytest.raises(InputError, match="power of 2, such as 128"):
        points_of(**sampled("sobol", 100))


def test_limits_hold_to_the_last_bit():
    plan = plan_of(**sampled("sobol", 1024))
    points = sample_of(plan.sample, plan.vary)
    assert points[:, 0].min() >= 0.5 and points[:, 0].max() <= 2.0


def test_a_file_of_cases(tmp_path):
    path = tmp_path / "cases.csv"
    path.write_text("isolator.count, sensors.seed, isolator.law\n1.5,3,hybrid\n2,4,linear\n")
    (axis,) = axes_of(plan_of(cases={"file": str(path)}))
    assert [axis.shown(k) for k in range(2)] == [
        {"isolator.count": 1.5, "sensors.seed": 3, "isolator.law": "hybrid"},
        {"isolator.count": 2.0, "sensors.seed": 4, "isolator.law": "linear"},
    ]
    assert isinstance(axis.shown(0)["sensors.seed"], int)


@pytest.mark.parametrize(
    ("text", "said"),
    [("", "empty"), ("a,b\n", "no cases"), ("a,b\n1,2\n3\n", "row 3 has 1 entries")],
)
def test_a_file_of_cases_that_cannot_be_used(tmp_path, text, said):
    path = tmp_path / "cases.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=said) as error:
        axes_of(plan_of(cases={"file": str(path)}))
    assert str(path) in str(error.value)


def test_tables_are_shown_by_their_names():
    values = [
        {"name": "el_centro_1940_ns"},
        {"kind": "ricker_pulse", "peak_velocity_m_s": 0.1, "pulse_period_s": 1.0},
    ]
    assert points_of(vary=[{"field": "ground", "values": values}])[:, 0].tolist() == [
        "el_centro_1940_ns",
        "ricker_pulse",
    ]
    named = {"field": "ground", "label": "motion", "values": values, "names": ["a", "b"]}
    assert points_of(vary=[named])[:, 0].tolist() == ["a", "b"]


def test_files_are_shown_without_their_folder(tmp_path):
    shown = {}
    for files in (("a.AT2", "b.AT2"), ("one/a.AT2", "two/a.AT2")):
        values = [str(tmp_path / file) for file in files]
        points = points_of(vary=[{"field": "ground.file", "label": "record", "values": values}])
        shown[files] = points[:, 0].tolist() == ["a", "b"], points[:, 0].tolist() == values
    assert [*shown.values()] == [(True, False), (False, True)]


def test_a_quantity_twice_is_refused():
    entry = {"field": "isolator.count", "values": [1.0]}
    with pytest.raises(InputError, match=r"isolator\.count is varied twice"):
        axes_of(plan_of(vary=[entry, entry]))
