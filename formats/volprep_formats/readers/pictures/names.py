"""Order of the pictures of a stack, by the one number that changes from name to name."""

import re
from collections import Counter
from itertools import pairwise
from math import gcd
from pathlib import Path
from typing import Literal

from volprep_formats.diagnostics import VolprepError

_LISTED = 12
_MOST_STRAYS = 0.1
_NUMBER = re.compile(r"([0-9]+)")
_HYPHEN = re.compile(r"-$")
_SIGN = re.compile(r"[^0-9A-Za-z)\]]-$")
"""A hyphen that follows neither a letter nor a digit, but another separator."""


def _fixed(parts: list[str]) -> list[str]:
    """Return a name without its numbers and their signs."""
    return [_HYPHEN.sub("", text.lower()) for text in parts[:-1:2]] + [parts[-1].lower()]


def strays_of(names: list[str]) -> list[str]:
    """Return the names, at most a tenth, that differ from all others in more than a number; none if there are more."""
    fixed = {name: tuple(_fixed(_NUMBER.split(name))) for name in names}
    usual, count = Counter(fixed.values()).most_common(1)[0]
    strays = sorted(name for name in names if fixed[name] != usual)
    return strays if len(strays) <= _MOST_STRAYS * count else []


def in_order(folder: Path, names: list[str], gaps: Literal["refuse", "ignore"]) -> tuple[list[str], int]:
    """Names by their number, so that z2 comes before z10, and the step from number to number.

    Raises VolprepError VP1161 when the names do not tell the order, VP1162 when numbers are missing and `gaps` is
    "refuse".
    """
    parts = {name: _NUMBER.split(name) for name in sorted(names)}
    first = next(iter(parts))
    for name, part in parts.items():
        if _fixed(part) != _fixed(parts[first]):
            raise unordered(folder, first, name, "differ in more than a number")
    numbers = _with_signs(parts)
    changing = [i for i, column in enumerate(zip(*numbers.values(), strict=True)) if len(set(column)) > 1]
    if len(changing) > 1:
        other = next(n for n in numbers if sum(numbers[n][i] != numbers[first][i] for i in changing) > 0)
        raise unordered(folder, first, other, f"belong to a stack in whose names {len(changing)} numbers change")
    ordered = sorted(parts, key=numbers.__getitem__)
    for below, above in pairwise(ordered):
        if numbers[below] == numbers[above]:
            raise unordered(folder, below, above, "have the same number")
    if not changing:
        return ordered, 1
    column = [numbers[name][changing[0]] for name in ordered]
    step = gcd(*(above - below for below, above in pairwise(column)))
    if gaps == "refuse":
        _check_gaps(folder, ordered, column, step)
    return ordered, step


def _with_signs(parts: dict[str, list[str]]) -> dict[str, tuple[int, ...]]:
    """Return the numbers of each name, negative where a hyphen before them is a sign and no mere separator.

    It is a sign behind another separator or at the beginning (slice_-40), and where only some names have it (z-5, z5).
    """
    hyphens = {name: [_HYPHEN.search(text) is not None for text in part[:-1:2]] for name, part in parts.items()}
    mixed = [len(set(column)) > 1 for column in zip(*hyphens.values(), strict=True)]
    signed: dict[str, tuple[int, ...]] = {}
    for name, part in parts.items():
        # A name that begins with a hyphen has nothing before it that it could separate from the number.
        before, digits = [f" {part[0]}", *part[2::2]][: len(part) // 2], part[1::2]
        signed[name] = tuple(
            -int(value) if hyphen and (only_some or _SIGN.search(text)) else int(value)
            for text, value, hyphen, only_some in zip(before, digits, hyphens[name], mixed, strict=True)
        )
    return signed


def _check_gaps(folder: Path, ordered: list[str], column: list[int], step: int) -> None:
    count = (column[-1] - column[0]) // step + 1 - len(column)
    if count == 0:
        return
    spans = [(a + step, b - step) for a, b in pairwise(column) if b - a > step]
    missing = ", ".join(str(a) if a == b else f"{a} to {b}" for a, b in spans[:_LISTED])
    raise VolprepError(
        "VP1162",
        path=folder,
        count=count,
        first=ordered[0],
        last=ordered[-1],
        missing=missing + (f" and {len(spans) - _LISTED} more gaps" if len(spans) > _LISTED else ""),
    )


def unordered(folder: Path, first: str, other: str, how: str) -> VolprepError:
    """Return VP1161 for two names that do not tell their order."""
    return VolprepError("VP1161", path=folder, first=first, other=other, how=how)
