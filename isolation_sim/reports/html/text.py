"""Typesetting of text: numbers and units on one line, capitals at the start of sentences."""

from __future__ import annotations

import re

# a number alone, or with words after it, as in 5.9 (5.7 to 6.1)
_NUMBER = re.compile(r"[<>±+\-]? ?\d[\d.,e+\-]*( |$)")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:%|m/s²|[mk]?m|m?s|[gtAVJNW]|k[NJ]|k?Hz|°C)(?!\w))")


def is_number(text: str) -> bool:
    """Whether a text is a number, with or without words after it."""
    return _NUMBER.match(text) is not None


def tied(text: str) -> str:
    """Keep numbers and their units on one line."""
    return _BEFORE_UNIT.sub("\u00a0", text)


def capital(text: str) -> str:
    """A text with a capital first letter."""
    return f"{text[:1].upper()}{text[1:]}"
