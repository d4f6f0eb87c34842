"""The papers' searches for parameters, on equal budgets behind one function.

To fit a law use its exact derivatives (`fit`). These searches serve for comparison, and for
objectives without a derivative.
"""

from .objectives import OBJECTIVES, force_objective
from .search import SearchResult, available_methods, search

__all__ = ["OBJECTIVES", "SearchResult", "available_methods", "force_objective", "search"]
