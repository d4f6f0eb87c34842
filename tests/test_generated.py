"""Generated modules: their names follow all that they depend on; old ones are removed."""

from __future__ import annotations

import ast
import io
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest

import controllers.compiled
import isolation_sim
from controllers.device_model import DeviceModel
from isolation_sim.compilation import generated
from isolation_sim.discrepancy.device import effect_kernel_text
from isolation_sim.effects import effect, followers, self_heating
from isolation_sim.identification.kernel import device_kernel_text
from isolation_sim.laws import LAWS, emit, standard_solid
from isolation_sim.simulation.kernel import loading

LAW = LAWS["standard_solid"]
PACKAGE = Path(isolation_sim.__file__).parent
DAY = 86400.0

GENERATORS = {
    "kernel": lambda: loading.load_integration.__wrapped__(loading.OWN_SHAPE),
    "law": lambda: loading._load_law.__wrapped__(LAW, 1, 1, 1, 0),
    "tables": lambda: loading.load_tables.__wrapped__(1),
    "peaks": lambda: loading.load_peaks.__wrapped__(1, 1),
    "device": lambda: device_kernel_text.compiled.__wrapped__(LAW),
    "effect": lambda: effect_kernel_text.compiled.__wrapped__(effect("current_lag")),
    "devices": lambda: controllers.compiled._device_module(DeviceModel, (LAW,), "combined_force"),
}
# a writer, its call, and a file that it needs
WRITERS = {
    "kernel": (
        loading.integration_text, lambda: loading.integration_text(loading.OWN_SHAPE), "segments.py"
    ),
    "law": (loading.law_text, lambda: loading.law_text(LAW, 1, 1, 1, 0), "emit.py"),
    "device": (
        device_kernel_text._text, lambda: device_kernel_text._text(LAW, False), "device_kernel.py"
    ),
    "stiff": (
        device_kernel_text._text, lambda: device_kernel_text._text(LAW, True), "device_kernel.py"
    ),
    "effect": (
        effect_kernel_text._text, lambda: effect_kernel_text._text(effect("self_heating")),
        "effect_kernel.py",
    ),
}  # fmt: skip
ARITHMETIC = {standard_solid.__file__, self_heating.__file__, followers.__file__}
"""Files of the law and of the effect, which are in the names by their fingerprints."""


@pytest.fixture
def name(monkeypatch):
    """Name under which a generator would keep its module; nothing is written or compiled."""
    monkeypatch.setattr(generated, "_load", lambda name, write, notice="": name)

    def named(kind):
        controllers.compiled._devices.cache_clear()
        return GENERATORS[kind]()

    return named


def changed(monkeypatch, path, old, new):
    """Let the file's text, as the names see it, have another byte at one place."""
    content = generated._content

    def read(file):
        result = content(file)
        assert file != path or old in result
        return result.replace(old, new, 1) if file == path else result

    monkeypatch.setattr(generated, "_content", read)
    monkeypatch.setattr(generated, "_digest", generated._digest.__wrapped__)


@pytest.mark.parametrize("kind", GENERATORS)
def test_another_byte_of_the_emitter_gives_another_name(kind, name, monkeypatch):
    before = name(kind)
    assert before == name(kind)
    # the same arithmetic, but the text that is written differs by one byte
    monkeypatch.setitem(emit._BINARY, "OP_MUL", "(+{} * {})")
    changed(monkeypatch, Path(emit.__file__), b'"({} * {})"', b'"(+{} * {})"')
    assert name(kind) != before


@pytest.mark.parametrize("kind", ["kernel", "law", "tables", "device", "effect"])
def test_modules_loaded_without_their_text_are_named_by_every_byte_of_their_sources(
    kind, name, monkeypatch
):
    before = name(kind)
    writers = {"device": device_kernel_text._text, "effect": effect_kernel_text._text}
    writer = writers.get(kind, loading.integration_text)
    sources = generated.sources_of(writer)
    assert Path(emit.__file__) in sources
    for path in sources:
        content = generated._content(path)
        for at in (0, len(content) // 2, len(content) - 1):
            other = content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]
            with monkeypatch.context() as patch:
                changed(patch, path, content, other)
                assert name(kind) != before, (path, at)


@pytest.mark.parametrize("kind", WRITERS)
def test_every_file_that_runs_or_is_read_while_a_text_is_written_is_a_source(kind, monkeypatch):
    writer, write, source = WRITERS[kind]
    used = set()

    def read(path, *arguments, **options):
        used.add(str(path))
        return real_open(path, *arguments, **options)

    real_open = io.open
    monkeypatch.setattr(io, "open", read)
    sys.setprofile(lambda frame, event, value: used.add(frame.f_code.co_filename))
    try:
        text = write()
    finally:
        sys.setprofile(None)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom):
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            used |= {sys.modules[name].__file__ for name in names if name in sys.modules}
    files = {path for path in map(Path, used) if path.suffix == ".py"}
    own = {p for p in files if PACKAGE in p.parents and p.name != "__init__.py"}
    missing = own - set(generated.sources_of(writer)) - {*map(Path, ARITHMETIC)}
    assert not missing
    assert {path.name for path in own} >= {source, Path(writer.__code__.co_filename).name}


def test_a_text_is_named_by_the_sources_that_it_imports(monkeypatch):
    """A kernel of a law that cannot be named depends on the intrinsics that it calls."""
    text = "from isolation_sim.simulation.kernel.intrinsics import read\n"
    before = generated.name_of_text("kernel", text)
    intrinsics = PACKAGE / "simulation" / "kernel" / "intrinsics.py"
    changed(monkeypatch, intrinsics, b"load", b"lead")
    assert generated.name_of_text("kernel", text) != before


def test_imports_are_followed_in_every_form():
    path = PACKAGE / "simulation" / "somewhere.py"
    text = '''
from ..laws import emit as e, law  # both modules
from ..errors import (
    InputError,
)
TEXT = """
from isolation_sim.simulation.kernel import intrinsics
import isolation_sim.criteria
import numpy as np
"""
def f():
    from . import grid
'''
    result = generated._package_files(text, path)
    assert {str(p.relative_to(PACKAGE)) for p in result} == {
        "laws/emit.py", "laws/law.py", "errors.py", "simulation/kernel/intrinsics.py",
        "criteria.py", "simulation/grid.py",
    }  # fmt: skip


def test_of_threads_that_ask_for_the_same_new_module_one_writes_it(tmp_path, monkeypatch):
    monkeypatch.setenv("ISOLATION_SIM_CACHE", str(tmp_path))
    n, written = 8, []
    barrier = Barrier(n)

    def value(k):
        def write():
            written.append(k)
            time.sleep(0.02)  # the others go on, if they can
            return f"VALUE = {k}\n"

        barrier.wait()
        return generated.load_written("same", k, write).VALUE

    with ThreadPoolExecutor(n) as pool:
        for k in range(4):
            assert list(pool.map(value, [k] * n)) == [k] * n
    assert written == list(range(4))
    assert not list(tmp_path.rglob(".*"))


def old_module(folder, stem, days):
    """A module and its compiled code, last used that many days ago."""
    files = [folder / f"{stem}.py", folder / "__pycache__" / f"{stem}.integrate-1.py311.nbi"]
    files[1].parent.mkdir(exist_ok=True)
    for path in files:
        path.write_text("VALUE = 1\n")
        os.utime(path, (time.time() - days * DAY,) * 2)
    return files


def test_modules_unused_for_long_are_removed_when_a_new_one_is_written(tmp_path, monkeypatch):
    monkeypatch.setenv("ISOLATION_SIM_CACHE", str(tmp_path))
    digits = "0123456789abcdef0123"
    old = old_module(tmp_path, f"kernel_{digits}", 61)
    young = old_module(tmp_path, f"device_{digits}", 59)
    # a folder that the user also keeps other files in
    foreign = old_module(tmp_path, "analysis", 400) + old_module(tmp_path, "kernel_2024", 400)
    result = tmp_path / "optima" / f"{digits}.json"
    result.parent.mkdir()
    result.write_text("{}")
    os.utime(result, (0, 0))
    generated.load_text("effect", "VALUE = 2\n")
    assert not any(path.exists() for path in old)
    assert all(path.exists() for path in (*young, *foreign, result))


def test_a_module_in_use_stays_and_its_compiled_code_stays_valid(tmp_path, monkeypatch):
    monkeypatch.setenv("ISOLATION_SIM_CACHE", str(tmp_path))
    text = "VALUE = 3\n"
    name = generated.name_of_text("kernel", text)
    path, _ = old_module(tmp_path, name, 400)
    path.write_text(text)
    os.utime(path, (time.time() - 400 * DAY,) * 2)
    modified = path.stat().st_mtime_ns
    assert generated.load_text("kernel", text).VALUE == 3
    # Numba's compiled code is valid while the time of modification is the same
    assert path.stat().st_mtime_ns == modified
    generated.load_text("effect", "VALUE = 4\n")
    assert path.exists()


def test_a_module_removed_by_another_process_just_before_it_is_read_is_written_again(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("ISOLATION_SIM_CACHE", str(tmp_path))
    generated.load_text("kernel", "VALUE = 5\n")
    mark = generated._mark_used

    def then_removed(path):
        result = mark(path)
        path.unlink()
        return result

    monkeypatch.setattr(generated, "_mark_used", then_removed)
    assert generated.load_text("kernel", "VALUE = 5\n").VALUE == 5
