"""The response between the samples of a record."""

import numpy as np

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.simulation.pieces import refined_outputs


def test_floor_spectra_under_a_switching_current_are_those_of_a_finer_record():
    isolated = iso.reference_building().on(iso.reference_isolators())
    ground = el_centro_1940().cut(0.0, 8.0)
    periods = np.array([0.05, 0.1, 0.2, 0.5])
    run, finer = (
        iso.simulate(isolated, each, iso.controller("on_off", period=0.02))
        for each in (ground, ground.resampled(0.001))
    )
    # decisions every 20 ms, all at samples: the same run
    base = "base_acceleration_m_s2"
    np.testing.assert_allclose(run.output(base), finer.output(base)[::20], atol=1e-4)
    expected = finer.floor_spectra(periods)
    for level, spectra in run.floor_spectra(periods).items():
        np.testing.assert_allclose(spectra.psa, expected[level].psa, rtol=0.02)


def test_refined_outputs_pass_through_the_samples():
    isolated = iso.reference_building().on(iso.reference_isolators())
    run = iso.simulate(isolated, el_centro_1940().cut(0.0, 2.0), "passive_on")
    names = ["floor5_acceleration_m_s2", "base_displacement_m"]
    refined = refined_outputs(run, names, 4)
    for name, column in zip(names, refined.T, strict=True):
        size = np.abs(column).max()
        np.testing.assert_allclose(column[::4], run.output(name), atol=1e-6 * size)
    # between them it is smooth: fourth differences are small
    assert np.abs(np.diff(refined[:, 1], 4)).max() < 1e-3 * np.abs(refined[:, 1]).max()
