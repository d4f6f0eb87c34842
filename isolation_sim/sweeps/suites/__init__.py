"""Suites of records: all records with all controllers, and the statistics that codes require."""

from .result import Suite
from .run import run_suite

__all__ = ["Suite", "run_suite"]
