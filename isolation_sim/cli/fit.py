"""The command ``isolation-sim fit``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from ..io.files import check_new_files
from .common_options import (
    AsJson,
    Force,
    Quiet,
    TestsFolder,
    check_exports,
    examples,
    print_path,
    print_result,
    progress,
    read_numbers,
    write_report,
)

EXAMPLES = examples(
    "isolation-sim fit my_tests --law kelvin_voigt",
    "isolation-sim fit my_tests --law bouc_wen --fix n=2 --fix A=1 --out fitted.toml",
    "isolation-sim fit my_tests --law strain_stiffening --out fitted.toml --export mat",
)


def fit(
    campaign: TestsFolder,
    law: Annotated[
        str,
        typer.Option(
            help="Law to fit, of isolation-sim list laws; auto compares all and takes the best."
        ),
    ],
    current_degree: Annotated[
        int | None, typer.Option(help="Degree of the polynomials in the current.")
    ] = None,
    fixed: Annotated[
        list[str] | None,
        typer.Option("--fix", help="Parameter to hold constant, as name=value; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File for the law, such as fitted.toml, an [isolator] section of a scenario; or "
            "a folder for iso.load."
        ),
    ] = None,
    starts: Annotated[int, typer.Option(help="Number of starts.")] = 20,
    figure: Annotated[
        Path | None, typer.Option(help="File stem for a figure of the loops (SVG and PNG).")
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(help="File for the report (HTML); beside or in --out by default."),
    ] = None,
    export: Annotated[
        list[str] | None,
        typer.Option(
            "--export", help="Also write law and loops: mat or xlsx; a folder --out has CSV files."
        ),
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit a law to measured runs."""
    from ..identification.fit import fit as run_fit
    from ..io.interchange import FORMS
    from ..io.results_folder import check_free

    check_exports(export, known=FORMS)
    if export and out is None:
        raise InputError(
            f"--export {export[0]}: needs a file for the law; expected: --out fitted.toml as well"
        )
    if report is None and out is not None and out.suffix:
        report = out.with_suffix(".html")
    if report is not None and report == out:
        raise InputError(
            f"--out {out}: is also the file of the report; expected: a file such as "
            f"{out.with_suffix('.toml')}"
        )
    figures = [Path(f"{figure}.{kind}") for kind in ("svg", "png")] if figure else []
    exports = [out.with_suffix(f".{form}") for form in export or () if out is not None]
    folder = out if out is not None and not out.suffix else None
    if folder is not None and (not force or folder.is_file()):
        check_free(folder, instead="--force, which replaces the files of a result")
    check_new_files(force, None if folder else out, report, *figures, *exports)
    with progress(quiet, starts, alike=True) as step:
        step("searching")
        result = run_fit(
            campaign, law, current_degree=current_degree, fixed=read_numbers(fixed, "--fix", "n=2"),
            starts=starts, progress=lambda done: step("searching", done),
        )  # fmt: skip
    print_result(result, as_json, quiet)
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        print_path("fitted law", result.save(out, overwrite=force), as_json)
    for path in exports:
        print_path("exported", result.save(path), as_json)
    if figure is not None:
        from ..reports.style import save

        for path in save(result.plot(), figure.parent, figure.name):
            print_path("figure", path, as_json)
    if report is not None:
        write_report(report, result.to_html, as_json)
