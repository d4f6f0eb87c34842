"""The plan of the next tests of a diagnosis or a campaign."""

from __future__ import annotations

from pathlib import Path

from ground_motions.argument_types import checked

from ..archive import FILE, load_archive
from ..errors import InputError
from ..identification.campaign import Campaign, read_campaign
from .diagnosis import Diagnosis
from .planned_tests import TestPlan, missing_conditions


@checked
def plan_tests(source: Diagnosis | Campaign | str | Path) -> TestPlan:
    """Plan the next tests of a device.

    Parameters
    ----------
    source : Diagnosis, Campaign, str or pathlib.Path
        A diagnosis of device tests, or the folder of a saved one: the tests that tell confusable
        causes apart, by their predicted forces, then the conditions that are missing. A campaign,
        or its folder: the missing conditions alone.

    Returns
    -------
    TestPlan
        A missing condition is a combination of a tested amplitude, frequency and current that no
        test has. Its velocity and acceleration are not above the tested ones.

    Raises
    ------
    InputError
        If the folder is neither, or the diagnosis is of a building or a loop table.
    """
    if isinstance(source, str | Path):
        folder = Path(source)
        saved = (folder / FILE).is_file()
        if not saved and not (folder / "campaign.toml").is_file():
            raise InputError(
                f"{folder}: neither a saved diagnosis nor a campaign; expected: a folder of "
                "diagnose, or one with campaign.toml"
            )
        source = load_archive(folder / FILE) if saved else read_campaign(folder)
    if isinstance(source, Campaign):
        tests, notes = missing_conditions(source.runs)
        return TestPlan(source.name, tests, notes)
    if not isinstance(source, Diagnosis) or source.test_plan is None:
        raise InputError(
            f"{getattr(source, 'data', type(source).__name__)}: has no plan of device tests; "
            "expected: a diagnosis of a campaign of this release, or a campaign"
        )
    return source.test_plan
