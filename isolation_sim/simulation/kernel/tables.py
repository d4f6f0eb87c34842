"""Coefficients that propagate the modes over a step, for any number of elements."""

import numpy as np
from numba import njit

from ...compilation.options import OPTIONS, exact, inline
from .collocation import LAGRANGE, NODES_AND_END
from .shape import TABLE_LANES


@exact
def phi_functions(z, phi):
    """phi[k] = sum_n z**n / (n + k)!, the integrals of exp against powers, for k = 0..3."""
    if abs(z) < 1.0:
        term = 1.0 / 6.0 + 0.0j
        total = term
        for n in range(1, 21):
            term = term * z
            # by parts: a division by a complex number takes several times as long
            term = complex(term.real / (n + 3), term.imag / (n + 3))
            total += term
            # all further terms are rounded off
            if abs(term.real) + abs(term.imag) < 5e-17 * min(abs(total.real), abs(total.imag)):
                break
        phi[3] = total
        phi[2] = 0.5 + z * phi[3]
        phi[1] = 1.0 + z * phi[2]
        phi[0] = 1.0 + z * phi[1]
    else:
        phi[0] = np.exp(z)
        phi[1] = (phi[0] - 1.0) / z
        phi[2] = (phi[1] - 1.0) / z
        phi[3] = (phi[2] - 0.5) / z


@exact
def powers(eigenvalue, span, h, integral, phi):
    """integral[p] = int_0^span exp(eigenvalue (span - t)) (t / h)**p dt."""
    phi_functions(eigenvalue * span, phi)
    ratio = span / h
    integral[0] = span * phi[1]
    integral[1] = span * ratio * phi[2]
    integral[2] = 2.0 * span * ratio * ratio * phi[3]


@njit(cache=True, **OPTIONS)
def build_table(h, n_sub, lane, sizes, modes, table, offset, phi, integral):
    """Fill the coefficients of one step length that spans n_sub grid intervals, for one lane.

    modes: [eigenvalues | rows d, v an element | columns a ground direction | columns an element].
    table, from offset, see ``layout``: free rows, ground rows, force rows, decay, ground columns,
    force columns.
    """
    n_modes, n_pad, n_elements, n_ground = sizes
    ground_rows, force_rows, decay, ground_columns, force_columns = layout(sizes, n_sub)
    first_ground = n_modes * (1 + 2 * n_elements)
    first_force = first_ground + n_modes * n_ground
    delta = h / n_sub
    for k in range(ground_rows, decay):
        table[(offset + k) * TABLE_LANES + lane] = 0.0
    for m in range(n_modes):
        value = modes[m, lane]
        for node in range(4):
            end = h * NODES_AND_END[node]
            powers(value, end, h, integral, phi)
            for rate in range(2):
                r = 3 * rate + node if node < 3 else 6 + rate
                for e in range(n_elements):
                    row = modes[n_modes * (1 + 2 * e + rate) + m, lane]
                    at = offset + (e * 2 * n_modes + m) * 8 + r
                    table[at * TABLE_LANES + lane] = (row * phi[0]).real
                    table[(at + 8 * n_modes) * TABLE_LANES + lane] = -(row * phi[0]).imag
                    for other in range(n_elements):
                        column = row * modes[first_force + n_modes * other + m, lane]
                        for k in range(3):
                            at = offset + force_rows + ((e * n_elements + other) * 3 + k) * 8 + r
                            table[at * TABLE_LANES + lane] += (
                                column
                                * (
                                    LAGRANGE[k][0] * integral[0]
                                    + LAGRANGE[k][1] * integral[1]
                                    + LAGRANGE[k][2] * integral[2]
                                )
                            ).real
            # the ground is linear in each grid interval that begins before this time
            for i in range(n_sub):
                start = i * delta
                if start >= end:
                    break
                stop = min(start + delta, end)
                powers(value, stop - start, delta, integral, phi)
                decayed = np.exp(value * (end - stop))
                for rate in range(2):
                    r = 3 * rate + node if node < 3 else 6 + rate
                    for e in range(n_elements):
                        row = modes[n_modes * (1 + 2 * e + rate) + m, lane] * decayed
                        for g in range(n_ground):
                            column = row * modes[first_ground + n_modes * g + m, lane]
                            at = (
                                offset
                                + ground_rows
                                + ((e * n_ground + g) * (n_sub + 1) + i) * 8
                                + r
                            )
                            low, high = integral[0] - integral[1], integral[1]
                            table[at * TABLE_LANES + lane] += (column * low).real
                            table[(at + 8) * TABLE_LANES + lane] += (column * high).real
        powers(value, delta, delta, integral, phi)
        table[(offset + decay + m) * TABLE_LANES + lane] = phi[0].real
        table[(offset + decay + n_pad + m) * TABLE_LANES + lane] = phi[0].imag
        for g in range(n_ground):
            column = modes[first_ground + n_modes * g + m, lane]
            at = offset + ground_columns + 2 * g * 2 * n_pad + m
            for k in range(2):
                weight = column * (integral[1] if k == 1 else integral[0] - integral[1])
                table[(at + k * 2 * n_pad) * TABLE_LANES + lane] = weight.real
                table[(at + (2 * k + 1) * n_pad) * TABLE_LANES + lane] = weight.imag
        for i in range(n_sub):
            # the force polynomial's powers of t/h, on the interval from i delta to (i + 1) delta
            a, b = i * delta / h, delta / h
            for e in range(n_elements):
                column = modes[first_force + n_modes * e + m, lane]
                for k in range(3):
                    c0, c1, c2 = LAGRANGE[k][0], LAGRANGE[k][1], LAGRANGE[k][2]
                    weight = column * (
                        (c0 + c1 * a + c2 * a * a) * integral[0]
                        + (c1 + 2.0 * c2 * a) * b * integral[1]
                        + c2 * b * b * integral[2]
                    )
                    at = offset + force_columns + ((i * n_elements + e) * 3 + k) * 2 * n_pad + m
                    table[at * TABLE_LANES + lane] = weight.real
                    table[(at + n_pad) * TABLE_LANES + lane] = weight.imag


@inline
def layout(sizes, n_sub):
    """Offsets of a table's parts: ground rows, force rows, decay, ground columns, force columns."""
    n_modes, n_pad, n_elements, n_ground = sizes
    ground_rows = n_elements * 2 * n_modes * 8
    force_rows = ground_rows + n_elements * n_ground * (n_sub + 1) * 8
    decay = force_rows + n_elements * n_elements * 3 * 8
    ground_columns = decay + 2 * n_pad
    return (
        ground_rows,
        force_rows,
        decay,
        ground_columns,
        ground_columns + 2 * n_ground * 2 * n_pad,
    )
