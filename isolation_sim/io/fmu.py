"""Functional mock-up units (FMUs) of other tools, run by FMPy."""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError, not_installed

VERSIONS = ("2.0", "3.0")


class Unit:
    """An FMU for co-simulation; ``start`` creates an instance."""

    def __init__(self, file: str | Path):
        self.file = Path(file)
        self._description = self._read()
        kinds = ("Real", "Float64")
        variables = [v for v in self._description.modelVariables if v.type in kinds]
        self._references = {v.name: v.valueReference for v in variables}
        self.inputs = tuple(v.name for v in variables if v.causality == "input")
        self.outputs = tuple(v.name for v in variables if v.causality == "output")
        self._instance: Any = None

    def _read(self) -> Any:
        try:
            import fmpy
        except ModuleNotFoundError:
            raise not_installed(f"{self.file}:", "FMPy", "fmi") from None
        if not self.file.is_file():
            raise InputError(f"{self.file}: no such file; expected: a functional mock-up unit")
        try:
            result = fmpy.read_model_description(str(self.file))
        except Exception as error:
            reason = _one_line(error) or type(error).__name__
            raise InputError(f"{self.file}: is no functional mock-up unit: {reason}") from None
        if result.fmiVersion not in VERSIONS or result.coSimulation is None:
            kind = "co-simulation" if result.coSimulation else "model exchange"
            raise InputError(
                f"{self.file}: is of FMI {result.fmiVersion} for {kind}; expected: FMI 2.0 or 3.0 "
                "for co-simulation"
            )
        return result

    @property
    def saves_state(self) -> bool:
        """Whether the state can be read and set."""
        own = self._description.coSimulation
        return any(
            getattr(own, name, False) for name in ("canGetAndSetFMUstate", "canGetAndSetFMUState")
        )

    @property
    def takes_any_step(self) -> bool:
        """Whether the FMU accepts steps of variable length."""
        return bool(self._description.coSimulation.canHandleVariableCommunicationStepSize)

    def check_has(self, inputs: Sequence[str], outputs: Sequence[str], key: str) -> None:
        """Refuse an FMU without a required variable; the error names the key for its name."""
        for kind, needed, own in (
            ("input", inputs, self.inputs),
            ("output", outputs, self.outputs),
        ):
            for name in needed:
                if name not in own:
                    raise InputError(
                        f"{self.file}: no {kind} is {name}; expected: {key}, for its {kind}s "
                        f"{', '.join(own) or 'are none'}"
                    )

    def start(self) -> None:
        """Create a new instance at time 0."""
        import fmpy

        self.stop()
        description = self._description
        second = description.fmiVersion == "2.0"
        folder = tempfile.TemporaryDirectory()
        try:
            kind = fmpy.fmi2.FMU2Slave if second else fmpy.fmi3.FMU3Slave
            instance = kind(
                guid=description.guid,
                unzipDirectory=fmpy.extract(str(self.file), unzipdir=folder.name),
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName=self.file.stem,
            )
            instance.instantiate()
            if second:
                instance.setupExperiment(startTime=0.0)
            instance.enterInitializationMode()
            instance.exitInitializationMode()
        except Exception as error:
            folder.cleanup()
            raise InputError(f"{self.file}: cannot be started here: {_one_line(error)}") from None
        self._put = instance.setReal if second else instance.setFloat64
        self._get = instance.getReal if second else instance.getFloat64
        self._instance = instance
        self._end = weakref.finalize(self, _end, instance, folder)

    def stop(self) -> None:
        """Free the instance, if there is one."""
        if self._instance is not None:
            self._end()
            self._instance = None

    def step(
        self, time: float, length: float, values: Mapping[str, float], outputs: Sequence[str]
    ) -> list[float]:
        """Set the inputs, make a step, and read the outputs."""
        self._put([self._references[name] for name in values], list(values.values()))
        try:
            self._instance.doStep(currentCommunicationPoint=time, communicationStepSize=length)
        except Exception as error:
            raise InputError(
                f"{self.file}: failed at t = {time:.4g} s: {_one_line(error)}"
            ) from None
        return self._get([self._references[name] for name in outputs])

    def get_state(self) -> Any:
        """A copy of the instance's state."""
        return self._state("get")()

    def set_state(self, state: Any) -> None:
        """Restore a state."""
        self._state("set")(state)

    def free_state(self, state: Any) -> None:
        """Free the copy of a state."""
        self._state("free")(state)

    def _state(self, verb: str) -> Any:
        second = self._description.fmiVersion == "2.0"
        return getattr(self._instance, f"{verb}FMU{'state' if second else 'State'}")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _end(instance: Any, folder: tempfile.TemporaryDirectory) -> None:
    instance.terminate()
    instance.freeInstance()
    folder.cleanup()
