"""The order in which a search exchanges effects, and what it proposes beside them."""

from types import SimpleNamespace

import numpy as np
import pytest

from isolation_sim.discrepancy.device import effect_search, validated_search
from isolation_sim.discrepancy.device.carried_history import carry_history
from isolation_sim.discrepancy.device.effect_search import EffectSearch
from isolation_sim.discrepancy.device.generic_terms import (
    OUTSIDE,
    generic_terms,
    variables,
    with_each_power,
)
from isolation_sim.discrepancy.device.validated_search import ValidatedSearch
from isolation_sim.discrepancy.search import Round, SearchResult
from isolation_sim.effects import Signals, effect


def fitted(cost, *causes, n_values=3):
    """A stand-in of a fitted model, whose effects are their causes; noise has no direction."""
    residual = np.zeros(100)
    residual[len(causes)] = np.sqrt(cost)
    return SimpleNamespace(
        cost=cost, effects=causes, causes=causes, values=np.zeros(n_values),
        penalty=n_values * np.log(len(residual)), residual=residual,
    )  # fmt: skip


class Space(EffectSearch):
    """A search whose rivals are given by the effects that stay and the place."""

    def __init__(self, table=None):
        super().__init__(fitted(1e4), (), (), np.full((100, 2), 0.1), None, None)
        self.table = table or {}

    def rivals(self, model, place):
        return None, self.table.get((model.effects, place), [])

    def exchanges(self, model, place):
        return []

    def _with_own_steps(self, fitted):
        return fitted


def test_an_effect_is_exchanged_again_after_another_one_was():
    # the last effect was best beside "filter"; beside "delay" another one is
    space = Space({
        (("filter", "payne"), 0): [fitted(900, "payne", "delay")],
        (("payne", "delay"), 0): [fitted(300, "delay", "mullins")],
    })  # fmt: skip
    assert space.revise(fitted(1000, "filter", "payne")).effects == ("delay", "mullins")


def test_effects_as_good_as_others_stay():
    rival = fitted(990, "mullins", n_values=9)
    space = Space({(("payne",), 0): [rival]})
    assert space.revise(fitted(1000, "payne")).effects == ("payne",)


@pytest.mark.parametrize(
    ("cost", "series", "keeps", "exchanged"),
    [
        (1050, True, False, True),
        (1150, True, False, False),  # the amplitude leaves clearly more
        (1050, True, True, False),  # a damage that goes on needs one specimen only
        (1050, False, False, False),  # in one run both begin anew
    ],
)
def test_a_damage_that_needs_new_specimens_must_be_clearly_better(cost, series, keeps, exchanged):
    damage, softening = effect("stress_softening"), effect("amplitude_softening")
    damage = carry_history(damage) if keeps else damage
    space = Space({((damage,), 0): [fitted(cost, softening)]})
    space.effects = (softening, *[carry_history(effect("stress_softening"))] * series)
    assert space.revise(fitted(1000, damage)).effects == ((softening,) if exchanged else (damage,))


@pytest.mark.parametrize(("cost", "n_values"), [(1000, 2), (1030, 3)])
def test_a_simpler_form_that_is_as_good_replaces_one_whose_values_degenerate(cost, n_values):
    simpler = fitted(cost, "relaxation", n_values=n_values)
    space = Space({(("relaxation",), 0): [simpler]})
    result = space.revise(fitted(1000, "relaxation", n_values=3))
    assert len(result.values) == n_values and (result is simpler) is (n_values == 2)


def test_what_is_more_than_noise_is_proposed_once_a_cause_the_best_first():
    tried = [
        fitted(500, "heat", "stop"), fitted(520, "heat", "stop"), fitted(530, "heat", OUTSIDE),
        fitted(700, "heat", "lag"), fitted(990, "heat", "offset"),
    ]  # fmt: skip
    proposed = list(Space().second_best(fitted(1000, "heat"), tried))
    assert [(one.cost, one.effects[-1]) for one in proposed] == [(500, "stop"), (700, "lag")]


def test_effects_that_explain_half_as_much_are_tried_in_its_place():
    space = Space()
    tried = [fitted(100, "payne"), fitted(300, "mullins"), fitted(700, "lag")]
    space._known[()] = fitted(1000), tried
    assert space._near("payne") == {"payne", "mullins"}
    assert space._near("friction") == set()


def test_a_rival_is_listed_where_it_was_fitted_best():
    space = Space()
    space._known[("lag",)] = fitted(1000, "lag"), [fitted(100, "lag", "a"), fitted(90, "lag", "b")]
    space._keep_better([fitted(50, "lag", "a"), fitted(95, "lag", "b"), fitted(10, "lag", "c")])
    assert [(one.cost, one.effects[-1]) for one in space._known[("lag",)][1]] == [
        (50, "a"), (90, "b"),
    ]  # fmt: skip


def test_a_small_share_counts_of_a_named_effect_that_leaves_less():
    space = Space()  # the noise costs 1
    space.__dict__["least_share"] = 0.03
    models = fitted(1100, "heat"), fitted(400, "heat", "wear")
    assert space.completes(*models)
    assert not space.completes(models[0], fitted(600, "heat", "wear"))
    assert not space.completes(fitted(21, "heat"), fitted(2, "heat", "wear"))  # by chance
    costs = np.full(2, 1100.0), np.array([400.0, 600.0])
    small = np.ones(2), np.full(2, 1e5)  # sizes of the sets of runs, misfit of the law
    assert space.helps(*models, *costs, *small).tolist() == [False, False]
    assert space.helps(*models, *costs, *small, named=True).tolist() == [True, False]


@pytest.mark.parametrize(
    ("second", "cost", "held_out", "value", "noise", "follows", "least", "added"),
    [
        ("force_offset", 400, 3.0, 1.0, (), False, None, True),
        # the fitted runs do not ask for it, or the others do not
        ("force_offset", 600, 3.0, 1.0, (), False, None, False),
        ("force_offset", 400, 6.0, 1.0, (), False, None, False),
        # those that are followed cannot ask for it: then the fitted ones are to be left with noise
        ("force_offset", 400, 6.0, 1.0, ("with",), True, None, True),
        ("force_offset", 400, 6.0, 1.0, (), True, None, False),
        ("force_offset", 400, 11.0, 1.0, ("with",), True, None, False),  # they object: more is left
        # noise alone is left without it
        ("force_offset", 400, 6.0, 1.0, ("without", "with"), True, None, False),
        # the first form is not quite right
        ("force_offset", 400, 3.0, 0.0, (), False, None, False),
        # what heats and wears looks like either, unless the fitted runs are left with noise
        ("cyclic_degradation", 400, 3.0, 1.0, (), False, None, False),
        ("cyclic_degradation", 400, 3.0, 1.0, ("with",), False, None, True),
        # it would replace the first
        ("cyclic_degradation", 400, 3.0, 1.0, ("with",), False, 0, False),
    ],
)
def test_a_model_is_completed_where_held_out_runs_agree(
    second, cost, held_out, value, noise, follows, least, added
):
    """Without the cause, fitted runs leave 1100 and those held out 10; values are in 0 to 2."""
    best = fitted(1100, effect("self_heating"))
    n_values = len(best.effects[0].parameters)
    best.values = np.full(n_values, value)
    best.model = SimpleNamespace(
        slices=lambda: [slice(0, n_values)], lower=lambda _: 0.0, upper=lambda _: 2.0
    )
    more = fitted(cost, effect("self_heating"), effect(second))

    class Problem(ValidatedSearch):
        data = SimpleNamespace(fitted=np.array([True, False]))
        after = property(lambda self: self.final)
        errors = SimpleNamespace(
            validation_samples=None,
            is_noise=lambda model, chosen: (
                follows if chosen is None else ("with" if model is more else "without") in noise
            ),
            is_near_noise=lambda model, *_: "without" in noise,
            misfit=lambda model: held_out if model is more else 10.0,
            relative=lambda model: held_out if model is more else 10.0,
        )

        def __init__(self):
            self.space, self.unstable, self.final = Space(), [more.effects[1].title], best

        def _extend(self, model):
            self.final = model

        def _holds(self):
            return True

        def _superfluous(self, model):
            return least

    problem = Problem()
    result = problem._completed(best, SearchResult(fitted(1e4), more, []))
    assert result is problem.final is (more if added else best)
    assert bool(problem.unstable) is not added


@pytest.mark.parametrize(
    ("cost", "held_out", "noise", "taken"),
    [
        (1020, 3.0, False, True),
        (1040, 3.0, False, False),  # the fitted runs tell it from the one found
        (1020, 5.0, False, False),  # those held out do not ask for it
        (1020, 3.0, True, False),  # they are left with noise already
    ],
)
def test_held_out_runs_choose_among_what_fits_as_well(cost, held_out, noise, taken):
    """The first effect leaves 1000 on the fitted runs, and 10 on those held out."""
    best, other = fitted(1000, "kept"), fitted(cost, "fresh")
    problem = ValidatedSearch.__new__(ValidatedSearch)
    problem.space, problem.final = Space({(("kept",), 0): [other]}), best
    problem.data = SimpleNamespace(fitted=np.array([True, False]), bounded=lambda force: force)
    for model, left in ((best, 10.0), (other, held_out)):
        model.force = left
    problem.errors = SimpleNamespace(
        validation_samples=None, is_noise=lambda *_: noise, misfit=lambda left: left
    )
    problem._extend = lambda model: setattr(problem, "final", model)
    problem._holds = lambda: True
    assert problem._of_equals(best) is problem.final is (other if taken else best)


@pytest.mark.parametrize(
    ("costs", "held_out", "missed", "revised"),
    [
        ((600, 650), (6.0, 6.0), True, "first"),
        ((900, 950), (6.0, 6.0), True, None),
        ((600, 650), (8.0, 6.0), True, "second"),
        ((600, 650), (8.0, 8.0), True, "first"),  # revised, it may help
        ((600, 650), (8.0, 6.0), False, "first"),  # those held out cannot tell
    ],
)
def test_what_helps_held_out_runs_as_it_was_found_is_revised_first(
    costs, held_out, missed, revised
):
    """Without a further cause, fitted runs leave 1000 and those held out 10."""
    names = ("first", "second")
    best = fitted(1000, "heat")
    more = [fitted(cost, "heat", name) for cost, name in zip(costs, names, strict=True)]
    left = {"best": 10.0, **dict(zip(names, held_out, strict=True))}
    problem = ValidatedSearch.__new__(ValidatedSearch)
    problem.space = Space()
    problem.space.revise = lambda model: model
    problem.data = SimpleNamespace(bounded=lambda force: force)
    problem._misses_held_out = lambda model: missed
    problem._on_all_samples = lambda model: SimpleNamespace(force=model.effects[-1])
    problem.final = SimpleNamespace(force="best")
    problem.errors = SimpleNamespace(misfit=left.get)
    result = SearchResult(fitted(1e4), best, [Round(best, more, None)])
    found = problem._one_more(best, result)
    assert (None if found is None else found.effects[-1]) == revised


@pytest.mark.parametrize(
    ("fitted_noise", "held_out_noise", "proposed"),
    [
        (True, False, [(900, "heat"), (960, "lag"), (1000,)]),
        (True, True, [(1000,)]),  # nothing is missed
        (False, False, [(1000,)]),  # the fitted runs could have asked for a cause
    ],
)
def test_held_out_runs_choose_where_the_law_misses_them_alone(
    fitted_noise, held_out_noise, proposed
):
    law = fitted(1000)
    tried = [fitted(900, "heat"), fitted(950, OUTSIDE), fitted(960, "lag"), fitted(990, "offset")]
    problem = ValidatedSearch.__new__(ValidatedSearch)
    problem.space = Space()  # of the noise's own gain, 1, 14 times are needed
    problem.data = SimpleNamespace(fitted=True)
    problem.errors = SimpleNamespace(
        validation_samples=False,
        is_noise=lambda force, chosen: fitted_noise if chosen else held_out_noise,
    )
    problem.__dict__["before"] = None
    result = SearchResult(law, law, [Round(law, tried, None)])
    assert [(one.cost, *one.effects) for one in problem._proposals(result)] == proposed


@pytest.mark.parametrize(("cost", "searches"), [(300, 2), (900, 1)])
def test_a_search_goes_on_where_a_dropped_cause_has_led_to_a_far_better_fit(
    monkeypatch, cost, searches
):
    """Beside heat at 1000 a lag was tried, which is dropped; the law alone leaves 10000."""
    first = fitted(1000, "heat")
    begun = []

    def search(space, base):
        begun.append(base)
        if len(begun) > 1:
            return SearchResult(base, fitted(20, "heat", "wear"), [Round(base, [], None)])
        return SearchResult(
            base, fitted(cost, "heat"), [Round(base, [], first), Round(first, [], None)]
        )

    monkeypatch.setattr(validated_search, "search", search)
    space = Space()
    space.least_share = 0.03
    result = validated_search._search(space, fitted(1e4))
    assert len(begun) == searches and len(result.rounds) == 1 + searches
    assert result.base is begun[0] and result.best.cost == (20 if searches == 2 else cost)


def test_a_cause_that_chance_explains_beside_the_others_is_dropped(monkeypatch):
    costs = {("heat", "wear"): 1000, ("heat",): 1010, ("wear",): 5000}

    class Alone(Space):
        def without(self, model, place):
            rest = model.effects[:place] + model.effects[place + 1 :]
            return fitted(costs[rest], *rest)

    needed = SimpleNamespace(needed=1.0)
    monkeypatch.setattr(validated_search, "stability", lambda *_: [needed])
    problem = ValidatedSearch.__new__(ValidatedSearch)
    problem.space, problem.seed, problem.unstable = Alone(), 0, []
    costs[()] = 1e4
    assert problem._needed(fitted(1000, "heat", "wear")).effects == ("heat",)


@pytest.mark.parametrize(("cost", "taken"), [(1500, True), (2500, False)])
def test_causes_take_the_place_of_a_state_of_each_run(monkeypatch, cost, taken):
    """If they leave less than twice what it leaves, their parameters included."""
    heat = carry_history(effect("self_heating"))
    temperature, wear = effect("ambient_temperature"), carry_history(effect("cyclic_degradation"))
    one, several = fitted(1000, heat), fitted(cost, temperature, wear)
    problem = ValidatedSearch.__new__(ValidatedSearch)
    noise = np.full((100, 2), 0.1)
    problem.space = EffectSearch(fitted(1e4), [heat, temperature, wear], (), noise, None, None)

    def search(space, base):
        assert list(space.effects) == [temperature, wear] and space.most_causes == 2
        return SearchResult(base, several, [])

    monkeypatch.setattr(validated_search, "search", search)
    result = problem._without_unknown_starts(SearchResult(fitted(1e4), one, []))
    assert result.best is (several if taken else one)
    alone = SearchResult(fitted(1e4), several, [])
    assert problem._without_unknown_starts(alone) is alone


def test_no_more_effects_are_tried_where_another_law_is_far_better():
    space = Space()
    assert not space.is_explained(fitted(2000, "payne"))
    space.stops_at = lambda current: True
    assert space.is_explained(fitted(2000, "payne"))
    assert not space.is_explained(fitted(900, "offset"))  # all but a tenth is no imitation
    assert not space.is_explained(fitted(1e4))  # one effect is always tried


@pytest.mark.parametrize(
    ("before", "best", "term", "taken"),
    [
        ((), 140, 60, True),  # both are near the noise: the data prefer the term
        ((), 140, 120, False),  # by no more than chance
        ((), 2000, 800, True),
        ((), 2000, 1500, False),  # nor by half
        (("heat",), 140, 60, False),  # the first effect's form is not exact
        (("heat",), 2000, 800, True),
        ((OUTSIDE,), 2000, 100, False),  # one term is enough
    ],
)
def test_a_term_is_taken_where_it_is_clearly_better(monkeypatch, before, best, term, taken):
    space = Space()
    space.noise = np.full((100, 2), 1.0)  # noise of unit variance costs 100
    current, fits = fitted(5000, *before), [fitted(term, *before, OUTSIDE)]
    results = [SimpleNamespace(gain=5000 - term)]
    monkeypatch.setattr(effect_search, "screen", lambda *value: results)
    monkeypatch.setattr(effect_search, "fit_directions", lambda *value: fits)
    assert (space._generic_term(current, fitted(best, *before, "stop")) is fits[0]) == taken


@pytest.mark.parametrize(("term", "causes"), [(800, ("heat", OUTSIDE)), (1500, ("stop", "heat"))])
def test_a_cause_that_imitates_a_term_is_replaced(monkeypatch, term, causes):
    space = Space()
    space.noise = np.full((100, 2), 1.0)
    monkeypatch.setattr(space, "without", lambda model, place: fitted(
        3000, *(c for k, c in enumerate(model.causes) if k != place)
    ))  # fmt: skip
    monkeypatch.setattr(effect_search, "screen", lambda *value: [SimpleNamespace(gain=2000)])
    # a term beside the first cause explains no more than the second one does
    monkeypatch.setattr(
        effect_search, "fit_directions", lambda base, *_: [
            fitted(term if base.causes == ("heat",) else 1990, *base.causes, OUTSIDE)
        ],
    )  # fmt: skip
    assert space._without_imitations(fitted(2000, "stop", "heat")).causes == causes


def test_a_term_has_a_polynomial_of_the_current():
    terms = {one.form: one for one in generic_terms(0.1, True, False)}
    family, power = with_each_power(terms["x^3 I"])
    assert (family.form, power) == ("x^3 (1, I, I^2)", 1)
    assert [q.unit for q in family.parameters] == ["N/m^3", "N/m^3 A", "N/m^3 A^2"]
    signals = Signals(x=2.0, v=0.0, a=0.0, current=3.0, force=0.0, temperature=20.0)
    assert family.force(signals, (), (1.0, 10.0, 100.0)) == 8 * (1 + 30 + 900)
    # inertia is of the catalogue, and the clock has no factors
    assert with_each_power(terms["a I"]) is None and with_each_power(terms["x t"]) is None


def test_the_rate_of_the_current_is_a_term():
    terms = {one.form: one for one in generic_terms(0.1, True, False, 0.01)}
    term = terms["x dI/dt"]
    assert [q.unit for q in term.parameters] == ["N s/m A"]
    signals = Signals(x=2.0, v=0.0, a=0.0, current=3.0, force=0.0, temperature=20.0)
    assert term.start(signals, ()) == (3.0, 3.0)
    assert term.force(signals, (3.0, 3.0), (5.0,)) == 0
    # a ramp of 10 A/s, once both low-passes follow it
    assert term.rates(signals, (2.9, 2.8), ()) == pytest.approx((10, 10))
    assert term.force(signals, (2.9, 2.8), (5.0,)) == pytest.approx(100)
    # what a low-pass of 10 ms alone would make late by 10 ms
    omega, time = 2 * np.pi * 3, np.arange(0, 1, 1e-4)
    states, rate = (0.0, 0.0), []
    for current in np.sin(omega * time).tolist():
        now = signals._replace(x=1.0, current=current)
        rate.append(term.force(now, states, (1.0,)))
        states = tuple(
            s + 1e-4 * r for s, r in zip(states, term.rates(now, states, ()), strict=True)
        )
    late = np.array(rate) - omega * np.cos(omega * time)
    assert np.sqrt(np.mean(late[time > 0.3] ** 2)) < 0.05 * omega
    assert variables("x dI/dt") == ("displacement", "current")
    # of runs with a steady current there is none
    assert not any("dI/dt" in one.form for one in generic_terms(0.1, True, False))


def test_terms_that_would_leave_far_more_are_not_fitted(monkeypatch):
    space, asked = Space(), []
    likely, unlikely = SimpleNamespace(gain=8500), SimpleNamespace(gain=5000)
    monkeypatch.setattr(effect_search, "screen", lambda *value: [likely, unlikely])
    monkeypatch.setattr(
        effect_search, "fit_directions", lambda base, terms, *_: asked.extend(terms) or []
    )
    assert space._generic_term(fitted(1e4), fitted(100, "stop")) is None
    assert asked == [likely]


def test_noise_counts_once_where_effects_are_screened(monkeypatch):
    # half of the cost is removed in a direction in which noise is a thousand times as strong
    space, current = Space(), fitted(1e6)
    space.pool = SimpleNamespace(map=map)
    gains = {"sharp": (5e5, 1e3), "noise": (6e3, 1e3), "small": (600, 1.0), "clear": (900, 1.0)}
    results = [
        SimpleNamespace(effect=name, gain=gain, noise_gain=noise)
        for name, (gain, noise) in gains.items()
    ]
    monkeypatch.setattr(effect_search, "screen", lambda *value: results)
    monkeypatch.setattr(effect_search, "refine", lambda base, one, noise: one)
    monkeypatch.setattr(effect_search, "fit_directions", lambda base, chosen, *_: list(chosen))
    assert [one.effect for one in space._fit_effects(current)] == ["sharp", "clear"]
