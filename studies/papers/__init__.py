"""The four papers' numbers recomputed and their figures redrawn: ``python -m studies.papers``."""
