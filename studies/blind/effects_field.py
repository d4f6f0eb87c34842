"""Hidden effects between the measured current and the field in the material."""

from __future__ import annotations

import numpy as np

from .effect import CURRENT, about, form
from .signals import lag, play, smooth_abs


@form("current_lag", CURRENT, limit=0.5)
def _coil_and_supply(rng):
    """Two poles in series: the coil's and a faster one of the supply; severity in s."""
    ratio = about(rng, 0.35)
    return lambda s, q: lag(lag(q.current, q.motion.step, s), q.motion.step, ratio * s)


@form("current_lag", CURRENT, limit=0.8)
def _eddy_diffusion(rng):
    """Field diffusing into a solid steel yoke: modes of amplitude 1/n^2, times 1/n^2; s in s."""
    air = about(rng, 0.15)  # share of the field that follows at once

    def act(s, q):
        odd = np.array([1, 3, 5, 7, 9])
        share = (1 - air) * odd**-2.0 / np.sum(odd**-2.0)
        return air * q.current + sum(
            w * lag(q.current, q.motion.step, s / n**2) for w, n in zip(share, odd, strict=True)
        )

    return act


@form("field_saturation", CURRENT, limit=1.5)
def _langevin(rng):
    """Langevin's function of domains aligning; severity is 1 / knee, 1/A."""

    def act(s, q):
        u = 3 * s * q.current
        far = np.maximum(u, 1e-2)
        return np.where(u < 1e-2, u / 3, 1 / np.tanh(far) - 1 / far) / s

    return act


@form("field_saturation", CURRENT, limit=1.2)
def _knee(rng):
    """Slope 1, then a softened knee (Fröhlich with an exponent); severity is 1 / knee, 1/A."""
    power = about(rng, 4.0)
    return lambda s, q: q.current / (1 + (s * q.current) ** power) ** (1 / power)


@form("magnetic_remanence", CURRENT, limit=0.6)
def _play_stack(rng):
    """Prandtl and Ishlinskii: a stack of play operators; severity is their share."""
    widths = np.array([about(rng, w) for w in (0.3, 0.7, 1.3)])

    def act(s, q):
        stack = sum(play(q.current, w) for w in widths) / widths.size
        return q.current + s * (stack + widths.mean() - q.current)

    return act


@form("magnetic_remanence", CURRENT, limit=0.6)
def _remanent_field(rng):
    """The yoke keeps part of the largest field that it has seen; severity is that part."""
    saturation = about(rng, 2.5)

    def act(s, q):
        largest = np.maximum.accumulate(q.current)
        keep = s * saturation * np.tanh(largest / saturation)
        return np.sqrt(q.current**2 + keep**2 * (1 - (q.current / np.maximum(largest, 1e-9)) ** 2))

    return act


@form("field_gap_coupling", CURRENT, limit=1.0)
def _longer_path(rng):
    """Shear lengthens the path of the flux through the material; severity at 8 mm."""
    return lambda s, q: q.current / (1 + s * (q.motion.x / 8.0) ** 2)


@form("field_gap_coupling", CURRENT, limit=1.2)
def _less_overlap(rng):
    """Poles slide past each other and overlap less; severity at 8 mm."""
    corner = about(rng, 1.0)
    return lambda s, q: q.current * np.exp(-s * smooth_abs(q.motion.x, corner) / 8.0)
