"""Ground motions: records, their files, spectra, and random and pulse-like excitation.

All quantities are in SI units: m, s, m/s^2. Every motion is a `Record`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ground_motions.exports import lazy_exports

if TYPE_CHECKING:
    from ground_motions.band_limited import band_limited_noise as band_limited_noise
    from ground_motions.band_limited import band_limited_series as band_limited_series
    from ground_motions.design_spectra import DesignSpectrum as DesignSpectrum
    from ground_motions.design_spectra import asce7_22_multi_period as asce7_22_multi_period
    from ground_motions.design_spectra import asce7_22_two_period as asce7_22_two_period
    from ground_motions.design_spectra import en1998_1_1_2022 as en1998_1_1_2022
    from ground_motions.design_spectra import en1998_1_2004 as en1998_1_2004
    from ground_motions.design_spectra import nzs1170_5 as nzs1170_5
    from ground_motions.design_spectra import table_spectrum as table_spectrum
    from ground_motions.envelopes import JENNINGS_HOUSNER_A as JENNINGS_HOUSNER_A
    from ground_motions.envelopes import JENNINGS_HOUSNER_B as JENNINGS_HOUSNER_B
    from ground_motions.envelopes import AminAng as AminAng
    from ground_motions.envelopes import Envelope as Envelope
    from ground_motions.envelopes import SaragoniHart as SaragoniHart
    from ground_motions.envelopes import Trapezoid as Trapezoid
    from ground_motions.errors import InputError as InputError
    from ground_motions.kanai_tajimi import SOILS as SOILS
    from ground_motions.kanai_tajimi import Soil as Soil
    from ground_motions.kanai_tajimi import clough_penzien_motion as clough_penzien_motion
    from ground_motions.kanai_tajimi import clough_penzien_psd as clough_penzien_psd
    from ground_motions.kanai_tajimi import kanai_tajimi_motion as kanai_tajimi_motion
    from ground_motions.kanai_tajimi import kanai_tajimi_psd as kanai_tajimi_psd
    from ground_motions.matching import MatchedRecord as MatchedRecord
    from ground_motions.matching import match_spectrum as match_spectrum
    from ground_motions.mixture import motion_mixture as motion_mixture
    from ground_motions.near_fault import MAKRIS_KINDS as MAKRIS_KINDS
    from ground_motions.near_fault import makris_pulse as makris_pulse
    from ground_motions.near_fault import (
        mavroeidis_papageorgiou_pulse as mavroeidis_papageorgiou_pulse,
    )
    from ground_motions.near_fault import ricker_pulse as ricker_pulse
    from ground_motions.pairs import combined_spectrum as combined_spectrum
    from ground_motions.readers import read as read
    from ground_motions.readers import read_at2 as read_at2
    from ground_motions.readers import read_csv as read_csv
    from ground_motions.readers import read_esm as read_esm
    from ground_motions.readers import read_geonet as read_geonet
    from ground_motions.readers import read_knet as read_knet
    from ground_motions.readers import read_mat as read_mat
    from ground_motions.readers import read_smc as read_smc
    from ground_motions.readers import read_text as read_text
    from ground_motions.readers import read_v2 as read_v2
    from ground_motions.readers.csv_file import write_csv as write_csv
    from ground_motions.record import Record as Record
    from ground_motions.records import available_records as available_records
    from ground_motions.records import el_centro_1940 as el_centro_1940
    from ground_motions.records import load_record as load_record
    from ground_motions.scaling import SUITE_RULES as SUITE_RULES
    from ground_motions.scaling import SuiteRule as SuiteRule
    from ground_motions.scaling import SuiteScaling as SuiteScaling
    from ground_motions.scaling import scale_suite as scale_suite
    from ground_motions.scaling import select_best as select_best
    from ground_motions.spectra import OscillatorResponse as OscillatorResponse
    from ground_motions.spectra import ResponseSpectrum as ResponseSpectrum
    from ground_motions.spectra import oscillator_response as oscillator_response
    from ground_motions.spectra import response_spectrum as response_spectrum
    from ground_motions.suites import SuiteRecord as SuiteRecord
    from ground_motions.suites import read_files as read_files
    from ground_motions.suites import read_folder as read_folder
    from ground_motions.suites import read_peer as read_peer
    from ground_motions.units import ACCELERATION_UNITS as ACCELERATION_UNITS
    from ground_motions.units import STANDARD_GRAVITY as STANDARD_GRAVITY

if not TYPE_CHECKING:  # type checkers refuse a misspelt name
    _exported, __all__ = lazy_exports(__name__)

    def __getattr__(name: str) -> Any:
        if name == "GroundMotionError":
            from ground_motions.errors import warn

            warn(
                "GroundMotionError is now InputError; the old name goes with the next release",
                DeprecationWarning,
            )
            name = "InputError"
        return _exported(name)

    def __dir__() -> list[str]:
        return sorted([*globals(), *__all__])
