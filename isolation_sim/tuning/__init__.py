"""Tuning: the settings of a controller that do best on some motions, judged on others."""

from __future__ import annotations
