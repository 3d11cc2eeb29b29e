"""Parse untrusted JSON. spec/README.md, sets the limits, which are the same in all readers of packages.

A text that two parsers could read as different values is refused: a key that occurs twice in one object, numbers that
are not JSON, characters that some parsers drop or replace.
"""

import json
import re
from collections.abc import Iterator
from typing import Literal, NoReturn, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

MOST_DEPTH = 32
"""Largest number of arrays and objects around a value."""
MOST_KEYS = 256
"""Largest number of keys of one object."""
MOST_DIGITS = 256
"""Largest number of digits before the decimal point, and after it."""
LARGEST_INTEGER = 2**53 - 1
"""Largest integer, either sign: any larger one would not survive JavaScript."""
_LARGE_INTEGER = re.compile(r"(?<![0-9.eE+])-?([0-9]{16,})(?![0-9.eE])")
_LONG_NUMBER = re.compile(rf"[0-9]{{{MOST_DIGITS + 1}}}")
_STRINGS = re.compile(r'"(?:[^"\\]|\\.)*"')
_NOT_CHARACTERS = re.compile("[\0\ud800-\udfff]")


_OTHERS_KEYS = frozenset(("extras", "extensions"))
"""Keys that any object may have for data of others, as in glTF."""
_Model = TypeVar("_Model", bound=BaseModel)


def read_record(model: type[_Model], data: bytes, unknown_keys: Literal["forbid", "ignore"]) -> _Model:
    """Parse a UTF-8 JSON text and return its record.

    With "forbid", a key that the model does not have is an error, except `extras` and `extensions`. Raises ValueError
    if the text breaks a rule of spec/README.md, and pydantic's ValidationError if the record breaks its schema.
    """
    value = parse_json(data)
    has_others = any(f'"{key}"'.encode() in data for key in _OTHERS_KEYS)
    if unknown_keys == "forbid" and has_others:
        data = json.dumps(_without_others(value)).encode()
    # Numbers near the end of the range overflow in the models' own checks, which then refuse them.
    with np.errstate(all="ignore"):
        try:
            return model.model_validate_json(data, strict=True, extra=unknown_keys)
        except ValidationError as error:
            if not any(_is_whole(error["input"]) for error in error.errors(include_url=False)):
                raise
            # An integer may be written as 2.0, as in JSON Schema.
            text = json.dumps(json.loads(data, parse_float=_number))
            return model.model_validate_json(text, strict=True, extra=unknown_keys)


def _is_whole(value: object) -> bool:
    return isinstance(value, float) and value.is_integer()


def _number(text: str) -> float:
    value = float(text)
    return int(value) if value.is_integer() and abs(value) < 2**53 else value


def _without_others(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_others(inner) for key, inner in value.items() if key not in _OTHERS_KEYS}
    return [_without_others(inner) for inner in value] if isinstance(value, list) else value


def places_of_others(value: object, at: str = "") -> Iterator[str]:
    """Yield the places of `extras` and `extensions` in a JSON value, such as channels.0.extras."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        place = f"{at}.{key}" if at else f"{key}"
        if key in _OTHERS_KEYS:
            yield place
        else:
            yield from places_of_others(inner, place)


def parse_json(data: bytes) -> object:
    """Return the value of a UTF-8 JSON text. Raises ValueError if the text breaks a rule of spec/README.md."""
    text = data.decode("utf-8")
    try:
        value = json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_refuse_constant)
    except RecursionError as error:
        msg = f"it nests more than {MOST_DEPTH} deep"
        raise ValueError(msg) from error
    outside_strings = _STRINGS.sub("", text)
    _check_numbers(outside_strings)
    _check_depth(outside_strings)
    if "\\u" in text:
        _check_characters(value)
    return value


def _check_numbers(text: str) -> None:
    if _LONG_NUMBER.search(text):
        msg = f"a number has more than {MOST_DIGITS} digits"
        raise ValueError(msg)
    if any(int(digits) > LARGEST_INTEGER for digits in _LARGE_INTEGER.findall(text)):
        msg = f"an integer is beyond {LARGEST_INTEGER}"
        raise ValueError(msg)


def _check_depth(text: str) -> None:
    depth = 0
    for bracket in re.findall(r"[][{}]", text):
        depth += 1 if bracket in "[{" else -1
        if depth > MOST_DEPTH:
            msg = f"it nests more than {MOST_DEPTH} deep"
            raise ValueError(msg)


def _check_characters(value: object) -> None:
    """Refuse strings with a zero character or half of a surrogate pair, which escapes can make."""
    if isinstance(value, str):
        if _NOT_CHARACTERS.search(value):
            msg = "a string has a zero character, or half of a surrogate pair"
            raise ValueError(msg)
    elif isinstance(value, dict):
        for key, inner in value.items():
            _check_characters(key)
            _check_characters(inner)
    elif isinstance(value, list):
        for inner in value:
            _check_characters(inner)


def _unique_keys(pairs: list[tuple[str, object]]) -> dict[str, object]:
    record = dict(pairs)
    if len(record) != len(pairs):
        # Of two equal keys two parsers may use different ones: one would check other values than the other draws.
        msg = "a key occurs twice in one object"
        raise ValueError(msg)
    if len(pairs) > MOST_KEYS:
        msg = f"an object has more than {MOST_KEYS} keys"
        raise ValueError(msg)
    return record


def _refuse_constant(name: str) -> NoReturn:
    msg = f"{name} is not a number in JSON"
    raise ValueError(msg)
