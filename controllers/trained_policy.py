"""A recurrent network that was trained through the equations of motion."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.errors import InputError
from isolation_sim.simulation.control import CompiledDecision, RunContext, Sensors
from isolation_sim.structures import (
    IsolatedStructure,
    reference_building,
    reference_isolators,
)

from .coils import coil_table, driven_elements
from .compiled import CompiledController, Decision, decision_step
from .device_states import SCRATCH
from .preview import Preview
from .settings import ExistingFile, Number, Optional, setting

WEIGHTS = Path(__file__).with_name("trained_policy.npz")
"""The network of the reference building, written by ``python -m studies.train_policy``."""
WITH_PREVIEW = Path(__file__).with_name("trained_policy_preview.npz")
"""The same with 0.8 s of preview."""
LAYERS = ("Wg", "Ug", "bg", "W1", "b1", "W2", "b2", "W3", "b3")
"""Arrays of a file of weights: gates from inputs and from hidden units, gate offsets; layers."""
SUBSTEP = 0.01
"""Longest integration step of the nominal model, s."""
TOLERANCE = 0.15
"""Largest relative difference from the periods of the reference building. The training had isolator
forces of 0.8 to 1.25 times the nominal ones, which change the isolated period by up to 14 %."""


class TrainedPolicy(CompiledController):
    """A recurrent network that was trained through the equations of motion.

    A gated recurrent unit and two layers compute the current from 33 inputs: the motion of base
    and floors, the isolator's states, the coil current and the peaks so far; the ground
    acceleration, its integrals, period and duration; and the responses of the nominal model to it
    at three constant currents. All are relative to the running peaks without current. With preview
    the ground motion and these responses are known up to its end, and ground accelerations at every
    fourth decision until then are further inputs.

    The weights minimise the mean of both peaks over synthetic motions of the reference building,
    by the gradient through the simulation. They are for this building and a coil lag of 50 ms.
    Another building needs its own training (``python -m studies.train_policy``). Measured are all
    accelerations, the deformation and velocity of the first isolator, the displacement of the roof
    and the ground acceleration, which has one direction. There is no observer.
    """

    name = "trained_policy"
    title = "Trained policy"
    source = "gated recurrent unit: Cho et al. 2014; training: Werbos 1990, Kingma and Ba 2015"

    period: float | None = 0.02
    preview: float = setting(
        0.0, "preview time: the ground motion is known this far ahead; 0 or 0.8 s with the "
        "networks of the reference building", Number(at_least=0), "s",
    )  # fmt: skip
    weights: str | None = setting(
        None, "file of the weights, as python -m studies.train_policy writes it; None for those of "
        "the reference building", Optional(ExistingFile()),
    )  # fmt: skip

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.preview_time = self.preview

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Accelerations, one isolator's motion, the roof's displacement, ground acceleration."""
        structure = nominal.structure
        if len(structure.directions) != 1:
            raise InputError(
                f"{self.name}: {structure.name} moves in {len(structure.directions)} directions; "
                "expected: one"
            )
        isolator = driven_elements(nominal, self.name)[0].name
        return (
            *(f"{dof}_acceleration_m_s2" for dof in structure.names),
            f"{isolator}_deformation_m",
            f"{isolator}_velocity_m_s",
            f"{structure.names[-1]}_displacement_m",
            "ground_acceleration_m_s2",
        )

    def decision(self, context: RunContext) -> Decision:
        """Assemble the nominal model, the network and the memory."""
        from .clipped_lqr import linear_model
        from .predictive import policy_kernel as at
        from .predictive.flat_arrays import flat_arrays
        from .predictive.prediction import Prediction

        nominal, step = context.nominal, context.period
        driven = driven_elements(nominal, self.name)[0]
        element = nominal.elements.index(driven)
        coils = np.minimum(coil_table(context), 1e30)
        softest = linear_model(nominal, coils[:, 2])[0]
        p = Prediction(nominal, coils, step, SUBSTEP)
        low, high = coils[:, 2], coils[:, 3]
        network = self._network(step)
        n_hidden, n_first = len(network[1]), len(network[4])
        settings: dict[int, Any] = {
            at.NUMBERS: [
                step, 2 * np.pi * softest, p.n_displacements, p.n_accelerations, element,
                p.lengths[element],
            ],
            at.FORCE_SCALES: p.plant[8], at.NO_BLOCK: [], at.RANGES: coils[:, 2:4],
            at.REFERENCE_CURRENTS: np.array([[low], [low + (high - low) / 3], [high]]),
        }  # fmt: skip
        settings |= dict(enumerate([*p.plant[:8], *p.plant[9:]], at.DECAY))
        settings |= dict(enumerate(network, at.GATES))
        n_z, n_levels = p.rows.shape[-1], nominal.structure.n_dofs
        n_peaks, rest = p.n_displacements + p.n_accelerations, p.initial_states()
        n_outputs = n_peaks + p.n_displacements
        zeros = {
            at.LEVELS: n_levels, at.FOLLOWING: SCRATCH * max(p.model.n_states, 1),
            at.PAST: (2, 1 + n_levels), at.PEAKS: 3, at.OUTPUTS: n_levels + 2,
            at.REFERENCE_Z: (at.N_REFERENCES, n_z),
            at.REFERENCE_PAST: (at.N_REFERENCES, 2, n_peaks),
            at.REFERENCE_PEAKS: (at.N_REFERENCES, 3),
            at.REFERENCE_OUTPUTS: (at.N_REFERENCES, n_outputs), at.GROUND: (1, p.n_sub + 1),
            at.SAMPLES: at.N_SAMPLES, at.INPUTS: len(network[0]), at.HIDDEN: n_hidden,
            at.GATE_SUMS: 6 * n_hidden, at.FIRST_LAYER: n_first, at.SECOND_LAYER: len(network[6]),
        }  # fmt: skip
        arrays = {k: np.zeros(shape) for k, shape in zeros.items()} | {
            at.STATE: np.eye(11)[at.CURRENT_THEN] * coils[driven.channel or 0, 4],
            at.STATES_THEN: rest[element],
            at.REFERENCE_STATES: np.tile(rest, (at.N_REFERENCES, 1, 1)),
        }  # fmt: skip
        values, derivatives, side = p.work(0)
        groups = {
            at.VALUES: values, at.DERIVATIVES: derivatives, at.SIDE: [side],
            at.RESULTS: p.results(1, 0),
        }  # fmt: skip
        for first, group in groups.items():
            arrays |= dict(enumerate(group, first))
        return Decision(at.decide, flat_arrays(settings), flat_arrays(arrays), p.model)

    def cautions(self, context: RunContext, sensors: Sensors) -> list[str]:
        """Warn about another building than that of the training."""
        reference = _reference()
        own, trained = _periods(context.nominal), _periods(reference)
        if self.weights is not None or np.allclose(own, trained, rtol=TOLERANCE, atol=0.0):
            return []
        return [
            f"its network was trained for the {reference.structure.name} on its isolators, and "
            f"the periods here are others (isolated at 0 and 3 A, fixed base: {_listed(own)} s; "
            f"expected: {_listed(trained)} s): train another one with "
            "python -m studies.train_policy"
        ]

    def reset(self, context: RunContext) -> None:
        """Assemble the decision and clear the memory; with preview, compile it."""
        super().reset(context)
        self._preview = Preview(self._ahead(context.period), context.ground or ())
        if self.preview:
            n_measured = len(context.outputs) + len(self._preview.times)
            self._step = decision_step(self._decision, n_measured, len(context.low), self.name)

    def compiled(self, context: RunContext) -> CompiledDecision | None:
        """Decision in compiled code."""
        decision = super().compiled(context)
        if decision is None:
            return None
        return replace(decision, inputs=self._preview.names(self.measures(context.nominal)[-1:]))

    def current(self, t: float, measurement: Any) -> NDArray:
        """Decide; with preview in compiled code."""
        return self._step(t, self._preview.known(t, measurement))

    def _ahead(self, step: float) -> NDArray:
        """Times after a decision at which the ground motion is known, s."""
        return np.arange(1, int(self.preview / step * (1 + 1e-9)) + 1) * step

    def _network(self, step: float) -> list[NDArray]:
        """Arrays of the network."""
        own = WITH_PREVIEW if self.preview else WEIGHTS
        path = own if self.weights is None else Path(self.weights)
        try:
            with np.load(path) as file:
                arrays = [np.asarray(file[name], dtype=float) for name in LAYERS]
        except (OSError, KeyError, ValueError) as error:
            raise InputError(
                f"{self.name}: weights {str(path)!r}: {error}; expected: a file that "
                "python -m studies.train_policy wrote"
            ) from None
        return self._checked(arrays, str(path), step)

    def _checked(self, arrays: list[NDArray], path: str, step: float) -> list[NDArray]:
        """Refuse arrays whose shapes do not fit together, or are for another preview."""
        from .predictive.policy_kernel import AHEAD, N_GROUND, N_MOTION

        n, n_hidden, n_first, n_second = N_GROUND + N_MOTION, *(len(arrays[k]) for k in (1, 4, 6))
        n_known = len(self._ahead(step))
        n += n_known // AHEAD
        shapes = [
            (n, 3 * n_hidden), (n_hidden, 3 * n_hidden), (3 * n_hidden,), (n + n_hidden, n_first),
            (n_first,), (n_first, n_second), (n_second,), (n_second, 1), (1,),
        ]  # fmt: skip
        if n_known % AHEAD or [array.shape for array in arrays] != shapes:
            trained = (len(arrays[0]) - N_GROUND - N_MOTION) * AHEAD * step
            raise InputError(
                f"{self.name}: weights {path!r} with preview {self.preview:g} s: arrays of "
                f"{[array.shape for array in arrays]}; expected: a network of {n} inputs; "
                f"preview of this number of inputs: {trained:g} s"
            )
        return arrays


@lru_cache(maxsize=1)
def _reference() -> IsolatedStructure:
    return reference_building().on(reference_isolators())


@lru_cache(maxsize=256)
def _periods(isolated: IsolatedStructure) -> tuple[float, ...]:
    """First periods: isolated at 0 and 3 A, and on a fixed base, s; NaN where there is none."""
    periods = []
    for period in (
        lambda: isolated.periods(0.0),
        lambda: isolated.periods(3.0),
        lambda: isolated.fixed_base().periods(),
    ):
        try:
            periods.append(float(period()[0]))
        except InputError:
            periods.append(np.nan)
    return tuple(periods)


def _listed(periods: tuple[float, ...]) -> str:
    return ", ".join(f"{period:.3g}" for period in periods)
