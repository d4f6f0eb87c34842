"""Device laws: one file per law, each written once as pure arithmetic."""

from .current_dependence import CurrentDependence
from .device import Device, Scaled
from .law import Law, Quantity
from .measured_force import measured_force
from .passive_switching import instantaneous, passive
from .registry import LAWS, available_conditions, available_laws, available_sets, law

__all__ = [
    "LAWS",
    "CurrentDependence",
    "Device",
    "Law",
    "Quantity",
    "Scaled",
    "available_conditions",
    "available_laws",
    "available_sets",
    "instantaneous",
    "law",
    "measured_force",
    "passive",
]
