"""Parts of a scenario as compiled functional mock-up units, which need no Python."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ground_motions.files import atomic_write

from ..errors import InputError
from ..version import __version__
from .controller import decision_files, prepare_decision
from .part import Part

if TYPE_CHECKING:
    from ..scenario.job import Job

FOLDER = Path(__file__).parent
UNITS = {
    "_m_s3": ("m/s3", {"m": 1, "s": -3}), "_m_s2": ("m/s2", {"m": 1, "s": -2}),
    "_m_s": ("m/s", {"m": 1, "s": -1}), "_m": ("m", {"m": 1}),
    "_J": ("J", {"kg": 1, "m": 2, "s": -2}), "_N": ("N", {"kg": 1, "m": 1, "s": -2}),
    "_A": ("A", {"A": 1}),
}  # fmt: skip
"""Unit by the end of a variable's name, and its exponents of the SI's base units."""
PLATFORMS = {
    ("Linux", "x86_64"): ("linux64", "x86_64-linux", ".so"),
    ("Linux", "aarch64"): ("aarch64-linux", "aarch64-linux", ".so"),
    ("Darwin", "x86_64"): ("darwin64", "x86_64-darwin", ".dylib"),
    ("Darwin", "arm64"): ("aarch64-darwin", "aarch64-darwin", ".dylib"),
}
"""By system and processor: folders of binaries in versions 2.0 and 3.0, suffix of a library."""


def controller_part(job: Job, label: str) -> Part:
    """A scenario's controller as a part."""
    result = prepare_decision(job, label)
    files = {k: v for k, v in decision_files(result).items() if not k.endswith("_run.c")}
    commands = tuple(f"coil{c}_command_A" for c in range(len(result.context.low)))
    context = result.context
    return Part(result.name, result.title, files, result.inputs, commands, context.period, True)


def write_fmu(part: Part, path: str | Path, version: str = "2.0") -> Path:
    """Write a part as a functional mock-up unit for co-simulation."""
    if version not in ("2.0", "3.0"):
        raise InputError("FMI version", repr(version), "2.0 or 3.0")
    here = (platform.system(), platform.machine())
    if here not in PLATFORMS:
        raise InputError(f"no FMU is built on {' '.join(here)}; expected: Linux or macOS")
    own = "fmi_controller.c" if part.sampled else "fmi_part.c"
    wrapper = "".join(
        (FOLDER / text).read_text() for text in (own, "fmi_common.c", f"fmi{version[0]}.c")
    )
    token = hashlib.sha256("".join([*part.files.values(), wrapper]).encode()).hexdigest()[:32]
    token = "-".join([token[:8], token[8:12], token[12:16], token[16:20], token[20:]])
    sources = {**part.files, "fmu.c": wrapper.replace("NAME", part.name).replace("GUID", token)}
    texts = {
        "modelDescription.xml": _described(f"fmi{version[0]}.xml.j2", part, token, sources),
        **{f"sources/{name}": text for name, text in sources.items()},
    }
    if version == "3.0":
        build = _described("fmi3_build.xml.j2", part, token, sources)
        texts["sources/buildDescription.xml"] = build
    folder_2, folder_3, ending = PLATFORMS[here]
    binary = f"binaries/{folder_2 if version == '2.0' else folder_3}/{part.name}{ending}"
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


def _described(template: str, part: Part, token: str, sources: Mapping[str, str]) -> str:
    """A description in XML by its template beside this file."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(FOLDER), autoescape=True, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True, undefined=StrictUndefined,
    )  # fmt: skip
    names = (*part.inputs, *part.outputs)
    used = dict.fromkeys(end for name in names if (end := _ending(name)))
    return environment.get_template(template).render(
        part=part, token=token, version=__version__, units=dict(UNITS[end] for end in used),
        sources=[source for source in sources if source.endswith(".c")],
        variables=[*_variables(part)], outputs=range(len(part.inputs), len(names)),
    )  # fmt: skip


def _ending(name: str) -> str | None:
    return next((end for end in UNITS if name.endswith(end)), None)


def _variables(part: Part) -> Iterator[dict[str, dict[str, Any]]]:
    """Attributes of each variable in both versions, and those of its type."""
    for k, name in enumerate((*part.inputs, *part.outputs)):
        end, is_input = _ending(name), k < len(part.inputs)
        kind = {"causality": "input", "variability": "continuous"}
        if not is_input:
            variability = "discrete" if part.sampled else "continuous"
            kind = {"causality": "output", "variability": variability, "initial": "calculated"}
        yield {
            "shared": {"name": name, "valueReference": k, **kind},
            "type": {"unit": UNITS[end][0] if end else None, "start": 0 if is_input else None},
        }
