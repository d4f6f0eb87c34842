"""Scenarios: one validated description of a run, a section a file, to and from TOML."""

from .job import Job
from .scenario import Scenario, main_job

__all__ = ["Job", "Scenario", "main_job"]
