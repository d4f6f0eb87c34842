"""Scenarios: one validated description of a run, one file per section, to and from TOML."""

from .job import Job
from .scenario import Scenario, main_job

__all__ = ["Job", "Scenario", "main_job"]
