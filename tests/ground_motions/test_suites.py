"""Suites of records: reading, spectra of pairs, scaling, selection, spectral matching."""

import math
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.signal import StateSpace, lsim

from ground_motions import (
    STANDARD_GRAVITY,
    SUITE_RULES,
    InputError,
    Record,
    asce7_22_two_period,
    combined_spectrum,
    el_centro_1940,
    en1998_1_2004,
    match_spectrum,
    matching,
    oscillator_response,
    read,
    read_files,
    read_folder,
    read_peer,
    response_spectrum,
    scale_suite,
    select_best,
    write_csv,
)
from ground_motions.component_names import component_end

G = STANDARD_GRAVITY
TARGET = asce7_22_two_period(G, 0.6 * G, 8.0)


def lsim_displacement(record, period, damping=0.05):
    """Relative displacement by SciPy's lsim, a period of free vibration included."""
    w = 2 * math.pi / period
    system = StateSpace([[0, 1], [-(w**2), -2 * damping * w]], [[0], [-1]], [[1, 0]], [[0]])
    motion = record.padded(after=period).resampled(record.dt / 4)
    return lsim(system, motion.acceleration, motion.time, interp=True)[1]


def a_pair():
    first = el_centro_1940().cut(0.0, 15.0)
    time = first.time
    turned = 0.6 * np.roll(first.acceleration, 7) + 0.3 * np.sin(4 * time) * np.exp(-0.3 * time)
    return first, Record(turned, first.dt, "second")


def test_rotd100_against_every_degree_by_lsim():
    first, second = a_pair()
    for period in (0.4, 1.1, 2.5):
        x, y = lsim_displacement(first, period), lsim_displacement(second, period)
        angles = np.radians(np.arange(180))
        peaks = np.abs(np.outer(np.cos(angles), x) + np.outer(np.sin(angles), y)).max(axis=1)
        expected = (2 * math.pi / period) ** 2 * peaks.max()
        (result,) = combined_spectrum((first, second), [period], "rotd100")
        assert result == pytest.approx(expected, rel=2e-3)


def test_rotd100_of_a_motion_along_one_line_is_its_own_spectrum():
    first, _ = a_pair()
    periods = [0.0, 0.3, 1.0, 3.0]
    (own,) = (combined_spectrum((first,), periods),)
    pair = first.scaled(0.8), first.scaled(0.6)
    np.testing.assert_allclose(combined_spectrum(pair, periods, "rotd100"), own, rtol=1e-4)
    np.testing.assert_allclose(combined_spectrum(pair, periods, "srss"), own, rtol=1e-12)
    np.testing.assert_allclose(combined_spectrum(pair, periods, "mean"), 0.7 * own, rtol=1e-12)
    np.testing.assert_allclose(
        combined_spectrum(pair, periods, "geometric_mean"), math.sqrt(0.48) * own, rtol=1e-12
    )


def test_scaling_finds_known_factors_and_lifts_the_mean_to_the_floor():
    rule = SUITE_RULES["asce7_22_16"]
    periods = rule.periods(2.0)
    assert (periods[0], periods[-1]) == pytest.approx((0.4, 4.0))
    target = TARGET.psa(periods)
    factors = np.array([0.5, 1.0, 2.5])
    computed = scale_suite(target / factors[:, None], target, rule.floors, (0.1, 10.0))
    np.testing.assert_allclose(computed.factors, factors)
    assert computed.common == 1.0
    # a record that is low somewhere: the common factor brings the mean to 0.9 there
    dented = target / factors[:, None]
    dented[:, 30] *= 0.6
    lifted = scale_suite(dented, target, rule.floors, (0.1, 10.0))
    assert lifted.mean_ratio.min() == pytest.approx(0.9)
    np.testing.assert_allclose(lifted.factors / lifted.common * lifted.common, lifted.factors)
    # the largest factor stays within its limit
    held = scale_suite(dented, target, rule.floors, (0.1, 2.6))
    assert held.factors.max() <= 2.6
    assert held.mean_ratio.min() == pytest.approx(0.9, rel=1e-6)
    with pytest.raises(InputError, match=r"upper limit 0.3"):
        scale_suite(dented, target, rule.floors, (0.1, 0.3))


def test_zero_period_of_en1998_1_is_checked():
    rule = SUITE_RULES["en1998_1_2004"]
    periods = rule.periods(1.0)
    target = TARGET.psa(periods)
    low_at_zero = target.copy()
    low_at_zero[0] *= 0.5
    result = scale_suite(low_at_zero[None], target, rule.floors, (0.1, 10.0))
    assert periods[0] == 0.0
    assert result.common == pytest.approx(2.0)


def test_which_response_a_rule_designs_for():
    asked = {name: [rule.design_statistic(n) for n in (2, 3, 7, 11)]
             for name, rule in SUITE_RULES.items()}  # fmt: skip
    assert asked["asce7_22_16"] == [None, None, None, "mean"]
    assert asked["asce7_22_17"] == [None, None, "mean", "mean"]
    assert asked["en1998_1_2004"] == [None, "maximum", "mean", "mean"]
    assert asked["en1998_2_2005"] == asked["en1998_1_2004"]


def test_selection_takes_the_best_shapes_within_the_limits():
    periods = np.geomspace(0.4, 3.0, 100)
    target = TARGET.psa(periods)
    wave = np.sin(np.linspace(0, 6, 100))
    spectra = np.array([target * np.exp(0.3 * wave), target / 3, target / 20,
                        target * np.exp(0.1 * wave)])  # fmt: skip
    # the third has the shape of the target, but needs a factor of 20
    assert select_best(spectra, target, 2, (0.25, 4.0)).tolist() == [1, 3]
    with pytest.raises(InputError, match="1 to 4"):
        select_best(spectra, target, 5, (0.25, 4.0))


def test_a_matched_record_fits_and_keeps_its_baseline():
    record = el_centro_1940()
    matched = match_spectrum(record, TARGET, 0.5, 3.75)
    motion = matched.record
    assert matched.largest_misfit <= 0.05
    for period in (0.53, 0.77, 1.03, 1.37, 1.9, 2.6, 3.3):  # none of those that were matched
        peak = np.abs(lsim_displacement(motion, period)).max() * (2 * math.pi / period) ** 2
        assert peak == pytest.approx(TARGET.psa(period)[0], rel=0.05)
    # the wavelets add neither velocity nor displacement at the end
    length = (len(motion) - 1) * motion.dt
    original = record.scaled(matched.scale_factor).resampled(motion.dt)
    before = (length - original.duration) / 2
    original = original.padded(before, before)
    n = min(len(motion), len(original))
    added = Record(motion.acceleration[:n] - original.acceleration[:n], motion.dt)
    assert abs(added.velocity[-1]) < 1e-8 * added.pgv
    assert abs(added.displacement[-1]) < 1e-6 * added.pgd
    assert matched.arias_ratio == pytest.approx(
        motion.arias_intensity() / record.scaled(matched.scale_factor).arias_intensity()
    )


@pytest.mark.parametrize("name", ["erzikan", pytest.param("kobe", marks=pytest.mark.slow)])
def test_recorded_components_are_matched_to_en1998(shared_data, name):
    """Two of 14; all of them and El Centro 1940 come within 4.6 % of both codes."""
    target = en1998_1_2004(2.0, "B")
    file = shared_data / "benchmark_8_storey" / f"{name}.csv"
    matched = match_spectrum(read(file, column="fault_parallel_m_s2"), target, 0.4, 4.0)
    assert matched.largest_misfit <= 0.05
    periods = np.geomspace(0.4, 4.0, 977)  # between those that were matched
    ratio = response_spectrum(matched.record, periods).psa / target.psa(periods)
    assert np.abs(ratio - 1.0).max() <= 0.05
    assert 0.7 < matched.arias_ratio < 1.5


def test_closed_form_of_a_wavelet_is_the_oscillators_response():
    """Influence of wavelets by error functions of complex numbers, against the time stepping."""
    periods = np.array([0.5, 0.9, 2.0])
    wavelets = matching._Wavelets(periods)
    time, peak = np.arange(0.0, 30.0, 0.002), np.full(3, 14.0)
    shapes = [wavelets.acceleration(np.array([k]), peak[:1], np.ones(1), time) for k in range(3)]
    at = np.linspace(8.0, 22.0, 40)
    for row, period in enumerate(periods):
        result = wavelets._influence(np.full(40, row), at, np.arange(3), peak)
        for column, shape in enumerate(shapes):
            response = oscillator_response(Record(shape, 0.002), period)
            expected = (2 * math.pi / period) ** 2 * np.interp(at, time, response.displacement)
            np.testing.assert_allclose(
                result[:, column], expected, atol=2e-4 * np.abs(expected).max()
            )


def test_a_match_that_fails_says_how_far_it_came():
    pulse = Record(np.concatenate((np.zeros(50), [1.0], np.zeros(200))), 0.02, "pulse")
    with pytest.raises(InputError, match=r"match of record pulse: given .*% from the target"):
        match_spectrum(pulse, TARGET, 0.5, 0.8, tolerance=0.0001)


AT2 = """PEER NGA STRONG MOTION DATABASE RECORD
Somewhere, 1/1/2000, {name}
ACCELERATION TIME SERIES IN UNITS OF G
NPTS=      4, DT=   .0100 SEC
  .1000000E+00  {second}  .3000000E-01  .0000000E+00
"""
SEARCH = """
 PEER Ground Motion Database, Time Series Search Report -- NGA-West2 -- 2025-12-30

 -- Summary of Metadata of Selected Records --
Result ID, Spectral Ordinate, Record Sequence Number, Mean Squared Error, Scale Factor, \
Earthquake Name, Year, Horizontal-1 Acc. Filename, Horizontal-2 Acc. Filename, Vertical Acc. Filename
1, SRSS, 6, 0.4768, 1.5, "Imperial Valley-02", 1940, RSN6_A-180.AT2, RSN6_A-270.AT2 , RSN6_A-UP.AT2  
2, SRSS, 78, 2.5232, 0.8, "San Fernando, again", 1971, RSN78_B.AT2, RSN78_C.AT2 ,  -----   

 These records were obtained from the NGA-West2 On-Line Ground-Motion Database Tool
"""  # noqa: E501
FILES = ("RSN6_A-180", "RSN6_A-270", "RSN6_A-UP", "RSN78_B", "RSN78_C")


def peer_download(path, leave_out=""):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("_SearchResults.csv", SEARCH)
        for k, name in enumerate(FILES):
            if name != leave_out:
                archive.writestr(f"{name}.AT2", AT2.format(name=name, second=f"{k + 2}.0E-02"))
            archive.writestr(f"{name}.VT2", "not wanted")
    return path


def test_a_peer_download_gives_pairs_and_factors(tmp_path):
    first, second = read_peer(peer_download(tmp_path / "peer.zip"))
    assert (first.name, second.name) == ("RSN6", "RSN78")
    assert (first.scale_factor, second.scale_factor) == (1.5, 0.8)
    assert [each.name for each in first.components] == ["RSN6_A-180", "RSN6_A-270"]
    assert first.vertical.name == "RSN6_A-UP"
    assert second.vertical is None
    np.testing.assert_allclose(first.components[1].acceleration[:2], [0.1 * G, 0.03 * G])
    # unpacked, it is the same
    with zipfile.ZipFile(tmp_path / "peer.zip") as archive:
        archive.extractall(tmp_path / "unpacked")
    again = read_folder(tmp_path / "unpacked")
    assert [record.components for record in again] != []
    np.testing.assert_array_equal(
        again[0].components[1].acceleration, first.components[1].acceleration
    )


def test_archives_are_to_be_unpacked(tmp_path):
    path = peer_download(tmp_path / "esm.zip")
    with pytest.raises(InputError, match=r"esm.zip: given an archive .zip; .*the files in it, unp"):
        read(path)
    with pytest.raises(InputError, match=r"given a file; expected: a folder with .*, unpacked"):
        read_folder(path)
    with pytest.raises(InputError, match=r"given a folder; .*folder = reads it unpacked"):
        read_peer(tmp_path)


def test_search_results_that_excel_has_saved_are_read(tmp_path):
    with zipfile.ZipFile(peer_download(tmp_path / "peer.zip")) as archive:
        archive.extractall(tmp_path)
    saved = "\n".join(f"{line},,," for line in SEARCH.splitlines())
    (tmp_path / "_SearchResults.csv").write_text(saved)
    assert [record.name for record in read_folder(tmp_path)] == ["RSN6", "RSN78"]


def test_bad_downloads_are_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r"RSN6_A-270.AT2, which is not in the zip file"):
        read_peer(peer_download(tmp_path / "lacks.zip", leave_out="RSN6_A-270"))
    (tmp_path / "no.zip").write_text("no zip file")
    with pytest.raises(InputError, match=r"no.zip: given no zip file"):
        read_peer(tmp_path / "no.zip")
    with pytest.raises(InputError, match="given a file; expected: a folder"):
        read_folder(__file__)
    with pytest.raises(InputError, match="a folder that does not exist"):
        read_folder(tmp_path / "missing")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no file of a record"):
        read_folder(tmp_path / "empty")


def test_a_folder_of_several_formats(tmp_path):
    motion = el_centro_1940().cut(0.0, 2.0)
    header, rows = "time_s,ew_m_s2,ns_m_s2,ud_m_s2", [f"{0.1 * k},{k},{2 * k},3" for k in range(9)]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]))
    (tmp_path / "d.csv").write_text("\n".join(["time_s,e1_m_s2,e2_m_s2,e3_m_s2", *rows]))
    (tmp_path / "b.csv").write_text(
        "\n".join(["time_s,acc", *(f"{0.1 * k},{0.1 * k}" for k in range(9))])
    )
    np.savetxt(tmp_path / "c.txt", np.column_stack((motion.time, motion.acceleration)))
    (tmp_path / "notes.md").write_text("mine")
    named = ["ns_m_s2", "ew_m_s2", "ud_m_s2"]
    with pytest.raises(InputError, match=r"column= one of e1_m_s2, e2_m_s2, e3_m_s2"):
        read_files([tmp_path / "d.csv"], unit="m/s2")
    (tmp_path / "d.csv").unlink()
    with pytest.warns(UserWarning, match=r": not used: notes\.md$"):
        a, b, c = read_folder(tmp_path, unit="g", column=named)
    assert [each.name for each in a.components] == ["a_ns", "a_ew"]
    assert a.vertical.acceleration.tolist() == [3.0] * 9
    assert b.components[0].pga == pytest.approx(0.8 * G)
    np.testing.assert_allclose(c.components[0].acceleration, motion.acceleration * G)
    # without a unit, text is not read
    (tmp_path / "b.csv").unlink()
    with pytest.warns(UserWarning, match=r"not used: c\.txt, notes\.md; \.txt, .* need unit"):
        assert [each.name for each in read_folder(tmp_path, column="ew_m_s2")] == ["a"]
    with pytest.raises(InputError, match=r"a\.csv: given 3 components; expected: one"):
        read_files([[tmp_path / "a.csv", tmp_path / "a.csv"]], column=named)


@pytest.mark.parametrize(
    ("heading", "order"),
    [
        ("Time [s],EW [m/s2],NS [m/s2],UD [m/s2]", [0, 1, 2]),
        ("time_s,acc_up_m_s2,acc_x_m_s2,acc_y_m_s2", [1, 2, 0]),
        ("Zeit,Beschl. NS,Beschl. vertikal,Beschl. EW\ns,m/s²,m/s²,m/s²", [0, 2, 1]),
    ],
)
def test_headings_tell_the_vertical_column(tmp_path, heading, order):
    rows = [f"{0.1 * k:g},{k},{2 * k},{3 * k}" for k in range(5)]
    (tmp_path / "a.csv").write_text("\n".join([heading, *rows]))
    (record,) = read_folder(tmp_path)
    parts = (*record.components, record.vertical)
    assert [each.acceleration[1] - 1.0 for each in parts] == order


def test_two_directions_in_a_matlab_file_are_a_pair(tmp_path):
    values = {"dt": 0.01, "acc_EW_m_s2": np.arange(9.0), "acc_NS_m_s2": np.ones(9)}
    savemat(tmp_path / "a.mat", values)
    savemat(tmp_path / "b.mat", values | {"acc_UD_m_s2": np.zeros(9)})
    savemat(tmp_path / "c.mat", {"dt": 0.01, "acc": np.ones(9), "acc_filtered": np.ones(9)})
    errors: list[InputError] = []
    a, b = read_folder(tmp_path, unit="m/s2", on_unreadable=errors.append)
    assert [each.acceleration[2] for each in a.components] == [2.0, 1.0]
    assert b.vertical.pga == 0.0
    assert "c.mat: given 2 vectors and no choice" in str(errors[0])


def test_text_with_units_in_its_headings_needs_no_unit(tmp_path):
    rows = ["0,00\t0,1", "0,01\t0,2", "0,02\t0,3"]
    text = "\n".join(["Zeit [s]\tBeschleunigung [cm/s²]", *rows])
    (tmp_path / "a.txt").write_text(text)
    (tmp_path / "b.txt").write_text("\n".join(rows))
    with pytest.warns(UserWarning, match="not used: b.txt; .* need unit, or headings with one"):
        (record,) = read_folder(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        one, other = read_folder(tmp_path, unit="g")
    pga = [each.components[0].pga for each in (record, one, other)]
    np.testing.assert_allclose(pga, [0.003, 0.003, 0.3 * G])
    with pytest.raises(InputError, match="unit 'g' for column"):
        read(tmp_path / "a.txt", unit="g")


def test_files_with_times_keep_their_step_beside_those_without(tmp_path):
    times = 0.01 * np.arange(50)
    shaken = np.sin(times)
    np.savetxt(tmp_path / "one.txt", shaken)
    np.savetxt(tmp_path / "two.txt", np.column_stack((times, shaken)))
    savemat(tmp_path / "three.mat", {"time": times, "acc": shaken})
    steps = {each.name: each.components[0].dt for each in read_folder(tmp_path, unit="g", dt=0.02)}
    assert steps == pytest.approx({"one": 0.02, "two": 0.01, "three": 0.01})
    np.savetxt(tmp_path / "two.txt", np.column_stack((times**2, shaken)))
    with pytest.raises(InputError, match=r"two\.txt, .*column 1"):
        read_folder(tmp_path, unit="g", dt=0.02)


def test_a_copied_record_is_told(tmp_path, recwarn):
    motion = el_centro_1940().cut(0.0, 3.0)
    write_csv(motion, tmp_path / "a.csv")
    write_csv(motion.scaled(0.6), tmp_path / "weak.csv")
    read_folder(tmp_path)
    assert not recwarn.list
    # the same in another format, with fewer digits
    np.savetxt(tmp_path / "b.txt", np.column_stack((motion.time, motion.acceleration / G)), "%.5f")
    with pytest.warns(UserWarning, match=r"same accelerations are in a and b: a copied record"):
        assert len(read_folder(tmp_path, unit="g")) == 3


def test_unreadable_records_are_told_together_or_left_out(tmp_path):
    good = "PEER\nan event\nACCELERATION IN UNITS OF G\nNPTS= 3, DT= .01 SEC\n0 .1 0\n"
    for name, text in (("a", good), ("b", good.replace("UNITS OF G", "")), ("c", ""), ("d", good)):
        (tmp_path / f"{name}.AT2").write_text(text)
    (tmp_path / "e.csv").write_text("")
    told = (
        r"3 of 5 records cannot be read: .*b\.AT2.*no units.*c\.AT2, .*e\.csv: .*empty.*leave_out"
    )
    with pytest.raises(InputError, match=told) as caught:
        read_folder(tmp_path)
    assert "\n" not in str(caught.value)
    errors = []
    assert [r.name for r in read_folder(tmp_path, on_unreadable=errors.append)] == ["a", "d"]
    assert [Path(error.place.partition(",")[0]).name for error in errors] == [
        "b.AT2", "c.AT2", "e.csv",
    ]  # fmt: skip
    missing = [tmp_path / f"{k}.AT2" for k in range(20)]
    with pytest.raises(InputError, match=r"20 of 20 .*0\.AT2.*7\.AT2: no such file; and 12 more$"):
        read_files(missing, on_unreadable=errors.append)
    with pytest.raises(InputError, match=r"^[^;]*0\.AT2: no such file$"):
        read_files(missing[:1])


def test_components_of_kiknet_are_one_record(tmp_path):
    names = ("Origin Time", "Lat.", "Lon.", "Depth. (km)", "Mag.", "Station Code", "Station Lat.",
             "Station Lon.", "Station Height(m)", "Record Time", "Sampling Freq(Hz)",
             "Duration Time(s)", "Dir.", "Scale Factor", "Max. Acc. (gal)", "Last Correction",
             "Memo.")  # fmt: skip
    values = {"Sampling Freq(Hz)": "2Hz", "Duration Time(s)": "2", "Scale Factor": "100(gal)/1"}
    header = "\n".join(f"{name:18s}{values.get(name, '1')}" for name in names)
    for k, suffix in enumerate(("NS1", "EW1", "UD1", "NS2", "EW2", "UD2"), start=1):
        (tmp_path / f"X.{suffix}").write_text(f"{header}\n {k} {-k} {k} {-k}\n")
    with pytest.warns(UserWarning, match=r"in a borehole: X\.NS1, X\.EW1, X\.UD1$"):
        records = read_folder(tmp_path)
    deep, surface = sorted(records, key=lambda each: each.name)
    assert (deep.name, surface.name) == ("X_1", "X_2")
    assert [each.pga for each in (*deep.components, deep.vertical)] == [1.0, 2.0, 3.0]
    assert [each.pga for each in (*surface.components, surface.vertical)] == [4.0, 5.0, 6.0]


@pytest.mark.parametrize(
    ("stems", "named"),
    [
        (("a_H1", "a_H2"), "a: a_H1 a_H2"),
        (("a-FP", "a-FN", "a-UP"), "a: a-FN a-FP | a-UP"),
        (("RSN6_IMPVALL.I_I-ELC270", "RSN6_IMPVALL.I_I-ELC180", "RSN6_IMPVALL.I_I-ELC-UP"),
         "RSN6_IMPVALL.I_I-ELC: RSN6_IMPVALL.I_I-ELC180 RSN6_IMPVALL.I_I-ELC270 | "
         "RSN6_IMPVALL.I_I-ELC-UP"),
        (("TAFT-000", "TAFT-090"), "TAFT: TAFT-000 TAFT-090"),
        (("B_360", "B_090"), "B: B_090 B_360"),
        (("c_y", "c_x", "d"), "c: c_x c_y, d"),
        (("e EW", "e NS", "e_N"), "e EW, e NS, e_N"),  # three ends
        (("f-000", "f-045"), "f-000, f-045"),  # no right angle
        (("g_001", "g_091", "g_181"), "g_001, g_091, g_181"),  # numbers
        (("h", "h_H1", "h_H2"), "h, h_H1, h_H2"),  # the pair would have another's name
        (("i_H1", "j_H2", "k_UP", "l_400", "l_490"), "i_H1, j_H2, k_UP, l_400, l_490"),
    ],
)  # fmt: skip
def test_components_are_paired_by_the_ends_of_their_names(tmp_path, stems, named):
    text = "PEER\nan event\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 3, DT= .01 SEC\n0 .{} 0\n"
    for k, stem in enumerate(stems, 1):
        (tmp_path / f"{stem}.AT2").write_text(text.format(k))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        records = read_folder(tmp_path)
    results = [
        " | ".join([" ".join(c.name for c in r.components), *([r.vertical.name] if r.vertical
                                                             else [])])
        for r in records
    ]  # fmt: skip
    results = [
        f"{r.name}: {parts}" if len(r.components) > 1 else parts
        for r, parts in zip(records, results, strict=True)
    ]
    assert ", ".join(results) == named
    lines = [str(each.message) for each in caught]
    pair = named.partition(",")[0]
    if ":" in named:
        files = ", ".join(f"{stem}.AT2" for stem in pair.partition(": ")[2].split() if stem != "|")
        told = f"by the ends of their names or by their headers: {records[0].name} ({files});"
        assert told in lines[0]
    else:
        assert not lines


def test_a_folder_and_a_list(tmp_path):
    first, second = a_pair()
    write_csv(first, tmp_path / "one.csv")
    rows = "\n".join(
        f"{t!r},{a!r},{b!r}" for t, a, b in zip(
            first.time.tolist(), first.acceleration.tolist(), second.acceleration.tolist(),
            strict=True,
        )
    )  # fmt: skip
    (tmp_path / "two.csv").write_text(f"time_s,normal_m_s2,parallel_m_s2\n{rows}\n")
    one, two = read_folder(tmp_path)
    assert (one.name, len(one.components)) == ("one", 1)
    assert (two.name, len(two.components)) == ("two", 2)
    np.testing.assert_array_equal(two.components[1].acceleration, second.acceleration)
    (pair,) = read_files([[tmp_path / "one.csv", tmp_path / "one.csv"]])
    assert (pair.name, len(pair.components)) == ("one", 2)
    for end in ("H1", "H2"):
        write_csv(first, tmp_path / f"hill_{end}.csv")
    (pair,) = read_files([[tmp_path / "hill_H2.csv", tmp_path / "hill_H1.csv"]])
    assert (pair.name, [each.name for each in pair.components]) == ("hill", ["hill_H2", "hill_H1"])
    with pytest.raises(InputError, match="two called one"):
        read_files([tmp_path / "one.csv", tmp_path / "one.csv"])


@pytest.mark.parametrize(
    ("name", "end"),
    [("kobe_FN", "FN"), ("RSN6_IMPVALL.I_I-ELC180", "180"), ("hill ns", "ns"), ("el_centro", "")],
)
def test_the_end_of_a_name_tells_the_component(name, end):
    assert component_end(name) == end
