"""The rewritten text of a kernel computes what the text said."""

import numpy as np
import pytest

from isolation_sim.compilation.kernel_text import fold_constants

TEXT = """
unsigned = int
LANES = {lanes}
STRIDE = 5
SLOTS = (3, 4)
WEIGHTS = ((0.5, 0.25), (1.5, 2.0))

def work(w, n):
    total = 0.0
    for lane in range(LANES):
        at = 2 * STRIDE + SLOTS[0] * LANES + lane
        total += w[at * LANES + lane] * WEIGHTS[1][0] - 1 * lane + (n // LANES) * 0
        if LANES == 1:
            total += 10.0
        elif LANES > 1:
            total += 20.0
        else:
            total += 30.0
    for lane in range(LANES):
        if n < 3:
            continue
        for k in range(n):
            if k == 2:
                break
            total += w[STRIDE - 0 + k] + lane
    return total
"""


def run(text, n):
    names = {}
    exec(text, names)
    return names["work"](np.arange(200.0) ** 1.5, n)


@pytest.mark.parametrize("lanes", [1, 4])
@pytest.mark.parametrize("n", [2, 5])
def test_it_computes_the_same(lanes, n):
    text = TEXT.format(lanes=lanes)
    assert run(fold_constants(text), n) == run(text, n)


def test_what_the_constants_decide_is_gone():
    body = fold_constants(TEXT.format(lanes=1)).split("def work")[1]
    assert "LANES" not in body and "SLOTS" not in body and "STRIDE" not in body
    assert "10.0" in body and "20.0" not in body and "30.0" not in body
    assert body.count("for lane in") == 1  # the one that is left by continue


def test_a_loop_over_lanes_stays_one():
    body = fold_constants(TEXT.format(lanes=4)).split("def work")[1]
    assert body.count("for lane in range(4)") == 2
    assert "20.0" in body and "10.0" not in body
    assert "unsigned(" in body


@pytest.mark.parametrize(
    "index", ["-1", "STRIDE - 7", "0, -2", "SLOTS[0] - SLOTS[1]", "1 + -SLOTS[1]"]
)
def test_a_negative_index_is_refused(index):
    """As an unsigned number it would be near 2^64: outside every array, and nothing checks it."""
    text = TEXT.format(lanes=1).replace("w[at * LANES + lane]", f"w[{index}]")
    with pytest.raises(ValueError, match=r"negative index in w\[.*-\d\]; expected"):
        fold_constants(text)
