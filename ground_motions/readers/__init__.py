"""Readers of ground-motion files."""

from ground_motions.readers.at2 import read_at2
from ground_motions.readers.csv_file import read_csv
from ground_motions.readers.dispatch import READERS, read
from ground_motions.readers.text_file import read_text

__all__ = ["READERS", "read", "read_at2", "read_csv", "read_text"]
