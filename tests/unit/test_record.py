from typing import Annotated, Literal

import pytest
from pydantic import Field, ValidationError

from volprep_formats.record import Record, problems


class Point(Record):
    value: float
    colour: str
    weight: float = 1.0


class Line(Record):
    points: Annotated[tuple[Point, ...], Field(min_length=1)]
    name: str = ""
    width: Literal["auto"] | float | tuple[float, float] = "auto"


def said(data) -> str:
    with pytest.raises(ValidationError) as caught:
        Line.model_validate(data)
    return problems(caught.value)


def test_a_misspelt_key_is_one_problem_and_the_right_one_is_named() -> None:
    assert said({"points": [{"value": 1, "color": "red"}]}) == "points.0.color: unknown key, colour is missing"


def test_an_unknown_key_that_is_near_to_nothing_missing_is_only_unknown() -> None:
    assert said({"points": [{"value": 1, "colour": "red"}], "brightness": 3}) == "brightness: unknown key"


def test_a_wrong_value_is_said_with_its_place() -> None:
    text = said({"points": [{"value": "a", "colour": "red"}]})
    assert text.startswith("points.0.value: Input should be a valid number")
    # Without its only entry the list would be too short, which is not another mistake.
    assert ";" not in text


def test_a_key_of_several_types_is_one_problem_without_their_names() -> None:
    text = said({"points": [{"value": 1, "colour": "red"}], "width": "wide"})
    assert text == (
        "width: Input should be 'auto', or Input should be a valid number, unable to parse string as a number, "
        "or Input should be a list"
    )


def test_a_table_in_place_of_a_list_of_tables_is_said_in_toml() -> None:
    assert said({"points": {"value": 1}}) == "points: Input should be a list, in TOML [[points]]"


def test_a_missing_key_is_said() -> None:
    assert said({}) == "points: is missing"


def test_a_key_that_is_wrong_everywhere_is_counted_not_repeated() -> None:
    text = said({"points": [{"value": 1, "color": "red"}] * 15})
    assert text.count("unknown key") == 12
    assert text.endswith("; and 3 more")


def test_a_file_that_is_no_table_is_said_to_be_wrong_as_a_whole() -> None:
    assert said([]).startswith("file: ")


class _Inner(Record):
    preset: str = ""
    colour: str = "#000000"
    size: int = 1


class _Outer(Record):
    name: Annotated[str, Field(pattern=r"^[a-z0-9_-]+$")] = "a"
    parts: tuple[_Inner, ...] = ()
    one: _Inner | None = None


def told(data: object) -> str:
    with pytest.raises(ValidationError) as caught:
        _Outer.model_validate(data)
    return problems(caught.value, _Outer)


def test_an_unknown_key_is_told_with_the_near_ones() -> None:
    assert told({"parts": [{"presett": "x"}]}) == "parts.0.presett: unknown key, perhaps preset is meant"
    assert told({"one": {"color": "#ffffff"}}) == "one.color: unknown key, perhaps colour is meant"
    assert told({"zzz": 1}) == "zzz: unknown key"


def test_a_key_of_another_table_is_told_with_its_place() -> None:
    assert told({"preset": "x"}) == "preset: unknown key, perhaps parts.preset or one.preset is meant"


def test_all_that_is_wrong_is_told_at_once() -> None:
    text = told({"nane": 1, "parts": [{"size": "big"}], "one": {"size": "huge"}})
    assert "nane: unknown key, perhaps name is meant" in text
    assert "parts.0.size" in text
    assert "one.size" in text


def test_names_are_explained_in_words() -> None:
    assert told({"name": "Big Head"}) == (
        "name: 'Big Head' is not possible: a name has lower-case letters, digits, - and _, and nothing else"
    )
