"""Blind tests: an independent generator hides effects in data, and scores what a diagnosis finds.

``study`` alone knows the package that is tested; all other modules share no code with it.
"""
