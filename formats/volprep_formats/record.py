"""Base class of every record that is read or written: frozen, closed, documented field by field."""

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

if TYPE_CHECKING:
    from pydantic import GetJsonSchemaHandler
    from pydantic.json_schema import JsonSchemaValue
    from pydantic_core import CoreSchema, ErrorDetails

_SHOWN = 12
"""Most problems in one message; a key that is wrong everywhere would otherwise fill the screen."""
_FOLLOWS = frozenset(("missing", "value_error", "too_short"))
"""Problems that an unknown key may cause."""
_IN_WORDS = (
    ("^#[0-9a-fA-F]{6}$", 'a colour is written as "#rrggbb"'),
    ("a-z0-9", "a name has lower-case letters, digits, - and _, and nothing else"),
)
"""Descriptions of the name patterns, by a substring of the pattern."""


Kind = TypeVar("Kind")


def present(*parts: Kind | None) -> tuple[Kind, ...]:
    """Return the ones that are there."""
    return tuple(part for part in parts if part is not None)


class Record(BaseModel):
    """A frozen model without unknown keys. The docstring under a field is its documentation in the schema."""

    # A record is built when the first of its kind is made: a verb uses few of them, and to build all took 0.1 s.
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True, defer_build=True)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: "CoreSchema", handler: "GetJsonSchemaHandler"
    ) -> "JsonSchemaValue":
        """Describe each field by its docstring.

        pydantic's own use_attribute_docstrings reads the source of every record whenever it is imported: 0.1 s.
        """
        schema = handler(core_schema)
        properties = handler.resolve_ref_schema(schema)["properties"]
        for name, text in _field_docstrings(cls).items():
            # Do not repeat the docstring of the record that the field holds.
            if getattr(cls.model_fields[name].annotation, "__doc__", None) != text:
                properties[name].setdefault("description", text)
        return schema


def _field_docstrings(record: type[Record]) -> dict[str, str]:
    """Return the docstrings of a record's fields, inherited fields included."""
    import ast  # noqa: PLC0415 - only schemas need it
    import inspect  # noqa: PLC0415 - as above

    found: dict[str, str] = {}
    for part in reversed(record.__mro__[: record.__mro__.index(Record)]):
        (definition,) = ast.parse(inspect.cleandoc("\n" + inspect.getsource(part))).body
        assert isinstance(definition, ast.ClassDef)  # noqa: S101 - the source of a class
        for field, after in itertools.pairwise(definition.body):
            if isinstance(field, ast.AnnAssign) and isinstance(after, ast.Expr):
                assert isinstance(field.target, ast.Name)  # noqa: S101 - a field has a plain name
                assert isinstance(after.value, ast.Constant)  # noqa: S101 - its docstring
                found[field.target.id] = inspect.cleandoc(str(after.value.value))
    return found


def problems(error: ValidationError, record: type[Record] | None = None) -> str:
    """Format a model's validation errors in one line: unknown keys, then each other key with its problem.

    With `record`, an unknown key is reported with the keys that may have been meant.
    """
    details = error.errors(include_url=False)
    unknown = [detail for detail in details if detail["type"] == "extra_forbidden"]
    # A misspelt key is also missing under its right name, and may make its parent appear missing.
    others = [detail for detail in details if detail not in unknown and (not unknown or detail["type"] not in _FOLLOWS)]
    told = [_unknown_key(detail, details, record) for detail in unknown] + _by_key(others)
    more = f"; and {len(told) - _SHOWN} more" if len(told) > _SHOWN else ""
    return "; ".join(told[:_SHOWN]) + more


def _unknown_key(detail: "ErrorDetails", details: list["ErrorDetails"], record: type[Record] | None) -> str:
    from difflib import get_close_matches  # noqa: PLC0415 - only for a message

    *parent, key = detail["loc"]
    missing = [
        str(detail["loc"][-1]) for detail in details if detail["type"] == "missing" and [*detail["loc"][:-1]] == parent
    ]
    name = _name([part for part in detail["loc"] if _is_key(part)])
    if meant := get_close_matches(str(key), missing, n=1):
        return f"{name}: unknown key, {meant[0]} is missing"
    near = _tables_with(record, str(key)) or get_close_matches(str(key), _keys_at(record, parent), n=2)
    return f"{name}: unknown key" + (f", perhaps {' or '.join(near)} is meant" if near else "")


def _tables_with(record: type[Record] | None, key: str) -> list[str]:
    """Return the places of a key in the tables of `record`, if they are at most two."""
    fields = {} if record is None else record.model_fields
    records = [(name, inner) for name, field in fields.items() for inner in _records_in(field.annotation)]
    places = dict.fromkeys(f"{name}.{key}" for name, inner in records if key in inner.model_fields)
    return [*places] if len(places) <= 2 else []


def _keys_at(record: type[Record] | None, place: Sequence[int | str]) -> list[str]:
    """Return the keys of the records at a place within `record`."""
    records = [] if record is None else [record]
    for part in place:
        if isinstance(part, str) and any(part in record.model_fields for record in records):
            fields = [record.model_fields[part].annotation for record in records if part in record.model_fields]
            records = [inner for annotation in fields for inner in _records_in(annotation)]
    return [name for record in records for name in record.model_fields]


def _records_in(annotation: object) -> list[type[Record]]:
    """Return the record types in an annotation, such as tuple[SceneTransfer, ...] or GridSettings | None."""
    if isinstance(annotation, type) and issubclass(annotation, Record):
        return [annotation]
    return [record for inner in get_args(annotation) for record in _records_in(inner)]


def _by_key(details: list["ErrorDetails"]) -> list[str]:
    """Group messages by key: the errors of all members of a union are reported together."""
    said: dict[str, list[str]] = {}
    for detail in details:
        said.setdefault(_name([part for part in detail["loc"] if _is_key(part)]), []).append(_problem(detail))
    # A list with a wrong entry counts as one without it, and may be too short for that.
    late = {
        _name(detail["loc"])
        for detail in details
        if detail["type"] == "too_short" and any(key.startswith(f"{_name(detail['loc'])}.") for key in said)
    }
    return [f"{key}: {', or '.join(dict.fromkeys(texts))}" for key, texts in said.items() if key not in late]


def _is_key(part: int | str) -> bool:
    """Tell a key or an index from what pydantic writes behind it of one of several types: literal['auto'], float."""
    return isinstance(part, int) or (part.isidentifier() and part not in {"bool", "int", "float", "str"})


def _problem(detail: "ErrorDetails") -> str:
    if detail["type"] == "missing":
        return "is missing"
    if detail["type"] == "tuple_type" and isinstance(detail["input"], dict):
        return f"Input should be a list, in TOML [[{_name(detail['loc'])}]]"
    if detail["type"] == "string_pattern_mismatch":
        pattern = str(detail.get("ctx", {}).get("pattern", ""))
        said = next((words for part, words in _IN_WORDS if part in pattern), "")
        return f"{str(detail['input'])[:60]!r} is not possible: {said}" if said else detail["msg"]
    return detail["msg"].removeprefix("Value error, ").replace("valid tuple", "list")


def _name(parts: Sequence[int | str]) -> str:
    return ".".join(str(part) for part in parts) or "file"
