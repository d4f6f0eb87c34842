"""Linear structures, and structures with nonlinear elements, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.old_names import renamed_attribute

from ..errors import InputError, unknown_name
from ..laws.current_dependence import CurrentDependence
from ..laws.device import Device
from ..laws.law import Law
from ..laws.linear import LAW as LINEAR
from .checks import check_matrices, matrix, read_only
from .element import (
    Element,
    check_devices,
    common_current_range,
    common_tested_current,
    group_by_device,
    law_of_device,
)
from .isolation_loop import Effective, effective_at
from .isolators import add_isolators, base_rows, isolator_rows, plan_dofs
from .modes import ModalFacts, facts, modal_facts, undamped_modes
from .sizing import Sizing


@checked
@dataclass(frozen=True, eq=False)
class Structure:
    """Linear structure M q'' + C q' + K q = -M r a_g, with q relative to the ground.

    ``on`` and ``with_element`` add isolators and other nonlinear elements. Without them the base is
    free.

    Attributes
    ----------
    mass : numpy.ndarray, shape (n, n), kg
        Symmetric, positive definite.
    damping : numpy.ndarray, shape (n, n), N s/m
        Viscous damping.
    stiffness : numpy.ndarray, shape (n, n), N/m
        Stiffness.
    influence : numpy.ndarray, shape (n, n_directions)
        Displacement of the dofs per unit displacement of the ground; one column per direction of
        ground motion.
    base : tuple of int
        Dofs of the isolated base; empty for a structure fixed to the ground.
    names : tuple of str
        Dofs.
    drift_rows : numpy.ndarray, shape (n_storeys, n)
        ``drift_rows @ q`` are the storey drifts.
    storeys : tuple of str
        Storeys, one per drift row.
    directions : tuple of str
        Directions of ground motion, one per column of ``influence``.
    heights : numpy.ndarray or None, shape (n_storeys,), m
        Storey heights, one per drift row; None if unknown.
    isolator_positions : numpy.ndarray or None, shape (n_isolators, 2), m
        Plan positions x, y of the isolators, from the point of the slab to which the base's dofs
        refer; None if unknown.
    foundation : tuple of int
        Dofs of a foundation on soil, below the isolators; see `on_soil`.
    vertical : tuple of int
        Dof of the vertical motion of the whole building; its direction is the last one. See
        `with_vertical_motion`.
    p_delta : float, N/m
        Negative stiffness of each isolator by the weight on it, contained in ``stiffness``; see
        `with_p_delta`.
    name : str
        Name to print.

    Raises
    ------
    InputError
        If shapes disagree, a number is not finite, the mass is not positive definite, or isolator
        positions are given for a base other than one slab that moves along x and y and rotates.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    influence: np.ndarray
    base: tuple[int, ...]
    names: tuple[str, ...]
    drift_rows: np.ndarray
    storeys: tuple[str, ...]
    directions: tuple[str, ...] = ("x",)
    heights: np.ndarray | None = None
    isolator_positions: np.ndarray | None = None
    foundation: tuple[int, ...] = ()
    vertical: tuple[int, ...] = ()
    p_delta: float = 0.0
    name: str = "structure"

    def __post_init__(self) -> None:
        def put(field: str, value: Any) -> None:
            object.__setattr__(self, field, value)

        put("names", tuple(self.names))
        put("storeys", tuple(self.storeys))
        put("directions", tuple(self.directions))
        n = len(self.names)
        for field in ("mass", "damping", "stiffness"):
            put(field, matrix(field, getattr(self, field), (n, n)))
        put("influence", matrix("influence", self.influence, (n, len(self.directions))))
        put("drift_rows", matrix("drift_rows", self.drift_rows, (len(self.storeys), n)))
        if self.heights is not None:
            put("heights", matrix("heights", self.heights, (len(self.storeys),)))
            if np.any(self.heights <= 0):
                raise InputError("heights", f"{self.heights.tolist()} m", "above zero")
        put("base", tuple(int(i) for i in self.base))
        check_matrices(self.mass, self.stiffness, self.names)
        if len(set(self.base)) < len(self.base) or not all(0 <= i < n for i in self.base):
            raise InputError("base", f"{self.base}", f"different dofs, 0 to {n - 1}")
        for what in ("names", "storeys", "directions"):
            values = getattr(self, what)
            if len(set(values)) < len(values):
                raise InputError(f"{what} of {self.name} contain a name twice: {', '.join(values)}")
        if self.isolator_positions is not None:
            places = np.asarray(self.isolator_positions)
            put("isolator_positions", matrix("isolator_positions", places, (len(places), 2)))
            self.plan_dofs()

    @property
    def n_dofs(self) -> int:
        """Number of degrees of freedom."""
        return len(self.names)

    @property
    def superstructure(self) -> tuple[int, ...]:
        """Dofs above the base."""
        below = {*self.base, *self.foundation, *self.vertical}
        return tuple(i for i in range(self.n_dofs) if i not in below)

    @property
    def horizontal(self) -> tuple[str, ...]:
        """Horizontal directions of ground motion."""
        return self.directions[: len(self.directions) - len(self.vertical)]

    @property
    def above_foundation(self) -> np.ndarray:
        """Horizontal influence of the structure above the isolators, shape (n, n_directions)."""
        result = self.influence.copy()
        result[[*self.foundation, *self.vertical]] = 0.0
        return result

    @property
    def total_mass(self) -> float:
        """Mass that moves with the ground in the first direction, kg."""
        return float(self.influence[:, 0] @ self.mass @ self.influence[:, 0])

    @property
    def isolated_mass(self) -> float:
        """Mass above the isolators that moves with the ground in the first direction, kg."""
        carried = self.above_foundation[:, 0]
        return float(carried @ self.mass @ carried)

    @property
    def isolator_rows(self) -> np.ndarray:
        """Rows for the displacements of the isolators along x and y: ``rows @ q``.

        A small rotation of the slab, positive from x to y, displaces its point (x, y) by -y and x
        times the angle.

        Returns
        -------
        numpy.ndarray, shape (n_isolators, 2, n)
            Empty if ``isolator_positions`` are unknown.
        """
        if self.isolator_positions is None:
            return np.zeros((0, 2, self.n_dofs))
        return isolator_rows(self)

    @property
    def isolation_rows(self) -> np.ndarray:
        """Rows for the displacements above the isolators, with known or unknown positions.

        Returns
        -------
        numpy.ndarray, shape (n_isolators, n_horizontal, n)
            Rows of `isolator_rows`; without positions, rows of one isolator at the base's dofs.
        """
        return base_rows(self) if self.isolator_positions is None else self.isolator_rows

    def plan_dofs(self) -> tuple[int, int, int]:
        """Dofs of the base along x, along y and in rotation."""
        return plan_dofs(self)

    def base_shear_rows(self, above_base: bool = True) -> np.ndarray:
        """Rows for the base shear from absolute accelerations.

        Parameters
        ----------
        above_base : bool, default True
            True for the shear between superstructure and base; False for the shear between the
            base and the isolators.

        Returns
        -------
        numpy.ndarray, shape (n_directions, n), kg
            Base shear in N = -rows @ (q'' + influence @ a_g): the sum of the inertia forces.
        """
        moving = self.above_foundation
        if above_base:
            moving[list(self.base)] = 0.0
        return moving.T @ self.mass

    def fixed_base_modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Undamped modes of the superstructure on a fixed base.

        Returns
        -------
        frequencies : numpy.ndarray, shape (n_modes,), rad/s
            Increasing.
        shapes : numpy.ndarray, shape (n, n_modes), 1/sqrt(kg)
            Columns with unit modal mass; zero at the base.

        Raises
        ------
        InputError
            If the superstructure is not held by its stiffness.
        """
        free = np.ix_(self.superstructure, self.superstructure)
        frequencies, inner = undamped_modes(self.mass[free], self.stiffness[free])
        shapes = np.zeros((self.n_dofs, frequencies.size))
        shapes[list(self.superstructure)] = inner
        return frequencies, shapes

    def fixed_base_periods(self) -> np.ndarray:
        """Periods of the superstructure on a fixed base.

        Returns
        -------
        numpy.ndarray, shape (n_modes,), s
            Decreasing.

        Raises
        ------
        InputError
            If the superstructure is not held by its stiffness.
        """
        return 2 * np.pi / self.fixed_base_modes()[0]

    def fixed_base(self) -> Structure:
        """Superstructure on a fixed base: the building without isolation.

        Returns
        -------
        Structure
            Without base dofs, and without the foundation on soil: the ground is rigid.
        """
        above = list(self.superstructure)
        block = np.ix_(above, above)
        return replace(
            self,
            mass=self.mass[block],
            damping=self.damping[block],
            stiffness=self.stiffness[block],
            influence=self.influence[above],
            base=(),
            foundation=(),
            vertical=(),
            p_delta=0.0,
            isolator_positions=None,
            names=tuple(self.names[i] for i in above),
            drift_rows=self.drift_rows[:, above],
            name=f"{self.name}, fixed base",
        )

    def __repr__(self) -> str:
        return f"Structure({self.name}, {self.n_dofs} dofs, {1e-3 * self.total_mass:.5g} t)"

    def direction_row(self, direction: str | Sequence[float] | np.ndarray) -> np.ndarray:
        """Row b for the deformation b @ q of an element.

        Parameters
        ----------
        direction : str or sequence of float, shape (n,)
            Name of a storey (its drift) or of a dof (its displacement relative to the ground), or
            the row itself.

        Returns
        -------
        numpy.ndarray, shape (n,)

        Raises
        ------
        InputError
            If the name is unknown, or the row has another shape, is zero or not finite.
        """
        if isinstance(direction, str):
            if direction in self.storeys:
                return self.drift_rows[self.storeys.index(direction)]
            if direction in self.names:
                return read_only(np.eye(self.n_dofs)[self.names.index(direction)])
            raise unknown_name("storey or dof", direction, [*self.storeys, *self.names])
        row = matrix("direction of an element", direction, (self.n_dofs,))
        if not np.any(row):
            raise InputError("direction of an element is zero; expected: a number that is not 0")
        return row

    @checked
    def on(
        self,
        device: Device,
        count: float = 1,
        *,
        target_period_s: float | None = None,
        effective_period_s: float | None = None,
        design_displacement_m: float | None = None,
        damping: float | None = None,
        biaxial: bool = False,
        load_changes: np.ndarray | None = None,
    ) -> IsolatedStructure:
        """Put the structure on isolators between the ground and the base.

        Parameters
        ----------
        device : Device
            The isolator. It represents all isolators; the device's scale contains their number.
            With several directions of ground motion there is one per direction, on the same coil
            channel.
        count : float, default 1
            Number of parallel devices; not together with a period.
        target_period_s : float, optional, s
            Period of the first mode for small vibrations, at the middle of the tested currents.
            The device's force is scaled to this period.
        effective_period_s : float, optional, s
            Instead, the period of the mass above the isolators on their effective stiffness at
            the design displacement, at the middle of the tested currents (ASCE 7-22, 17.2.8).
        design_displacement_m : float, optional, m
            Deformation of the isolators at the largest tested deformation of the device. By
            default 0.04 m per second of the target period, if the device is not scaled yet (80 mm
            at 2 s, as for the reference isolators). The effective period needs it.
        damping : float, optional, dimensionless
            Damping ratio of the first mode, or with an effective period the effective damping at
            the design displacement; a linear dashpot parallel to the isolators adds the difference.
        biaxial : bool, default False
            Whether the directions are coupled, by the law's in-plan form. With known isolator
            positions there is one device at each, with equal shares.
        load_changes : numpy.ndarray, shape (n_isolators, n), optional, 1/m
            Rows for the change of each biaxial device's vertical load over its mean, from
            `load_change_rows`; the law needs a form with axial load.

        Returns
        -------
        IsolatedStructure

        Raises
        ------
        InputError
            If an argument has a wrong type, a number cannot be used or attained, or the structure
            has no base; with ``biaxial`` also if it does not have two directions.
        """
        if not self.base:
            raise InputError(f"{self.name} has no base; expected: a base, for the isolators")
        sizing = Sizing(target_period_s, effective_period_s, design_displacement_m, damping)
        if sizing.gives_period(*(["count"] if count != 1 else [])):
            device = sizing.scale(self, device, biaxial)
        isolated = add_isolators(
            IsolatedStructure(self, ()), device.scaled(force=count), biaxial, load_changes
        )
        return sizing.add_dashpots(isolated, device, "damping")

    @checked
    def with_element(
        self,
        device: Device,
        direction: str | Sequence[float] | np.ndarray,
        channel: int | None = None,
        name: str = "",
    ) -> IsolatedStructure:
        """Add a nonlinear element; see ``IsolatedStructure.with_element``.

        Parameters
        ----------
        device : Device
            Its law and numbers.
        direction : str or sequence of float, shape (n,)
            See ``direction_row``.
        channel : int, optional
            Coil channel.
        name : str, optional
            Name to print.

        Returns
        -------
        IsolatedStructure

        Raises
        ------
        InputError
            If the direction, channel or name cannot be used.
        """
        return IsolatedStructure(self, ()).with_element(device, direction, channel, name)


def _no_force() -> Device:
    """Return a spring without stiffness."""
    return Device(LINEAR, CurrentDependence.polynomial({"k": 0.0}, ("k",)))


@checked
@dataclass(frozen=True, eq=False)
class IsolatedStructure:
    """Structure with nonlinear elements: M q'' + C q' + K q = -M r a_g - sum b_i F_i.

    Attributes
    ----------
    structure : Structure
        The linear part.
    elements : tuple of Element
        The nonlinear part.

    Raises
    ------
    InputError
        If a direction does not fit the structure, a name is used twice, or a channel is missing.
    """

    structure: Structure
    elements: tuple[Element, ...]

    def __post_init__(self) -> None:
        elements = tuple(
            replace(element, direction=self.structure.direction_row(element.direction))
            for element in self.elements
        )
        object.__setattr__(self, "elements", elements)
        names = self.element_names
        if len(set(names)) < len(names):
            raise InputError(f"two elements of {self.structure.name} share a name: {names}")
        check_devices(elements)
        used = sorted({e.channel for e in elements if e.channel is not None})
        if used != list(range(len(used))):
            raise InputError("coil channels", f"{used}", "0, 1, 2 without gaps")

    def __reduce__(self) -> tuple:
        """Pickle the parts: a law in plan, which may have no name, is derived from them again."""
        return type(self), (self.structure, self.elements)

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the elements of each device: one, or one per direction."""
        return group_by_device(self.elements)

    @cached_property
    def group_laws(self) -> tuple[Law, ...]:
        """Law of each device, for the number of directions of its elements."""
        return tuple(law_of_device([self.elements[e] for e in group]) for group in self.groups)

    @property
    def device_names(self) -> tuple[str, ...]:
        """Names of the devices; one in plan has several elements."""
        # ``with_biaxial`` ends the names of the elements in _x and _y
        return tuple(
            self.elements[e].name.removesuffix("_x" if others else "") for e, *others in self.groups
        )

    @property
    def element_names(self) -> tuple[str, ...]:
        """Names of the elements."""
        return tuple(element.name for element in self.elements)

    @property
    def n_channels(self) -> int:
        """Number of coil channels."""
        return len({element.channel for element in self.elements} - {None})

    @property
    def element_rows(self) -> np.ndarray:
        """Deformation of each element per unit of each displacement, shape (n_elements, n)."""
        rows = [element.direction for element in self.elements]
        return np.array(rows).reshape(len(rows), self.structure.n_dofs)

    @property
    def control_devices(self) -> np.ndarray:
        """Whether each element is a control device, shape (n_elements,) of bool.

        These are the elements with a coil; without any coil, all elements between structure and
        ground.
        """
        driven = np.array([element.channel is not None for element in self.elements], dtype=bool)
        return driven if driven.any() else np.any(self.holding, axis=1)

    @property
    def holding(self) -> np.ndarray:
        """Deformation of each element per unit rigid displacement of structure over foundation.

        Shape (n_elements, n_directions); zero for an element inside the structure.
        """
        return self.element_rows @ self.structure.above_foundation

    def current_range(self, channel: int = 0) -> tuple[float, float]:
        """Currents that are valid for every device on a channel.

        Parameters
        ----------
        channel : int, default 0
            Coil channel.

        Returns
        -------
        tuple of float, A
            Lowest and highest current.

        Raises
        ------
        InputError
            If no element is on the channel, or its devices have no current in common.
        """
        return common_current_range(self.elements, channel)

    def tested_current(self, channel: int = 0) -> float:
        """Highest tested current of the devices on a channel: the smallest over the devices.

        Parameters
        ----------
        channel : int, default 0
            Coil channel.

        Returns
        -------
        float, A
            inf if it is unknown for all devices.
        """
        return common_tested_current(self.elements, channel)

    def element(self, name: str) -> Element:
        """Return an element by name.

        Parameters
        ----------
        name : str
            Its name.

        Returns
        -------
        Element

        Raises
        ------
        InputError
            If there is no such element.
        """
        for element in self.elements:
            if element.name == name:
                return element
        raise unknown_name("element", name, self.element_names)

    @checked
    def with_element(
        self,
        device: Device,
        direction: str | Sequence[float] | np.ndarray,
        channel: int | None = None,
        name: str = "",
    ) -> IsolatedStructure:
        """Return the structure with one more nonlinear element.

        Parameters
        ----------
        device : Device
            Its law, numbers and scale.
        direction : str or sequence of float, shape (n,)
            Name of a storey (element between its floors) or of a dof (element between it and the
            ground), or the row of the element's deformation over the displacements.
        channel : int, optional
            Coil channel; none by default.
        name : str, optional
            Name to print; the device's and a number by default.

        Returns
        -------
        IsolatedStructure

        Raises
        ------
        InputError
            If the direction, channel or name cannot be used.
        """
        row = self.structure.direction_row(direction)
        name = name or f"{device.name}_{len(self.elements) + 1}"
        return replace(self, elements=(*self.elements, Element(device, row, channel, name)))

    def with_biaxial(
        self,
        device: Device,
        directions: Sequence[str | Sequence[float] | np.ndarray],
        channel: int | None = None,
        name: str = "isolator",
        load_change: Sequence[float] | np.ndarray | None = None,
    ) -> IsolatedStructure:
        """Return the structure with one more biaxial device.

        Parameters
        ----------
        device : Device
            Its law, numbers and scale; the law has an in-plan form.
        directions : sequence of two directions
            Directions along x and y, each as in ``with_element``.
        channel : int, optional
            Coil channel of both; none by default.
        name : str, default "isolator"
            Name to print; its elements have the names ``..._x`` and ``..._y``.
        load_change : sequence of float, shape (n,), optional
            Row for the change of the device's vertical load over its mean, from
            `overturning_rows`. It adds a third element ``..._load`` without force.

        Returns
        -------
        IsolatedStructure

        Raises
        ------
        InputError
            If the law has no in-plan form, or a direction, channel or name cannot be used.

        Notes
        -----
        Controllers and linearisation use single elements: each direction then follows the law in
        one direction, without motion across.
        """
        x, y = (self.structure.direction_row(row) for row in directions)
        first = Element(device, x, channel, f"{name}_x")
        elements = [*self.elements, first, Element(device, y, channel, f"{name}_y", first.name)]
        if load_change is not None:
            row = self.structure.direction_row(load_change)
            device = replace(_no_force(), name="change of the vertical load over its mean")
            elements.append(Element(device, row, None, f"{name}_load", first.name))
        return replace(self, elements=tuple(elements))

    @checked
    def modes(self, currents: float | Sequence[float] = 0.0) -> ModalFacts:
        """Modes for small vibrations about rest.

        Each element is linearised at the frequency of the first mode.

        Parameters
        ----------
        currents : float or sequence of float, shape (n_channels,), A
            Current of each channel, or one for all.

        Returns
        -------
        ModalFacts
            ``periods`` (s), ``damping_ratios`` and ``shapes``.

        Raises
        ------
        InputError
            If a current is outside its device's range, or a mode has no stiffness.
        """
        return modal_facts(self, currents)

    @checked
    def periods(self, currents: float | Sequence[float] = 0.0) -> np.ndarray:
        """Periods for small vibrations about rest; see `modes`.

        Parameters
        ----------
        currents : float or sequence of float, shape (n_channels,), A
            Current of each channel, or one for all.

        Returns
        -------
        numpy.ndarray, shape (n,), s
            Decreasing.
        """
        return self.modes(currents).periods

    def damping_ratio(self, currents: float | Sequence[float] = 0.0) -> float:
        """Damping ratio of the first mode for small vibrations about rest; see `modes`.

        Parameters
        ----------
        currents : float or sequence of float, shape (n_channels,), A
            Current of each channel, or one for all.

        Returns
        -------
        float
            Dimensionless.
        """
        return float(self.modes(currents).damping_ratios[0])

    effective_damping = renamed_attribute("effective_damping", "damping_ratio")

    @checked
    def effective(self, displacement: float, currents: float | Sequence[float] = 0.0) -> Effective:
        """Effective period and damping of the isolation at a displacement (ASCE 7-22, 17.2.8).

        Parameters
        ----------
        displacement : float, m
            Amplitude of the cycle along the first direction, with the structure rigid above the
            isolators. The cycle has the effective period.
        currents : float or sequence of float, shape (n_channels,), A
            Current of each channel, or one for all.

        Returns
        -------
        Effective
            ``stiffness`` (N/m), ``damping`` (dimensionless) and ``period`` (s).

        Raises
        ------
        InputError
            If the displacement is not above 0, a current is outside its device's range, or the
            isolators have no stiffness at this displacement.
        """
        amperes = self._per_channel(currents)
        for element in self.elements:
            if element.channel is not None:
                element.device.checked_current(float(amperes[element.channel]))
        return effective_at(self, displacement, amperes)

    def fixed_base(self) -> IsolatedStructure:
        """Superstructure on a fixed base and rigid ground, without isolators, for comparison.

        Returns
        -------
        IsolatedStructure
            With the elements of the superstructure; if there are none, with a spring without
            stiffness, since a simulation needs an element.
        """
        above = list(self.structure.superstructure)
        fixed = self.structure.fixed_base()
        below = [*self.structure.base, *self.structure.foundation]
        holding = np.any(np.abs(self.holding) > 1e-9, axis=1)

        def stays(e: int) -> bool:
            # the first storey is connected to the base, but does not deform in rigid motion
            row = self.elements[e].direction
            inside = np.any(row[above]) and not holding[e]
            return bool(inside or not np.any(row[below]))

        elements = tuple(
            replace(self.elements[e], direction=self.elements[e].direction[above], channel=None)
            for group in self.groups
            if stays(group[0]) and not self.elements[group[0]].device.depends_on_current
            for e in group
        )
        if not elements:
            top = np.zeros(len(above))
            top[-1] = 1.0
            elements = (Element(_no_force(), top, None, "no_element"),)
        return IsolatedStructure(fixed, elements)

    def facts(self) -> dict[str, str]:
        """Masses, periods and tested range as texts, in engineering units.

        Returns
        -------
        dict of str to str
        """
        return facts(self)

    def __repr__(self) -> str:
        facts = "; ".join(f"{key.lower()} {value}" for key, value in self.facts().items())
        return f"IsolatedStructure({self.structure.name}: {facts})"

    def linearised(
        self, currents: float | Sequence[float] = 0.0, frequency_hz: float = 1.0
    ) -> Structure:
        """Linear structure for small vibrations about rest.

        Parameters
        ----------
        currents : float or sequence of float, shape (n_channels,), A
            Current of each channel, or one for all.
        frequency_hz : float, default 1, Hz
            Frequency at which each element's complex stiffness becomes a spring and a dashpot.

        Returns
        -------
        Structure

        Raises
        ------
        InputError
            If a current is outside its device's range or the frequency is not positive.
        """
        amperes = self._per_channel(currents)
        stiffness, damping = self.structure.stiffness.copy(), self.structure.damping.copy()
        for element in self.elements:
            current = 0.0 if element.channel is None else amperes[element.channel]
            complex_stiffness = element.device.linearised(float(current), frequency_hz)
            along = np.outer(element.direction, element.direction)
            stiffness += complex_stiffness.real * along
            damping += complex_stiffness.imag / (2 * np.pi * frequency_hz) * along
        return replace(self.structure, stiffness=stiffness, damping=damping)

    def _per_channel(self, currents: float | Sequence[float]) -> np.ndarray:
        """Currents of the channels, A, of one for all or one for each."""
        try:
            return np.broadcast_to(np.array(currents, dtype=float), (max(self.n_channels, 1),))
        except ValueError:
            raise InputError(
                "currents", f"{currents!r}", f"a number or {self.n_channels} of them, in A"
            ) from None
