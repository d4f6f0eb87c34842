"""All laws compared on short data: the right one is found, and those that fit as well are named."""

from functools import partial

import numpy as np
import pytest

from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.errors import InputError
from isolation_sim.identification import fit as fit_module
from isolation_sim.identification.fit import fit
from isolation_sim.identification.law_choice import LawChoice, LawRank, choose_law
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.workers import workers

COMPARED = ("kelvin_voigt", "maxwell", "dahl")


@pytest.fixture(params=COMPARED)
def choice(request, campaign_of):
    with workers(1) as pool:
        return request.param, choose_law(campaign_of(request.param, 0), 1, pool, laws=COMPARED)


def test_the_law_that_made_the_data_is_chosen(choice):
    name, found = choice
    assert found.best.law == name
    assert found.best.error == pytest.approx(0.01, rel=0.2)  # the noise
    # Dahl's law holds a spring and a dashpot, and has more numbers
    near = [name, "dahl"] if name == "kelvin_voigt" else [name]
    assert [one.law for one in found.near] == near
    assert {one.law for one in found.ranks} == set(COMPARED)
    assert f"Of 3 laws {name} fits best" in found.text and "another family" in found.text


def test_near_laws_are_told():
    def rank(law, held_out):
        return LawRank(law, law, 2, held_out, held_out)

    found = LawChoice((rank("a", 0.1), rank("b", 0.19), rank("c", 0.21)))
    assert [one.law for one in found.near] == ["a", "b"]
    assert "Within twice that error: b." in found.text


def test_fit_takes_the_law_that_fits_best(campaign_of, monkeypatch):
    monkeypatch.setattr(fit_module, "choose_law", partial(choose_law, laws=COMPARED))
    result = fit(campaign_of("maxwell", 0), "auto", current_degree=1, starts=4, threads=1)
    assert result.device.law.name == "maxwell"
    assert result.notes[0].startswith("Of 3 laws maxwell fits best")


def test_given_numbers_belong_to_a_law(campaign_of):
    with pytest.raises(InputError, match=r'law is "auto"; expected: .*the name of a law'):
        diagnose(campaign_of("maxwell", 0), "auto", "published")


def test_the_first_cycles_of_each_run_are_kept(campaign_of):
    data = measured_runs(campaign_of("maxwell", 0).runs)
    short = data.cycles(2, 10)
    for long, kept, dt in zip(data.runs, short.runs, short.dt, strict=True):
        every = round(dt / data.dt[0])
        assert every > 1
        n = kept.stop - kept.start
        np.testing.assert_array_equal(short.force[kept], data.force[long][: n * every : every])
        # about two cycles, of about ten samples each
        assert 18 <= n <= 30
