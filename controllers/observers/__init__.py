"""Observers: the state from accelerometers and the isolators' displacement."""

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
