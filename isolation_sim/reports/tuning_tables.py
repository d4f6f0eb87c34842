"""Tables of a tuning: settings, and gains on each set of motions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..written_names import as_written
from .tables import TextTable

if TYPE_CHECKING:
    from ..tuning.tuning import Tuning


def settings_table(tuning: Tuning) -> TextTable:
    """Settings before and after the tuning, with their ranges and sensitivities."""
    headings = ["setting", "unit", "from", "to", "before", "tuned", "largest loss over the range"]
    rows = []
    for name, one in tuning.content["settings"].items():
        scores = tuning.sensitivity[name][1]
        tuned = tuning.best.settings.get(name, one["present"])
        rows.append([
            name, one["unit"] or "-", f"{one['low']:g}", f"{one['high']:g}", _text(one["present"]),
            _text(tuned), f"{max(scores) - tuning.best.mean:z.3f}",
        ])  # fmt: skip
    return TextTable(f"Settings of {as_written(tuning.controller)}", headings, rows)


def gains_table(tuning: Tuning) -> TextTable:
    """Mean scores before and after, and gains, with 95 % intervals."""
    headings = ["motions", "before", "tuned", "gain", "better than constant in"]
    rows = []
    for evaluated in tuning.outcomes:
        means = evaluated.means
        counted = f"{evaluated.better} of {len(evaluated.motions)}"
        rows.append([evaluated.name, *(str(means[key]) for key in means), counted])
    title = "Mean score, 95 % interval: J minus that of the best constant current"
    alone = any(len(evaluated.motions) == 1 for evaluated in tuning.outcomes)
    return TextTable(title, headings, rows, caption="one motion gives no interval" * alone)


def tuning_tables(tuning: Tuning) -> list[TextTable]:
    """Format the tables for the terminal."""
    return [settings_table(tuning), gains_table(tuning)]


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, int | float) else "by itself"
