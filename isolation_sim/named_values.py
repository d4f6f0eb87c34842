"""Values by name, whose unknown names are answered."""

from __future__ import annotations

from .errors import unknown_name


class Criteria(dict[str, float]):
    """Criteria by name, SI units; an unknown name is answered with the nearest."""

    def __missing__(self, name: str) -> float:
        raise unknown_name("criterion", str(name), self)
