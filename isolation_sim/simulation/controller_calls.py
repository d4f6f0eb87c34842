"""Calls of a user's controller: an error names the controller, the time and the line of code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from traceback import walk_tb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ControllerError, Diverged, InputError
from .control import Control


def current_of(controller: Control, t: float, measurement: Any) -> NDArray:
    """Ask for a decision; (n_channels,) or (1,), A."""
    try:
        chosen = controller.current(t, measurement)
        currents = np.atleast_1d(np.asarray(chosen, float))
    except (InputError, Diverged):
        raise
    except Exception as error:
        cause = _missing(error, measurement) or _cause(error)
        raise _failed(controller, f"at t = {t:.4g} s", cause, error) from error
    if chosen is None:
        raise InputError(
            f"{controller.name}: current() gave None at t = {t:.4g} s; expected: a current, A, "
            "after return"
        )
    return currents


@contextmanager
def calling(controller: Control, method: str) -> Iterator[None]:
    """Name the controller and its method in an error before the run."""
    try:
        yield
    except (InputError, Diverged):
        raise
    except Exception as error:
        raise _failed(controller, f"in {method}()", _cause(error), error) from error


def _failed(controller: Control, when: str, cause: str, error: Exception) -> ControllerError:
    # the last line of the controller's own module; what it calls may be anywhere
    own = type(controller).__module__
    lines = [
        f" ({Path(frame.f_code.co_filename).name}:{line})"
        for frame, line in walk_tb(error.__traceback__)
        if frame.f_globals.get("__name__") == own
    ]
    return ControllerError(f"{controller.name} failed {when}: {cause}{(lines or [''])[-1]}")


def _cause(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split()).removesuffix(":")


def _missing(error: Exception, measurement: Any) -> str:
    """Cause where a controller reads a field that it does not measure; empty otherwise."""
    if not isinstance(error, AttributeError) or error.obj is not measurement:
        return ""
    fields: tuple[str, ...] = getattr(measurement, "_fields", ())
    return (
        f"the measurement has no {error.name}; expected: {', '.join(fields)}, or "
        f"{error.name} among the names of measures()"
    )
