"""Ground motions: records, their files, spectra, and random and pulse-like excitation.

Everything is in SI units inside: m, s, m/s2. A motion is a `Record`, wherever it comes from.
"""

from ground_motions.band_limited import band_limited_noise, band_limited_series
from ground_motions.csv_writer import write_csv
from ground_motions.envelopes import (
    JENNINGS_HOUSNER_A,
    JENNINGS_HOUSNER_B,
    AminAng,
    Envelope,
    SaragoniHart,
    Trapezoid,
)
from ground_motions.errors import GroundMotionError
from ground_motions.kanai_tajimi import (
    SOILS,
    Soil,
    clough_penzien_motion,
    clough_penzien_psd,
    kanai_tajimi_motion,
    kanai_tajimi_psd,
)
from ground_motions.near_fault import (
    MAKRIS_KINDS,
    makris_pulse,
    mavroeidis_papageorgiou_pulse,
    ricker_pulse,
)
from ground_motions.readers import read, read_at2, read_csv, read_text
from ground_motions.record import Record
from ground_motions.records import available_records, el_centro_1940, load_record
from ground_motions.spectra import (
    OscillatorResponse,
    ResponseSpectrum,
    oscillator_response,
    response_spectrum,
)
from ground_motions.units import ACCELERATION_UNITS, STANDARD_GRAVITY

__all__ = [
    "ACCELERATION_UNITS",
    "JENNINGS_HOUSNER_A",
    "JENNINGS_HOUSNER_B",
    "MAKRIS_KINDS",
    "SOILS",
    "STANDARD_GRAVITY",
    "AminAng",
    "Envelope",
    "GroundMotionError",
    "OscillatorResponse",
    "Record",
    "ResponseSpectrum",
    "SaragoniHart",
    "Soil",
    "Trapezoid",
    "available_records",
    "band_limited_noise",
    "band_limited_series",
    "clough_penzien_motion",
    "clough_penzien_psd",
    "el_centro_1940",
    "kanai_tajimi_motion",
    "kanai_tajimi_psd",
    "load_record",
    "makris_pulse",
    "mavroeidis_papageorgiou_pulse",
    "oscillator_response",
    "read",
    "read_at2",
    "read_csv",
    "read_text",
    "response_spectrum",
    "ricker_pulse",
    "write_csv",
]
