"""Types of values that several records of a package share."""

import re
from typing import Annotated

from pydantic import AfterValidator, Field

_RESERVED = r"(^|/)(con|prn|aux|nul|com[1-9]|lpt[1-9])(\.|/|$)"
"""Names of devices, which Windows does not allow for files, whatever follows after a dot."""


def _without_devices(path: str) -> str:
    if re.search(_RESERVED, path):
        msg = f"{path!r} is the name of a device on Windows"
        raise ValueError(msg)
    return path


Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
PackagePath = Annotated[
    str,
    Field(
        pattern=r"^[a-z0-9_-]+(\.[a-z0-9_-]+)*(/[a-z0-9_-]+(\.[a-z0-9_-]+)*)*$",
        json_schema_extra={"not": {"pattern": _RESERVED}},
    ),
    AfterValidator(_without_devices),
]
"""Relative path with forward slashes, lower case, no dot at the start of a part: it cannot leave the package."""
ByteCount = Annotated[int, Field(ge=0, le=2**53 - 1)]
"""Any larger number would not survive JavaScript."""
Total = Annotated[int, Field(ge=0, le=2**53 - 1)]
"""Number of things, which may be more than an axis has voxels."""


def open_word(*known: str) -> object:
    """Return the annotation of a string that only describes: readers accept words beside the known ones."""
    return Field(examples=[*known])
