"""The blind generator shares no code with what it tests, and no study needs the tests."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import studies
from studies import blind
from studies.blind.study import share_from

ROOT = Path(__file__).resolve().parents[2]
TESTED = {"isolation_sim", "controllers", "ground_motions"}
# the runner gives the generator's data to the diagnosis
GENERATOR = sorted(
    p.stem for p in Path(blind.__path__[0]).glob("*.py") if p.stem not in ("study", "__main__")
)


def imported(path: Path) -> set[str]:
    """Names of all that a file imports, wherever in it; relative names with their dots."""
    results = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            results |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            origin = "." * node.level + (node.module or "")
            joint = "" if node.module is None else "."
            results |= {origin, *(f"{origin}{joint}{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name | ast.Attribute):
            called = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            if called in ("import_module", "__import__"):
                results |= {a.value for a in node.args if isinstance(a, ast.Constant)}
    return results


@pytest.mark.parametrize("name", GENERATOR)
def test_the_generator_imports_nothing_of_what_it_tests(name):
    used = imported(Path(blind.__path__[0]) / f"{name}.py")
    outside = {module.split(".")[0] for module in used if not module.startswith(".")}
    assert not outside & {*TESTED, "studies", "tests"}
    assert not any(module.startswith("..") or module.startswith(".study") for module in used)


def test_the_generator_loads_nothing_of_what_it_tests():
    modules = ", ".join(f"studies.blind.{name}" for name in GENERATOR if name != "__init__")
    done = subprocess.run(
        [sys.executable, "-c", f"import sys, {modules}; print(*sys.modules)"],
        capture_output=True, text=True, check=True, cwd=ROOT,
    )  # fmt: skip
    assert not {name.split(".")[0] for name in done.stdout.split()} & TESTED


def test_no_study_imports_the_tests():
    files = list(Path(studies.__path__[0]).rglob("*.py"))
    assert len(files) > 40
    assert not [p for p in files if any(m.split(".")[0] == "tests" for m in imported(p))]


HELP = """
import runpy, sys
modules = sys.argv[1:]
for module in modules:
    sys.argv = [module, "--help"]
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        assert not ended.code
"""


def test_the_blind_studies_start_from_an_installation(tmp_path):
    """The packages of the wheel alone, away from the repository."""
    project, site = tomllib.loads((ROOT / "pyproject.toml").read_text()), tmp_path / "site"
    for package in project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]:
        shutil.copytree(ROOT / package, site / package)
    environment = {**os.environ, "PYTHONPATH": str(site)}
    modules = ("studies.blind", "studies.blind_buildings", "studies.blind_plan_buildings")
    done = subprocess.run(
        [sys.executable, "-c", HELP, *modules], capture_output=True, text=True,
        cwd=tmp_path, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    for module in modules:
        assert f"python -m {module} [-h] [SHARE]" in done.stdout


@pytest.mark.parametrize("share", ["0", "2", "half"])
def test_a_share_that_cannot_be_taken_is_refused(share, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["blind", share])
    with pytest.raises(SystemExit, match="2"):
        share_from("studies.blind", "Diagnose.")
    assert share in capsys.readouterr().err.splitlines()[-1]


def test_a_share_is_read_and_is_1_by_default(monkeypatch):
    for inputs, expected in (([], 1.0), (["0.25"], 0.25)):
        monkeypatch.setattr(sys, "argv", ["blind", *inputs])
        assert share_from("studies.blind", "Diagnose.") == expected
