"""Small pieces of MyST text: tables, displays, figures, and docstrings as prose."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence
from inspect import cleandoc


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """Write a table.

    Parameters
    ----------
    headings : sequence of str
        Of the columns.
    rows : iterable of sequence of str
        Cells, MyST text.
    caption : str
        Above it, none if empty.

    Returns
    -------
    str
        MyST text.
    """
    lines = [f":::{{list-table}} {caption}", ":header-rows: 1", ""]
    for row in (headings, *rows):
        for k, cell in enumerate(row):
            # a space that does not break stays
            text = re.sub(r"[ \n]+", " ", cell.strip())
            lines.append(f"{'* -' if k == 0 else '  -'} {text}".rstrip())
    return "\n".join([*lines, ":::", ""])


def display(formula: str) -> str:
    """Write a displayed formula.

    Parameters
    ----------
    formula : str
        LaTeX.

    Returns
    -------
    str
        MyST text.
    """
    return f"$$\n{formula}\n$$\n"


def figure(path: str, caption: str, text_instead: str) -> str:
    """Show a figure.

    Parameters
    ----------
    path : str
        Of the image, relative to the page or from the source's root.
    caption : str
        MyST text.
    text_instead : str
        For those who do not see it.

    Returns
    -------
    str
        MyST text.
    """
    return f"```{{figure}} {path}\n:alt: {text_instead}\n\n{caption}\n```\n"


def prose(docstring: str | None, skip_first: bool = True) -> str:
    """Turn a module's docstring into MyST text; what is indented stays as it is typed.

    Parameters
    ----------
    docstring : str or None
        The docstring.
    skip_first : bool
        Whether to leave its first line out.

    Returns
    -------
    str
        MyST text.
    """
    lines = cleandoc(docstring or "").splitlines()
    if skip_first:
        lines = lines[1:]
    parts: list[str] = []
    for block in "\n".join(lines).strip().split("\n\n"):
        if block.startswith("    "):
            parts.append(f"```text\n{textwrap.dedent(block)}\n```")
        elif block.strip():
            parts.append(block.replace("::\n", ":\n").removesuffix("::"))
    return "\n\n".join(parts) + "\n"


def written(name: str) -> str:
    """Return text in which nothing is taken for markup.

    Parameters
    ----------
    name : str
        Plain text.

    Returns
    -------
    str
        MyST text.
    """
    return "".join(f"\\{letter}" if letter in "\\`*_[]<>$|~{}" else letter for letter in name)
