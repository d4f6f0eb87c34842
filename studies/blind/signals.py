"""Filters and memories that the hidden effects are made of; uniform grids, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.signal import fftconvolve


@njit(cache=True)
def lag(signal, step, tau):
    """First-order lag, exact for a signal linear between points, steady at the start."""
    out = np.empty_like(signal)
    decay = np.exp(-step / tau)
    mean = tau / step * (1 - decay)
    out[0] = signal[0]
    for i in range(1, signal.size):
        out[i] = decay * out[i - 1] + (mean - decay) * signal[i - 1] + (1 - mean) * signal[i]
    return out


@njit(cache=True)
def play(signal, width):
    """Play (backlash) operator, virgin at zero."""
    out = np.empty_like(signal)
    now = 0.0
    for i in range(signal.size):
        now = max(signal[i] - width, min(signal[i] + width, now))
        out[i] = now
    return out


@njit(cache=True)
def fading_peak(signal, step, tau):
    """Largest absolute value, forgotten over ``tau``: an envelope follower."""
    out = np.empty_like(signal)
    decay, now = np.exp(-step / tau), 0.0
    for i in range(signal.size):
        now = max(abs(signal[i]), now * decay)
        out[i] = now
    return out


@njit(cache=True)
def bristle(x, length):
    """Dahl's friction as a share of sliding friction, exact between points."""
    out = np.zeros_like(x)
    for i in range(1, x.size):
        side = np.sign(x[i] - x[i - 1])
        out[i] = side + (out[i - 1] - side) * np.exp(-abs(x[i] - x[i - 1]) / length)
    return out


@njit(cache=True)
def stick_slip(x, reach):
    """Elastic up to ``reach``, then sliding (Jenkins element), as a share of sliding friction."""
    out = np.zeros_like(x)
    for i in range(1, x.size):
        out[i] = min(1.0, max(-1.0, out[i - 1] + (x[i] - x[i - 1]) / reach))
    return out


@njit(cache=True)
def two_nodes(power, step, heat, inner, cooling, outer):
    """Temperature rise of rubber beside steel plates that lose heat to the room.

    ``heat`` is degrees for a unit of work in the rubber; ``inner``, ``cooling`` and ``outer`` are
    rates in 1/s: rubber to plates, plates from rubber, plates to room.
    """
    out = np.zeros_like(power)
    rubber, plates = 0.0, 0.0
    for i in range(1, power.size):
        flow = rubber - plates
        work = heat * 0.5 * (power[i - 1] + power[i])
        rubber, plates = (
            rubber + step * (work - inner * flow),
            plates + step * (cooling * flow - outer * plates),
        )
        out[i] = rubber
    return out


def hereditary(kernel: np.ndarray, v: np.ndarray, step: float) -> np.ndarray:
    """Convolution of a relaxation kernel with the velocity."""
    return fftconvolve(kernel, v)[: v.size] * step


def grunwald(x: np.ndarray, order: float, step: float) -> np.ndarray:
    """Fractional derivative of Grünwald and Letnikov from rest."""
    k = np.arange(1, x.size)
    weights = np.concatenate(([1.0], np.cumprod((k - 1 - order) / k)))
    return fftconvolve(weights, x)[: x.size] / step**order


def smooth_abs(x: np.ndarray, corner: float) -> np.ndarray:
    """Absolute value with a round corner."""
    return np.hypot(x, corner) - corner


def running_max(x: np.ndarray) -> np.ndarray:
    """Largest absolute value so far."""
    return np.maximum.accumulate(np.abs(x))


def travel(x: np.ndarray) -> np.ndarray:
    """Path length so far."""
    return np.concatenate(([0.0], np.cumsum(np.abs(np.diff(x)))))


def integral(signal: np.ndarray, step: float) -> np.ndarray:
    """Time integral so far, trapezoidal."""
    return np.concatenate(([0.0], np.cumsum((signal[1:] + signal[:-1]) / 2))) * step
