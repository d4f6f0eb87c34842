"""Sweeps: thousands of runs from one plan, resumable after an interruption."""

from .plan import SweepPlan
from .result import Sweep
from .run import Estimate, sweep

__all__ = ["Estimate", "Sweep", "SweepPlan", "sweep"]
