"""How often the diagnosis finds the effects that independent generators hide: a confusion matrix.

Run it with ``python -m studies.blind [SHARE]``. A share below 1 takes every so many cases. It
prints the rates with Wilson's 95 % intervals. ``results/blind/confusion.md`` and ``rates.md`` count
the second family of effects alone; the first, which the catalogue's authors wrote, has
``first_confusion.md`` and ``first_rates.md``.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import chain
from pathlib import Path
from typing import Any

from . import cases as blind
from . import second_cases as second
from .score import Rate, Scored, confusion_table, median_held_out_ratio, rates

RESULTS = Path("results/blind")
CLEAN, PAIRS, TRIPLES, WRONG = 100, 60, 40, 20


Case = blind.Case | second.SecondCase


def first_family(share: float) -> list[Case]:
    """List the cases of the first family."""
    kinds = (
        blind.singles(), blind.clean(CLEAN), blind.outside(), blind.several(2, PAIRS),
        blind.several(3, TRIPLES), blind.wrong_law(WRONG),
    )  # fmt: skip
    return list(chain.from_iterable(part(kind, share) for kind in kinds))


def second_family(share: float) -> list[Case]:
    """List the cases of the second family."""
    kinds = (
        second.second_singles(), second.second_clean(CLEAN), second.second_pairs(PAIRS)
    )  # fmt: skip
    return list(chain.from_iterable(part(kind, share) for kind in kinds))


def part(kind: Iterable[Any], share: float) -> list[Any]:
    """Take every so many cases."""
    return list(kind)[:: max(1, round(1 / share))]


def diagnose_cases(listed: Sequence[Any], score: Callable[[Any], Any]) -> tuple[list[Any], float]:
    """Diagnose cases on all processors."""
    from rich.progress import track

    begin = time.perf_counter()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        results = list(track(pool.map(score, listed), "diagnosing", total=len(listed)))
    return results, (time.perf_counter() - begin) / len(listed)


def score(case: Case) -> Scored:
    """Make a case's data, diagnose them, and put the truth beside the outcome."""
    from isolation_sim.discrepancy.diagnose import diagnose

    campaign = case.campaign()
    with tempfile.TemporaryDirectory() as folder:
        diagnosis = diagnose(
            campaign.write(Path(folder) / "campaign"), case.law, tiers="causes", threads=1
        )
    least = case.true_form_error(campaign)
    return Scored(case.kind, case.truth, diagnosis.to_dict(), least)


def write_tables(lines: Sequence[str], table: str, stem: str = "") -> None:
    """Print rates and write them beside the confusion matrix."""
    from isolation_sim.io.files import write_text

    RESULTS.mkdir(parents=True, exist_ok=True)
    write_text("\n".join(lines) + "\n", RESULTS / f"{stem}rates.md")
    write_text(table + "\n", RESULTS / f"{stem}confusion.md")
    print("\n".join(lines))
    print(f"results: {RESULTS}")


def study_records(
    listed: Sequence[Any],
    score: Callable[[Any], Any],
    rates_of: Callable[[list[Any]], Mapping[str, Rate]],
    table_of: Callable[[list[Any]], str],
    stem: str,
) -> None:
    """Diagnose cases of building records, and print and write their rates."""
    results, seconds = diagnose_cases(listed, score)
    lines = [f"- {name}: {rate}" for name, rate in rates_of(results).items()]
    lines.append(f"- {len(results)} records, {seconds:.1f} s each")
    write_tables(lines, table_of(results), stem)


def main(share: float = 1.0) -> None:
    """Diagnose all cases of both families and print the rates."""
    for stem, listed in (("", second_family(share)), ("first_", first_family(share))):
        results, seconds = diagnose_cases(listed, score)
        lines = [f"- {name}: {rate}" for name, rate in rates(results).items() if rate.cases]
        ratio = median_held_out_ratio(results)
        lines.append(f"- held-out error over that of the true form, median: {ratio:.3f}")
        lines.append(f"- {len(results)} campaigns, {seconds:.1f} s each")
        write_tables(lines, confusion_table(results), stem)


def share_from(module: str, description: str) -> float:
    """Read the share of the cases from the command line."""
    parser = argparse.ArgumentParser(f"python -m {module}", description=description)
    parser.add_argument(
        "share", metavar="SHARE", nargs="?", type=float, default=1.0,
        help="part of the cases to take, above 0 and up to 1 (the default)",
    )  # fmt: skip
    share: float = parser.parse_args().share
    if not 0 < share <= 1:
        parser.error(f"SHARE is {share:g}; expected: above 0, up to 1")
    return share
