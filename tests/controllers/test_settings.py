"""What settings accept."""

import inspect
from typing import ClassVar

import numpy as np
import pytest

from controllers import CONTROLLERS, Controller, Policy, setting
from controllers.settings import Integer, Number, Numbers, OneOf, Optional, SearchRange
from isolation_sim.errors import InputError


class Tuned(Controller):
    name = "tuned"
    period = 0.25
    gain: float = setting(2.0, "gain", Number(at_least=0), "A/m")


class Retuned(Tuned):
    gain = 3


def test_defaults_and_overrides():
    assert (Tuned().gain, Tuned().period, Tuned(gain=1).gain) == (2.0, 0.25, 1.0)
    assert (Retuned().gain, Retuned.name, Retuned.settings["gain"].unit) == (3.0, "Retuned", "A/m")
    assert Tuned.gain == 2.0 and Controller.period is None


class Chosen(Tuned):
    presets: ClassVar = {"published": {"gain": 7.0}, "wrong": {"gain": -1}}


def test_a_preset_is_chosen_by_name_and_completed():
    assert (Chosen().gain, Chosen(preset="published").gain) == (2.0, 7.0)
    both = Chosen(preset="published", period=0.5)
    assert (both.gain, both.period) == (7.0, 0.5) and Chosen(**both_of(both)).gain == 7.0
    assert Chosen(preset="published", gain=1).gain == 1.0
    with pytest.raises(InputError, match="unknown preset of Chosen 'publishd'; did you mean"):
        Chosen(preset="publishd")
    with pytest.raises(InputError, match="gain: given -1; expected"):
        Chosen(preset="wrong")


def both_of(one):
    """What ``to_dict`` gives, without the name."""
    return {key: value for key, value in one.to_dict().items() if key != "name"}


def test_editors_show_the_settings():
    """Names, defaults, types and units, of a class and of every class below it."""

    def shown(kind):
        return str(inspect.signature(kind)).replace("typing.", "")

    assert shown(Retuned) == (
        "(*, period: Annotated[float | None, 's'] = 0.25, gain: Annotated[float, 'A/m'] = 3.0)"
    )
    assert "preset: Optional[Literal['published', 'wrong']] = None" in shown(Chosen)

    class Worded(Controller):
        word: str = setting("a", "a word", OneOf(("a", "b")))
        count: int | None = setting(None, "a count", Optional(Integer(at_least=1)))

    assert shown(Worded).endswith("word: Literal['a', 'b'] = 'a', count: int | None = None)")

    class Own(Tuned):
        def __init__(self, plan: list, **value: float) -> None:
            super().__init__(**value)

    assert shown(Own).startswith("(plan: 'list', *, period") or shown(Own).startswith("(plan: list")
    assert "given" not in shown(Own) and "gain" in shown(Own)
    assert list(inspect.signature(Policy).parameters) == ["act", "measures", "period"]


@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_signature_of_every_controller_is_its_settings(name):
    kind = CONTROLLERS[name]
    parameters = dict(inspect.signature(kind).parameters)
    assert parameters.pop("preset", None) is not None or not kind.presets
    assert {key: each.default for key, each in parameters.items()} == {
        key: each.default for key, each in kind.settings.items()
    }
    for key, each in parameters.items():
        unit = kind.settings[key].unit
        assert getattr(each.annotation, "__metadata__", ("",)) == (unit,)


def test_a_search_range_stays_with_a_new_default():
    class Wide(Controller):
        gain: float = setting(2.0, "gain", Number(), "A/m", SearchRange(1.0, 4.0))

    class Narrow(Wide):
        gain = 3.0

    assert Narrow.settings["gain"].search == SearchRange(1.0, 4.0) == Wide.settings["gain"].search
    assert Narrow.settings["gain"].default == 3.0


def test_a_bad_default_is_refused_where_the_class_is_written():
    with pytest.raises(
        InputError, match="Bad: gain: given -1; expected: a number, 0 or more, in A/m"
    ):
        type("Bad", (Tuned,), {"gain": -1})


@pytest.mark.parametrize(
    ("accepts", "good", "bad"),
    [
        (Number(), 1, ["1", True, np.nan, np.inf, None, [1, 2]]),
        (Number(above=0, infinite=True), np.inf, [0, -1, -np.inf]),
        (Integer(at_least=3), 3, [2, 3.5, "3", True, None]),
        (OneOf(("a", "b")), "a", ["c", 1, None]),
        (Optional(Number()), None, ["x"]),
        (Numbers(), [1, 2], [[], 1.0, "ab", [np.nan], [[1.0]]]),
        (Numbers((1, 2)), [[1, 2]], [[[[1.0]]], [[1], [1, 2]]]),
    ],
)
def test_accepted_and_refused(accepts, good, bad):
    accepts(good)
    for value in bad:
        with pytest.raises((TypeError, ValueError)):
            accepts(value)


def test_a_setting_accepts_numbers_by_default():
    class Plain(Controller):
        name = "plain"
        gain: float = setting(2.0, "gain")

    assert Plain(gain=3).gain == 3.0
    with pytest.raises(InputError, match=r"plain: gain: given 'large'; expected: a number$"):
        Plain(gain="large")
