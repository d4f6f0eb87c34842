"""Searches for causes of a building's records: where they begin, and with how much data fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ...decisions import (
    INSTEAD,
    MISFIT_LEVEL,
    MOST_BESIDE_FORCE,
    MOST_BUILDING_CAUSES,
    NEARLY_RIGHT,
    REMAINS,
)
from ...search import Round, SearchResult, search
from ..comparison import BuildingComparison, CauseValues, FittedBuilding, with_causes
from ..errors import excess_error, largest_excess, least_noise
from ..goodness_of_fit import adequacy, noise_chance
from ..localisation import unknown_force
from .cause_search import CauseSearch

Searched = tuple[CauseSearch, SearchResult[FittedBuilding]]


def search_causes(
    comparison: BuildingComparison,
    most_causes: int = MOST_BUILDING_CAUSES,
    progress: Callable[[str], None] = lambda text: None,
) -> Searched:
    """Search for causes: those seen whatever the isolators' force first, and all of them."""
    start = CauseSearch(comparison, most_causes, progress)
    return _search(start, _search_by_structure(start))


def _search(start: CauseSearch, found: Searched | None = None) -> Searched:
    """Search for causes, again with more of the last record fitted where only that shows them.

    What was found goes before a search from the beginning.
    """
    comparison, before, late = start.comparison, start.before, None
    missed, missed_fitted = (excess_error(comparison, before, part) for part in (True, False))
    if found is None and missed_fitted < NEARLY_RIGHT * missed:
        # what grows or comes late is seen in the held-out data alone
        late = _reopened(comparison, before)
        if late is not None:
            again = _search_as_expected(start.over(late))
            if again[1].best.cause_values:
                return again
    space, result = found or _search_as_expected(start)
    best, comes_late = result.best, False
    if not _explain(space, result):
        # a cause that imitates two others, taken first, may keep both out
        least = INSTEAD * largest_excess(space.comparison, best)
        of_pair = _search_from_pair(start, least)
        if of_pair is not None:
            return of_pair
        unknown = unknown_force(space.comparison, space.before, best.cause_values)
        if unknown is not None and unknown.is_in_structure:
            return space, result  # other causes only imitate it, too
        left, left_fitted = (excess_error(space.comparison, best, part) for part in (True, False))
        comes_late = left_fitted < INSTEAD * left
    if late is not None or (best.cause_values and not comes_late):
        return space, result
    reopened = _reopened(space.comparison, best)
    if reopened is None:
        return space, result
    again = _search_as_expected(start.over(reopened), best.cause_values)
    if best.cause_values:
        remains = largest_excess(again[0].comparison, again[1].best)
        nearer = remains < INSTEAD * largest_excess(space.comparison, best)
        return again if nearer else (space, result)
    last = again if again[1].best.cause_values else (space, result)
    remains = largest_excess(last[0].comparison, last[1].best)
    if remains > REMAINS:
        beside = _search_beside(space, result, start.over(reopened), INSTEAD * remains)
        return last if beside is None else beside
    return last


def _search_by_structure(start: CauseSearch) -> Searched | None:
    """Search for what is seen whatever the isolators' force first, then beside it; None without.

    Their effects, and what is wrong in the structure or with sensors, may imitate each other.
    """
    expected = NEARLY_RIGHT * largest_excess(start.comparison, start.before)
    seen, main = start.over(start.comparison.expecting(expected)).beside_any_force()
    if not seen or len(main) > MOST_BESIDE_FORCE:
        return None
    corrected = replace(
        start.comparison, model=with_causes(start.comparison.model, seen), _cache={}
    )
    others = [cause for cause in start.choices if cause not in start.not_of_layer]
    layer = start.over(corrected, others)
    layer.most_causes = MOST_BESIDE_FORCE  # more of them only mend the form of another
    space, of_layer = _search(layer)
    more = start.comparison.fitting_more() if space.comparison.middle != corrected.middle else None
    begin = start if more is None else start.over(more)
    both = _search_as_expected(begin, (*main, *of_layer.best.cause_values))
    return both if both[1].best.cause_values else None


def _explain(space: CauseSearch, result: SearchResult[FittedBuilding]) -> bool:
    """Whether the causes of a search explain the records."""
    return space.explains(result.best, noise_chance(space.comparison, result.best))


def _search_beside(
    space: CauseSearch, result: SearchResult[FittedBuilding], more: CauseSearch, least: float
) -> Searched | None:
    """Search with more data fitted, from the cause that less of them showed; None without one.

    Beside another that acts in strong motion alone, it may help nothing where that is held out.
    All of them must leave less than an error.
    """
    tried = result.rounds[-1].tried if result.rounds else []
    if not tried or not space.shows_where_fitted(tried[0]):
        return None
    again = _search_as_expected(more, tried[0].cause_values)
    best = again[1].best
    found = len(best.cause_values) > 1 and largest_excess(again[0].comparison, best) < least
    return again if found else None


def _search_from_pair(start: CauseSearch, least: float) -> Searched | None:
    """Search from the best pair; None unless it leaves less."""
    expected = NEARLY_RIGHT * largest_excess(start.comparison, start.before)
    begun = start.over(start.comparison.expecting(expected))
    pairs = begun.pairs()
    if not pairs or not largest_excess(begun.comparison, pairs[0]) < least:
        return None
    space, result = _search_as_expected(start, pairs[0].cause_values)
    if not largest_excess(space.comparison, result.best) < least:
        return None
    space.chances.update(begun.chances)
    taken = Round(begun.before, pairs, pairs[0])
    return space, replace(result, rounds=[taken, *result.rounds])


def _reopened(comparison: BuildingComparison, best: FittedBuilding) -> BuildingComparison | None:
    """More of the last record fitted where a model misses its held-out part; None where not."""
    missed = adequacy(comparison.held_out, best.held_out) < MISFIT_LEVEL
    return comparison.fitting_more() if missed else None


def _search_as_expected(start: CauseSearch, begin: CauseValues = ()) -> Searched:
    """Repeat the search until the best model leaves no more than the expected model error.

    It begins with some causes in the model.
    """
    expected, rounds = NEARLY_RIGHT * largest_excess(start.comparison, start.before), []
    space = start.over(start.comparison.expecting(expected))
    while True:
        result = search(space, space.beginning_with(begin) if begin else space.before)
        rounds += result.rounds
        begin = result.best.cause_values
        left = largest_excess(space.comparison, result.best)
        enough = max(2 * expected, least_noise(space.comparison))
        if left < enough:
            return space, replace(result, rounds=rounds)
        expected = left
        space = space.going_on(start.comparison.expecting(expected))
        if not begin:  # a larger error would hide all the more
            return space, SearchResult(space.before, space.before, rounds)
