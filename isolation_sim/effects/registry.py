"""Effects by cause and form."""

from __future__ import annotations

from typing import Any

from ground_motions.argument_types import checked
from ground_motions.old_names import renamed_value
from ground_motions.registry import Registry

from ..errors import check_name
from .effect import Effect


def _forms(result: Any) -> tuple[Effect, ...] | None:
    """The forms of one cause; an effect alone is its only form."""
    forms = (result,) if isinstance(result, Effect) else result
    if not (isinstance(forms, tuple) and forms and all(isinstance(one, Effect) for one in forms)):
        return None
    return forms if len({one.cause for one in forms}) == 1 else None


EFFECTS: Registry[tuple[Effect, ...]] = Registry(
    "isolation_sim.effects",
    "effect",
    "an isolation_sim.effects.Effect, or a tuple of them with one cause",
    _forms,
    lambda forms: forms[0].cause,
)
"""Forms of each cause, the default one first."""


@checked
def effect(cause: str, form: str | None = None) -> Effect:
    """Find an effect.

    Parameters
    ----------
    cause : str
        Such as "current_lag", or a place such as ``"my_effects.py:FORMS"``.
    form : str, optional
        The default form if not given.

    Returns
    -------
    Effect

    Raises
    ------
    InputError
        If there is no such cause or form.
    """
    forms = {one.form: one for one in EFFECTS[cause]}
    if form is None:
        return next(iter(forms.values()))
    if cause == "sensor_delay":
        form = renamed_value("form of sensor_delay", form, second_order="shift")
    check_name(f"form of {cause}", form, forms)
    return forms[form]
