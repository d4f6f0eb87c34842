"""Sizes that the compiler must know: here those of one run at a time, of any structure.

The compiled integration of a batch, or of a structure with one element, is a copy of
``segments.py``, ``step.py`` and ``integration.py`` with other sizes (``loading.py``).
"""

from __future__ import annotations

LANES = 1
"""Runs that are integrated side by side."""
TABLE_LANES = 1
"""Lanes of the coefficients; 1 if they serve all lanes, with equal structures."""
N_ELEMENTS = 0
"""Elements, those of a device of several directions counted one by one; 0: any number."""
N_GROUND = 0
"""Directions of the ground motion; 0: any number."""
STRIDE = 256
"""Numbers of an element."""
