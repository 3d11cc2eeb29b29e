"""The base of every record that is read or written: frozen, closed, documented field by field."""

from pydantic import BaseModel, ConfigDict


class Record(BaseModel):
    """A frozen model without unknown keys. The docstring under a field is its documentation in the schema."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False, validate_default=True
    )
