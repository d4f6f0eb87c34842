"""Studies that can be run: sweeps and scenarios, papers reproduced, benchmarks.

One module a study and one entry point a name; see ``studies.study`` for what such a module holds.
"""
