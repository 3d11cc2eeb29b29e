"""Parse numbers in header text strictly: Python's own parsers allow underscores and digits of any script."""

import re

_FLOAT = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|[-+]?(?:nan|inf)", re.IGNORECASE)
_INTEGER = re.compile(r"[-+]?[0-9]{1,19}")


def parse_floats(words: list[str]) -> list[float] | None:
    """Parse the words as numbers; None if one is invalid."""
    return [float(word) for word in words] if all(map(_FLOAT.fullmatch, words)) else None


def parse_integers(words: list[str], least: int, most: int) -> list[int] | None:
    """Parse the words as integers from `least` to `most`; None if one is invalid or there are no words."""
    if not words or not all(map(_INTEGER.fullmatch, words)):
        return None
    numbers = [int(word) for word in words]
    return numbers if least <= min(numbers) and max(numbers) <= most else None
