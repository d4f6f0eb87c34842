"""Measured runs as they are: channels, cycles, rests, noise, and checks of the data."""
