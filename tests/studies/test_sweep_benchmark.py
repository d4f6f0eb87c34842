"""The sweep benchmark measures what it says."""

import numpy as np

from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building, reference_isolators
from isolation_sim.sweeps.design import Design
from isolation_sim.workers import in_this_process
from studies.benchmarks import sweep as benchmark


def test_it_varies_the_reference_building():
    design = Design(benchmark.plan(3))
    assert design.n_runs == 81
    middle = design.case(1 * 27 + 1 * 9)
    assert middle.shown["mass"] == 1.0 and middle.shown["stiffness"] == 1.25
    job = middle.scenario(design.base).build()
    expected = reference_building().on(reference_isolators())
    for name in ("mass", "damping", "stiffness"):
        inputs, target = (getattr(each.structure, name) for each in (job.isolated, expected))
        np.testing.assert_allclose(inputs, target, rtol=1e-12)


def test_it_counts_the_kernel_and_leaves_it_as_it_was():
    design = Design(benchmark.plan(2))
    originals = benchmark.Workspace.integrate, benchmark.Workspace.peaks_and_mean_squares
    with benchmark.in_compiled_code() as spent:
        (finished,) = in_this_process(benchmark.chunks_of(design))
    assert finished.n_failed == 0 and finished.n_runs == 16
    assert len(spent) == 2 and sum(spent) > 0  # one block of lanes, integrated and summed up
    assert (benchmark.Workspace.integrate, benchmark.Workspace.peaks_and_mean_squares) == originals
    case = design.case(5).scenario(design.base).build()
    run = simulate(case.isolated, case.records, case.controllers["constant"], **case.options)
    assert benchmark.one_run(design, 5) == run.criteria
