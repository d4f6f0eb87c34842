"""Hidden effects that change the material: stiffness and loss factors."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from .effect import MATERIAL, about, form
from .motion import AMBIENT
from .signals import fading_peak, integral, lag, running_max, travel, two_nodes


@form("stress_softening", MATERIAL, limit=0.8)
def _hill_of_largest(rng):
    """Hill's curve of the largest past deformation; severity is the share lost at the end."""
    half, power = about(rng, 4.0), about(rng, 2.0)

    def act(s, q):
        u = (running_max(q.motion.x) / half) ** power
        return 1 - s * u / (1 + u)

    return act


@form("stress_softening", MATERIAL, limit=0.8)
def _pseudo_elastic(rng):
    """After Ogden and Roxburgh: soft only below the largest past deformation."""
    depth = about(rng, 12.0)

    def act(s, q):
        x = q.motion.x
        missing = running_max(x) ** 2 - x**2
        return 1 - s * missing / (missing + depth)

    return act


@form("amplitude_softening", MATERIAL, limit=0.8)
def _kraus(rng):
    """Kraus's curve of an envelope that follows the peaks and fades within seconds."""
    critical, power, tau = about(rng, 2.5), about(rng, 1.1), about(rng, 1.5)

    def act(s, q):
        amplitude = fading_peak(lag(q.motion.x, q.motion.step, 0.01), q.motion.step, tau)
        return 1 - s + s / (1 + (amplitude / critical) ** power)

    return act


@form("amplitude_softening", MATERIAL, limit=0.6)
def _power_of_moving_rms(rng):
    """Power of the moving RMS over the last second, as Li & Li's Table 1 asks for."""
    window, more_loss = about(rng, 1.0), about(rng, 1.15, 0.1)

    def act(s, q):
        size = max(1, round(window / q.motion.step))
        mean = uniform_filter1d(q.motion.x**2, size, mode="constant", origin=(size - 1) // 2)
        g = (1 + np.maximum(mean, 0.0) / 0.5) ** (-s / 2)
        return g, g**more_loss

    return act


@form("self_heating", MATERIAL, limit=0.1, heats=True)
def _rubber_and_plates(rng):
    """Two thermal nodes, exponential softening; severity is kelvin for a joule times 1 %/K."""
    inner, cooling, outer = about(rng, 0.15), about(rng, 0.08), about(rng, 0.05)

    def act(s, q):
        rise = two_nodes(q.power, q.motion.step, s * 1e-3, inner, cooling, outer)
        return np.exp(-rise), np.exp(-1.3 * rise)

    return act


@form("self_heating", MATERIAL, limit=0.15, heats=True)
def _one_node(rng):
    """Newton's cooling, hyperbolic softening, loss and stiffness alike."""
    tau = about(rng, 6.0)

    def act(s, q):
        rise = s * 1e-3 * tau * lag(np.concatenate(([0.0], q.power[1:])), q.motion.step, tau)
        return 1 / (1 + rise)

    return act


@form("ambient_temperature", MATERIAL, limit=4.0)
def _wlf(rng):
    """Williams, Landel and Ferry: loss changes more than stiffness."""
    c2, more = about(rng, 90.0), about(rng, 1.5)

    def act(s, q):
        warmer = q.motion.temperature - AMBIENT
        shift = s * warmer / (c2 + warmer)
        return np.exp(-shift), np.exp(-more * shift)

    return act


@form("ambient_temperature", MATERIAL, limit=5.0)
def _arrhenius(rng):
    """Arrhenius' law, stiffness and loss alike; severity in thousands of kelvin."""

    def act(s, q):
        return np.exp(1e3 * s * (1 / (q.motion.temperature + 273.15) - 1 / (AMBIENT + 273.15)))

    return act


@form("weak_rate_dependence", MATERIAL, limit=1.0)
def _thinning(rng):
    """Dashpots thin with the velocity (Carreau); severity is the exponent."""
    corner = about(rng, 4.0)

    def act(s, q):
        return 1.0, (1 + (q.motion.v / corner) ** 2) ** (-s / 2)

    return act


@form("cyclic_degradation", MATERIAL, limit=0.6)
def _logarithm_of_travel(rng):
    """Softening with the logarithm of the path travelled."""
    start = about(rng, 60.0)
    return lambda s, q: 1 / (1 + s * np.log1p(travel(q.motion.x) / start))


@form("cyclic_degradation", MATERIAL, limit=0.8, heats=True)
def _damage_by_work(rng):
    """Stretched exponential of the energy dissipated, to a floor; severity is the share lost."""
    scale, power = about(rng, 1.5e4), about(rng, 0.7, 0.15)

    def act(s, q):
        work = np.maximum(integral(q.power, q.motion.step), 0.0)
        return 1 - s * (1 - np.exp(-((work / scale) ** power)))

    return act


@form("tension_compression_asymmetry", MATERIAL, limit=0.6)
def _stiffer_one_way(rng):
    """Parameters higher for positive deformation; severity is half the difference."""
    corner = about(rng, 1.5)
    return lambda s, q: 1 + s * np.tanh(q.motion.x / corner)


@form("tension_compression_asymmetry", MATERIAL, limit=1.0)
def _weaker_one_way(rng):
    """Stiffness alone falls with negative deformation, as a preloaded pad's."""
    corner = about(rng, 1.0)

    def act(s, q):
        pushed = (np.hypot(q.motion.x, corner) - q.motion.x) / 2
        return 1 / (1 + s * pushed / 8.0), 1.0

    return act
