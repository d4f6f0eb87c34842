"""Tiers beyond named causes: an equation, and a learned term; see ``ladder.py``."""
