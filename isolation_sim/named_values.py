"""Values by name, with errors for unknown names."""

from __future__ import annotations

from .errors import unknown_name


class Criteria(dict[str, float]):
    """Criteria by name, SI units; the error for an unknown name contains the nearest one."""

    def __missing__(self, name: str) -> float:
        raise unknown_name("criterion", str(name), self)
