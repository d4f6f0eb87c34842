"""Compiled simulation of a device under measured motion, with derivatives."""
