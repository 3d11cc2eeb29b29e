"""Records of several channels in one picture."""

from typing import Annotated

from pydantic import Field

from volprep_formats.record import Record


class Together(Record):
    """One picture of several channels: extinctions add, and each channel emits light as its extinction does."""

    name: str
    """Name of the picture, which programs name in place of a transfer function."""
    transfers: Annotated[tuple[str, ...], Field(min_length=2)]
    """Names of the transfer functions that are drawn together. Each belongs to another channel."""
