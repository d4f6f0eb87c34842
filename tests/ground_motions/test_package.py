import doctest
import importlib
import inspect
import pickle
import pkgutil
import subprocess
import sys

import pytest

import ground_motions
from ground_motions import InputError, exports

MODULES = [m.name for m in pkgutil.walk_packages(ground_motions.__path__, "ground_motions.")]
PUBLIC = [
    getattr(ground_motions, name)
    for name in ground_motions.__all__
    if inspect.isfunction(getattr(ground_motions, name))
]


def test_importing_loads_nothing_heavy():
    code = "import sys, ground_motions; print(sorted({'scipy', 'numba'} & set(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_nothing_of_ours_is_imported():
    code = (
        "import sys; import ground_motions; from ground_motions import oscillator\n"
        "print(sorted({'isolation_sim', 'controllers', 'studies'} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_every_public_name_exists_once():
    names = ground_motions.__all__
    assert len(set(names)) == len(names)
    assert all(hasattr(ground_motions, name) for name in names)


def test_exported_are_the_names_that_type_checkers_see():
    text = "if TYPE_CHECKING:\n    from .a import B as B\n    from c import d\n    e = d\n"
    assert exports._homes(text) == {"B": (".a", "B"), "e": ("c", "d")}


@pytest.mark.parametrize("function", PUBLIC, ids=lambda f: f.__name__)
def test_every_argument_is_documented(function):
    text = inspect.getdoc(function)
    for name in inspect.signature(function).parameters:
        assert f"{name} :" in text or f"{name}, " in text or f", {name} :" in text, name
    assert "Returns" in text


@pytest.mark.parametrize("module", MODULES)
def test_examples_run(module):
    failed, _ = doctest.testmod(importlib.import_module(module))
    assert failed == 0


def test_the_error_is_one_line_and_survives_pickling():
    error = InputError("a\nfile", "x\r\ny", "z")
    assert str(error) == "a file: given x y; expected: z"
    assert isinstance(error, ValueError)
    again = pickle.loads(pickle.dumps(error))
    assert (again.place, again.given, again.expected) == ("a file", "x y", "z")
