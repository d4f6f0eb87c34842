"""Pages of suites, tunings and studies in headless Chromium, operated as those of runs are."""

import csv
import io

import pytest

import isolation_sim as iso
from ground_motions import write_csv
from isolation_sim.reports import style
from isolation_sim.reports.figures import time_histories
from studies.report import study_report

SUITE = """
name = "two"
[ground]
folder = "records"
[[controller]]
name = "passive_off"
[[controller]]
name = "passive_on"
"""
SECTIONS = {
    "suite": ["Verdict", "Spectra", "Statistics over the suite", "Results by record"],
    "tuning": ["Verdict", "Gain", "Settings", "Search", "Sensitivity", "Inputs and versions"],
    "study": ["Finding", "Numbers", "Figures", "Inputs and versions"],
}
PHONE = {"width": 390, "height": 600, "is_mobile": True, "has_touch": True}
DARK = {"color_scheme": "dark"}


@pytest.fixture(scope="module")
def pages(ground, runs, tmp_path_factory):
    """A page of each kind, of motions of two seconds."""
    place = tmp_path_factory.mktemp("pages")
    (place / "records").mkdir()
    short = ground.cut(1.0, 3.0)
    for k, factor in enumerate((1.0, 0.5)):
        write_csv(short.scaled(factor), place / "records" / f"m{k}.csv")
    (place / "two.toml").write_text(SUITE)
    suite = iso.run_suite(place / "two.toml", place / "suite", workers=1)
    iso.tune(
        "constant", motions=[short], unseen=[short.scaled(0.5)], evaluations=5,
        out=place / "tuned", workers=1,
    )  # fmt: skip
    picture, _ = style.save(time_histories(runs), place, "histories")
    study = study_report(
        "Currents", ["It is so."],
        {"Found": (["controller", "drift, mm"], [["passive off", "1.9"], ["passive on", "4.2"]])},
        [picture], "which current", "isolation-sim study currents",
    )  # fmt: skip
    return {
        "suite": suite.folder / "report.html",
        "tuning": place / "tuned" / "report.html",
        "study": study.write(place / "study.html"),
    }


def fits(page, cut_off):
    """Whether nothing is cut off, no chart scrolls and all images are there."""
    return (
        cut_off(page) == []
        and page.evaluate(
            "[...document.querySelectorAll('.chart .scroll')].every("
            "(each) => each.scrollWidth <= each.clientWidth)"
        )
        and page.evaluate(
            "[...document.images].every((image) => image.complete && image.naturalWidth > 0)"
        )
    )


@pytest.mark.parametrize("kind", SECTIONS)
def test_a_page_fits_its_window_and_its_figures_do_not_scroll(pages, shown, until, cut_off, kind):
    page = shown(pages[kind], **DARK)
    for width in (390, 1400):
        page.set_viewport_size({"width": width, "height": 600})
        until(
            page,
            "(width) => [...document.querySelectorAll('.plot')].every("
            "(plot) => plot._fullLayout.width > 0.6 * width && plot._fullLayout.width < width)",
            width,
        )
        assert fits(page, cut_off), (width, cut_off(page))


def test_a_page_fits_a_phone(pages, shown, cut_off):
    assert fits(shown(pages["suite"], **PHONE), cut_off)


@pytest.mark.parametrize("kind", SECTIONS)
def test_the_navigation_names_the_sections_and_stays(pages, shown, until, kind):
    page = shown(pages[kind], **DARK)
    links = page.locator("nav a").all_inner_texts()
    assert [name for name in links if name in SECTIONS[kind]] == SECTIONS[kind]
    page.evaluate("scrollTo({top: document.body.scrollHeight, behavior: 'instant'})")
    until(page, "Math.abs(document.querySelector('nav').getBoundingClientRect().top) < 1")


@pytest.mark.parametrize("kind", SECTIONS)
def test_a_dark_page_has_light_text(pages, shown, kind):
    page = shown(pages[kind], **DARK)
    grey = """(key) => { const [r, g, b] = getComputedStyle(document.body)[key]
      .match(/[\\d.]+/g).map(Number); return 0.299 * r + 0.587 * g + 0.114 * b; }"""
    assert page.evaluate(grey, "backgroundColor") < 40
    assert page.evaluate(grey, "color") > 180


@pytest.mark.parametrize("kind", SECTIONS)
def test_the_keyboard_goes_from_top_to_bottom_past_the_toolbars(pages, shown, kind):
    page = shown(pages[kind], **DARK)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    stops = []
    for _ in range(60):
        page.keyboard.press("Tab")
        stop = page.evaluate(
            "(({tagName, className, textContent}) => [tagName, className, textContent])"
            "(document.activeElement)"
        )
        if stop[0] == "BODY":
            break
        top = page.evaluate("document.activeElement.getBoundingClientRect().top + scrollY")
        stops.append((*stop, top))
    assert stops and not any("modebar" in str(each[1]) for each in stops)
    # behind the navigation, which stands on top wherever the page is
    below = [top for tag, _, _, top in stops if tag != "A"]
    assert below == sorted(below)


@pytest.mark.parametrize("kind", ["suite", "study"])
def test_tables_name_controllers_as_people_write_them(pages, shown, kind):
    text = shown(pages[kind], **DARK).locator("main").inner_text()
    assert "passive off" in text and "passive_o" not in text


def test_a_tunings_charts_tell_units_and_are_downloaded(pages, shown):
    page = shown(pages["tuning"], **DARK)
    assert page.evaluate(
        "[...document.querySelectorAll('.plot')].flatMap((plot) => plot._fullData)"
        ".every((trace) => trace.hoverinfo !== 'skip')"
    )
    figure = page.locator("figure.chart", has_text="Progress of the search")
    figure.locator("summary").click()
    with page.expect_download() as waited:
        figure.get_by_role("button", name="data (CSV)").click()
    rows = list(csv.reader(io.StringIO(waited.value.path().read_text())))
    assert rows[0] == ["line", "Trial", "Mean score"]
    assert {line for line, *_ in rows[1:]} == {"candidate", "best so far"}
    with page.expect_download() as waited:
        figure.get_by_role("button", name="figure (SVG)").click()
    assert waited.value.path().read_text().startswith("<svg")
