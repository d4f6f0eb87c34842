"""The benchmark of the predictive controller compares like with like."""

import numpy as np
import pytest

from controllers.mpc import MPC
from ground_motions import el_centro_1940
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building, reference_isolators
from studies.benchmarks.do_mpc_peer import ALONE, DoMPC, Recorder
from studies.benchmarks.mpc import DRIVER


def test_do_mpc_finds_the_first_move_that_the_iterated_controller_finds():
    pytest.importorskip("do_mpc")
    plant, first, count = reference_building().on(reference_isolators()), 198, 4
    one = Recorder(first, count, **ALONE | {"horizon": 0.4, "blocks": 20}, iterations=60)
    simulate(plant, el_centro_1940().cut(0.0, (first + count) * MPC.period), one, driver=DRIVER)
    assert len(one.cases) == count
    peer = DoMPC(plant, one, np.abs([case.state for case in one.cases]).max(axis=0))
    commands = [peer.decide(case)[0] for case in one.cases]
    own = [case.command for case in one.cases]
    assert np.ptp(own) > 0.02
    assert own == pytest.approx(commands, abs=0.02 * 3.0)  # of the range
