"""Tuning: find the best settings of a controller on some motions, and evaluate them on others."""

from __future__ import annotations
