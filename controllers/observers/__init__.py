"""Observers: estimates of the state from accelerometers and isolator deformations."""

from .extended import ExtendedKalmanFilter
from .ground_noise import GroundNoise
from .kalman import KalmanFilter
from .observer import Estimate, Noise, Observer

__all__ = [
    "Estimate",
    "ExtendedKalmanFilter",
    "GroundNoise",
    "KalmanFilter",
    "Noise",
    "Observer",
]
