"""Benchmarks: speed at matched accuracy, as ratios within one process."""
