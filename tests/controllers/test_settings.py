"""What settings accept."""

import numpy as np
import pytest

from controllers import Controller, setting
from controllers.settings import Integer, Number, Numbers, OneOf, Optional
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


def test_a_bad_default_is_refused_where_the_class_is_written():
    with pytest.raises(InputError, match="Bad: gain is -1; accepted: a number, 0 or more, in A/m"):
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
