"""The ``[isolator]``, ``[[element]]`` and ``[nominal]`` sections: devices, true and nominal."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from ground_motions.old_names import renamed_value

from ..effects import Effect, effect, extend
from ..errors import InputError, warn
from ..laws import Device, law, passive
from ..structures import (
    IsolatedStructure,
    Structure,
    load_change_rows,
    with_p_delta,
    with_vertical_motion,
)
from ..structures.reference import FORCE_SCALE, LENGTH_SCALE
from ..structures.sizing import Sizing
from ..validation import Coefficients, Number, Positive, Registered, Section

_Parameters = Annotated[
    str | Annotated[dict[str, Coefficients], Field(min_length=1)] | None,
    Field(
        description="set (isolation-sim list sets), or { name = SI number or [ascending powers of "
        "the current] }"
    ),
]
_Range = Annotated[
    list[Number] | None,
    Field(min_length=2, max_length=2, description="valid currents; those of the set by default"),
]

_OLD_SWITCHING = BeforeValidator(
    lambda value: renamed_value("switching", value, papers="instantaneous")
)


class AppliedEffect(Section):
    """An effect by its cause and form; every other key is one of its parameters."""

    name: Annotated[
        Registered, Field(description="cause; isolation-sim list effects, or file.py:FORMS")
    ]
    form: Annotated[str | None, Field(description="the cause's first form if left out")] = None
    parameters: dict[str, Number] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        # the effect checks the names of its parameters when it is applied to the law
        if not isinstance(data, dict):
            return data
        own = {key: data[key] for key in ("name", "form") if key in data}
        numbers = {key: v for key, v in data.items() if key not in (*own, "parameters")}
        return own | {"parameters": numbers | data.get("parameters", {})}

    def build(self) -> tuple[Effect, dict[str, float]]:
        """Return the effect with its numbers."""
        return effect(self.name, self.form), self.parameters


_Effects = Annotated[
    list[AppliedEffect] | None, Field(description="effects applied to the law, in this order")
]


class _Device(Section):
    law: Annotated[
        Registered, Field(description="isolation-sim list laws, file.py:LAW or unit.fmu")
    ] = "strain_stiffening"
    variables: Annotated[
        dict[str, str] | None,
        Field(description="of a unit: displacement_m, velocity_m_s, current_A, force_N by its own"),
    ] = None
    parameters: _Parameters = None
    current_range_A: _Range = None
    tested_deformation_m: Annotated[
        Positive | None, Field(description="of one device; that of the set by default")
    ] = None
    tested_current_A: Annotated[
        Number | None, Field(description="highest current of the tests; that of the set by default")
    ] = None
    length_scale: Annotated[
        Positive | None,
        Field(description="deformation relative to the tested device; reference building: 10"),
    ] = None
    force_scale: Annotated[
        Positive | None,
        Field(description="force relative to the tested device; reference building: 3014.69"),
    ] = None
    count: Annotated[Positive, Field(description="number of parallel devices")] = 1.0
    switching: Annotated[
        Literal["instantaneous", "passive"],
        _OLD_SWITCHING,
        Field(description="instantaneous: deformed springs stiffen; passive: new deformation only"),
    ] = "instantaneous"
    effect: _Effects = None
    instrument: Annotated[
        list[AppliedEffect] | None,
        Field(description="effects in the instruments of the tests; for evaluate, not simulated"),
    ] = None

    def device(self, length_scale: float = 1.0, force_scale: float = 1.0) -> Device:
        """Return the device."""
        valid_range = self.current_range_A
        limits = None if valid_range is None else (valid_range[0], valid_range[1])
        device = law(self.law, self.parameters, limits)
        if self.variables is not None:
            if not device.law.unit:
                raise InputError("variables is set, but law is no FMU; expected: law = unit.fmu")
            own = replace(device.law, unit_variables=self.variables)
            device = replace(device, law=own)
        if self.tested_deformation_m is not None:
            device = replace(device, tested_deformation=self.tested_deformation_m)
        if self.tested_current_A is not None:
            device = replace(device, tested_current=self.tested_current_A)
        if self.switching == "passive":
            if self.effect:
                raise InputError(
                    "switching is 'passive', with effects around the law; expected: one of the two"
                )
            device = passive(device)
        if self.effect:
            device = extend(device, [one.build() for one in self.effect])
        if device.law.unit:  # a unit already has the building's scale
            length_scale = force_scale = 1.0
        return device.scaled(
            length_scale if self.length_scale is None else self.length_scale,
            self.count * (force_scale if self.force_scale is None else self.force_scale),
        )


class Isolator(_Device):
    """Equal isolators between the ground and the base."""

    target_period_s: Annotated[
        Positive | None,
        Field(description="first period at the middle current; replaces scales and count"),
    ] = None
    effective_period_s: Annotated[
        Positive | None,
        Field(description="effective period at the design displacement; replaces scales and count"),
    ] = None
    design_displacement_m: Annotated[
        Positive | None,
        Field(description="displacement at the tested deformation; 0.04 m per s of target period"),
    ] = None
    damping_ratio: Annotated[
        float | None,
        Field(
            ge=0,
            lt=1,
            description="of the first mode, or at design_displacement_m with "
            "effective_period_s; a dashpot adds the difference",
        ),
    ] = None
    biaxial: Annotated[
        bool,
        Field(description="coupled directions; one device per known position"),
    ] = False
    overturning: Annotated[
        bool, Field(description="overturning changes each device's vertical load; with biaxial")
    ] = False
    vertical_period_s: Annotated[
        Positive | None,
        Field(
            description="of the building on the isolators' vertical stiffness; a last [[ground]] "
            "moves it vertically, which changes their load; with biaxial"
        ),
    ] = None
    p_delta_height_m: Annotated[
        Positive | None, Field(description="height of the bearings for P-delta: stiffness -W / h")
    ] = None

    def put_under(self, structure: Structure, device: Device) -> IsolatedStructure:
        """Return the structure on the isolators."""
        if self.p_delta_height_m is not None:
            structure = with_p_delta(structure, self.p_delta_height_m)
        if self.vertical_period_s is not None:
            structure = with_vertical_motion(structure, self.vertical_period_s)
        loads = self.overturning or self.vertical_period_s is not None
        changes = load_change_rows(structure, self.overturning) if loads else None
        isolated = structure.on(device, biaxial=self.biaxial, load_changes=changes)
        return self._sizing.add_dashpots(isolated, device, "damping_ratio")

    def with_scales(self, structure: Structure) -> Isolator:
        """Return the section with scales by the period that it gives."""
        scales = {"length_scale": None, "force_scale": None, "count": 1.0}
        others = [key for key, default in scales.items() if getattr(self, key) != default]
        if not self._sizing.gives_period(*others):
            return self
        device = self._sizing.scale(structure, self.device(), self.biaxial)
        changes: dict[str, Any] = {
            "length_scale": device.length, "force_scale": device.force_scale,
        }  # fmt: skip
        if self.effective_period_s is None:  # the damping ratio needs them
            changes |= {"target_period_s": None, "design_displacement_m": None}
        return self.model_copy(update=changes)

    @property
    def _sizing(self) -> Sizing:
        return Sizing(
            self.target_period_s,
            self.effective_period_s,
            self.design_displacement_m,
            self.damping_ratio,
        )

    def on_reference(self) -> Device:
        """Return the device; scales that the section leaves out are the reference building's."""
        device = self.device(LENGTH_SCALE, FORCE_SCALE)
        unscaled = self.length_scale is None and self.force_scale is None
        # a published set is that of a tested device, as its name says
        if isinstance(self.parameters, dict) and unscaled and not device.law.unit:
            warn(
                "parameters without scales are those of a tested device: its lengths are "
                f"multiplied by {LENGTH_SCALE:g} and its forces by {FORCE_SCALE:g} for the "
                "reference building; length_scale = 1 and force_scale = 1 are those of "
                "full-size isolators",
                UserWarning,
            )
        return device

    def scaled(self) -> Device:
        """Return the device; the section must contain its scales."""
        for key in ("length_scale", "force_scale"):
            if getattr(self, key) is None and not self.law.endswith(".fmu"):
                raise InputError(
                    f"{key} is missing; expected: a number above 0, such as 1 for parameters of "
                    "full-size isolators (only the reference building has a default), or in place "
                    "of both scales target_period_s or effective_period_s"
                )
        return self.device()


class Element(_Device):
    """One more nonlinear element."""

    name: Annotated[str, Field(description="name in reports")] = ""
    direction: Annotated[
        str | list[Number],
        Field(description="a storey (its drift), a dof (to the ground), or a row over the dofs"),
    ]
    channel: Annotated[
        int | None,
        Field(ge=0, description="coil channel; 0 is that of the isolators; no coil by default"),
    ] = None

    def add_to(self, isolated: IsolatedStructure) -> IsolatedStructure:
        """Return the structure with the element."""
        return isolated.with_element(self.device(), self.direction, self.channel, self.name)


class NominalModel(Section):
    """Nominal model of the isolators in controllers, where it differs from the plant."""

    law: Annotated[Registered | None, Field(description="another law")] = None
    parameters: _Parameters = None
    length_factor: Annotated[Positive, Field(description="nominal over true length scale")] = 1.0
    force_factor: Annotated[Positive, Field(description="nominal over true force scale")] = 1.0
    switching: Annotated[
        Literal["instantaneous", "passive"],
        _OLD_SWITCHING,
        Field(description="as in [isolator]; instantaneous: deformed springs stiffen"),
    ] = "instantaneous"
    effect: Annotated[
        list[AppliedEffect] | None,
        Field(description="replaces the isolator's effects; effect = [] for none"),
    ] = None

    def of(self, isolator: Isolator) -> Isolator:
        """Return the nominal isolator before its scales are changed."""
        changes: dict[str, Any] = {"switching": self.switching}
        if self.law is not None and self.law != isolator.law:
            # another law has its own parameters, current range and effects
            changes |= {"law": self.law, "parameters": self.parameters, "effect": None}
            changes |= {"current_range_A": None, "tested_deformation_m": None}
            changes |= {"tested_current_A": None, "variables": None}
        elif isinstance(self.parameters, dict) and isinstance(isolator.parameters, dict):
            changes |= {"parameters": {**isolator.parameters, **self.parameters}}
        elif self.parameters is not None:
            changes |= {"parameters": self.parameters}
        if self.effect is not None:
            changes["effect"] = self.effect
        return isolator.model_copy(update=changes)
