"""Which files of a folder are volumes, by their names: as scanners' converters and organ segmenters write them."""

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.time_axis import TimeAxis, not_time

HEADERS = (".nhdr", ".mhd")
"""Endings of headers whose voxels lie in a data file."""
SUFFIXES = (".nii", ".nii.gz", ".nrrd", ".mha", ".mgz", ".mgh", ".mif", ".mif.gz", *HEADERS)
"""Endings of files that hold a volume each, in lower case."""
_OF_SIMULATIONS = (".vdb", ".vti", ".vtk", ".npy", ".mrc", ".mnc")
"""The same, of files that count as volumes only where a folder is a time series."""
_NUMBER = re.compile(r"[0-9]{1,18}")


def volumes_in(folder: Path) -> int:
    """Return the number of volumes directly in a folder, without hidden files. Raises OSError."""
    return len(_ending_with(folder, SUFFIXES))


def series_in(folder: Path) -> list[Path]:
    """Return the volumes directly in a folder, in the order of the numbers in their names.

    Returns nothing if the folder has more other files than volumes: a volume may have one beside it. Raises OSError.
    """
    there = _ending_with(folder, "")
    files = [path for path in there if path.name.lower().endswith((*SUFFIXES, *_OF_SIMULATIONS))]
    if len(there) > 2 * len(files):
        return []
    return sorted(files, key=lambda path: (_numbers(path), path.name))


def folder_frames(files: Sequence[Path]) -> TimeAxis:
    """Return a frame for each volume of a folder, which does not say their times.

    Raises VP1340 for names that differ in more than a number, and VP1343 where a number is missing.
    """
    columns = [set(column) for column in zip(*map(_numbers, files), strict=False)]
    varying = [k for k, column in enumerate(columns) if len(column) > 1]
    if len({_NUMBER.sub("#", path.name) for path in files}) > 1 or len(varying) > 1:
        raise not_time(
            files[0].parent, f"names such as {files[0].name} and {files[-1].name} differ in more than one number"
        )
    numbers = [_numbers(path)[varying[0]] for path in files] if varying else []
    steps = [after - before for before, after in pairwise(numbers)]
    gap = next((k for k, step in enumerate(steps) if step != min(steps)), None)
    if gap is not None:
        what = f"after {files[gap].name} comes {files[gap + 1].name}, and other numbers differ by {min(steps)}"
        raise VolprepError("VP1343", path=files[0].parent, what=what)
    return TimeAxis(len(files))


def _ending_with(folder: Path, endings: str | tuple[str, ...]) -> list[Path]:
    return [path for path in folder.iterdir() if path.name.lower().endswith(endings) and not path.name.startswith(".")]


def _numbers(path: Path) -> tuple[int, ...]:
    return tuple(int(digits) for digits in _NUMBER.findall(path.name))
