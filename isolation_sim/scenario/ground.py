"""The ``[ground]`` section: source and processing of the ground motion."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

import ground_motions
from ground_motions import STANDARD_GRAVITY, Record

from ..errors import InputError
from ..validation import (
    InputPath,
    NonNegative,
    Number,
    Positive,
    Registered,
    Section,
    WholeNumber,
    kind_by_keys,
)
from .suite import RecordSuite

_SCALES = ("scale_factor", "scale_to_pga_g", "scale_to_sa_g")


class _Ground(Section):
    """Processing of a motion, in the order of these keys."""

    start_s: Annotated[NonNegative | None, Field(description="cut: start time")] = None
    stop_s: Annotated[Positive | None, Field(description="cut: end time")] = None
    baseline_order: Annotated[
        WholeNumber | None, Field(description="degree of the polynomial of a baseline correction")
    ] = None
    highpass_Hz: Annotated[
        Positive | None,
        Field(description="corner frequency of a high-pass filter, with baseline_order"),
    ] = None
    resample_to_s: Annotated[Positive | None, Field(description="new sampling step")] = None
    quiet_before_s: Annotated[
        NonNegative, Field(description="duration of zeros before the record")
    ] = 0.0
    quiet_after_s: Annotated[
        NonNegative, Field(description="duration of zeros after the record")
    ] = 0.0
    scale_factor: Annotated[
        Number | None, Field(description="factor on the acceleration; at most one scale_ key")
    ] = None
    scale_to_pga_g: Annotated[
        Positive | None, Field(description="target peak ground acceleration")
    ] = None
    scale_to_sa_g: Annotated[
        Positive | None, Field(description="target spectral acceleration at sa_period_s")
    ] = None
    sa_period_s: Annotated[NonNegative | None, Field(description="with scale_to_sa_g")] = None
    sa_damping_ratio: Annotated[float, Field(ge=0, lt=1, description="with scale_to_sa_g")] = 0.05

    @model_validator(mode="after")
    def _keys_that_go_together(self) -> Self:
        scales = [key for key in _SCALES if getattr(self, key) is not None]
        if len(scales) > 1:
            raise InputError(f"{' and '.join(scales)} are set; expected: at most one of them")
        if (self.scale_to_sa_g is None) != (self.sa_period_s is None):
            raise InputError("scale_to_sa_g or sa_period_s is missing; expected: both or none")
        if self.highpass_Hz is not None and self.baseline_order is None:
            raise InputError("highpass_Hz needs baseline_order; expected: 0 to 10")
        return self

    def motion(self) -> Record:
        """Return the motion before anything is done to it."""
        raise NotImplementedError

    def record(self) -> Record:
        """Return the processed motion."""
        record = self.motion()
        if self.start_s is not None or self.stop_s is not None:
            record = record.cut(self.start_s or 0.0, self.stop_s)
        if self.baseline_order is not None:
            record = record.baseline_corrected(self.baseline_order, self.highpass_Hz)
        if self.resample_to_s is not None:
            record = record.resampled(self.resample_to_s)
        if self.quiet_before_s or self.quiet_after_s:
            record = record.padded(self.quiet_before_s, self.quiet_after_s)
        # the last step: quiet ground beside a sample other than 0 changes the spectrum
        if self.scale_factor is not None:
            record = record.scaled(self.scale_factor)
        if self.scale_to_pga_g is not None:
            record = record.scaled_to_pga(self.scale_to_pga_g * STANDARD_GRAVITY)
        if self.scale_to_sa_g is not None and self.sa_period_s is not None:
            target = self.scale_to_sa_g * STANDARD_GRAVITY
            record = record.scaled_to_sa(target, self.sa_period_s, self.sa_damping_ratio)
        return record


class ShippedRecord(_Ground):
    """A record that ships with the project."""

    kind: Literal["record"] = "record"
    name: Annotated[str, Field(description="isolation-sim list records")] = "el_centro_1940_ns"

    def motion(self) -> Record:
        """Return the motion before anything is done to it."""
        return ground_motions.load_record(self.name)


class RecordFile(_Ground):
    """A record in a file of your own."""

    kind: Literal["record_file"] = "record_file"
    file: Annotated[InputPath, Field(description="isolation-sim list readers, or a file of reader")]
    column: Annotated[
        str | None,
        Field(
            description="CSV: column, such as ground_acceleration_m_s2; MAT: variable; V2: channel"
        ),
    ] = None
    unit: Annotated[
        str | None,
        Field(
            description="text, CSV and MAT without one: m/s2, g, cm/s2, gal, mm/s2, ft/s2, in/s2"
        ),
    ] = None
    dt_s: Annotated[
        Positive | None,
        Field(description="sampling step of accelerations without times: text, MAT"),
    ] = None
    reader: Annotated[
        Registered | None,
        Field(description="isolation-sim list readers, or file.py:FUNCTION; by suffix"),
    ] = None

    def motion(self) -> Record:
        """Return the motion before anything is done to it."""
        return ground_motions.read(
            self.file, column=self.column, unit=self.unit, dt=self.dt_s, reader=self.reader
        )


class BandLimitedNoise(_Ground):
    """Noise of constant power between two frequencies."""

    kind: Literal["band_limited_noise"] = "band_limited_noise"
    low_Hz: Annotated[NonNegative, Field(description="lower edge of the band")]
    high_Hz: Annotated[Positive, Field(description="upper edge of the band")]
    duration_s: Annotated[Positive, Field(description="length")]
    dt_s: Annotated[Positive, Field(description="sampling step")] = 0.01
    rms_m_s2: Annotated[Positive | None, Field(description="give this or pga_m_s2")] = None
    pga_m_s2: Annotated[Positive | None, Field(description="give this or rms_m_s2")] = None
    seed: Annotated[WholeNumber, Field(description="the same seed gives the same motion")] = 0
    taper: Annotated[float, Field(ge=0, le=0.5, description="share tapered at each end")] = 0.05

    def motion(self) -> Record:
        """Return the motion before anything is done to it."""
        return ground_motions.band_limited_noise(
            self.low_Hz,
            self.high_Hz,
            self.duration_s,
            self.dt_s,
            rms=self.rms_m_s2,
            pga=self.pga_m_s2,
            seed=self.seed,
            taper=self.taper,
        )


class FilteredNoise(_Ground):
    """Random earthquake motion with the spectrum of Kanai and Tajimi or of Clough and Penzien."""

    ENVELOPES: ClassVar[dict[str, Any]] = {
        "jennings_housner_a": ground_motions.JENNINGS_HOUSNER_A,
        "jennings_housner_b": ground_motions.JENNINGS_HOUSNER_B,
        "stationary": None,
    }
    kind: Annotated[
        Literal["kanai_tajimi", "clough_penzien"], Field(description="kanai_tajimi, clough_penzien")
    ]
    soil: Annotated[Literal["firm", "medium", "soft"], Field(description="firm, medium, soft")] = (
        "firm"
    )
    duration_s: Annotated[Positive, Field(description="length")] = 30.0
    dt_s: Annotated[Positive, Field(description="sampling step")] = 0.01
    pga_m_s2: Annotated[Positive | None, Field(description="give this or intensity_m2_s3")] = None
    intensity_m2_s3: Annotated[
        Positive | None, Field(description="one-sided density of the noise at bedrock")
    ] = None
    envelope: Annotated[
        Literal["jennings_housner_a", "jennings_housner_b", "stationary"],
        Field(description="jennings_housner_a, jennings_housner_b, stationary"),
    ] = "jennings_housner_b"
    seed: Annotated[WholeNumber, Field(description="the same seed gives the same motion")] = 0

    def motion(self) -> Record:
        """Return the motion before anything is done to it."""
        make = getattr(ground_motions, f"{self.kind}_motion")
        record: Record = make(
            self.soil,
            self.duration_s,
            self.dt_s,
            seed=self.seed,
            pga=self.pga_m_s2,
            intensity=self.intensity_m2_s3,
            envelope=self.ENVELOPES[self.envelope],
        )
        return record


class _Pulse(_Ground):
    peak_velocity_m_s: Annotated[Positive, Field(description="amplitude of the velocity")]
    pulse_period_s: Annotated[Positive, Field(description="period of the pulse")]
    dt_s: Annotated[Positive, Field(description="sampling step")] = 0.01

    @property
    def _still(self) -> dict[str, float]:
        # the closed forms need one step at rest on both sides; quiet_ keys can only lengthen it
        return {"dt": self.dt_s, "before": 0.5, "after": 0.5}


class RickerPulse(_Pulse):
    """Symmetric Ricker wavelet in acceleration."""

    kind: Literal["ricker_pulse"] = "ricker_pulse"

    def motion(self) -> Record:
        """Return the motion before anything is done to it."""
        return ground_motions.ricker_pulse(
            self.peak_velocity_m_s, self.pulse_period_s, **self._still
        )


class MakrisPulse(_Pulse):
    """Cycloidal pulse of Makris."""

    kind: Literal["makris_pulse"] = "makris_pulse"
    pulse: Annotated[Literal["A", "B", "C1", "C2"], Field(description="A, B, C1, C2")]

    def motion(self) -> Record:
        """Return the motion before anything is done to it."""
        return ground_motions.makris_pulse(
            self.pulse, self.peak_velocity_m_s, self.pulse_period_s, **self._still
        )


class MavroeidisPulse(_Pulse):
    """Near-fault pulse of Mavroeidis and Papageorgiou."""

    kind: Literal["mavroeidis_papageorgiou_pulse"] = "mavroeidis_papageorgiou_pulse"
    cycles: Annotated[float, Field(gt=1, description="length of the pulse in periods")] = 2.0
    phase_rad: Annotated[Number, Field(description="0 is symmetric in velocity")] = 0.0

    def motion(self) -> Record:
        """Return the motion before anything is done to it."""
        return ground_motions.mavroeidis_papageorgiou_pulse(
            self.peak_velocity_m_s,
            self.pulse_period_s,
            self.cycles,
            self.phase_rad,
            **self._still,
        )


Ground = Annotated[
    Annotated[ShippedRecord, Tag("record")]
    | Annotated[RecordFile, Tag("record_file")]
    | Annotated[BandLimitedNoise, Tag("band_limited_noise")]
    | Annotated[FilteredNoise, Tag("kanai_tajimi")]
    | Annotated[FilteredNoise, Tag("clough_penzien")]
    | Annotated[RickerPulse, Tag("ricker_pulse")]
    | Annotated[MakrisPulse, Tag("makris_pulse")]
    | Annotated[MavroeidisPulse, Tag("mavroeidis_papageorgiou_pulse")]
    | Annotated[RecordSuite, Tag("suite")],
    Discriminator(kind_by_keys(
        ShippedRecord, RecordFile, BandLimitedNoise, FilteredNoise, RickerPulse, MakrisPulse,
        MavroeidisPulse, RecordSuite,
    )),
]  # fmt: skip
