"""Readers of ground-motion files."""

from ground_motions.readers.at2 import read_at2
from ground_motions.readers.csv_file import read_csv
from ground_motions.readers.dispatch import READERS, read
from ground_motions.readers.esm import read_esm
from ground_motions.readers.geonet import read_geonet
from ground_motions.readers.knet import read_knet
from ground_motions.readers.mat_file import read_mat
from ground_motions.readers.smc import read_smc
from ground_motions.readers.text_file import read_text
from ground_motions.readers.v2 import read_v2

__all__ = [
    "READERS",
    "read",
    "read_at2",
    "read_csv",
    "read_esm",
    "read_geonet",
    "read_knet",
    "read_mat",
    "read_smc",
    "read_text",
    "read_v2",
]
