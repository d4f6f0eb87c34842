"""The ``[ground]`` section for a suite of records."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Literal, NoReturn, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from ground_motions import SUITE_RULES, SuiteRecord, SuiteRule, read_files, read_folder, read_peer

from ..errors import InputError, check_name
from ..validation import InputPath, NonNegative, Positive, Section, absolute
from .targets import Target


class RecordSuite(Section):
    """A set of records for ``isolation-sim suite``."""

    kind: Literal["suite"] = "suite"
    folder: Annotated[
        InputPath | None, Field(description="folder of records, or an unpacked PEER download")
    ] = None
    files: Annotated[
        list[str | list[str]] | None,
        Field(
            min_length=1,
            description="one file per record, or its components in brackets: two horizontal ones "
            "and the vertical one",
        ),
    ] = None
    peer: Annotated[InputPath | None, Field(description="PEER NGA-West2 download, .zip")] = None
    unit: Annotated[
        str | None, Field(description="of text files, and of CSV and MAT files without one")
    ] = None
    dt_s: Annotated[
        Positive | None,
        Field(description="sampling step of accelerations without times: text, MAT"),
    ] = None
    column: Annotated[
        str | list[str] | None,
        Field(
            min_length=1,
            description="CSV, MAT or V2 with several: one column or channel, or in brackets two "
            "horizontal ones and the vertical one",
        ),
    ] = None
    leave_out_unreadable: Annotated[
        bool, Field(description="run without the records that cannot be used, which are named")
    ] = False
    components: Annotated[
        Literal["both", "first", "second", "swapped"],
        Field(
            description="of a pair: both, one after the other for one direction of motion; "
            "swapped, the second one along x of two directions"
        ),
    ] = "both"
    target: Annotated[
        Target | None, Field(description='such as { kind = "nzs1170_5", Z = 0.4, ... }')
    ] = None
    rule: Annotated[
        str, Field(description="asce7_22_16, asce7_22_17, en1998_1_2004, en1998_2_2005")
    ] = next(iter(SUITE_RULES))
    scaling: Annotated[
        Literal["amplitude", "matched", "peer", "none"] | None,
        Field(description="amplitude, matched, peer (factors of the download), none"),
    ] = None
    isolated_period_s: Annotated[
        Positive | None, Field(description="T of the period range; of small vibrations if left out")
    ] = None
    scale_limits: Annotated[
        list[Positive], Field(min_length=2, max_length=2, description="smallest and largest factor")
    ] = Field(default_factory=lambda: [0.25, 4.0])
    select: Annotated[
        int | None, Field(ge=1, description="number of records with the best fit to the target")
    ] = None
    match_tolerance: Annotated[
        float, Field(ge=1e-3, le=0.5, description="tolerance of matched, relative to the target")
    ] = 0.05
    floors: Annotated[
        bool, Field(description="peaks of each level and storey, and floor spectra")
    ] = True
    quiet_after_s: Annotated[
        NonNegative, Field(description="duration of zeros after the record")
    ] = 0.0

    @field_validator("files", mode="before")
    @classmethod
    def _absolute(cls, value: object, info: ValidationInfo) -> object:
        if not isinstance(value, list):
            return value
        return [
            [str(absolute(each, info)) for each in entry]
            if isinstance(entry, list)
            else str(absolute(entry, info))
            for entry in value
        ]

    @model_validator(mode="after")
    def _keys_that_go_together(self) -> Self:
        places = [key for key in ("folder", "files", "peer") if getattr(self, key) is not None]
        if len(places) != 1:
            raise InputError(
                f"{' and '.join(places) or 'no records'} given; expected: one of folder, files, "
                "peer"
            )
        check_name("rule", self.rule, SUITE_RULES)
        if self.target is None and (self.scaling in ("amplitude", "matched") or self.select):
            raise InputError(
                f"{self.scaling or 'select'} needs a target spectrum; expected: a target"
            )
        low, high = self.scale_limits
        if low > high:
            raise InputError("scale_limits", f"{low:g} and {high:g}", "the smallest first")
        return self

    @property
    def scaled_by(self) -> str:
        """Scaling of the records; amplitude by default if there is a target."""
        return self.scaling or ("none" if self.target is None else "amplitude")

    @property
    def suite_rule(self) -> SuiteRule:
        """Requirements of the code on these records."""
        return SUITE_RULES[self.rule].under(self.scaling)

    def records(self) -> tuple[list[SuiteRecord], list[str]]:
        """Return the unprocessed records, and the reason for each one that is left out."""
        left_out: list[str] = []

        def leave_out(error: InputError) -> None:
            left_out.append(str(error))

        on_unreadable = leave_out if self.leave_out_unreadable else None
        if self.peer is not None:
            return read_peer(self.peer, on_unreadable=on_unreadable), left_out
        read = partial(read_files, self.files or [])
        if self.folder is not None:
            read = partial(read_folder, self.folder)
        records = read(
            unit=self.unit, dt=self.dt_s, column=self.column, on_unreadable=on_unreadable
        )
        return records, left_out

    def sources(self) -> list[Path]:
        """Return the input files of the suite."""
        if self.folder is not None:
            return sorted(path for path in self.folder.glob("*") if path.is_file())
        files = [self.peer] if self.peer is not None else []
        for entry in self.files or []:
            files += [Path(each) for each in ([entry] if isinstance(entry, str) else entry)]
        return files

    def record(self) -> NoReturn:
        """Raise, since a suite is more than one motion."""
        raise InputError("[ground] is a suite of records; expected: isolation-sim suite")
