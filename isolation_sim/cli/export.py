"""The command ``isolation-sim export``: one subcommand per format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, cast

import typer

from ..io.files import check_new_files, write_text
from .common_options import Force, ScenarioFile, examples, read_scenario, write_new_file

app = typer.Typer(
    help="Write parts of a scenario for other programs.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=examples(
        "isolation-sim export c --controller clipped_lqr --out laboratory",
        "isolation-sim export fmu --controller clipped_lqg --out clipped_lqg.fmu",
        "isolation-sim export opensees fitted.toml --current 1",
        "isolation-sim export mat results/main_job",
    ),
)

Controller = Annotated[
    str, typer.Option(help="Label of a controller of the scenario, as in its tables.")
]


@app.command(
    "c",
    epilog=examples(
        "isolation-sim export c --controller clipped_lqr --out laboratory",
        "isolation-sim export c my_scenario.toml --controller on_off --out laboratory",
    ),
)
def export_c(
    controller: Controller,
    scenario: ScenarioFile = None,
    out: Annotated[Path, typer.Option(help="Folder for the files.")] = Path("."),
    force: Force = False,
) -> None:
    """Write a controller as C99 code without memory allocation or dependencies."""
    from ..export.controller import controller_files

    files = controller_files(read_scenario(scenario).build(), controller)
    check_new_files(force, *(out / name for name in files))
    out.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        print(write_text(text, out / name))


@app.command(
    "fmu",
    epilog=examples(
        "isolation-sim export fmu --controller clipped_lqg --out clipped_lqg.fmu",
        "isolation-sim export fmu --plant --out building.fmu",
        "isolation-sim export fmu my_scenario.toml --device --out isolators.fmu --fmi 3.0",
    ),
)
def export_fmu(
    out: Annotated[Path, typer.Option(help="File to write, *.fmu.")],
    scenario: ScenarioFile = None,
    controller: Annotated[
        str | None,
        typer.Option(help="Label of a controller of the scenario, as in its tables."),
    ] = None,
    plant: Annotated[
        bool, typer.Option("--plant", help="Building, isolators and coil drivers.")
    ] = False,
    device: Annotated[bool, typer.Option("--device", help="The isolators alone.")] = False,
    fmi: Annotated[str, typer.Option(help="FMI version: 2.0 or 3.0.")] = "2.0",
    force: Force = False,
) -> None:
    """Write a part of a scenario as a compiled FMU (functional mock-up unit) for co-simulation."""
    from ..errors import InputError
    from ..export.device import device_part
    from ..export.fmu import controller_part, write_fmu
    from ..export.plant import plant_part

    if (controller is not None) + plant + device != 1:
        raise InputError("a unit holds one part; expected: --controller NAME, --plant or --device")
    if out.suffix.lower() != ".fmu":  # other tools take no other
        raise InputError(f"--out {out}: expected: a file name ending in .fmu")
    check_new_files(force, out)
    job = read_scenario(scenario).build()
    if controller is not None:
        part = controller_part(job, controller)
    else:
        part = plant_part(job) if plant else device_part(job)
    print(write_fmu(part, out, fmi))


Folder = Annotated[Path, typer.Argument(help="Results folder.")]
OutFile = Annotated[
    Path | None, typer.Option(help="File to write; results.mat or .xlsx in the folder by default.")
]


Units = Annotated[
    str, typer.Option(help="si, or engineering: mm, kN, kJ and % of drift, as in printed tables.")
]


@app.command("mat", epilog=examples("isolation-sim export mat results/main_job"))
def export_mat(
    results: Folder, out: OutFile = None, units: Units = "si", force: Force = False
) -> None:
    """Write all tables and histories of a results folder to one MATLAB file."""
    _export(results, "mat", out, units, force)


@app.command(
    "xlsx",
    epilog=examples(
        "isolation-sim export xlsx results/main_job",
        "isolation-sim export xlsx results/main_job --units engineering --out tables.xlsx",
    ),
)
def export_xlsx(
    results: Folder, out: OutFile = None, units: Units = "si", force: Force = False
) -> None:
    """Write all tables and histories of a results folder to one Excel workbook."""
    _export(results, "xlsx", out, units, force)


@app.command(
    "csv",
    epilog=examples(
        "isolation-sim export csv results/main_job",
        "isolation-sim export csv results/main_job --units engineering --out tables",
    ),
)
def export_csv(
    results: Folder,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the files; results_csv in the folder by default."),
    ] = None,
    units: Units = "si",
    force: Force = False,
) -> None:
    """Write the histories of a results folder, and a sweep's table, to CSV files."""
    from ..io.interchange import CSV, export_place, export_results
    from ..io.results_folder import check_free, update_contents

    if not force:
        check_free(out or export_place(results, CSV), instead="--force, which replaces its files")
    print(export_results(results, CSV, out, cast("Any", units)))
    update_contents(results)


def _export(results: Path, form: str, out: Path | None, units: str, force: bool) -> None:
    from ..io.interchange import export_place, export_results
    from ..io.results_folder import update_contents

    check_new_files(force, out or export_place(results, form))
    print(export_results(results, form, out, cast("Any", units)))
    update_contents(results)


@app.command(
    "opensees",
    epilog=examples(
        "isolation-sim export opensees fitted.toml --current 1",
        "isolation-sim export opensees my_scenario.toml --current 0 --out isolator.tcl",
    ),
)
def export_opensees(
    law: Annotated[Path, typer.Argument(help="Scenario, or file or folder of fit --out.")],
    current: Annotated[
        float | None,
        typer.Option(help="Coil current, A; not needed if the law does not depend on it."),
    ] = None,
    amplitude: Annotated[
        float | None, typer.Option(help="Largest deformation, m; the tested one by default.")
    ] = None,
    frequency: Annotated[
        float | None,
        typer.Option(
            help="Frequency of the fitted loops, Hz; that of the isolated building at this current "
            "by default, and 1 Hz for a law alone."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write, *.py or *.tcl; printed by default.")
    ] = None,
    force: Force = False,
) -> None:
    """Write the OpenSees material closest to the isolators at one current."""
    from ..errors import InputError
    from ..export.opensees import USUAL, isolated_frequency, opensees_material
    from ..scenario import Scenario

    if out is not None and out.suffix not in (".py", ".tcl"):
        raise InputError(f"--out {out}: expected: a file name ending in .py or .tcl")
    if out is not None:
        check_new_files(force, out)
    scenario = Scenario.read(law)
    isolated = scenario.build().isolated
    device = isolated.elements[0].device
    if current is None and device.depends_on_current:
        raise InputError("--current is missing; expected: a coil current in A, such as --current 1")
    current = 0.0 if current is None else current
    if frequency is None:
        # as fit --out writes it: of a device in its own scale, without a building
        alone = scenario.model_fields_set <= {"name", "isolator"}
        is_law = alone and device.length == device.force_scale == 1.0
        frequency = USUAL if is_law else isolated_frequency(isolated, current, amplitude)
    material = opensees_material(device, current, amplitude, frequency)
    text = material.tcl() if out is not None and out.suffix == ".tcl" else material.python()
    first, *others = (isolated.element_names[group[0]] for group in isolated.groups)
    if others:
        text = f"# of {first} alone; further elements: {', '.join(others)}\n{text}"
    if out is None:
        print(text, end="")
    else:
        write_new_file(out, text, force)
        print(out)
