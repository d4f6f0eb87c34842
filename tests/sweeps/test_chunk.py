"""Rows of a sweep against single runs: to the last bit, alone or in company."""

import io
import json
from dataclasses import replace

import pandas
import pytest

from isolation_sim.api import run_scenario
from isolation_sim.io.columns import read_columns
from isolation_sim.sweeps import run
from isolation_sim.sweeps.chunk import Chunk, Finished
from isolation_sim.sweeps.run import chunk_of

from .conftest import MIXED, SHORT, design_of


def rows_of(design, places=None, **keys):
    places = range(design.n_cases) if places is None else places
    finished = replace(chunk_of(design, 0, places), **keys)()
    return pandas.DataFrame(read_columns(io.BytesIO(finished.table))), finished


@pytest.fixture(scope="module")
def mixed():
    return design_of(**MIXED)


@pytest.fixture(scope="module")
def together(mixed):
    return rows_of(mixed)[0]


def test_an_estimate_fills_the_vector_lanes(monkeypatch):
    """A batch of runs takes hardly longer than one."""
    now = [0.0]

    def fake(chunk):
        n = len(chunk.cases)
        now[0] += 0.4 + 0.002 * n
        return Finished(0, bytes(n), n, 0)

    monkeypatch.setattr(Chunk, "__call__", fake)
    monkeypatch.setattr(run.time, "perf_counter", lambda: now[0])
    vary = [{"field": "isolator.count", "low": 0.5, "high": 1.5, "count": 240}]
    assert run.estimate(design_of(vary=vary)).seconds < 2 * (240 * 0.002 + 2 * 0.4)


def test_compilation_does_not_count_in_an_estimate(monkeypatch):
    """It would make the chunks so small that vector lanes are empty."""
    now, compiled = [0.0], set()

    def fake(chunk):
        n = len(chunk.cases)
        kernel = n > 1  # in vector lanes or not
        now[0] += 0.002 * n + (0 if kernel in compiled else 20.0)
        compiled.add(kernel)
        return Finished(0, bytes(n), n, 0)

    monkeypatch.setattr(Chunk, "__call__", fake)
    monkeypatch.setattr(run.time, "perf_counter", lambda: now[0])
    vary = [{"field": "isolator.count", "low": 0.5, "high": 1.5, "count": 1000}]
    estimate = run.estimate(design_of(vary=vary))
    assert estimate.seconds == pytest.approx(1000 * 0.002)
    assert estimate.cases_per_chunk == run.MOST_CASES


def test_a_row_is_the_single_run_of_its_case(mixed, together):
    """Everything that `isolation-sim run` reports, with the same bits."""
    assert len(together) == 108 and (together["status"] == "ok").all()
    for number in (0, 17, 35):
        scenario = mixed.case(number).scenario(mixed.base)
        for record in run_scenario(scenario).to_records():
            at = (together["case"] == number) & (together["controller"] == record["controller"])
            (row,) = together[at].to_dict("records")
            names = set(record) & set(row) - {"controller"}
            # seven peaks, seven RMS values, J1 to J8 and five normalised ratios
            assert len(names) == 27
            assert {name: row[name] for name in names} == {name: record[name] for name in names}


def test_energies_of_a_row_are_those_of_the_single_run(mixed, together):
    rows, _ = rows_of(mixed, [17], energy=True)
    records = run_scenario(mixed.case(17).scenario(mixed.base)).to_records()
    for row, record in zip(rows.to_dict("records"), records, strict=True):
        assert set(record) <= set(row)
        assert {name: row[name] for name in record} == record
    # what both have is the same whether the ledger is kept or not
    alike = together[together["case"] == 17].reset_index(drop=True)
    pandas.testing.assert_frame_equal(rows[alike.columns], alike, check_exact=True)


@pytest.mark.parametrize("places", [[35], [3, 2, 1], list(range(5, 36, 7))])
def test_company_does_not_matter(mixed, together, places):
    some, _ = rows_of(mixed, places)
    expected = together.set_index("case").loc[places].reset_index()
    pandas.testing.assert_frame_equal(some, expected[some.columns], check_exact=True)


OPTIONS = {
    "scenario": {
        "controller": [{"name": "passive_on"}, {"name": "on_off"}],
        "nominal": {"force_factor": 1.1},
        "sensors": {"noise": {"velocity_m_s": 1e-3}},
    },
    "vary": [
        {"field": "sensors.delay_s", "values": [0.0, 0.01]},
        {"field": "driver.lag_s", "values": [0.0, 0.03]},
        {"field": "simulation.computation_delay_s", "values": [0.0, 0.004]},
    ],
    "seeds": {"count": 2},
}


def test_options_that_differ_from_case_to_case():
    """Drivers, delays and seeds of each case's own, which cannot share a block of lanes."""
    design = design_of(**OPTIONS)
    rows, _ = rows_of(design)
    assert (rows["status"] == "ok").all() and rows["peak_drift_m"].nunique() > 10
    for number in (0, 7, 15):
        comparison = run_scenario(design.case(number).scenario(design.base))
        result = comparison.criteria["on_off"]
        at = (rows["case"] == number) & (rows["controller"] == "on_off")
        (row,) = rows[at].to_dict("records")
        assert {name: row[name] for name in result} == result


FAILING = {
    "scenario": {"controller": [{"name": "passive_off"}, {"name": "constant", "amperes": 1.0}]},
    "vary": [
        {"field": "controller[1].amperes", "values": [1.0, 99.0]},
        {"field": "ground.scale_factor", "values": [1.0, 1e4]},
    ],
}


def test_an_error_of_a_controller_is_a_row_like_a_divergence(tmp_path):
    (tmp_path / "boom.py").write_text(
        "from controllers import Controller\n\n\nclass Boom(Controller):\n"
        "    def current(self, t, m):\n        return 1 / 0\n"
    )
    names = "passive_off", f"{tmp_path}/boom.py:Boom"
    rows, finished = rows_of(design_of(scenario={"controller": [{"name": n} for n in names]}))
    assert rows["status"].tolist() == ["ok", "diverged"] and finished.n_failed == 1
    assert rows["reason"][1] == (
        "Boom failed at t = 0 s: ZeroDivisionError: division by zero (boom.py:6)"
    )


def test_a_failing_case_is_a_row_with_its_reason_and_leaves_the_others_alone():
    rows, finished = rows_of(design_of(**FAILING))
    assert rows["status"].tolist() == [
        "ok",
        "ok",
        "diverged",
        "diverged",
        "ok",
        "refused",
        "diverged",
        "refused",
    ]
    assert (finished.n_runs, finished.n_failed) == (8, 5)
    assert "50 times further than they were tested; the ground motion peaks" in rows["reason"][2]
    assert rows["reason"][5].startswith("constant: current 99 A at t = 0 s is outside")
    failed = rows[rows["status"] != "ok"]
    assert failed.filter(regex="peak|rms").isna().all().all()
    good, _ = rows_of(design_of(**FAILING), [0])
    pandas.testing.assert_frame_equal(rows[:2], good, check_exact=True)
    assert not rows["reason"][rows["status"] == "ok"].any()


def test_what_cannot_even_start_is_a_row_too():
    """A supply that ends below the coil's least current, and settings of one controller alone."""
    keys = {
        "scenario": {"controller": [{"name": "passive_off"}, {"name": "on_off"}]},
        "vary": [
            {"field": "driver.high_A", "values": [2.0, 50.0, 3.0]},
            {"field": "controller[1].period", "values": [0.02, 0.05]},
        ],
    }
    rows, _ = rows_of(design_of(**keys))
    assert rows["status"].tolist() == ["ok"] * 4 + ["refused"] * 4 + ["ok"] * 4
    assert rows["reason"][4].startswith("coil driver: high 50.0 A is outside")
    keys["vary"][1]["values"] = [0.02, -1.0]
    rows, _ = rows_of(design_of(**keys), [0, 1])
    assert rows["status"].tolist() == ["ok", "ok", "ok", "refused"]
    assert "period" in rows["reason"][3]


def test_histories_are_those_of_the_single_run(tmp_path, mixed):
    from isolation_sim import read_run
    from isolation_sim.scenario import Scenario

    _, finished = rows_of(mixed, [4, 17], histories=frozenset([17]))
    assert sorted(finished.histories) == [
        f"case_0000017_{name}.nc" for name in ("constant", "on_off", "passive_off")
    ]
    path = tmp_path / "run.nc"
    path.write_bytes(finished.histories["case_0000017_constant.nc"])
    saved = read_run(path)
    # the scenario that is kept with it makes the same run again
    run = run_scenario(Scenario.from_toml(saved.attrs["scenario"])).runs["constant"]
    assert (saved.displacement == run.history.displacement).all()
    assert saved.attrs["criterion_peak_drift_m"] == run.criteria["peak_drift_m"]


def test_a_chunk_goes_to_another_process_as_it_is(mixed):
    import pickle

    chunk = chunk_of(mixed, 3, range(2))
    assert pickle.loads(pickle.dumps(chunk)) == chunk
    assert json.loads(json.dumps(chunk.base)) == chunk.base
    assert SHORT["stop_s"] == chunk.base["ground"][0]["stop_s"]
