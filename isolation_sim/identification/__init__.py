"""Fitting a law to measured runs: campaigns, loop measures, searches."""
