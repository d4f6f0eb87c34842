"""Diagnosis of building records: structure and isolation layer judged by what was measured."""

from .diagnosis import BuildingDiagnosis, diagnose_building
from .record import BuildingRecord, read_building_record

__all__ = ["BuildingDiagnosis", "BuildingRecord", "diagnose_building", "read_building_record"]
