"""The kernel's operations: LLVM instructions, or Python where nothing is compiled."""

from __future__ import annotations

from typing import Any

from ...compilation.generated import COMPILED
from . import intrinsics, plain

_used: Any = intrinsics if COMPILED else plain
read, write, fused = _used.read, _used.write, _used.fused
make_respond_to_others, make_free_rows = _used.make_respond_to_others, _used.make_free_rows
make_move_modes, make_rows_at = _used.make_move_modes, _used.make_rows_at
make_element, address_of_element = _used.make_element, _used.address_of_element
# no controller is compiled where nothing is
call: Any = intrinsics.call
points_at_once = intrinsics.points_at_once
