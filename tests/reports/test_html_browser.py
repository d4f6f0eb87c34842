"""Reports in headless Chromium: opened, operated, printed, on a wide and on a narrow screen."""

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.reports.chart import Panel
from isolation_sim.reports.html.page import Cell, Page, Row, Section, Table
from isolation_sim.reports.html.panels import panel_chart
from isolation_sim.reports.style import Look
from isolation_sim.written_names import as_written

LINKED_CSS = ".plot[data-link='time']"
LINKED = "[...document.querySelectorAll(\".plot[data-link='time']\")]"


@pytest.fixture(scope="module")
def report(runs, tmp_path_factory):
    """Report of three runs of eight seconds."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    return iso.Comparison(runs).to_html(path, 'name = "short"\n')


def ranges(page):
    """Interval of time that each linked chart shows."""
    return page.evaluate(f"{LINKED}.map((plot) => plot.layout.xaxis.range)")


def all_show(until, page, start, stop):
    """Wait until every chart over time shows an interval, to 1 ms."""
    until(
        page,
        f"([start, stop]) => {LINKED}.every((plot) => Math.abs(plot.layout.xaxis.range[0] - start)"
        " < 1e-3 && Math.abs(plot.layout.xaxis.range[1] - stop) < 1e-3)",
        [start, stop],
    )


def test_zoom_one_and_all_follow(report, shown, until):
    page = shown(report)
    assert len(ranges(page)) == 7  # ground, base, roof, current, and an energy ledger a run
    chart = page.locator(".plot[data-link='time']").nth(1)
    chart.scroll_into_view_if_needed()
    box = chart.locator(".nsewdrag").bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 0.25 * box["width"], middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.75 * box["width"], middle, steps=5)
    page.mouse.up()
    until(page, f"{LINKED}[1].layout.xaxis.range[0] > 1")
    start, stop = ranges(page)[1]
    assert start == pytest.approx(2, abs=0.1) and stop == pytest.approx(6, abs=0.1)
    all_show(until, page, start, stop)
    # the fields tell it, set it, and bring the whole record back
    assert float(page.locator("[name=start]").input_value()) == pytest.approx(start, abs=1e-3)
    page.locator("[name=start]").fill("3")
    page.locator("[name=stop]").fill("3.5")
    page.keyboard.press("Enter")
    all_show(until, page, 3, 3.5)
    page.get_by_role("button", name="Whole record").click()
    all_show(until, page, 0, 8)
    # an interval that ends before it starts is refused
    page.locator("[name=start]").fill("5")
    page.locator("[name=stop]").fill("4")
    page.get_by_role("button", name="Show").click()
    message = page.evaluate("document.querySelector('[name=stop]').validationMessage")
    assert message == "The end has to come after the start."
    assert all(shown == [0, 8] for shown in ranges(page))


def test_loops_follow_each_other_and_the_legend_hides_a_run_everywhere(report, shown, until):
    page = shown(report)
    page.evaluate(
        "Plotly.relayout(document.querySelector(\".plot[data-link='loop']\"),"
        " {'xaxis.range': [-10, 10], 'yaxis.range': [-5, 5]})"
    )
    until(
        page,
        "[...document.querySelectorAll(\".plot[data-link='loop']\")].every((plot) =>"
        " plot.layout.xaxis.range[1] === 10 && plot.layout.yaxis.range[1] === 5)",
    )
    assert all(shown == [0, 8] for shown in ranges(page))
    visible = (
        "[...document.querySelectorAll('.plot')].flatMap((plot) => plot._fullData)"
        ".filter((trace) => trace.meta === 'on-off' && trace.visible === true).length"
    )
    before = page.evaluate(visible)
    page.get_by_label("on-off").and_(page.locator("[type=checkbox]")).uncheck()
    until(page, f"{visible} === 0")
    page.get_by_label("on-off").and_(page.locator("[type=checkbox]")).check()
    until(page, f"{visible} === {before}")
    assert before == 7  # trade-off, base, roof, current, loop, acceleration, drift


def frame(page):
    return int(page.locator(".slider input").input_value())


def picture(page, side="left"):
    return page.locator(f"[data-side={side}] svg").inner_html()


def test_the_animation_tells_what_the_run_did_and_plays(report, shown, until, runs):
    page = shown(report)
    displacement = 1e3 * runs["passive_off"].output("base_displacement_m")
    text = page.locator("[data-side=left] figcaption").inner_text()
    # at rest it shows the largest motion; frames may fall between samples
    shown = float(text.splitlines()[0].split()[1])
    assert abs(shown) == pytest.approx(abs(displacement).max(), rel=0.01)
    still = picture(page), picture(page, "right")
    assert still[0] != still[1]
    # on a busy machine the first frame has begun long before the button was pressed
    page.evaluate(
        "(real => { window.requestAnimationFrame = (call) => real((now) => call(now - 500)); })"
        "(window.requestAnimationFrame)"
    )
    page.get_by_role("button", name="Play").click()
    until(page, "+document.querySelector('.slider input').value > 5")
    page.get_by_role("button", name="Pause").click()
    paused = frame(page)
    page.wait_for_timeout(200)
    assert frame(page) == paused
    assert picture(page) != still[0]
    page.locator(".slider input").focus()
    page.keyboard.press("Home")
    assert frame(page) == 0
    page.keyboard.press("ArrowRight")
    assert frame(page) == 1
    page.keyboard.press("End")
    assert page.locator(".controls output").inner_text() == "8.0 s"
    assert page.locator(".slider input").get_attribute("aria-valuetext") == "8.0 s"
    page.locator("[data-side=left] select").select_option("on-off")
    page.locator("[data-side=right] select").select_option("on-off")
    assert picture(page) == picture(page, "right")


def test_little_motion_is_shown_to_those_who_want_little(report, shown):
    page = shown(report)
    page.emulate_media(reduced_motion="reduce")
    page.get_by_role("button", name="Play").click()
    page.evaluate(
        "new MutationObserver((all) => { window.changes = (window.changes ?? 0) + 1; }).observe("
        "document.querySelector('[data-side=left] svg'), {attributes: true, subtree: true})"
    )
    page.wait_for_timeout(700)
    assert page.evaluate("window.changes ?? 0") <= 2
    page.get_by_role("button", name="Pause").click()
    page.emulate_media(reduced_motion="no-preference")


def test_everything_is_accessible_by_keyboard(report, opened, until):
    page = opened(report)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "content"
    peaks, expected = set(), {
        "DIV  scroll", "SELECT select-one", "BUTTON button play", "INPUT range", "INPUT checkbox",
        "INPUT number", "BUTTON submit", "BUTTON reset", "SUMMARY",
    }  # fmt: skip
    for _ in range(120):
        if expected <= peaks:
            break
        page.keyboard.press("Tab")
        peaks.add(page.evaluate(
            "(({tagName, type, className}) => `${tagName} ${type ?? ''} ${className}`.trim())"
            "(document.activeElement)"
        ))  # fmt: skip
    assert expected <= peaks
    page.locator(LINKED_CSS).first.get_by_role("button", name="Zoom in").focus()
    page.keyboard.press("Enter")
    all_show(until, page, 2, 6)


WINDOWS = [{}, {"width": 390, "height": 844, "is_mobile": True, "has_touch": True}]


@pytest.mark.parametrize("window", WINDOWS)
def test_nothing_is_cut_off_or_overlaps(report, shown, window, cut_off):
    page = shown(report, **window)
    assert cut_off(page) == []


def test_charts_fit_on_paper(report, shown, until):
    page = shown(report)
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    until(
        page,
        "[...document.querySelectorAll('.plot')].every((plot) => plot._fullLayout.width <= 680)",
    )
    assert not page.locator(".controls").is_visible()
    assert not page.locator("details").first.is_visible()
    assert page.locator(".marked").first.is_visible()
    # no gap below a chart, and four time histories or three rows of loops a page
    plots = "[...document.querySelectorAll('.plot')]"
    heights = f"{plots}.map((plot) => [plot.offsetHeight, plot._fullLayout.height])"
    assert all(room == height <= 255 for room, height in page.evaluate(heights))
    page.set_viewport_size({"width": 688, "height": 900})
    assert page.evaluate("document.documentElement.scrollWidth") <= 688
    page.set_viewport_size({"width": 1400, "height": 900})
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    until(page, "document.querySelector('.plot')._fullLayout.width > 1000")
    assert page.evaluate(heights)[0] == [340, 340]
    assert page.pdf(format="A4").startswith(b"%PDF")


def test_a_table_is_filtered_by_its_columns(opened, tmp_path, until):
    rows = tuple(
        Row(name, (Cell(law), Cell(value, "best" if value == "1" else "")))
        for name, law, value in (("a", "x", "1"), ("b", "y", "2"), ("c", "x", "3"))
    )
    table = Table("Runs", ("Run", "Law", "Drift, mm"), rows, filters=("Law", "Run"))
    points = {"all": (np.array([1, 2, 3]), np.array([4, 5, 6]))}
    look = {"all": Look("#000000", marker="o", joined=False)}
    chart = panel_chart(Panel("Drift", "x (m)", "y (m)", points, look), ids="abc")
    section = Section("Runs", [table, chart])
    page = opened(Page("Sweep", "", [section]).write(tmp_path / "sweep.html"))
    page.locator("select[data-column='1']").select_option("x")
    shown = page.locator("tbody tr:visible th")
    assert shown.all_inner_texts() == ["a", "c"]
    assert page.locator(".filters output").inner_text() == "2 of 3 rows"
    selected = "JSON.stringify(document.querySelector('.plot').data[0].selectedpoints)"
    until(page, f"{selected} === '[0,2]'")
    page.locator("select[data-column='0']").select_option("c")
    assert shown.all_inner_texts() == ["c"]
    until(page, f"{selected} === '[2]'")


def test_a_run_without_coils_along_two_directions(passive_biaxial, opened, tmp_path, until):
    page = opened(iso.Comparison({"bare": passive_biaxial}).to_html(tmp_path / "bare.html"))
    titles = page.locator(".chart figcaption").all_inner_texts()
    for expected in ("Ground acceleration along x (m/s²)", "Absolute roof acceleration along y"):
        assert any(title.startswith(expected) for title in titles)
    assert not any("current" in title for title in titles)
    page.get_by_role("button", name="Play").click()
    until(page, "+document.querySelector('.slider input').value > 2")


def test_the_first_screen_shows_the_trade_off_and_the_navigation_stays(report, shown, until):
    for window in WINDOWS:
        page, height = shown(report, **window), window.get("height", 900)
        page.evaluate("scrollTo({top: 0, behavior: 'instant'})")
        box = page.locator(".plot").first.bounding_box()
        assert "Trade-off" in page.locator("figcaption").first.inner_text()
        assert box["y"] + box["height"] < height
        page.evaluate("scrollTo({top: document.body.scrollHeight, behavior: 'instant'})")
        until(page, "Math.abs(document.querySelector('nav').getBoundingClientRect().top) < 1")
        assert page.locator("nav").bounding_box()["height"] < 60
        page.evaluate("document.querySelector('nav a[href=\"#energy\"]').click()")
        # the heading is below the navigation, not behind it
        until(
            page,
            "document.querySelector('#energy').getBoundingClientRect().top >= 40"
            " && document.querySelector('#energy').getBoundingClientRect().top < 120",
        )


def test_the_points_of_the_trade_off_are_the_runs_criteria(report, shown, runs):
    page = shown(report)
    evaluation = page.evaluate(
        "document.querySelector('.plot').data.map(({meta, x, y}) => [meta, x[0], y[0]])"
    )
    assert evaluation == [
        [as_written(name), pytest.approx(1e3 * run.criteria["peak_base_displacement_m"]),
         pytest.approx(run.criteria["peak_floor_acceleration_m_s2"])]
        for name, run in runs.items()
    ]  # fmt: skip


def test_a_dark_page_has_light_lines_and_paper_stays_light(report, opened, until):
    page = opened(report, color_scheme="dark")
    bright = """(colour) => { const [r, g, b] = colour.match(/[\\d.]+/g).map(Number);
      return 0.299 * r + 0.587 * g + 0.114 * b; }"""
    body = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert page.evaluate(bright, body) < 40
    until(page, f"{LINKED}.every((plot) => plot._fullLayout.paper_bgcolor === '#15191d')")
    strokes = page.evaluate(
        f"{LINKED}.flatMap((plot) => [...plot.querySelectorAll('.js-line')].map("
        "(line) => getComputedStyle(line).stroke))"
    )
    assert len(strokes) > 6
    assert all(page.evaluate(bright, stroke) > 60 for stroke in strokes)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    until(page, f"{LINKED}.every((plot) => plot._fullLayout.paper_bgcolor === '#fff')")
    first = page.evaluate("document.querySelectorAll('.plot')[2].data[0].line.color")
    assert first == "#000000"


def test_a_chart_is_downloaded_as_data_and_as_a_figure(report, shown, runs):
    import csv
    import io

    page = shown(report)
    figure = page.locator("figure.chart", has_text="Base displacement relative to the ground")
    figure.locator("summary").click()
    with page.expect_download() as waited:
        figure.get_by_role("button", name="data (CSV)").click()
    assert waited.value.suggested_filename == "base_displacement_relative_to_the_ground_mm.csv"
    rows = list(csv.reader(io.StringIO(waited.value.path().read_text())))
    assert rows[0] == ["line", "Time (s)", "Base disp. (mm)"]
    for name, run in runs.items():
        values = [float(y) for line, _, y in rows[1:] if line == as_written(name)]
        times = [float(x) for line, x, _ in rows[1:] if line == as_written(name)]
        assert max(map(abs, values)) == pytest.approx(
            1e3 * abs(run.output("base_displacement_m")).max(), rel=1e-6
        )
        assert times[0] == 0.0 and times[-1] == pytest.approx(run.time[-1], rel=1e-5)
    with page.expect_download() as waited:
        figure.get_by_role("button", name="figure (SVG)").click()
    assert waited.value.path().read_text().startswith("<svg")


def test_toolbars_are_no_stops_of_the_keyboard(report, shown):
    page = shown(report)
    assert page.locator(".modebar-btn").count() > 10
    assert page.evaluate(
        "[...document.querySelectorAll('.modebar-btn')].every((each) => each.tabIndex === -1)"
    )
    plot = page.locator(".plot[data-link='time']").first
    plot.get_by_role("button", name="Zoom in").first.focus()
    page.keyboard.press("Enter")
    page.wait_for_timeout(300)
    assert page.evaluate(
        "[...document.querySelectorAll('.modebar-btn')].every((each) => each.tabIndex === -1)"
    )


def test_hover_texts_have_units_and_few_digits(report, shown):
    page = shown(report)
    texts = page.evaluate(f"{LINKED}.map((plot) => plot.data[0].hovertemplate)")
    assert texts[0] == "%{x:.4g} s, %{y:.4g} m/s²<extra>ground</extra>"
    assert texts[1] == "%{x:.4g} s, %{y:.4g} mm<extra>passive off</extra>"
    assert all(".4g" in text for text in texts)
