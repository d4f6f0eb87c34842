"""The result of a tuning: saved after every generation, loaded, and reported."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ground_motions.old_names import renamed_attribute, renamed_keys

from ..errors import InputError
from ..io.csv_table import write_table
from ..io.files import json_text, write_text
from ..io.results_folder import check_free, files_into, write_contents, writing_to
from ..rendering import Printed, render
from ..resampling import bootstrap_level
from ..search_range import SearchRange
from .search import Trial, generation_size

if TYPE_CHECKING:
    from rich.console import RenderableType

_STATE = "tuning.json"
_AT_BOUND = 0.01
"""Distance from a bound that counts as at the bound, as a share of the range."""
_CLEARLY_BETTER = 0.01
"""Difference of mean scores beyond the rounding of the values that the sensitivity tries."""
MARGIN = 1e-3
"""Smallest difference of scores that counts. The scan of constant currents finds the smallest sum
to a tenth of it."""


class MeanInterval(NamedTuple):
    """A mean with the bounds of its interval."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        bounds = "" if np.isnan(self.low) else f" ({self.low:+z.3f} to {self.high:+z.3f})"
        return f"{self.mean:+z.3f}{bounds}"


def mean_interval(values: ArrayLike) -> MeanInterval:
    """Mean of the values of a sample of motions, with its 95 % interval."""
    from scipy.stats import bootstrap

    array = np.sort(np.asarray(values, dtype=float))
    mean = float(array.mean())
    if np.ptp(array) == 0.0:
        bounds = (np.nan, np.nan) if len(array) == 1 else (mean, mean)
        return MeanInterval(mean, *bounds)
    result = bootstrap(
        (array,), np.mean, confidence_level=bootstrap_level(len(array)),
        random_state=np.random.default_rng(0),
    ).confidence_interval  # fmt: skip
    return MeanInterval(mean, float(result.low), float(result.high))


@dataclass(frozen=True)
class Evaluation:
    """Scores on one set of motions, one number per motion."""

    name: str  # Name of the set
    motions: list[str]  # Names of its motions
    current: list[float]  # Best constant current of each, A
    constant: list[float]  # J with this current
    # before, after: That sum minus the best constant current's, before and after the tuning
    before: list[float]
    after: list[float]

    @property
    def means(self) -> dict[str, MeanInterval]:
        """Mean scores before and after, and mean gain, with 95 % intervals."""
        gain = [a - b for a, b in zip(self.before, self.after, strict=True)]
        result = {"before": self.before, "after": self.after, "gain": gain}
        return {name: mean_interval(values) for name, values in result.items()}

    @property
    def better(self) -> int:
        """Number of motions with a significant gain over every constant current."""
        return sum(score < -MARGIN for score in self.after)


@dataclass
class Tuning(Printed):
    """Result of a tuning.

    Attributes
    ----------
    content : dict
        Inputs: controller, scenario, motions, criteria, settings with their ranges, seed.
    trials : list of Trial
        Candidates with their scores, in the order of evaluation; the first one is the initial
        controller.
    sensitivity : dict of str to tuple
        By setting: values over its range, and their mean scores; the other settings are tuned.
    outcomes : list of Evaluation
        Scores on the tuning motions, then on the unseen ones; empty before the end of the search.
    """

    content: dict[str, Any]
    trials: list[Trial] = field(default_factory=list)
    sensitivity: dict[str, tuple[list[float], list[float]]] = field(default_factory=dict)
    outcomes: list[Evaluation] = field(default_factory=list)

    judged = renamed_attribute("judged", "outcomes")

    @property
    def controller(self) -> str:
        """Name of the controller."""
        return str(self.content["controller"])

    @property
    def best(self) -> Trial:
        """Candidate with the smallest mean score; the first of equal ones."""
        return min(self.trials, key=lambda trial: trial.mean)

    @property
    def settings(self) -> dict[str, Any]:
        """Fixed settings, then tuned settings; without tuned settings if none was better."""
        return {**self.content["fixed"], **self.best.settings}

    def verdict(self) -> list[str]:
        """Describe the gain.

        Returns
        -------
        list of str
            Among them one or two for each set of motions, one for each setting at a bound of its
            search range, and one if the search has not converged.
        """
        if len(self.trials) == 1:
            first = (
                "Only the initial controller was tried: give the search at least "
                f"{1 + generation_size(len(self.content['settings']))} evaluations, itself and a "
                "generation of candidates."
            )
        elif not self.best.settings:
            first = "No candidate was better than the initial controller."
        else:
            first = f"Tuned on {self.outcomes[0].name}, in {len(self.trials)} trials."
        return [first, *self.at_bounds(), *self._missed(), *map(_sentences, self.outcomes)]

    def at_bounds(self) -> list[str]:
        """Name the tuned settings at a bound of their search range.

        Returns
        -------
        list of str
            One sentence each.
        """
        sentences = []
        for name, value in self.best.settings.items():
            one = self.content["settings"][name]
            place = SearchRange(one["low"], one["high"], one["scale"]).place(value)
            if min(place, 1 - place) < _AT_BOUND:
                bound = "lower" if place < 0.5 else "upper"
                sentences.append(
                    f"{name} = {value:g} is at the {bound} bound of its search range, "
                    f"{one['low']:g} to {one['high']:g}: the optimum may lie beyond it."
                )
        return sentences

    def _missed(self) -> Iterator[str]:
        """Say that the variation of one setting alone found a clearly better value."""
        scans = [
            (score, name, value)
            for name, (values, scores) in self.sensitivity.items()
            for value, score in zip(values, scores, strict=True)
        ]
        score, name, value = min(scans, default=(np.inf, "", np.inf))
        if score < self.best.mean - _CLEARLY_BETTER:
            yield (
                f"{name} = {value:.4g} alone has a mean score of {score:+.3f}, better than that of "
                f"the search, {self.best.mean:+.3f}: the search has not converged. Give it more "
                "evaluations."
            )

    def _shown(self) -> Iterator[Any]:
        yield from self.tables()
        yield from self.verdict()

    def __repr__(self) -> str:
        state = f"mean score {self.best.mean:.3g}" if self.trials else "unfinished"
        return f"Tuning({self.controller}: {len(self.trials)} trials, {state})"

    def to_dict(self) -> dict[str, Any]:
        """Return the result as numbers and text.

        Returns
        -------
        dict
            Controller, settings, command and, for each set of motions, mean score before and after
            and gain, each with its interval.
        """
        return {
            "controller": self.controller,
            "settings": self.settings,
            "trials": len(self.trials),
            "command": self.content["command"],
            "outcomes": [
                {
                    "motions": evaluated.name,
                    "count": len(evaluated.motions),
                    "better": evaluated.better,
                }
                | {name: mean._asdict() for name, mean in evaluated.means.items()}
                for evaluated in self.outcomes
            ],
        }

    def scenario_section(self) -> str:
        """Write the tuned controller as a scenario's section.

        Returns
        -------
        str
            TOML, with the command of the tuning and the gains as comments.
        """
        from ..scenario.control import ControllerEntry
        from ..scenario.writer import toml_text
        from ..validation import Section

        class Written(Section):
            controller: list[ControllerEntry]

        entry = ControllerEntry(name=self.controller, settings=self.settings)
        sentences = [
            *self.verdict(),
            f"isolation-sim {self.content['isolation_sim']}: {self.content['command']}",
        ]
        return "".join(f"# {line}\n" for line in sentences) + toml_text(
            Written(controller=[entry]), False
        )

    def to_html(self, path: str | Path) -> Path:
        """Write the report.

        Parameters
        ----------
        path : str or pathlib.Path
            File to write; replaced completely or not at all.

        Returns
        -------
        pathlib.Path
            The file.
        """
        return render("html.tuning_report:tuning_report", self).write(path)

    def tables(self) -> list[RenderableType]:
        """Build the tables of settings and of gains.

        Returns
        -------
        list of rich.console.RenderableType
        """
        return render("tuning_tables:tuning_tables", self)

    def save(self, folder: str | Path, overwrite: bool = False) -> Path:
        """Write state, tables, scenario section and report.

        Parameters
        ----------
        folder : str or pathlib.Path
            Made where it is absent.
        overwrite : bool, default False
            Whether to replace the files of a result that is in the folder. Other files stay.

        Returns
        -------
        pathlib.Path
            The folder.

        Raises
        ------
        InputError
            If the folder contains a saved result or a file of the same name.
        """
        with files_into(folder, overwrite) as place:
            self.save_state(place)
            write_text(self.scenario_section(), place / "controller.toml")
            for name, rows in self._records().items():
                write_table(rows, place / f"{name}.csv")
            self.to_html(place / "report.html")
            write_contents(place, f"Tuning of {self.controller}")
        return Path(folder)

    def _records(self) -> dict[str, list[dict[str, Any]]]:
        """Trials, sensitivity and scores by motion, as rows of tables."""
        scores = [
            {"motions": each.name, "motion": motion, "best_constant_A": current,
             "best_constant_score": constant, "score_before": before, "score_after": after}
            for each in self.outcomes
            for motion, current, constant, before, after in zip(
                each.motions, each.current, each.constant, each.before, each.after, strict=True
            )
        ]  # fmt: skip
        return {
            "trials": [
                {"trial": k, "mean_score": trial.mean, **trial.settings}
                for k, trial in enumerate(self.trials)
            ],
            "sensitivity": [
                {"setting": name, "value": value, "mean_score": score}
                for name, (values, scores) in self.sensitivity.items()
                for value, score in zip(values, scores, strict=True)
            ],
            "scores": scores,
        }

    def save_state(self, folder: str | Path) -> Path:
        """Write the present state, completely or not at all.

        Parameters
        ----------
        folder : str or pathlib.Path
            Made where it is absent.

        Returns
        -------
        pathlib.Path
            The folder.

        Raises
        ------
        InputError
            If the folder cannot be written.
        """
        folder = Path(folder)
        with writing_to(folder):
            folder.mkdir(parents=True, exist_ok=True)
            write_text(json_text(asdict(self), indent=1), folder / _STATE)
        return folder

    @classmethod
    def read(cls, folder: str | Path) -> Tuning:
        """Read a saved tuning.

        Parameters
        ----------
        folder : str or pathlib.Path
            Folder of a tuning, finished or unfinished.

        Returns
        -------
        Tuning

        Raises
        ------
        InputError
            If there is no readable tuning.
        """
        path = Path(folder) / _STATE
        try:
            data = renamed_keys(json.loads(path.read_bytes()), judged="outcomes")
            return cls(
                data["content"],
                [Trial(*each) for each in data["trials"]],
                {name: (x, y) for name, (x, y) in data["sensitivity"].items()},
                [Evaluation(**each) for each in data["outcomes"]],
            )
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(
                f"{folder}: no tuning there; expected: a folder that isolation-sim tune made"
            ) from None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"{path}: cannot be read ({error}); expected: as isolation-sim tune wrote it"
            ) from None


def check_place(folder: str | Path | None, resume: bool) -> None:
    """Refuse a folder in use, unless its tuning is continued."""
    if folder is not None:
        begun = (Path(folder) / _STATE).exists()
        if not (resume and begun):
            check_free(Path(folder), resumable=begun)


def begin(folder: str | Path | None, content: Mapping[str, Any], resume: bool) -> Tuning:
    """A new tuning, or the one in a folder to continue; nothing is written."""
    # convert by JSON, to compare with the saved content
    new = Tuning(json.loads(json.dumps(content)))
    if folder is None or not (resume and (there := Path(folder) / _STATE).exists()):
        return new
    stored = Tuning.read(folder)
    for key, value in new.content.items():
        # equal motions and scenarios can have different names
        if key != "command" and stored.content.get(key) != value:
            raise InputError(
                f"{there}: {key} differs from the tuning begun there; expected: the same "
                "arguments and files, or another folder"
            )
    return Tuning(stored.content, stored.trials)


def _sentences(evaluated: Evaluation) -> str:
    """Gain on one set of motions, in one or two sentences."""
    before, after, gain = evaluated.means.values()
    name = evaluated.name[:1].upper() + evaluated.name[1:]
    if len(evaluated.motions) == 1:
        return (
            f"{name}: score {before} before, {after} after, gain {gain}; one motion: no interval."
        )
    if after.high < 0:
        beats = "It beats the best constant current of each motion"
    elif after.low > 0:
        beats = "It does not beat the best constant current of each motion"
    else:
        beats = "It does not differ significantly from the best constant current of each motion"
    return (
        f"{name}: mean score {before} before, {after} after, gain {gain}. "
        f"{beats}; it is better in {evaluated.better} of {len(evaluated.motions)}."
    )
