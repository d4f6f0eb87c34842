"""The papers' searches for parameters, on equal budgets behind one function.

For fitting a law use its exact derivatives; these searches are here to compare with, and for
objectives that have no derivative.
"""

from .objectives import OBJECTIVES, force_objective
from .search import SearchResult, available_methods, search

__all__ = ["OBJECTIVES", "SearchResult", "available_methods", "force_objective", "search"]
