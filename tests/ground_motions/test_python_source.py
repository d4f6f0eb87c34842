"""Python is parsed in several threads at once."""

from __future__ import annotations

import ast
import gc
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import ground_motions
from ground_motions.python_source import parse

PACKAGES = Path(ground_motions.__file__).parents[1]


def test_threads_parse_at_once():
    text = "\n".join(f"x{k} = [a + (b * {k}) for a, b in zip(c, d) if a]" for k in range(100))
    interval, threshold = sys.getswitchinterval(), gc.get_threshold()

    def take_turns(*_):
        sum(range(20))

    # garbage is collected while a tree is made, and another thread takes its turn
    sys.setswitchinterval(1e-6)
    gc.set_threshold(50, 2, 2)
    gc.callbacks.append(take_turns)
    try:
        with ThreadPoolExecutor(4) as pool:
            trees = list(pool.map(parse, [text] * 40))
    finally:
        gc.callbacks.remove(take_turns)
        gc.set_threshold(*threshold)
        sys.setswitchinterval(interval)
    assert {ast.unparse(tree) for tree in trees} == {ast.unparse(ast.parse(text))}


def test_nothing_that_may_run_in_a_thread_parses_by_itself():
    files = [
        path for name in ("ground_motions", "isolation_sim", "controllers")
        for path in (PACKAGES / name).rglob("*.py")
    ]  # fmt: skip
    own = [path.name for path in files if "ast.parse(" in path.read_text(encoding="utf-8")]
    assert own == ["python_source.py"]
