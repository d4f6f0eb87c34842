"""The filter that an agency or a laboratory passed a record through, and its inverse."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Sequence
from functools import lru_cache
from itertools import takewhile
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator
from scipy.fft import next_fast_len

from ...errors import InputError
from ...validation import Positive, Section

_LINE = re.compile(r"#\s*(filter\s*=.*)")
_MOST_RESTORED = 0.1
"""Share of a motion below which it is lost and not restored. Convention."""
_REACH = 2.0
"""Periods of the high-pass corner after which the filter forgets."""

Ramp = Annotated[tuple[Positive, Positive], Field(strict=False)]


class RecordFilter(Section):
    """A band-pass filter of each channel on its own."""

    # Corner of a Butterworth filter, or frequencies between which an Ormsby filter rises, Hz
    high_pass_Hz: Positive | Ramp | None = None
    low_pass_Hz: Positive | Ramp | None = None  # The same, of the filter that falls
    order: Annotated[int, Field(ge=1, le=12)] = 2  # Of the Butterworth filters, in one pass
    zero_phase: bool = True  # Whether they ran forwards and backwards
    ground: bool = True  # Whether the ground motion passed the filter as well

    @model_validator(mode="after")
    def _with_corner(self) -> Self:
        if self.high_pass_Hz is None and self.low_pass_Hz is None:
            raise InputError("filter", "no corner", "high_pass_Hz, low_pass_Hz or both")
        for name in ("high_pass_Hz", "low_pass_Hz"):
            ends = getattr(self, name)
            if isinstance(ends, tuple) and not ends[0] < ends[1]:
                raise InputError(f"filter.{name}", str(ends), "a lower and a higher frequency")
        return self

    @classmethod
    def between(cls, high: Sequence[float], low: Sequence[float]) -> RecordFilter:
        """A filter with corners that are each one frequency, the two ends of a ramp, or none."""
        of_high, of_low = (list(one) if len(one) > 1 else one[0] if one else None
                           for one in (high, low))  # fmt: skip
        return cls.model_validate({"high_pass_Hz": of_high, "low_pass_Hz": of_low})

    @property
    def line(self) -> str:
        """The key that states it in a record's file."""
        keys = self.model_dump(exclude_defaults=True)
        return f"filter = {{ {', '.join(f'{key} = {json.dumps(keys[key])}' for key in keys)} }}"

    def apply(self, signals: NDArray, dt: float) -> NDArray:
        """Filter signals (n, ...) that are at rest before their first sample."""
        return self._multiplied(signals, dt)

    def restore(self, motion: NDArray, dt: float) -> NDArray:
        """Motion (n,) before the filter, as far as the filter left enough of it."""
        return self._multiplied(motion, dt, inverse=True)

    def reach(self, dt: float) -> int:
        """Samples after an instant on which its filtered value depends."""
        has_ramp = any(isinstance(one, tuple) for one in (self.high_pass_Hz, self.low_pass_Hz))
        return self._memory(dt) if self.zero_phase or has_ramp else 0

    @property
    def slow(self) -> float:
        """Frequency below which slow motion is missing, Hz; 0 without a high-pass filter."""
        return max(_ends(self.high_pass_Hz), default=0.0)

    def response(self, n: int, dt: float) -> NDArray:
        """Frequency response at the frequencies of n samples, (n // 2 + 1,)."""
        corners = self.high_pass_Hz, self.low_pass_Hz
        return _response(corners, self.order, self.zero_phase, n, dt)

    def _memory(self, dt: float) -> int:
        lowest = min((*_ends(self.high_pass_Hz), *_ends(self.low_pass_Hz)))
        return int(np.ceil(_REACH / (lowest * dt)))

    def _multiplied(self, signals: NDArray, dt: float, inverse: bool = False) -> NDArray:
        n, pad = len(signals), self._memory(dt)
        whole = next_fast_len(n + 2 * pad, real=True)
        factors = self.response(whole, dt)
        if inverse:
            factors = factors.conj() / np.maximum(np.abs(factors), _MOST_RESTORED) ** 2
        padded = np.pad(signals.T, [*[(0, 0)] * (signals.ndim - 1), (pad, whole - n - pad)])
        result = np.fft.irfft(factors * np.fft.rfft(padded), whole)
        return result[..., pad : pad + n].T


def _ends(frequency: float | tuple[float, float] | None) -> tuple[float, ...]:
    if frequency is None:
        return ()
    return frequency if isinstance(frequency, tuple) else (frequency,)


@lru_cache(maxsize=16)
def _response(
    corners: tuple[float | tuple[float, ...] | None, ...],
    order: int,
    zero_phase: bool,
    n: int,
    dt: float,
) -> NDArray:
    """Frequency response at the frequencies of n samples, (n // 2 + 1,)."""
    from scipy.signal import butter, sosfreqz

    frequencies = np.fft.rfftfreq(n, dt)
    result = np.ones(len(frequencies), complex)
    for corner, kind in zip(corners, ("highpass", "lowpass"), strict=True):
        if isinstance(corner, tuple):
            rise = np.clip((frequencies - corner[0]) / (corner[1] - corner[0]), 0.0, 1.0)
            result *= rise if kind == "highpass" else 1 - rise
        elif corner is not None and corner < 0.5 / dt:
            sections = butter(order, corner, kind, fs=1 / dt, output="sos")
            one = sosfreqz(sections, frequencies, fs=1 / dt)[1]
            result *= np.abs(one) ** 2 if zero_phase else one
    return result


def read_filter(path: str | Path) -> RecordFilter | None:
    """Read the filter that a line ``# filter = { ... }`` of a record's file states."""
    with Path(path).open(encoding="utf-8", errors="replace") as lines:
        comments = list(takewhile(lambda line: line.startswith("#"), lines))
    for line in comments:
        if stated := _LINE.match(line):
            try:
                return RecordFilter(**tomllib.loads(stated[1])["filter"])
            except (tomllib.TOMLDecodeError, TypeError, InputError) as error:
                raise InputError(
                    f"{path}: {line.strip().strip('# ')}: {error}; expected: such as "
                    "filter = { high_pass_Hz = 0.1 }"
                ) from None
    return None
