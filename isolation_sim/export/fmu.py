"""A controller as a functional mock-up unit, compiled: no Python where it runs."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from ..errors import InputError
from ..io.atomic_write import atomic_write
from ..version import __version__
from .controller import controller_files, decided

if TYPE_CHECKING:
    from ..scenario.job import Job

FOLDER = Path(__file__).parent
UNITS = {
    "_m_s2": ("m/s2", {"m": 1, "s": -2}), "_m_s": ("m/s", {"m": 1, "s": -1}),
    "_m": ("m", {"m": 1}), "_N": ("N", {"kg": 1, "m": 1, "s": -2}), "_A": ("A", {"A": 1}),
}  # fmt: skip
"""Unit by the end of a variable's name, and its exponents of the SI's base units."""
PLATFORMS = {
    ("Linux", "x86_64"): ("linux64", "x86_64-linux", ".so"),
    ("Linux", "aarch64"): ("aarch64-linux", "aarch64-linux", ".so"),
    ("Darwin", "x86_64"): ("darwin64", "x86_64-darwin", ".dylib"),
    ("Darwin", "arm64"): ("aarch64-darwin", "aarch64-darwin", ".dylib"),
}
"""By system and processor: folder of binaries in version 2.0 and in 3.0, ending of a library."""


def controller_fmu(job: Job, label: str, path: str | Path, version: str = "2.0") -> Path:
    """Write a scenario's controller as a functional mock-up unit for co-simulation."""
    if version not in ("2.0", "3.0"):
        raise InputError(f"FMI version is {version!r}; expected: 2.0 or 3.0")
    here = (platform.system(), platform.machine())
    if here not in PLATFORMS:
        raise InputError(f"no FMU is built on {' '.join(here)}; expected: Linux or macOS")
    result = decided(job, label)
    sources = {k: v for k, v in controller_files(job, label).items() if not k.endswith("_run.c")}
    wrapper = "".join(
        (FOLDER / part).read_text() for part in ("fmi_common.c", f"fmi{version[0]}.c")
    )
    token = hashlib.sha256("".join([*sources.values(), wrapper]).encode()).hexdigest()[:32]
    token = "-".join([token[:8], token[8:12], token[12:16], token[16:20], token[20:]])
    sources["fmu.c"] = wrapper.replace("NAME", result.name).replace("GUID", token)
    variables = [("input", output) for output in result.context.outputs]
    variables += [("output", f"coil{c}_command_A") for c in range(len(result.context.low))]
    describe = _description_2 if version == "2.0" else _description_3
    texts = {
        "modelDescription.xml": describe(result.name, result.title, token, variables,
                                         result.context.period, sources),
        **{f"sources/{name}": text for name, text in sources.items()},
    }  # fmt: skip
    if version == "3.0":
        texts["sources/buildDescription.xml"] = _build_description(result.name, sources)
    folder_2, folder_3, ending = PLATFORMS[here]
    binary = f"binaries/{folder_2 if version == '2.0' else folder_3}/{result.name}{ending}"
    library = _library(sources)
    path = Path(path)
    with (
        atomic_write(path) as unfinished,
        zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name, text in texts.items():
            archive.writestr(name, text)
        archive.writestr(binary, library)
    return path


def _library(sources: Mapping[str, str]) -> bytes:
    """Compile C sources to a shared library."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise InputError("an FMU needs a C compiler; expected: cc or gcc on the search path")
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text)
        names = [name for name in sources if name.endswith(".c")]
        done = subprocess.run(
            [compiler, "-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden",
             "-o", "library", *names, "-lm"],
            cwd=folder, capture_output=True, text=True,
        )  # fmt: skip
        if done.returncode:
            raise InputError(f"the C compiler failed: {done.stderr.strip().splitlines()[0]}")
        return (Path(folder) / "library").read_bytes()


def _unit(name: str) -> str | None:
    return next((end for end in UNITS if name.endswith(end)), None)


def _units(variables: list[tuple[str, str]], time: bool) -> list[str]:
    used = dict.fromkeys(end for _, name in variables if (end := _unit(name)))
    lines = ["  <UnitDefinitions>"]
    for end in used:
        unit, exponents = UNITS[end]
        base = " ".join(f'{key}="{value}"' for key, value in exponents.items())
        lines.append(f'    <Unit name="{unit}"><BaseUnit {base}/></Unit>')
    if time:
        lines.append('    <Unit name="s"><BaseUnit s="1"/></Unit>')
    return [*lines, "  </UnitDefinitions>"]


def _description_2(
    name: str, title: str, token: str, variables: list[tuple[str, str]], period: float,
    sources: Mapping[str, str],
) -> str:  # fmt: skip
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{token}"'
        f' description={quoteattr(title)} generationTool="isolation-sim {__version__}"'
        ' variableNamingConvention="flat">',
        f'  <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true"'
        ' canGetAndSetFMUstate="true" canSerializeFMUstate="true">',
        "    <SourceFiles>",
        *(f'      <File name="{source}"/>' for source in sources if source.endswith(".c")),
        "    </SourceFiles>",
        "  </CoSimulation>",
        *_units(variables, time=False),
        f'  <DefaultExperiment startTime="0" stepSize="{period!r}"/>',
        "  <ModelVariables>",
    ]
    for k, (causality, variable) in enumerate(variables):
        more = (
            'variability="continuous"'
            if causality == "input"
            else ('variability="discrete" initial="exact"')
        )
        end = _unit(variable)
        unit = f' unit="{UNITS[end][0]}"' if end else ""
        lines.append(
            f'    <ScalarVariable name="{variable}" valueReference="{k}" causality="{causality}" '
            f'{more}><Real{unit} start="0"/></ScalarVariable>'
        )
    outputs = [k for k, (causality, _) in enumerate(variables) if causality == "output"]
    lines += ["  </ModelVariables>", "  <ModelStructure>", "    <Outputs>"]
    lines += [f'      <Unknown index="{k + 1}"/>' for k in outputs]
    lines += ["    </Outputs>", "  </ModelStructure>", "</fmiModelDescription>", ""]
    return "\n".join(lines)


def _description_3(
    name: str, title: str, token: str, variables: list[tuple[str, str]], period: float,
    sources: Mapping[str, str],
) -> str:  # fmt: skip
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<fmiModelDescription fmiVersion="3.0" modelName="{name}" instantiationToken="{token}"'
        f' description={quoteattr(title)} generationTool="isolation-sim {__version__}"'
        ' variableNamingConvention="flat">',
        f'  <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true"'
        ' canGetAndSetFMUState="true" canSerializeFMUState="true"/>',
        *_units(variables, time=True),
        f'  <DefaultExperiment startTime="0" stepSize="{period!r}"/>',
        "  <ModelVariables>",
        f'    <Float64 name="time" valueReference="{len(variables)}" causality="independent"'
        ' variability="continuous" unit="s"/>',
    ]
    for k, (causality, variable) in enumerate(variables):
        more = (
            'variability="continuous"'
            if causality == "input"
            else ('variability="discrete" initial="exact"')
        )
        end = _unit(variable)
        unit = f' unit="{UNITS[end][0]}"' if end else ""
        lines.append(
            f'    <Float64 name="{variable}" valueReference="{k}" causality="{causality}" '
            f'{more}{unit} start="0"/>'
        )
    outputs = [k for k, (causality, _) in enumerate(variables) if causality == "output"]
    lines += ["  </ModelVariables>", "  <ModelStructure>"]
    lines += [f'    <Output valueReference="{k}"/>' for k in outputs]
    lines += ["  </ModelStructure>", "</fmiModelDescription>", ""]
    return "\n".join(lines)


def _build_description(name: str, sources: Mapping[str, str]) -> str:
    files = [f'      <SourceFile name="{s}"/>' for s in sources if s.endswith(".c")]
    return "\n".join([
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<fmiBuildDescription fmiVersion="3.0">',
        f'  <BuildConfiguration modelIdentifier="{name}">',
        '    <SourceFileSet language="C99">',
        *files,
        "    </SourceFileSet>",
        "  </BuildConfiguration>",
        "</fmiBuildDescription>",
        "",
    ])  # fmt: skip
