"""The predicted response over a horizon and its derivatives by the commands, for Numba.

``prediction.py`` puts this text together with the laws' and compiles it. The modes are carried
exactly; each device's force beyond its reference spring is held over a substep, then corrected to a
line from a second evaluation at its end (exponential Heun), and device states follow by Heun's
rule. The derivatives are those of exactly this recursion.
"""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import NDArray


def motion_of(rows: NDArray, z: NDArray, n_modes: int) -> float:
    """Output of the modes: rows over real parts, then imaginary ones."""
    total = 0.0
    for m in range(2 * n_modes):
        total += rows[m] * z[m]
    return total


def carry(decay: NDArray, z: NDArray, out: NDArray, n_modes: int) -> None:
    """Propagate the modes, real parts then imaginary ones."""
    for m in range(n_modes):
        re, im = decay[0, m], decay[1, m]
        out[m] = re * z[m] - im * z[n_modes + m]
        out[n_modes + m] = im * z[m] + re * z[n_modes + m]


def carry_all(decay: NDArray, z: NDArray, out: NDArray, n_modes: int, width: int) -> None:
    """The same for many columns."""
    for m in range(n_modes):
        re, im = decay[0, m], decay[1, m]
        for j in range(width):
            out[m, j] = re * z[m, j] - im * z[n_modes + m, j]
            out[n_modes + m, j] = im * z[m, j] + re * z[n_modes + m, j]


def device_now(
    e: int, z: NDArray, s: NDArray, i: NDArray, plant: tuple, side: NDArray, device_side: Callable
) -> tuple[float, float]:
    """Evaluate one device's law."""
    decay, _, _, _, rows, _, channels, numbers, _, _, _, _ = plant
    n_modes, c = decay.shape[1], int(channels[e])
    x, v = motion_of(rows[e, 0], z, n_modes), motion_of(rows[e, 1], z, n_modes)
    device_side(x, v, s[e], i[c] if c >= 0 else 0.0, numbers[e], side)
    return x, v


def devices(
    z: NDArray, dz: NDArray, s: NDArray, ds: NDArray, i: NDArray, di: NDArray, plant: tuple,
    force: NDArray, dforce: NDArray, rate: NDArray, drate: NDArray, side: NDArray, width: int,
    device_side: Callable,
) -> None:  # fmt: skip
    """Forces beyond reference and state rates of all devices, with their derivatives."""
    decay, held, _, _, rows, reference, channels, _, force_scales, _, _, _ = plant
    n_modes, n_states = decay.shape[1], s.shape[1]
    for e in range(held.shape[0]):
        c = int(channels[e])
        x, v = device_now(e, z, s, i, plant, side, device_side)
        stride = n_states + 4
        for q in range(stride):
            side[q] *= force_scales[e]
        force[e] = side[0] - reference[e, 0] * x - reference[e, 1] * v
        for k in range(n_states):
            rate[e, k] = side[(k + 1) * stride]
        for k in range(n_states + 1):
            at = k * stride
            by_x, by_v, by_i = side[at + 1], side[at + 2], side[at + 3]
            if k == 0:
                by_x -= reference[e, 0]
                by_v -= reference[e, 1]
            if width == 0:
                continue
            target = dforce[e] if k == 0 else drate[e, k - 1]
            for j in range(width):
                target[j] = by_i * di[c, j] if c >= 0 else 0.0
            for m in range(2 * n_modes):
                weight = by_x * rows[e, 0, m] + by_v * rows[e, 1, m]
                for j in range(width):
                    target[j] += weight * dz[m, j]
            for q in range(n_states):
                weight = side[at + 4 + q]
                for j in range(width):
                    target[j] += weight * ds[e, q, j]


def observe(
    on_modes: NDArray, on_force: NDArray, z: NDArray, dz: NDArray, force: NDArray,
    dforce: NDArray, y: NDArray, dy: NDArray, width: int,
) -> None:  # fmt: skip
    """Outputs of one instant, (n_outputs,), and their derivatives, from modes and forces."""
    n_modes = len(z) // 2
    for o in range(on_modes.shape[0]):
        value = motion_of(on_modes[o], z, n_modes)
        for e in range(len(force)):
            value += on_force[o, e] * force[e]
        y[o] = value
        for j in range(width):
            dy[o, j] = 0.0
        for m in range(2 * n_modes):
            weight = on_modes[o, m]
            if weight != 0.0:
                for j in range(width):
                    dy[o, j] += weight * dz[m, j]
        for e in range(len(force)):
            weight = on_force[o, e]
            if weight != 0.0:
                for j in range(width):
                    dy[o, j] += weight * dforce[e, j]


def outputs_now(
    z: NDArray, s: NDArray, i: NDArray, plant: tuple, work: tuple, y: NDArray,
    device_side: Callable,
) -> None:  # fmt: skip
    """Outputs of one instant."""
    on_modes, on_force = plant[10], plant[11]
    values, derivatives, side = work
    force, rate = values[6], values[8]
    dz, ds, di, dforce, drate = (
        derivatives[0], derivatives[2], derivatives[4], derivatives[6], derivatives[8]
    )  # fmt: skip
    devices(z, dz, s, ds, i, di, plant, force, dforce, rate, drate, side, 0, device_side)
    observe(on_modes, on_force, z, dz, force, dforce, y, dz, 0)


def begin(z: NDArray, s: NDArray, i: NDArray, values: tuple, derivatives: tuple) -> None:
    """Put the first instant where a step begins."""
    # element by element: the compiler takes seconds for an array assigned to an array
    for m in range(len(z)):
        values[0][m] = z[m]
    for e in range(s.shape[0]):
        for q in range(s.shape[1]):
            values[2][e, q] = s[e, q]
    for c in range(len(i)):
        values[4][c] = i[c]
    # at both ends of a step: a new block must not use values of the last call
    derivatives[0][:] = 0.0
    derivatives[1][:] = 0.0
    derivatives[2][:] = 0.0
    derivatives[3][:] = 0.0
    derivatives[4][:] = 0.0
    derivatives[5][:] = 0.0


def keep_currents(i: NDArray, di: NDArray, past: NDArray) -> None:
    """Keep the currents at a step's start, behind their derivatives."""
    everything = past.shape[1] - 1
    for c in range(len(i)):
        for j in range(everything):
            past[c, j] = di[c, j]
        past[c, everything] = i[c]


def obey(
    i: NDArray, di: NDArray, command: NDArray, coil_decay: NDArray, now: int, width: int
) -> None:
    """Set the currents of coils without lag to their command."""
    n_channels = len(i)
    for c in range(n_channels):
        if coil_decay[c, 0] == 0.0:
            i[c] = command[c]
            for j in range(width):
                di[c, j] = 0.0
            if width > 0:
                di[c, now * n_channels + c] = 1.0


def hold(
    ground: NDArray, at: int, command: NDArray, now: int, width: int, plant: tuple, values: tuple,
    derivatives: tuple,
) -> None:  # fmt: skip
    """Advance a substep with the forces and state rates of its start."""
    decay, held, _, moved, _, _, _, _, _, coil_decay, _, _ = plant
    za, zb, sa, sb, ia, ib, f, _, r, _ = values
    dza, dzb, dsa, dsb, dia, dib, df, _, dr, _ = derivatives
    n_modes, n_channels, h = decay.shape[1], len(ia), coil_decay[0, 2]
    carry(decay, za, zb, n_modes)
    carry_all(decay, dza, dzb, n_modes, width)
    for m in range(2 * n_modes):
        for e in range(held.shape[0]):
            weight = held[e, m]
            zb[m] += weight * f[e]
            for j in range(width):
                dzb[m, j] += weight * df[e, j]
        for d in range(ground.shape[0]):
            zb[m] += moved[d, 0, m] * ground[d, at]
            zb[m] += moved[d, 1, m] * ground[d, at + 1]
    for c in range(n_channels):
        factor = coil_decay[c, 0]
        ib[c] = command[c] + factor * (ia[c] - command[c])
        for j in range(width):
            dib[c, j] = factor * dia[c, j]
        if width > 0:
            dib[c, now * n_channels + c] += 1.0 - factor
    for e in range(sa.shape[0]):
        for q in range(sa.shape[1]):
            sb[e, q] = sa[e, q] + h * r[e, q]
            for j in range(width):
                dsb[e, q, j] = dsa[e, q, j] + h * dr[e, q, j]


def correct(width: int, plant: tuple, values: tuple, derivatives: tuple) -> None:
    """Correct a substep by the forces and rates at its end, and begin the next one there."""
    sloped, coil_decay = plant[2], plant[9]
    h = coil_decay[0, 2]
    za, zb, sa, sb, ia, ib, f0, f1, r0, r1 = values
    dza, dzb, dsa, dsb, dia, dib, df0, df1, dr0, dr1 = derivatives
    n_states = sa.shape[1]
    for e in range(sa.shape[0]):
        f1[e] -= f0[e]
        for j in range(width):
            df1[e, j] -= df0[e, j]
        for m in range(len(za)):
            weight = sloped[e, m]
            zb[m] += weight * f1[e]
            for j in range(width):
                dzb[m, j] += weight * df1[e, j]
        for q in range(n_states):
            sa[e, q] = sb[e, q] + 0.5 * h * (r1[e, q] - r0[e, q])
            for j in range(width):
                dsa[e, q, j] = dsb[e, q, j] + 0.5 * h * (dr1[e, q, j] - dr0[e, q, j])
    for m in range(len(za)):
        za[m] = zb[m]
        for j in range(width):
            dza[m, j] = dzb[m, j]
    for c in range(len(ia)):
        ia[c] = ib[c]
        for j in range(width):
            dia[c, j] = dib[c, j]


def predict(
    n_steps: int, z: NDArray, s: NDArray, i: NDArray, commands: NDArray, block: NDArray,
    ground: NDArray, first: int, plant: tuple, work: tuple, results: tuple, device_side: Callable,
) -> None:  # fmt: skip
    """Predict outputs over the horizon and differentiate them by the blocks of commands, if any."""
    # ground: (n_directions, more than first + n_steps * n_sub), at the substeps' ends
    _, _, _, _, _, _, _, _, _, coil_decay, on_modes, on_force = plant
    y, dy, past, y_before, dy_before = results
    values, derivatives, side = work
    za, zb, sa, sb, ia, ib, f0, f1, r0, r1 = values
    dza, dzb, dsa, dsb, dia, dib, df0, df1, dr0, dr1 = derivatives
    n_channels, n_sub = len(i), int(coil_decay[0, 1])
    begin(z, s, i, values, derivatives)
    for k in range(n_steps + 1):
        last = min(k, n_steps - 1)
        # later blocks have no effect yet
        now = int(block[last]) if len(block) > 0 else -1
        width = (now + 1) * n_channels
        if y_before.shape[0] > 0:
            devices(za, dza, sa, dsa, ia, dia, plant, f0, df0, r0, dr0, side, width, device_side)
            observe(on_modes, on_force, za, dza, f0, df0, y_before[k], dy_before[k], width)
        if k < n_steps and past.shape[0] > 0:
            keep_currents(ia, dia, past[k])
        obey(ia, dia, commands[last], coil_decay, now, width)
        for sub in range(n_sub):
            devices(za, dza, sa, dsa, ia, dia, plant, f0, df0, r0, dr0, side, width, device_side)
            if sub == 0:
                observe(on_modes, on_force, za, dza, f0, df0, y[k], dy[k], width)
                if k == n_steps:
                    return
            at = first + k * n_sub + sub
            hold(ground, at, commands[k], now, width, plant, values, derivatives)
            devices(zb, dzb, sb, dsb, ib, dib, plant, f1, df1, r1, dr1, side, width, device_side)
            correct(width, plant, values, derivatives)
