"""Sizes that the compiler must know: here those of one element and one run at a time.

The compiled integration of another structure, or of a batch, is a copy of ``windows.py``,
``step.py`` and ``integration.py`` with other sizes (``loading.py``).
"""

from __future__ import annotations

LANES = 1
"""Runs that are integrated side by side."""
TABLE_LANES = 1
"""Lanes of the coefficients; 1 if they serve all lanes, with equal structures."""
N_ELEMENTS = 1
"""Elements, those of a device of several directions counted one by one."""
N_GROUND = 1
"""Directions of the ground motion."""
STRIDE = 128
"""Numbers of an element."""
