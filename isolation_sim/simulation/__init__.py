"""Compiled time integration: one run, many runs, the energy ledger."""
