"""Pages and what they are made of: one file, safe text, numbers that arrive as they were sent."""

import json
import re
import sys

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.reports.html import charts, page
from isolation_sim.reports.html.page import tied

EVIL = "</script><script>alert('x')</script><b onclick=alert(1)>&"


def every_block(text):
    look = charts.looks([text])
    chart = page.Chart(text, {"data": [{"name": text, "y": [1.0]}], "layout": {}}, text)
    return [
        page.Prose((text,), "warning"), page.Facts({text: text}), page.Bullets((text,)),
        page.Listing(text, text), chart, page.Gallery((chart,)),
        page.Table(text, (text, "B"), (page.Row(text, (page.Cell(text, "best"),)), page.Row(text)),
                   note=text),
        page.LineChoice(look, text), page.Key({text: ("#fff", "/")}, look),
        page.TimeRange(0.0, 1.0),
    ]  # fmt: skip


def test_text_stays_text(read):
    text = page.Page(EVIL, EVIL, [page.Section(EVIL, every_block(EVIL))]).html()
    parsed = read(text)
    assert not any("onclick" in attributes for _, attributes in parsed.tags)
    assert "alert('x')" not in text
    data = [json.loads(content) for kind, content in parsed.scripts if kind.get("type")]
    assert [figure["data"][0]["name"] for figure in data] == [EVIL, EVIL]


def test_a_page_needs_nothing_but_itself(read):
    text = page.Page("Title", "", [page.Section("Part", every_block("text"))]).html()
    parsed = read(text)
    for tag, attributes in parsed.tags:
        assert "src" not in attributes, tag
        assert attributes.get("href", "#").startswith(("#", "data:")), attributes
    policy = next(a["content"] for t, a in parsed.tags if a.get("http-equiv"))
    assert policy.startswith("default-src 'none'")
    assert not re.search(r"url\(|@import", text[: text.index("</style>")])


def test_plotly_is_there_only_for_charts():
    text = page.Page("Title", "", [page.Section("Part", [page.Prose(("text",))])]).html()
    assert len(text) < 40_000
    assert "Plotly, Inc." not in text


def test_a_checkout_without_plotly_says_what_to_install(monkeypatch):
    page._plotly.cache_clear()
    monkeypatch.setattr(page, "_file", lambda name: (_ for _ in ()).throw(FileNotFoundError(name)))
    monkeypatch.setitem(sys.modules, "plotly.offline", None)
    with pytest.raises(InputError, match=r"plotly\.js of the reports is missing.*pip install \."):
        page._plotly()


def test_headings_and_tables_have_an_order_and_names(read):
    parts = [page.Section(name, every_block(name)) for name in ("One, first", "Two")]
    tags = read(page.Page("Title", "", parts).html()).tags
    names = [tag for tag, _ in tags]
    assert names.count("h1") == 1 and names.count("h2") == 2
    ids = [attributes["id"] for _, attributes in tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    targets = {a["href"][1:] for t, a in tags if t == "a"}
    assert targets == {"content", "one-first", "two"} <= set(ids)
    assert all("scope" in attributes for tag, attributes in tags if tag == "th")


def test_the_same_page_gives_the_same_bytes(tmp_path):
    made = page.Page("Title", "Sub", [page.Section("Part", every_block("text"))])
    one, two = (made.write(tmp_path / name) for name in ("1.html", "2.html"))
    assert one.read_bytes() == two.read_bytes()


def test_columns_of_numbers_line_up_at_the_right(read):
    rows = (("small", "2.5", "fitted", "N/m", "", "5.9 (5.7 to 6.1)"),
            ("large", "-31", "held out", "1", "+4 %", "< 1e-9"))  # fmt: skip
    table = page.Table(
        "Runs", ("Run", "Error", "Used as", "Unit", "More", "Value"),
        tuple(page.Row(label, tuple(map(page.Cell, cells))) for label, *cells in rows),
    )  # fmt: skip
    assert table.numeric == (False, True, False, True, True, True)
    tags = read(page.Page("Title", "", [page.Section("Part", [table])]).html()).tags
    for tag in ("td", "th"):
        kinds = [a.get("class") for t, a in tags if t == tag and a.get("scope") != "row"]
        aligned = [kind == "number" for kind in kinds]
        assert aligned == [*table.numeric[tag == "td" :]] * (len(rows) if tag == "td" else 1)


@pytest.mark.parametrize("text", ["1.5 mm", "+40 %", "2 m/s²", "0.3 A", "7 kN", "1 Hz"])
def test_a_unit_stays_with_its_number(text):
    assert tied(f"It is {text}, so.") == f"It is {text.replace(' ', chr(160))}, so."


@pytest.mark.parametrize("text", ["1.5", "0.45* ± 0.27", "-2e-3 (-3 to -1)", "± 1", "3.1*"])
def test_a_number_is_one_with_words_or_a_mark_after_it(text):
    assert page.is_number(text)


def test_words_after_numbers_may_go_to_another_line():
    assert tied("5 motions and 3 Axes, 7 gaps") == "5 motions and 3 Axes, 7 gaps"


def test_filters_offer_each_value_once():
    rows = tuple(page.Row(n, (page.Cell(law),)) for n, law in (("a", "x"), ("b", "y"), ("c", "x")))
    table = page.Table("Runs", ("Run", "Law"), rows, filters=("Law", "Run"))
    assert table.choices == [("Law", 1, ["x", "y"]), ("Run", 0, ["a", "b", "c"])]


def test_numbers_arrive_as_they_were_sent(unpacked):
    values = np.array([0.0, -1.5, np.nan, 1e-7, 3e8])
    np.testing.assert_allclose(unpacked(charts.numbers(values)), values, rtol=1e-7)


def test_an_even_abscissa_takes_no_room(unpacked):
    y = np.arange(5.0)
    even = charts.over(2 + 0.02 * y, y)
    assert even["x0"] == 2 and even["dx"] == pytest.approx(0.02) and "x" not in even
    np.testing.assert_allclose(unpacked(charts.over(y**2, y)["x"]), y**2)


@pytest.mark.parametrize("n", [1, 2, 99, 1000, 12_345])
def test_thinning_keeps_every_peak(n):
    random = np.random.default_rng(n)
    one, two = random.normal(size=(2, n))
    selected = charts.choose_samples(200, one, two)
    assert np.all(np.diff(selected) > 0)
    assert selected[0] == 0 and selected[-1] == n - 1
    for values in (one, two):
        assert values[selected].max() == values.max() and values[selected].min() == values.min()
    if n <= 200:
        assert len(selected) == n
    else:
        assert 100 < len(selected) < 250
        # no stretch of the record is left out
        assert np.diff(selected).max() < n / 20


def test_lines_differ_by_more_than_colour():
    names = [str(k) for k in range(7)]
    result = charts.looks(names)
    assert len({(look.dashes, look.marker) for look in result.values()}) == len(names)


def test_axes_that_have_to_be_alike_hold_everything():
    assert charts.span([[1.0, 3.0], [-1.0]], 0.0) == [-1, 3]
    assert charts.span([[2.0, 2.0]]) == [1, 3]
    assert charts.span([[0.0, 10.0]], 0.1) == [-1, 11]


def test_long_names_break_after_their_underscores():
    block = page.Facts({"tension_compression_asymmetry": "text"})
    text = page.Page("Title", "", [page.Section("Part", [block])]).html()
    assert "<dt>tension_<wbr>compression_<wbr>asymmetry</dt>" in text
