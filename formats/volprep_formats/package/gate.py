"""Checks on opening a sealed package: every problem that can be found without reading a file.

Names, sizes and the consistency of the records take about a millisecond. The digest of a file is checked when it is
read.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.rules import contradictions
from volprep_formats.package.storage.contents import sizes_of
from volprep_formats.package.storage.files import MANIFEST


def require_sound(path: Path, manifest: Manifest) -> None:
    """Raise the first error from `disagreements` and `wrong_sizes`, if any."""
    sizes = sizes_of(path)
    for problem in (*disagreements(path, manifest, sizes), *wrong_sizes(path, manifest, sizes)):
        raise problem


def disagreements(path: Path, manifest: Manifest, sizes: dict[str, int | None]) -> Iterator[VolprepError]:
    """Yield VP4010 for each file that the manifest does not name, and VP4011 for each contradiction in it."""
    named = {MANIFEST, *(record.path for record in manifest.files)}
    yield from (VolprepError("VP4010", path=path, file=name) for name in sizes if name not in named)
    # Numbers near the end of the range overflow; the comparison then fails, which is the intended result.
    with np.errstate(all="ignore"):
        try:
            problems = list(contradictions(manifest))
        except (ValidationError, OverflowError):
            problems = ["a size computed from its numbers overflows"]
    yield from (VolprepError("VP4011", path=path, problem=problem) for problem in problems)


def wrong_sizes(path: Path, manifest: Manifest, sizes: dict[str, int | None]) -> Iterator[VolprepError]:
    """Yield VP4007 for each file that is missing or a link, VP4008 for each whose size differs from its record."""
    for record in manifest.files:
        size = sizes.get(record.path)
        if record.path not in sizes:
            yield VolprepError("VP4007", path=path, file=record.path, error="there is no such file")
        elif size is None:
            yield VolprepError("VP4007", path=path, file=record.path, error="not a regular file")
        elif size != record.size_bytes:
            yield VolprepError("VP4008", path=path, file=record.path, size=size, expected=record.size_bytes)
