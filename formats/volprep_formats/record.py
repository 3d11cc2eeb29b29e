"""The base of every record that is read or written: frozen, closed, documented field by field."""

from difflib import get_close_matches
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict, ValidationError

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

_SHOWN = 3
"""Problems that one message names; a key that is wrong everywhere would otherwise fill the screen."""


class Record(BaseModel):
    """A frozen model without unknown keys. The docstring under a field is its documentation in the schema."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False, validate_default=True
    )


def problems(error: ValidationError) -> str:
    """Say in one line what a model found wrong: keys that it does not know, or else each key with its problem."""
    details = error.errors(include_url=False)
    unknown = [detail for detail in details if detail["type"] == "extra_forbidden"]
    # A misspelt key is missing under its right name, too, and what it belongs to may be missing for it.
    told = [_unknown_key(detail, details) for detail in unknown] or [_problem(detail) for detail in details]
    more = f"; and {len(told) - _SHOWN} more" if len(told) > _SHOWN else ""
    return "; ".join(told[:_SHOWN]) + more


def _unknown_key(detail: "ErrorDetails", details: list["ErrorDetails"]) -> str:
    *parent, key = detail["loc"]
    missing = [str(each["loc"][-1]) for each in details if each["type"] == "missing" and [*each["loc"][:-1]] == parent]
    meant = get_close_matches(str(key), missing, n=1)
    return f"{_name(detail)}: unknown key" + (f", {meant[0]} is missing" if meant else "")


def _problem(detail: "ErrorDetails") -> str:
    return f"{_name(detail)}: {detail['msg'].removeprefix('Value error, ')}"


def _name(detail: "ErrorDetails") -> str:
    return ".".join(str(part) for part in detail["loc"]) or "file"
