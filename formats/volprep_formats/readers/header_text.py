"""Numbers in the text of headers, taken strictly: Python's own parsers allow underscores and digits of any script."""

import re

_FLOAT = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|[-+]?(?:nan|inf)", re.IGNORECASE)
_INTEGER = re.compile(r"[-+]?[0-9]{1,19}")


def parse_floats(words: list[str]) -> list[float] | None:
    """Numbers that the words are, or None when one is none."""
    return [float(word) for word in words] if all(map(_FLOAT.fullmatch, words)) else None


def parse_integers(words: list[str], least: int, most: int) -> list[int] | None:
    """Whole numbers from `least` to `most` that the words are, or None when one is none or there are no words."""
    if not words or not all(map(_INTEGER.fullmatch, words)):
        return None
    numbers = [int(word) for word in words]
    return numbers if least <= min(numbers) and max(numbers) <= most else None
