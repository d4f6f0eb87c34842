"""The predictive controller's kernels compiled one by one, for tests."""

import numpy as np

from controllers.compiled import _device_parts, _module_text, collect
from controllers.device_states import follow_states
from controllers.predictive.generated_jacobian import PredictionModel
from controllers.predictive.prediction import Prediction
from controllers.predictive.prediction_kernel import predict
from controllers.predictive.uncontrolled import follow_uncontrolled
from isolation_sim.compilation.generated import load_text

_ENTRIES = """
@njit(cache=True, error_model="numpy")
def run(n_steps, z, s, i, commands, block, ground, first, plant, work, results):
    predict(n_steps, z, s, i, commands, block, ground, first, plant, work, results)


@njit(cache=True, error_model="numpy")
def follow_free(
    begun, n_known, sizes, lowest, ground, n_sub, plant, work, results, state, no_block
):
    follow_uncontrolled(
        begun, n_known, sizes, lowest, ground, n_sub, plant, work, results, state, no_block
    )
"""


def compiled_kernels(laws):
    parts = _device_parts(PredictionModel, laws, {"device_side"})
    collect(follow_uncontrolled, parts, ("device_side",))
    collect(predict, parts, ("device_side",))
    return load_text("test", _module_text(parts) + _ENTRIES)


def as_tuples(work):
    values, derivatives, side = work
    return tuple(values), tuple(derivatives), side


class Predictor(Prediction):
    """A prediction with arrays of its own."""

    def __init__(self, nominal, coils, step, block, longest=np.inf):
        super().__init__(nominal, coils, step, longest)
        self.block, self.step = np.asarray(block, dtype=float), step
        width = int(self.block[-1] + 1) * len(coils)
        self.own_work, self.own_results = self.work(width), self.results(len(block), width)
        self.y, self.dy, self.past = self.own_results[:3]
        self.module = compiled_kernels(self.model.laws)

    def modes_of(self, displacement, velocity):
        return self.to_modes @ np.concatenate([displacement, velocity])

    def between(self, samples):
        """Ground acceleration at the substeps' ends, on lines from one sample to the next."""
        at = np.arange((len(samples) - 1) * self.n_sub + 1) / self.n_sub
        return np.stack([np.interp(at, np.arange(len(samples)), one) for one in samples.T])

    def predict(self, z, states, i, commands, ground):
        self.module.run(
            len(self.block), z, states, i, commands, self.block, ground, 0, self.plant,
            as_tuples(self.own_work), tuple(self.own_results),
        )  # fmt: skip

    def carried(self, z, states, i, commands, ground):
        """State at the end, by a prediction without derivatives."""
        work = as_tuples(self.work(0))
        self.module.run(
            len(self.block), z, states, i, commands, np.zeros(0), ground, 0, self.plant, work,
            tuple(self.results(len(self.block), 0)),
        )  # fmt: skip
        return work[0][0], work[0][2], work[0][4]

    def follow(self, before, after, h, states, i):
        for e, (size, c) in enumerate(zip(self.lengths, self.plant[6], strict=True)):
            ends = [tuple(size * self.rows[e] @ z) for z in (before, after)]
            follow_states(
                e, *ends, h, states[e], i[int(c)] if c >= 0 else 0.0, self.numbers[e],
                np.zeros(5 * states.shape[1]), self.model.state_rates,
            )  # fmt: skip


class Uncontrolled(Predictor):
    """The response without current under a ground motion that is given piece by piece."""

    def __init__(self, nominal, coils, step, longest, n_known=0, n_ahead=0):
        super().__init__(nominal, coils, step, np.zeros(1), longest)
        self.n_known, n_peaks = n_known, self.n_displacements + self.n_accelerations
        self.lowest = np.tile(coils[:, 2], (n_ahead + 1, 1))
        self.peaks, self.peak_history = np.zeros(3), np.zeros((1 + n_known + n_ahead, 2))
        self.state = (
            np.zeros(self.rows.shape[-1]), self.initial_states(), np.zeros((2, n_peaks)),
            self.peaks, self.peak_history, np.zeros((self.along.shape[1], self.n_sub + 1)),
        )  # fmt: skip
        self.begun = False

    def follow_ground(self, ground):
        self.module.follow_free(
            self.begun, self.n_known, (self.n_displacements, self.n_accelerations), self.lowest,
            ground, self.n_sub, self.plant, as_tuples(self.work(0)),
            tuple(self.results(len(self.lowest), 0)), self.state, np.zeros(0),
        )  # fmt: skip
        self.begun = True
