"""Runs to draw, and a browser to open reports in."""

import base64
import json
import re
import shutil
from contextlib import contextmanager
from functools import cache
from html.parser import HTMLParser

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940


@pytest.fixture(scope="session")
def ground():
    return el_centro_1940().cut(0, 8)


@pytest.fixture(scope="session")
def runs(ground):
    isolated = iso.reference_building().on(iso.reference_isolators())
    return {
        name: iso.simulate(isolated, ground, name)
        for name in ("passive_off", "passive_on", "on_off")
    }


@pytest.fixture(scope="session")
def seven(runs):
    """As many controllers as a comparison may show, some with long names."""
    names = [
        "passive_off",
        "passive_on",
        "best_constant",
        "clipped_lqr",
        "sliding_mode",
        "model_predictive_control",
        "clairvoyant",
    ]
    values = list(runs.values())
    return {name: values[k % 3] for k, name in enumerate(names)}


@pytest.fixture(scope="session")
def passive_biaxial(ground):
    """Building that moves in x, y and rotation, on isolators without coils."""
    mass = np.diag([2e5, 2e5, 5e6])
    building = iso.from_fixed_base(
        mass,
        0.5 * mass,
        400 * mass,
        np.diag([3e5, 3e5, 7e6]),
        rigid_motion=np.eye(3),
        shaken=[0, 1],
        names=["base_x", "base_y", "base_r", "floor1_x", "floor1_y", "floor1_r"],
    )
    # no isolator resists rotation here: hold it
    stiffness = building.stiffness.copy()
    stiffness[2, 2] += 1e8
    building = iso.from_matrices(
        building.mass,
        building.damping,
        stiffness,
        influence=building.influence,
        base=(0, 1, 2),
        names=building.names,
        name="biaxial building",
    )
    isolated = building.on(iso.law("linear", {"k": 5e6}))
    return iso.simulate(isolated, [ground, ground.scaled(0.5)], "passive_off")


class Reader(HTMLParser):
    """Tags with their attributes, and the text of each script."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.scripts = [], []
        self._in_script = False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self._in_script = tag == "script"
        if self._in_script:
            self.scripts.append((dict(attributes), ""))

    def handle_endtag(self, tag):
        self._in_script = False

    def handle_data(self, data):
        if self._in_script:
            attributes, text = self.scripts[-1]
            self.scripts[-1] = attributes, text + data


@pytest.fixture(scope="session")
def read():
    """Parse a page."""
    return Reader


@pytest.fixture(scope="session")
def unpacked():
    """Turn numbers in a page's base64 back into an array."""
    return lambda packed: np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"])


@pytest.fixture(scope="session")
def figures():
    """Find the figures of a page by their title, in order."""

    def find(text):
        titles = re.findall(
            r"<figcaption>([^<]+)</figcaption>\n<div class=\"plot\"", text.replace("<wbr>", "")
        )
        scripts = [json.loads(t) for kind, t in Reader(text).scripts if kind.get("type")]
        return dict(zip(titles, [s for s in scripts if "layout" in s], strict=True))

    return find


# without these Chromium looks for the network and asks for a sandbox that root does not have; pages
# share a process, which compiles the scripts of a file once
CHROMIUM = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--process-per-site",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip


@pytest.fixture(scope="session")
def browser():
    """Headless Chromium; skips where there is none."""
    playwright = pytest.importorskip("playwright.sync_api")
    names = ("chromium", "chromium-browser", "google-chrome")
    result = next(filter(None, map(shutil.which, names)), None)
    if result is None:
        pytest.skip(f"no browser to open reports in; looked for {', '.join(names)}")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=result, args=CHROMIUM)
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def screens(browser):
    """A desktop or a phone; an empty page keeps its window, since a new one takes a second."""

    @cache
    def screen(**options):
        context = browser.new_context(**options)
        context.new_page()
        return context

    return screen


@pytest.fixture(scope="session")
def until():
    """Wait for an expression to be true; Playwright's own waiting breaks the pages' policy."""

    def wait(page, expression, argument=None):
        for _ in range(400):
            if page.evaluate(expression, argument):
                return
            page.wait_for_timeout(50)
        pytest.fail(f"never true: {expression}")

    return wait


@contextmanager
def windows(screens, until):
    """Open files, each in a page of its own; at the end, nothing may have gone wrong in them."""
    pages, complaints, requests = [], [], []

    def open_file(path, width=1400, height=900, color_scheme="light", **options):
        page = screens(**options).new_page()
        pages.append(page)
        page.set_viewport_size({"width": width, "height": height})
        page.emulate_media(color_scheme=color_scheme)
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto(path.as_uri())
        until(page, "[...document.querySelectorAll('.plot')].every((plot) => plot._fullLayout)")
        return page

    yield open_file
    for page in pages:
        page.close()
    assert not complaints
    assert all(url.startswith(("file:", "data:", "blob:")) for url in requests)


@pytest.fixture
def opened(screens, until):
    """Open a file afresh, to operate it."""
    with windows(screens, until) as open_file:
        yield open_file


@pytest.fixture(scope="module")
def shown(screens, until):
    """Open a file in a page that all tests of a module share, which only read it or scroll."""
    with windows(screens, until) as open_file:
        yield cache(open_file)


@pytest.fixture(scope="session")
def cut_off():
    """Find what does not fit: the page in its window, titles and ticks side by side in charts."""
    return lambda page: page.evaluate(
        """[...document.querySelectorAll('.plot')].flatMap((plot) => {
          const frame = plot.getBoundingClientRect();
          const texts = [...plot.querySelectorAll(
            '.xtick text, .ytick text, .xtitle, .ytitle, .annotation-text')];
          const boxes = texts.map((text) => [text.textContent, text.getBoundingClientRect()]);
          const outside = boxes.filter(([, b]) => b.left < frame.left - 1
            || b.right > frame.right + 1 || b.bottom > frame.bottom + 1);
          const touching = boxes.flatMap(([name, a], k) => boxes.slice(k + 1).filter(([, b]) =>
            a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1
            && b.top < a.bottom - 1).map(([other]) => [name, other]));
          return [...outside.map(([name]) => name), ...touching];
        }).concat((({scrollWidth, clientWidth}) => scrollWidth > clientWidth ? ['the page'] : [])(
          document.documentElement))"""
    )
