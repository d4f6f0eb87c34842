"""Sweeps: thousands of runs from one plan, that survive anything."""

from .plan import SweepPlan
from .result import Sweep
from .run import Estimate, sweep

__all__ = ["Estimate", "Sweep", "SweepPlan", "sweep"]
