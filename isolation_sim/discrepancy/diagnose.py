"""The front of the diagnosis: what kind of data, which model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ..errors import InputError
from ..identification.campaign import Campaign, read_campaign
from ..io.toml import read_toml
from ..laws import Device
from ..laws import law as published
from ..laws.law import Law
from ..laws.registry import LAWS
from .diagnosis import Diagnosis

DEFAULT_LAW = "strain_stiffening"


def diagnose(
    data: Campaign | str | Path,
    law: str | Law = DEFAULT_LAW,
    parameters: str | Path | Device = "fit",
    *,
    current_degree: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Find what a simulation gets wrong, and why.

    Parameters
    ----------
    data : Campaign, str or pathlib.Path
        A campaign or its folder, or the CSV file of a loop table.
    law : str or Law, default "strain_stiffening"
        The law to judge, or its registry name.
    parameters : str, pathlib.Path or Device, default "fit"
        Numbers of the law: "fit" to fit them to the data, "published" for the law's published
        ones, or a file with an ``[isolator]`` section, as ``fit --out`` writes.
    current_degree : int, optional
        Degree of the parameters' polynomials of the current, where they are fitted.
    seed : int, default 0
        Of random starts and examples of noise.
    threads : int, optional
        As many as there are processors by default.
    progress : callable, optional
        Called with the name of what is being done, whenever a part of it is done.

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        If the data cannot be read, a name is unknown, or the law cannot be fitted.
    """
    if isinstance(law, str):
        law = LAWS[law]
    device = given_device(law, parameters)
    if not isinstance(data, Campaign) and kind_of(data) == "loops":
        from .loop_table import read_loop_table
        from .loop_table_diagnosis import diagnose_loop_table

        found = diagnose_loop_table(
            read_loop_table(data), law, device, current_degree=current_degree, seed=seed,
            threads=threads, progress=progress,
        )  # fmt: skip
        return found if device is None else replace(found, judged=device)
    from .campaign_diagnosis import diagnose_campaign

    campaign = data if isinstance(data, Campaign) else read_campaign(data)
    found = diagnose_campaign(
        campaign, law, device, current_degree=current_degree, seed=seed, threads=threads,
        progress=progress,
    )  # fmt: skip
    return found if device is None else replace(found, judged=device)


def kind_of(path: str | Path) -> str:
    """Tell what kind of data is in a path.

    Parameters
    ----------
    path : str or pathlib.Path
        A folder, or a CSV file.

    Returns
    -------
    str
        "campaign", "loops" (a loop table) or "building" (a building record).

    Raises
    ------
    InputError
        If a file cannot be read or is none of these.
    """
    path = Path(path)
    if path.is_dir() or path.suffix.lower() != ".csv":
        return "campaign"
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise InputError(f"{path}: cannot be read ({reason})") from None
    head = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    if "ground_acceleration" in head or "isolator_displacement" in head:
        return "building"
    if "amplitude" in head or "damping_ratio" in head:
        return "loops"
    given = f"columns {head!r}" if head else "no line of column names"
    raise InputError(
        f"{path}: {given}; accepted: a campaign folder, a loop table (amplitude_mm, "
        "frequency_Hz, ...) or a building record (time_s, ground_acceleration_m_s2, ...)"
    )


def given_device(law: Law, parameters: str | Path | Device) -> Device | None:
    """Find the numbers with which a law is to be judged.

    Parameters
    ----------
    law : Law
        The law.
    parameters : str, pathlib.Path or Device
        As of ``diagnose``.

    Returns
    -------
    Device or None
        None where they are to be fitted.

    Raises
    ------
    InputError
        If the law has no published numbers, or the file is missing, unreadable, or of another law.
    """
    if isinstance(parameters, Device):
        device = parameters
    elif str(parameters) == "fit":
        return None
    elif str(parameters) == "published":
        device = published(law)
    else:
        device = _from_file(Path(parameters))
    if device.law is not law:
        raise InputError(
            f"{parameters}: numbers of {device.law.name}; accepted: of {law.name}, the law to judge"
        )
    return device


def _from_file(path: Path) -> Device:
    accepted = "fit, published or a file that fit --out has written"
    data = read_toml(path, accepted)
    try:
        name, numbers = data["isolator"]["law"], data["isolator"]["parameters"]
    except (KeyError, TypeError):
        raise InputError(
            f"{path}: no [isolator] section with law and parameters; accepted: {accepted}"
        ) from None
    return published(name, numbers)
