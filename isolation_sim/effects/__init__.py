"""Effects that a law may lack. One file an effect, one line in the registry."""

from .effect import Effect, EffectParameter, Signals
from .extend import ExtendedLaw, extend, separate
from .plain import device_section
from .registry import EFFECTS, effect

__all__ = [
    "EFFECTS",
    "Effect",
    "EffectParameter",
    "ExtendedLaw",
    "Signals",
    "device_section",
    "effect",
    "extend",
    "separate",
]
