"""Values by name, with errors for unknown names."""

from __future__ import annotations

import re

from .errors import InputError, unknown_name


class Criteria(dict[str, float]):
    """Criteria by name, SI units; the error for an unknown name contains the nearest one."""

    def __missing__(self, name: str) -> float:
        if "J1" not in self and re.fullmatch(r"J[1-9]|normalised_\w+", str(name)):
            raise InputError(
                f"criterion {name!r} is a ratio to the run without current; expected: compare() "
                "with passive_off among the controllers"
            )
        raise unknown_name("criterion", str(name), self)
