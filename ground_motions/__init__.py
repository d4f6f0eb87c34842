"""Ground motions: records, their files, spectra, and random and pulse-like excitation.

All quantities are in SI units: m, s, m/s^2. Every motion is a `Record`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ground_motions.band_limited import band_limited_noise, band_limited_series
    from ground_motions.csv_writer import write_csv
    from ground_motions.design_spectra import (
        DesignSpectrum,
        asce7_22_multi_period,
        asce7_22_two_period,
        en1998_1_1_2022,
        en1998_1_2004,
        nzs1170_5,
        table_spectrum,
    )
    from ground_motions.envelopes import (
        JENNINGS_HOUSNER_A,
        JENNINGS_HOUSNER_B,
        AminAng,
        Envelope,
        SaragoniHart,
        Trapezoid,
    )
    from ground_motions.errors import InputError
    from ground_motions.kanai_tajimi import (
        SOILS,
        Soil,
        clough_penzien_motion,
        clough_penzien_psd,
        kanai_tajimi_motion,
        kanai_tajimi_psd,
    )
    from ground_motions.matching import MatchedRecord, match_spectrum
    from ground_motions.mixture import motion_mixture
    from ground_motions.near_fault import (
        MAKRIS_KINDS,
        makris_pulse,
        mavroeidis_papageorgiou_pulse,
        ricker_pulse,
    )
    from ground_motions.pairs import combined_spectrum
    from ground_motions.readers import read, read_at2, read_csv, read_knet, read_text, read_v2
    from ground_motions.record import Record
    from ground_motions.records import available_records, el_centro_1940, load_record
    from ground_motions.scaling import (
        SUITE_RULES,
        SuiteRule,
        SuiteScaling,
        scale_suite,
        select_best,
    )
    from ground_motions.spectra import (
        OscillatorResponse,
        ResponseSpectrum,
        oscillator_response,
        response_spectrum,
    )
    from ground_motions.suites import SuiteRecord, read_files, read_folder, read_peer
    from ground_motions.units import ACCELERATION_UNITS, STANDARD_GRAVITY

# one line per name: where it lives
_HOMES = {
    "ACCELERATION_UNITS": "ground_motions.units",
    "AminAng": "ground_motions.envelopes",
    "DesignSpectrum": "ground_motions.design_spectra",
    "Envelope": "ground_motions.envelopes",
    "InputError": "ground_motions.errors",
    "JENNINGS_HOUSNER_A": "ground_motions.envelopes",
    "JENNINGS_HOUSNER_B": "ground_motions.envelopes",
    "MAKRIS_KINDS": "ground_motions.near_fault",
    "MatchedRecord": "ground_motions.matching",
    "OscillatorResponse": "ground_motions.spectra",
    "Record": "ground_motions.record",
    "ResponseSpectrum": "ground_motions.spectra",
    "SOILS": "ground_motions.kanai_tajimi",
    "STANDARD_GRAVITY": "ground_motions.units",
    "SUITE_RULES": "ground_motions.scaling",
    "SaragoniHart": "ground_motions.envelopes",
    "Soil": "ground_motions.kanai_tajimi",
    "SuiteRecord": "ground_motions.suites",
    "SuiteRule": "ground_motions.scaling",
    "SuiteScaling": "ground_motions.scaling",
    "Trapezoid": "ground_motions.envelopes",
    "asce7_22_multi_period": "ground_motions.design_spectra",
    "asce7_22_two_period": "ground_motions.design_spectra",
    "available_records": "ground_motions.records",
    "band_limited_noise": "ground_motions.band_limited",
    "band_limited_series": "ground_motions.band_limited",
    "clough_penzien_motion": "ground_motions.kanai_tajimi",
    "clough_penzien_psd": "ground_motions.kanai_tajimi",
    "combined_spectrum": "ground_motions.pairs",
    "el_centro_1940": "ground_motions.records",
    "en1998_1_1_2022": "ground_motions.design_spectra",
    "en1998_1_2004": "ground_motions.design_spectra",
    "kanai_tajimi_motion": "ground_motions.kanai_tajimi",
    "kanai_tajimi_psd": "ground_motions.kanai_tajimi",
    "load_record": "ground_motions.records",
    "makris_pulse": "ground_motions.near_fault",
    "match_spectrum": "ground_motions.matching",
    "mavroeidis_papageorgiou_pulse": "ground_motions.near_fault",
    "motion_mixture": "ground_motions.mixture",
    "nzs1170_5": "ground_motions.design_spectra",
    "oscillator_response": "ground_motions.spectra",
    "read": "ground_motions.readers",
    "read_at2": "ground_motions.readers",
    "read_csv": "ground_motions.readers",
    "read_files": "ground_motions.suites",
    "read_folder": "ground_motions.suites",
    "read_knet": "ground_motions.readers",
    "read_peer": "ground_motions.suites",
    "read_text": "ground_motions.readers",
    "read_v2": "ground_motions.readers",
    "response_spectrum": "ground_motions.spectra",
    "ricker_pulse": "ground_motions.near_fault",
    "scale_suite": "ground_motions.scaling",
    "select_best": "ground_motions.scaling",
    "table_spectrum": "ground_motions.design_spectra",
    "write_csv": "ground_motions.csv_writer",
}

__all__ = [
    "ACCELERATION_UNITS",
    "JENNINGS_HOUSNER_A",
    "JENNINGS_HOUSNER_B",
    "MAKRIS_KINDS",
    "SOILS",
    "STANDARD_GRAVITY",
    "SUITE_RULES",
    "AminAng",
    "DesignSpectrum",
    "Envelope",
    "InputError",
    "MatchedRecord",
    "OscillatorResponse",
    "Record",
    "ResponseSpectrum",
    "SaragoniHart",
    "Soil",
    "SuiteRecord",
    "SuiteRule",
    "SuiteScaling",
    "Trapezoid",
    "asce7_22_multi_period",
    "asce7_22_two_period",
    "available_records",
    "band_limited_noise",
    "band_limited_series",
    "clough_penzien_motion",
    "clough_penzien_psd",
    "combined_spectrum",
    "el_centro_1940",
    "en1998_1_1_2022",
    "en1998_1_2004",
    "kanai_tajimi_motion",
    "kanai_tajimi_psd",
    "load_record",
    "makris_pulse",
    "match_spectrum",
    "mavroeidis_papageorgiou_pulse",
    "motion_mixture",
    "nzs1170_5",
    "oscillator_response",
    "read",
    "read_at2",
    "read_csv",
    "read_files",
    "read_folder",
    "read_knet",
    "read_peer",
    "read_text",
    "read_v2",
    "response_spectrum",
    "ricker_pulse",
    "scale_suite",
    "select_best",
    "table_spectrum",
    "write_csv",
]


def __getattr__(name: str) -> Any:
    if name == "GroundMotionError":
        from ground_motions.errors import warn

        warn(
            "GroundMotionError is now InputError; the old name goes with the next release",
            DeprecationWarning,
        )
        name = "InputError"
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
