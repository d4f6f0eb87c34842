"""One validated description of a run, to and from TOML."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

from pydantic import BeforeValidator, Field, PrivateAttr, model_validator

from ground_motions import Record
from ground_motions.old_names import renamed_keys
from ground_motions.registry import has_changed

from ..code_check import CheckRow, Motions, check_building
from ..criterion import selected_criteria
from ..errors import InputError, warn
from ..io.files import parse_toml, read_toml
from ..structures import IsolatedStructure, Structure
from ..validation import Section
from .building import Building, MoatWall, PlanBuilding, ReferenceBuilding, Soil, Yielding
from .check import Check, simulator
from .control import ControllerEntry, Driver, SensorSet, Simulation
from .devices import Element, Isolator, NominalModel
from .ground import Ground, ShippedRecord
from .job import Job, with_place
from .suite import RecordSuite

T = TypeVar("T")

MAIN_CONTROLLERS = ("passive_off", "passive_on", "best_constant", "on_off", "clipped_lqr")
"""Default controllers of a scenario."""

_CONTROLLERS = (
    "controllers to compare; label is the name in reports, other keys are settings "
    "(isolation-sim list controllers)"
)


def _main_ground() -> list[Ground]:
    return [ShippedRecord()]


def _one_or_more(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


class Scenario(Section):
    """All settings of a comparison of controllers.

    Sections that are left out have defaults: the reference building on strain-stiffening isolators
    under El Centro 1940, with five controllers. ``main_job`` adds predictive control.
    """

    name: Annotated[str, Field(min_length=1, description="names the results folder")] = "main_job"
    ground: Annotated[
        list[Ground],
        BeforeValidator(_one_or_more),
        Field(min_length=1, description="ground motion; one [[ground]] per direction"),
    ] = Field(default_factory=_main_ground)
    structure: Annotated[Building, Field(description="the building, base included")] = (
        ReferenceBuilding()
    )
    isolator: Annotated[Isolator, Field(description="between ground and base")] = Isolator()
    element: Annotated[list[Element], Field(description="more nonlinear elements")] = Field(
        default_factory=list
    )
    yielding: Annotated[
        Yielding | None, Field(description="storeys that yield; elastic if left out")
    ] = None
    moat_wall: Annotated[
        MoatWall | None, Field(description="wall around the base; none if left out")
    ] = None
    soil: Annotated[
        Soil | None, Field(description="springs under the foundation; rigid ground if left out")
    ] = None
    controller: Annotated[list[ControllerEntry], Field(min_length=1, description=_CONTROLLERS)] = (
        Field(default_factory=lambda: [ControllerEntry(name=name) for name in MAIN_CONTROLLERS])
    )
    driver: Annotated[Driver, Field(description="coils and supply")] = Driver()
    sensors: Annotated[SensorSet, Field(description="sensors of the controllers")] = SensorSet()
    simulation: Annotated[Simulation, Field(description="numerical options")] = Simulation()
    nominal: Annotated[
        NominalModel | None,
        Field(description="nominal isolators of the controllers; those of the plant if left out"),
    ] = None

    check: Annotated[Check | None, Field(description="settings of isolation-sim check")] = None

    _source: str = PrivateAttr(default="")

    @model_validator(mode="before")
    @classmethod
    def _old_keys(cls, data: Any) -> Any:
        return renamed_keys(data, belief="nominal")

    @model_validator(mode="after")
    def _labels_differ(self) -> Self:
        labels = [entry.shown for entry in self.controller]
        for label in labels:
            if labels.count(label) > 1:
                raise InputError(
                    f"two controllers have the label {label!r}; expected: a key label in each"
                )
        return self

    def __eq__(self, other: object) -> bool:
        # the file's place is not compared
        return isinstance(other, Scenario) and self.model_dump() == other.model_dump()

    @classmethod
    def read(cls, path: str | Path) -> Scenario:
        """Read a scenario file.

        Parameters
        ----------
        path : str or pathlib.Path
            TOML file. Paths in it are relative to its folder; the scenario stores absolute paths.

        Returns
        -------
        Scenario

        Raises
        ------
        InputError
            With the file, the key, its value and the expected value.
        """
        path = Path(path)
        data = read_toml(path, "a scenario, such as isolation-sim new writes")
        return cls._of(data, path.parent, str(path))

    @classmethod
    def from_toml(cls, text: str, folder: str | Path = ".", source: str = "") -> Scenario:
        """Build a scenario from TOML.

        Parameters
        ----------
        text : str
            TOML.
        folder : str or pathlib.Path
            Base folder of relative paths in the text.
        source : str
            Name of the text's source, for error messages.

        Returns
        -------
        Scenario

        Raises
        ------
        InputError
            With the source, the key, its value and the expected value.
        """
        return cls._of(parse_toml(text, source), folder, source)

    @classmethod
    def _of(cls, data: dict[str, Any], folder: str | Path, source: str) -> Scenario:
        # the default name of a scenario is that of its file
        data = ({"name": Path(source).stem} if source else {}) | data
        try:
            changed = _changed_code(data.pop("code", {}), folder)
            scenario = cls._in_folder(data, folder)
        except InputError as error:
            raise with_place(error, source) from None
        scenario._source = source
        for file in changed:
            warn(
                f"{file} has changed since {source or 'the scenario'} was written: results may "
                "differ",
                UserWarning,
            )
        return scenario

    def to_toml(self, comments: bool = False) -> str:
        """Write the scenario as TOML.

        Parameters
        ----------
        comments : bool, default False
            Whether to add a description of every key, and the keys that are left out.

        Returns
        -------
        str
            ``Scenario.from_toml`` reads the same scenario from it.
        """
        from .writer import toml_text

        return toml_text(self, comments)

    def build(self, cache: dict[tuple[str, ...], Any] | None = None) -> Job:
        """Build the plant, ground motion and controllers of the scenario.

        Parameters
        ----------
        cache : dict, optional
            Structures and motions of other scenarios. Those of equal sections are reused; new
            ones are added.

        Returns
        -------
        Job

        Raises
        ------
        InputError
            With the section and the unusable value.
        """
        at = self._at
        known = {} if cache is None else cache

        def once(build: Callable[[], T], what: str, *sections: Section) -> T:
            key = (what, *(section.model_dump_json() for section in sections))
            if key not in known:
                known[key] = build()
            return known[key]

        structure = once(lambda: at("structure", self.structure.build), "structure", self.structure)
        more = [part for part in (self.yielding, self.moat_wall, self.soil) if part]
        plant = self.structure, self.isolator, *self.element, *more
        isolator = once(
            lambda: at("isolator", partial(self.isolator.with_scales, structure)),
            "scales",
            *plant[:2],
        )
        isolated = once(
            lambda: self._isolated(structure, isolator, 1.0, 1.0, "isolator"), "plant", *plant
        )
        options: dict[str, Any] = {
            "driver": at("driver", self.driver.build),
            "sensors": at("sensors", self.sensors.build),
            "computation_delay": self.simulation.computation_delay_s,
            "tolerance": self.simulation.tolerance,
            "current_outside": self.simulation.current_outside,
            "criteria": at("simulation", lambda: selected_criteria(self.simulation.criteria)),
        }
        nominal = self.nominal
        if nominal is not None:
            options["nominal"] = once(
                lambda: self._isolated(
                    structure, nominal.of(isolator), nominal.length_factor,
                    nominal.force_factor, "nominal",
                ),
                "nominal", nominal, *plant,
            )  # fmt: skip
        many = len(self.ground) > 1
        records = tuple(
            once(partial(at, f"ground[{k}]" if many else "ground", ground.record), "ground", ground)
            for k, ground in enumerate(self.ground)
        )
        at("ground", partial(_check_motion, records))
        return Job(
            source=self._source,
            isolated=isolated,
            records=records,
            controllers={
                entry.shown: at(f"controller[{k}]", entry.build)
                for k, entry in enumerate(self.controller)
            },
            options=options,
            fixed_base=self.simulation.fixed_base,
        )

    def check_rows(
        self, motions: Motions | None = None
    ) -> tuple[IsolatedStructure, Iterator[CheckRow]]:
        """Check the scenario's building in the manner of ASCE 7-22, chapter 17.

        Parameters
        ----------
        motions : Motions, optional
            In place of the scenario's motion.

        Returns
        -------
        isolated : IsolatedStructure
            The building that is checked.
        rows : iterator of CheckRow
            Lines of the table, each computed on request.

        Raises
        ------
        InputError
            If there is no ``[check]`` section, or the building or a factor cannot be used.
        """
        if self.check is None:
            raise with_place(
                InputError("no [check] section; expected: one with S_M1_g"), self._source
            )
        job = (self if motions is None else self.under_one_motion()).build()
        gap = None if self.moat_wall is None else self.moat_wall.gap_m
        settings = self.check.settings(gap)
        motions = motions or Motions([job.records])
        rows = check_building(job.isolated, settings, motions, simulator(job), job.controllers)
        return job.isolated, rows

    @property
    def suite(self) -> RecordSuite | None:
        """The suite of records that is the ground; None without one."""
        section = self.ground[0]
        return section if len(self.ground) == 1 and isinstance(section, RecordSuite) else None

    def under_one_motion(self) -> Scenario:
        """The scenario under the default motion in place of a suite, to build its other parts."""
        return self.model_copy(update={"ground": Scenario().ground})

    def _isolated(
        self, structure: Structure, isolator: Isolator, length: float, force: float, section: str
    ) -> IsolatedStructure:
        reference = isinstance(self.structure, ReferenceBuilding)
        device = self._at(section, isolator.on_reference if reference else isolator.scaled)
        scaled = device.scaled(length, force)
        isolated = self._at(section, partial(isolator.put_under, structure, scaled))
        for k, element in enumerate(self.element):
            isolated = self._at(f"element[{k}]", partial(element.add_to, isolated))
        if isinstance(self.structure, PlanBuilding):
            self._at(section, partial(_check_rotation, isolated))
        if self.yielding is not None:
            isolated = self._at("yielding", partial(self.yielding.add_to, isolated))
        if self.moat_wall is not None:
            isolated = self._at("moat_wall", partial(self.moat_wall.add_to, isolated))
        if self.soil is not None:
            isolated = self._at("soil", partial(self.soil.add_to, isolated))
        return isolated

    def _at(self, section: str, build: Callable[[], T]) -> T:
        try:
            return build()
        except InputError as error:
            raise with_place(error, self._source, section) from None


def _changed_code(code: Any, folder: str | Path) -> list[str]:
    """Files of code that differ from those of a scenario's digests."""
    if not (isinstance(code, dict) and all(isinstance(digest, str) for digest in code.values())):
        raise InputError("code", repr(code), "a table of files with their SHA-256")
    return [
        file for file, digest in code.items() if has_changed(Path(folder, file).resolve(), digest)
    ]


def _check_motion(records: Sequence[Record]) -> None:
    if not any(record.acceleration.any() for record in records):
        raise InputError(
            "the ground acceleration is 0 at all times; expected: a motion, with a scale_factor "
            "other than 0 and a start_s and stop_s within its strong part"
        )


def _check_rotation(isolated: IsolatedStructure) -> None:
    rotation = isolated.structure.plan_dofs()[2]
    if not isolated.element_rows[:, rotation].any():
        raise InputError(
            "isolators that are not biaxial act at the centre of the plan, and nothing resists "
            "rotation; expected: biaxial = true, or an [[element]] along base_rotation"
        )


def main_job() -> Scenario:
    """Return the scenario of ``isolation-sim run`` without a file.

    Returns
    -------
    Scenario
        The default scenario, plus ``mpc`` without preview and with 0.8 s of preview.
    """
    default = Scenario()
    predictive = [
        ControllerEntry(name="mpc"),
        ControllerEntry(name="mpc", label="mpc, 0.8 s preview", settings={"preview": 0.8}),
    ]
    return Scenario(controller=[*default.controller, *predictive])
