"""Controllers, studies and commands of other packages by name, and ``register``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from ground_motions.argument_types import checked
from ground_motions.registry import Registry

from .criterion import CRITERIA
from .errors import InputError, check_name, line_within

if TYPE_CHECKING:
    from .simulation.control import Control

_METHODS = ("prepare", "measures", "schedule", "compiled", "reset", "current")


def _controller_class(result: Any) -> type[Control] | None:
    whole = isinstance(result, type) and all(callable(getattr(result, m, None)) for m in _METHODS)
    return result if whole and isinstance(getattr(result, "name", None), str) else None


CONTROLLERS: Registry[type[Control]] = Registry(
    "isolation_sim.controllers",
    "controller",
    f"a class with name and the methods {', '.join(_METHODS)}, as a subclass of "
    "controllers.Controller has them",
    _controller_class,
    lambda kind: kind.name,  # type: ignore[arg-type, return-value]
    unit="controllers.fmu:of_file",
)
"""Every controller's class by name, or by a place such as ``"my_package.control:Outwards"``."""


def _study(result: Any) -> Any:
    return (
        result if hasattr(result, "TITLE") and callable(getattr(result, "outcome", None)) else None
    )


STUDIES: Registry[Any] = Registry(
    "isolation_sim.studies", "study", "a module with TITLE and outcome(folder, short, step)", _study
)
"""Every study by name, a module with ``TITLE`` and ``outcome``, or by its file."""

COMMANDS: Registry[Any] = Registry(
    "isolation_sim.commands",
    "command",
    "a typer.Typer",
    lambda module: module if hasattr(module, "registered_commands") else None,
)
"""Commands of ``isolation-sim`` that other packages add, each a ``typer.Typer``."""

Kind = Literal["law", "effect", "controller", "criterion", "study", "reader", "test reader"]


def available_controllers() -> tuple[str, ...]:
    """Names of the controllers.

    Returns
    -------
    tuple of str
    """
    return tuple(CONTROLLERS)


@checked
def controller(name: str, **settings: Any) -> Control:
    """Build a controller from its name.

    Parameters
    ----------
    name : str
        Name of the controller, a place such as ``"my_controllers.py:Outwards"``, or a functional
        mock-up unit, ``"my.fmu"``.
    **settings : object
        Its settings, listed in the signature of its class and by ``isolation-sim list
        controllers``.

    Returns
    -------
    Control

    Raises
    ------
    InputError
        If there is no such controller or setting, or a setting does not accept its value.
    """
    kind = CONTROLLERS[name]
    try:
        return kind(**settings)
    except InputError:
        raise
    except Exception as error:
        line = line_within(kind.__module__, error)
        text = f"{type(error).__name__}: {error}{line}"
        raise InputError(f"controller {name}", text, "a class that its settings build") from error


def named_controllers(
    controllers: Sequence[str | Control] | Mapping[str, str | Control],
) -> dict[str, Control]:
    """Controllers by the names to print; a sequence has their own names."""

    def built(one: str | Control) -> Control:
        return controller(one) if isinstance(one, str) else one

    if isinstance(controllers, Mapping):
        return {name: built(each) for name, each in controllers.items()}
    every = [built(each) for each in controllers]
    named = {each.name: each for each in every}
    if len(named) < len(every):
        names = ", ".join(each.name for each in every)
        expected = "different names, or a mapping of names to controllers"
        raise InputError("controllers", names, expected)
    return named


@checked
def register(kind: Kind, thing: Any, name: str | None = None, *, replace: bool = False) -> None:
    """Register a law, an effect, a controller, a criterion, a study or a reader of files.

    The name is valid in this process. The worker processes of a sweep do not know it; for them use
    a place, ``"my_laws.py:CUBIC"``, or install a package with an entry point.

    Parameters
    ----------
    kind : {"law", "effect", "controller", "criterion", "study", "reader", "test reader"}
        Kind of object.
    thing : object
        A ``Law``; the forms of an ``Effect``; a controller's class; a `Criterion`; a study's
        module; a function that reads a file of ground motion, or one of device tests.
    name : str, optional
        Its own name by default; required for a study or a reader.
    replace : bool, default False
        Whether to replace an earlier registration of this name in this process.

    Raises
    ------
    InputError
        If the object cannot be used, has no name, or the name is in use.
    """
    registry(kind).register(thing, name, replace=replace)


def registry(kind: str) -> Registry[Any]:
    """Return the registry of a kind, such as "law"."""
    from ground_motions.readers import READERS

    from .effects import EFFECTS
    from .identification.raw_tests.files import TEST_READERS
    from .laws import LAWS

    registries = LAWS, EFFECTS, CONTROLLERS, CRITERIA, STUDIES, READERS, TEST_READERS
    kinds = {each.kind: each for each in registries}
    check_name("kind", kind, kinds)
    return kinds[kind]
