"""Types of values that several records of a package share."""

from typing import Annotated

from pydantic import Field

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
PackagePath = Annotated[str, Field(pattern=r"^[a-z0-9_-]+(\.[a-z0-9_-]+)*(/[a-z0-9_-]+(\.[a-z0-9_-]+)*)*$")]
"""Relative path with forward slashes, lower case, no dot at the start of a part: it cannot leave the package."""
ByteCount = Annotated[int, Field(ge=0, le=2**53 - 1)]
"""Any larger number would not survive JavaScript."""
Total = Annotated[int, Field(ge=0, le=2**53 - 1)]
"""Number of things, which may be more than an axis has voxels."""


def open_word(*known: str) -> object:
    """Return the annotation of a string that only describes: readers accept words beside the known ones."""
    return Field(examples=[*known])
