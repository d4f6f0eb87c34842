"""Files of a diagnosis."""

from __future__ import annotations

from pathlib import Path

from ground_motions.registry import copy_code

from ..archive import FILE, save_archive
from ..discrepancy.diagnosis import Diagnosis, relative_error
from ..discrepancy.tiers.law_file import text_beside
from ..effects.serialisation import device_places, device_section
from ..io.csv_table import write_table
from ..io.files import write_text
from ..io.results_folder import files_into, write_contents
from . import diagnosis_figures
from .diagnosis import markdown
from .html.diagnosis_report import diagnosis_report
from .style import save

LAW_FILE = "extended_law.py"


def save_diagnosis(diagnosis: Diagnosis, folder: Path, overwrite: bool) -> list[Path]:
    """Write report, JSON, text, figures and extended law to a folder; return the files."""
    with files_into(folder, overwrite) as place:
        written = _write_files(diagnosis, place)
    return [folder / path.relative_to(place) for path in written]


def _write_files(diagnosis: Diagnosis, folder: Path) -> list[Path]:
    texts = {"diagnosis.json": diagnosis.to_json() + "\n", "report.md": markdown(diagnosis)}
    section = ""
    if diagnosis.extended is not None:
        comment = f"{diagnosis.model}, extended by a diagnosis of {diagnosis.data}"
        law, *effects = device_places(diagnosis.extended)
        if diagnosis.ladder is not None and diagnosis.ladder.law_text:
            texts[LAW_FILE] = text_beside(diagnosis.ladder.law_text, folder)
            places = {law: f"{LAW_FILE}:LAW"} | copy_code(effects, folder)
        else:
            places = copy_code([law, *effects], folder)
        section = device_section(diagnosis.extended, comment, places=places)
        texts["extended_law.toml"] = section
    written = [diagnosis_report(diagnosis, section).write(folder / "report.html")]
    written += [write_text(text, folder / name) for name, text in texts.items()]
    errors = [
        {"run": each.name, "held_out": each.held_out,
         "error_before": relative_error(each, each.before),
         "error_after": relative_error(each, each.after)}
        for each in diagnosis.traces
    ]  # fmt: skip
    written.append(write_table(errors, folder / "errors.csv"))
    if diagnosis.causes:
        causes = [
            {"cause": each.name, "form": each.form, "place": each.place, "share": each.share,
             "p_value": each.p_value,
             **{f"{name}, {one.unit}": one.value for name, one in each.parameters.items()}}
            for each in diagnosis.causes
        ]  # fmt: skip
        written.append(write_table(causes, folder / "causes.csv"))
    if diagnosis.traces:
        for stem, draw in (
            ("loops", diagnosis_figures.overview),
            ("residuals", diagnosis_figures.residuals),
            ("errors", diagnosis_figures.errors_by_run),
        ):
            written += save(draw(diagnosis), folder, stem)
    written.append(save_archive(diagnosis, folder / FILE))
    written.append(write_contents(folder, f"Diagnosis of {diagnosis.data}"))
    return written
