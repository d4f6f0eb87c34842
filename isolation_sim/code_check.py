"""Checks of an isolated building by rules like ASCE 7-22, chapter 17; this is no certification."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions import STANDARD_GRAVITY

from .errors import wrong_choice
from .simulation.contact import stops
from .simulation.pieces import refined_displacements
from .structures import IsolatedStructure
from .structures.element import isolation_elements
from .structures.isolation_loop import effective, isolation_loop
from .structures.modes import translational_period
from .written_names import number_text

if TYPE_CHECKING:
    from ground_motions import Record

    from .simulation.result import Run

DAMPING_COEFFICIENT = {0.02: 0.8, 0.05: 1.0, 0.10: 1.2, 0.20: 1.5, 0.30: 1.7, 0.40: 1.9, 0.50: 2.0}
"""B_M by the effective damping (Table 17.5-1; equal to that of a public program for ASCE 7-16)."""
MOST_DAMPING, LONGEST_PERIOD, LEAST_LENGTHENING = 0.30, 5.0, 3.0
"""Limits of the equivalent lateral force procedure (17.4.1, from memory)."""
LEAST_RESTORING = 0.025
"""Least increase of the force from 0.5 D_M to D_M, as a share of the weight (17.2.4.4)."""
LEAST_OF_STATIC = {"displacement": 0.8, "shear": 0.9}
"""Least design values of a response history, as shares of the static estimate (17.6.4)."""
SLOW = 50.0
"""Period of the cycle for the restoring force, over the effective period."""
_INSTANTS, _PARTS = 8, 8

MEMORY = "clauses and limits from memory: look them up before use"


@dataclass(frozen=True)
class CheckSettings:
    """Settings of a check, in addition to the scenario."""

    # S_M1, spectral acceleration at 1 s of the maximum considered earthquake, m/s^2
    spectral_acceleration: float
    # upper, lower: Factors λ of the upper and lower bound properties: on the isolators' force, or
    # on some parameters of their law
    upper: float | Mapping[str, float] = 1.3
    lower: float | Mapping[str, float] = 0.85
    # Largest displacement of the isolators, m; by default the gap of a moat wall, or no limit
    capacity: float | None = None
    quiet: float = 20.0  # Time after the ground motion until the residual displacement is read, s


class Motions(NamedTuple):
    """Ground motions of a check; design values are their mean, or the largest of them."""

    records: Sequence[tuple[Record, ...]]  # Components of each motion
    mean: bool = False  # Whether there are as many as the code needs for a mean

    def together(self, values: Iterable[float]) -> float:
        """Response to design for, of that to each motion."""
        return float(np.mean([*values]) if self.mean else max(values))

    @property
    def text(self) -> str:
        """What a value is, behind its name; empty for a single motion."""
        n = len(self.records)
        return f", {'mean' if self.mean else 'largest'} of {n} motions" if n > 1 else ""


class EffectiveProperties(NamedTuple):
    """Equivalent linear isolation at its design displacement."""

    # ``D_M = S_M1 T_M / (4 pi^2 B_M)`` with S_M1 in m/s^2 and T_M in s, k_M = (F+ - F-) / (2 D_M)
    # and β_M = loop area / (2 pi k_M D_M^2).

    displacement: float  # D_M, m
    period: float  # T_M, s
    damping: float  # β_M, dimensionless
    stiffness: float  # k_M, N/m
    shear: float  # V_b = k_M D_M, N
    # Force at D_M minus force at 0.5 D_M in a slow cycle, over the weight, dimensionless
    restoring: float
    softening: float  # k_M over the effective stiffness at a fifth of D_M, dimensionless


DESIGN = "17.6.4.1"
"""Clause of the design values, from memory."""


class CheckRow(NamedTuple):
    """One line of the table."""

    # group, subject, case: Kind of check, checked quantity, and properties or failure
    group: str
    subject: str
    case: str
    clause: str  # Clause of the code; empty if the code does not require it
    # value, limit: With units; an empty limit means no limit
    value: str
    limit: str = ""
    passes: bool | None = None  # None without a requirement


def with_factors(
    isolated: IsolatedStructure, factors: float | Mapping[str, float], place: str = "factors"
) -> IsolatedStructure:
    """Multiply the isolators' force, or some of their parameters, by factors λ."""
    elements = list(isolated.elements)
    known: dict[str, None] = {}
    for e in isolation_elements(isolated):
        device = elements[e].device
        if isinstance(factors, Mapping):
            names = device.law.parameter_names
            known |= dict.fromkeys(names)
            row = np.array([factors.get(name, 1.0) for name in names])
            coefficients = device.current.coefficients * row[np.newaxis, :, np.newaxis]
            device = replace(device, current=replace(device.current, coefficients=coefficients))
        else:
            device = device.scaled(force=factors)
        elements[e] = replace(elements[e], device=device)
    if isinstance(factors, Mapping):
        for name in factors:
            if name not in known:
                raise wrong_choice(place, name, known)
    return replace(isolated, elements=tuple(elements))


def effective_properties(
    isolated: IsolatedStructure, spectral_acceleration: float, current: float = 0.0
) -> EffectiveProperties:
    """Effective properties at the displacement D_M, by iteration; S_M1 in m/s^2."""
    period, displacement = 2.0, 0.1
    earlier: tuple[float, float] | None = None
    for _ in range(100):
        stiffness, damping, period = effective(isolated, displacement, period, current)
        before = displacement
        target = spectral_acceleration * period / (4 * np.pi**2 * damping_coefficient(damping))
        if abs(target - before) < 1e-6 * target:
            break
        # secant on logarithms; half of the way where there is no slope that can be right
        here = float(np.log(before)), float(np.log(target / before))
        slope = 0.0
        if earlier is not None and here[0] != earlier[0]:
            slope = (earlier[1] - here[1]) / (here[0] - earlier[0])
        displacement *= float(np.exp(here[1] / (slope if 0.25 < slope < 4.0 else 2.0)))
        earlier = here
    # slow loading from the other side, since viscous forces do not recentre the base
    slow, at_rest = isolation_loop(isolated, before, SLOW * period, current)
    rising = slice(len(slow) // 2, None)
    half = np.interp(before / 2, slow[rising], at_rest[rising])
    weight = isolated.structure.isolated_mass * STANDARD_GRAVITY
    return EffectiveProperties(
        displacement=before, period=period, damping=damping, stiffness=stiffness,
        shear=stiffness * before, restoring=float(at_rest[-1] - half) / weight,
        softening=stiffness / effective(isolated, 0.2 * before, period, current).stiffness,
    )  # fmt: skip


def damping_coefficient(damping: float) -> float:
    """B_M, linearly between the table's dampings."""
    return float(np.interp(damping, [*DAMPING_COEFFICIENT], [*DAMPING_COEFFICIENT.values()]))


def check_building(
    isolated: IsolatedStructure,
    settings: CheckSettings,
    motions: Motions,
    simulate: Callable[..., Run],
    controllers: Mapping[str, Any],
) -> Iterator[CheckRow]:
    """Check an isolated building; ``simulate(plant, records, controller)`` returns a run."""
    bounds = {
        "lower bound": with_factors(isolated, settings.lower, "check.lower_factors"),
        "nominal": isolated,
        "upper bound": with_factors(isolated, settings.upper, "check.upper_factors"),
    }
    coils: dict[str, float] = {"": 0.0}
    if isolated.n_channels:
        low, high = isolated.current_range()
        coils = {", coil off": max(low, 0.0), ", coil on": min(high, isolated.tested_current())}
    estimates = {}
    for name, plant in bounds.items():
        for coil, current in coils.items():
            estimates[name + coil] = effective_properties(
                plant, settings.spectral_acceleration, current
            )
    for case, estimate in estimates.items():
        yield from _effective_rows(isolated, case, estimate)
    yield from _history_rows(bounds, estimates, settings, motions, simulate, controllers)
    if isolated.n_channels:
        yield from _failure_rows(isolated, settings, motions, simulate, controllers, coils)


def _force_text(force: float) -> str:
    return f"{number_text(1e-3 * force)} kN"


def _beside(value: float, limit: float, digits: int = 3) -> str:
    """A value with so many digits that it is seen on which side of its limit it is."""
    texts = (f"{value:.{count}g}" for count in range(digits, 17))
    return next((text for text in texts if np.sign(float(text) - limit) == np.sign(value - limit)),
                f"{value:.17g}")  # fmt: skip


def _effective_rows(
    isolated: IsolatedStructure, case: str, estimate: EffectiveProperties
) -> Iterator[CheckRow]:
    group = "Effective properties and equivalent lateral force"
    yield CheckRow(
        group, "design displacement D_M", case, "17.5.3.1", f"{1e3 * estimate.displacement:.4g} mm"
    )
    period = estimate.period
    yield CheckRow(
        group, "effective period T_M", case, "17.4.1", f"{_beside(period, LONGEST_PERIOD)} s",
        f"at most {LONGEST_PERIOD:g} s", period <= LONGEST_PERIOD,
    )  # fmt: skip
    if isolated.structure.superstructure:
        fixed = translational_period(isolated.fixed_base())
        yield CheckRow(
            group, "T_M over the fixed-base period", case, "17.4.1",
            _beside(period / fixed, LEAST_LENGTHENING),
            f"above {LEAST_LENGTHENING:g}", period / fixed > LEAST_LENGTHENING,
        )  # fmt: skip
    yield CheckRow(
        group, "effective damping", case, "17.4.1",
        f"{_beside(100 * estimate.damping, 100 * MOST_DAMPING)} %",
        f"at most {100 * MOST_DAMPING:g} %", estimate.damping <= MOST_DAMPING,
    )  # fmt: skip
    yield CheckRow(
        group, "k at D_M over k at 0.2 D_M", case, "17.4.1",
        _beside(estimate.softening, 1 / 3),
        "above 1/3", estimate.softening > 1 / 3,
    )  # fmt: skip
    yield CheckRow(
        group, "recentring: F(D_M) - F(D_M / 2), of the weight", case, "17.2.4.4",
        _beside(estimate.restoring, LEAST_RESTORING), f"at least {LEAST_RESTORING:g}",
        estimate.restoring >= LEAST_RESTORING,
    )  # fmt: skip
    yield CheckRow(group, "base shear V_b = k_M D_M", case, "17.5.4.1", _force_text(estimate.shear))


def _history_rows(
    bounds: Mapping[str, IsolatedStructure],
    estimates: Mapping[str, EffectiveProperties],
    settings: CheckSettings,
    motions: Motions,
    simulate: Callable[..., Run],
    controllers: Mapping[str, Any],
) -> Iterator[CheckRow]:
    group = f"Response history{motions.text}"
    least = {
        what: LEAST_OF_STATIC[what] * max(getattr(each, key) for each in estimates.values())
        for what, key in (("displacement", "displacement"), ("shear", "shear"))
    }
    padded = [
        tuple(record.padded(after=settings.quiet) for record in one) for one in motions.records
    ]
    for label, controller in controllers.items():
        peaks, shears, beyond, contacts = [], [], 0.0, 0
        for name, plant in bounds.items():
            case = f"{name}, {label}"
            of_motions, moves = [], False
            for records in padded:
                run = simulate(plant, records, controller)
                beyond = max(beyond, run.test_comparison.deformation_ratio)
                contacts += sum(run.contacts.values())
                moves = moves or run.end[0]
                shear = run.criteria["peak_base_shear_N"]
                of_motions.append((peak_displacement(run), shear, residual_displacement(run)))
            peak, shear, residual = map(motions.together, zip(*of_motions, strict=True))
            peaks.append(peak)
            shears.append(shear)
            yield CheckRow(
                group, "largest isolator displacement", case, "17.6.4", f"{1e3 * peak:.4g} mm"
            )
            yield CheckRow(group, "largest base shear", case, "17.6.4", _force_text(shear))
            yield CheckRow(
                group, f"residual displacement {settings.quiet:g} s after the motion", case, "",
                "not known: still moving" if moves else f"{1e3 * residual:.3g} mm",
            )  # fmt: skip
        needed = max(*peaks, least["displacement"])
        yield _against_capacity(
            group, "design displacement: the largest, at least 0.8 D_M", label, DESIGN,
            needed, settings.capacity,
        )  # fmt: skip
        yield CheckRow(
            group, "design shear: the largest, at least 0.9 V_b", label, DESIGN,
            _force_text(max(*shears, least["shear"])),
        )  # fmt: skip
        if beyond > 0:
            yield CheckRow(
                group, "deformation over that of the tests", label, "", _beside(beyond, 1.0),
                "at most 1", beyond <= 1,
            )  # fmt: skip
        if any(stops(plant) for plant in bounds.values()):
            yield CheckRow(
                group, "contacts with walls and stops", label, "", f"{contacts}", "0", not contacts
            )


def _failure_rows(
    isolated: IsolatedStructure,
    settings: CheckSettings,
    motions: Motions,
    simulate: Callable[..., Run],
    controllers: Mapping[str, Any],
    coils: Mapping[str, float],
) -> Iterator[CheckRow]:
    from .registry import controller as registered

    group, subject = f"Failure of the control{motions.text}", "largest isolator displacement"
    off, on = coils.values()
    for case, current in (("coil stuck off", off), ("coil stuck on", on)):
        stuck = registered("constant", amperes=current)
        peaks = [peak_displacement(simulate(isolated, one, stuck)) for one in motions.records]
        yield _against_capacity(
            group, subject, case, "", motions.together(peaks), settings.capacity
        )
    for label, controller in controllers.items():
        worst, varied = [], False
        for records in motions.records:
            run = simulate(isolated, records, controller)
            tried = [(peak_displacement(run), 0.0)]
            if np.ptp(run.history.command.values):
                varied, tried = True, []
                for lost in instants_of_large_motion(run):
                    replayed = registered("prescribed", **commands_until(run, lost, off))
                    tried.append((peak_displacement(simulate(isolated, records, replayed)), lost))
            # a motion without a peak has no instant
            worst.append(max(tried, key=lambda each: each[0], default=(0.0, 0.0)))
        if varied:
            largest, instants = zip(*worst, strict=True)
            at = f"{instants[0]:.3g} s" if len(instants) == 1 else "an instant of each motion"
            yield _against_capacity(
                group, subject, f"power lost at {at}, the worst of the instants tried, {label}",
                "", motions.together(largest), settings.capacity,
            )  # fmt: skip


def _against_capacity(
    group: str, subject: str, case: str, clause: str, value: float, capacity: float | None
) -> CheckRow:
    limit = "" if capacity is None else f"at most {1e3 * capacity:.4g} mm"
    passes = None if capacity is None else bool(value <= capacity)
    text = f"{1e3 * value:.4g}" if capacity is None else _beside(1e3 * value, 1e3 * capacity, 4)
    return CheckRow(group, subject, case, clause, f"{text} mm", limit, passes)


def base_motion(run: Run, parts: int = 1) -> NDArray:
    """Deformation of the isolators at every isolator or at the base, shape (n_times, n, 2 or 1)."""
    # parts: equal parts of a sampling interval
    structure = run.isolated.structure
    displacement = refined_displacements(run, parts)
    return np.einsum("ndk,tk->tnd", structure.isolation_rows, displacement)


def peak_displacement(run: Run) -> float:
    """Largest displacement of any isolator, in any direction, m."""
    return float(np.linalg.norm(base_motion(run, _PARTS), axis=2).max())


def residual_displacement(run: Run) -> float:
    """Mean displacement of the isolators at the end of a run, m."""
    # The mean is over the last quarter of the time without ground motion, or of the run without it.
    moving = np.flatnonzero(np.any([r.acceleration != 0 for r in run.records], axis=0))
    motion = base_motion(run)
    still = len(motion) - moving[-1] if moving.size else len(motion)
    last = motion[-max(still // 4, 1) :].mean(axis=0)
    return float(np.linalg.norm(last, axis=1).max())


def instants_of_large_motion(run: Run) -> NDArray:
    """Instants of the largest peaks of the isolators' displacement and speed, s."""
    motion = base_motion(run)[:, 0]
    speed = np.gradient(motion, run.time, axis=0)
    result = []
    for size in (np.linalg.norm(motion, axis=1), np.linalg.norm(speed, axis=1)):
        inner = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
        result.append(inner[np.argsort(size[inner])[::-1][:_INSTANTS]])
    return np.unique(run.time[np.concatenate(result)])


def commands_until(run: Run, lost: float, off: float) -> dict[str, tuple]:
    """Instants and currents of a run's commands up to an instant, and the off current after it."""
    # the commands as they acted: late by a computation delay, also between the record's samples
    begin = run.grid.segments[:-1, 0]
    time, command = run.grid.time[begin], run.work.command[begin, : run.isolated.n_channels, 0]
    # an instant of the grid may differ from the sample by rounding
    before = time < lost - 1e-6 * run.records[0].dt
    changed = before & np.any(np.diff(command, axis=0, prepend=np.nan) != 0, axis=1)
    rows = [*command[changed].tolist(), [off] * command.shape[1]]
    return {
        "time": (*time[changed].tolist(), float(lost)), "amperes": tuple(map(tuple, rows)),
    }  # fmt: skip
