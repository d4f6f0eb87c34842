"""Effects by cause and form."""

from __future__ import annotations

from ..errors import unknown_name
from . import (
    ambient_temperature,
    amplitude_softening,
    coulomb_friction,
    current_lag,
    cyclic_degradation,
    end_stop,
    extra_relaxation,
    field_gap_coupling,
    field_saturation,
    force_offset,
    inertia_force,
    magnetic_remanence,
    self_heating,
    sensor_delay,
    stress_softening,
    tension_compression_asymmetry,
    weak_rate_dependence,
)
from .effect import Effect

# one line an effect: its file holds FORMS, the forms of one cause, the default one first
_FILES = (
    current_lag,
    field_saturation,
    magnetic_remanence,
    field_gap_coupling,
    stress_softening,
    amplitude_softening,
    self_heating,
    ambient_temperature,
    tension_compression_asymmetry,
    force_offset,
    coulomb_friction,
    inertia_force,
    sensor_delay,
    extra_relaxation,
    weak_rate_dependence,
    end_stop,
    cyclic_degradation,
)

EFFECTS: dict[str, tuple[Effect, ...]] = {file.FORMS[0].cause: file.FORMS for file in _FILES}
"""Forms of each cause, the default one first."""


def effect(cause: str, form: str | None = None) -> Effect:
    """Find an effect.

    Parameters
    ----------
    cause : str
        Such as "current_lag".
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
    if cause not in EFFECTS:
        raise unknown_name("effect", cause, EFFECTS)
    forms = {one.form: one for one in EFFECTS[cause]}
    if form is None:
        return EFFECTS[cause][0]
    if form not in forms:
        raise unknown_name(f"form of {cause}", form, forms)
    return forms[form]
