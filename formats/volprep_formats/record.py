"""The base of every record that is read or written: frozen, closed, documented field by field."""

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict, ValidationError

if TYPE_CHECKING:
    from pydantic import GetJsonSchemaHandler
    from pydantic.json_schema import JsonSchemaValue
    from pydantic_core import CoreSchema, ErrorDetails

_SHOWN = 3
"""Problems that one message names; a key that is wrong everywhere would otherwise fill the screen."""


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
            # What the docstring of the field's record says as well stands only there.
            if getattr(cls.model_fields[name].annotation, "__doc__", None) != text:
                properties[name].setdefault("description", text)
        return schema


def _field_docstrings(record: type[Record]) -> dict[str, str]:
    """Docstrings of the fields of a record, those that it inherits included."""
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


def problems(error: ValidationError) -> str:
    """Say in one line what a model found wrong: keys that it does not know, or else each key with its problem."""
    details = error.errors(include_url=False)
    unknown = [detail for detail in details if detail["type"] == "extra_forbidden"]
    # A misspelt key is missing under its right name, too, and what it belongs to may be missing for it.
    told = [_unknown_key(detail, details) for detail in unknown] or _by_key(details)
    more = f"; and {len(told) - _SHOWN} more" if len(told) > _SHOWN else ""
    return "; ".join(told[:_SHOWN]) + more


def _unknown_key(detail: "ErrorDetails", details: list["ErrorDetails"]) -> str:
    from difflib import get_close_matches  # noqa: PLC0415 - only for a message

    *parent, key = detail["loc"]
    missing = [str(each["loc"][-1]) for each in details if each["type"] == "missing" and [*each["loc"][:-1]] == parent]
    meant = get_close_matches(str(key), missing, n=1)
    return f"{_name(detail['loc'])}: unknown key" + (f", {meant[0]} is missing" if meant else "")


def _by_key(details: list["ErrorDetails"]) -> list[str]:
    """Say each key once; what is wrong with each of several types that it may have is said together."""
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
    return detail["msg"].removeprefix("Value error, ").replace("valid tuple", "list")


def _name(parts: Sequence[int | str]) -> str:
    return ".".join(str(part) for part in parts) or "file"
