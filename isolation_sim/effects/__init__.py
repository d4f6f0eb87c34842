"""Effects that a law may lack: one file per effect, one line in the registry."""

from .effect import Effect, EffectInPlan, EffectParameter, Past, Signals
from .extend import ExtendedLaw, extend, separate
from .registry import EFFECTS, effect
from .serialisation import device_section

__all__ = [
    "EFFECTS",
    "Effect",
    "EffectInPlan",
    "EffectParameter",
    "ExtendedLaw",
    "Past",
    "Signals",
    "device_section",
    "effect",
    "extend",
    "separate",
]
