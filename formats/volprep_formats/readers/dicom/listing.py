"""What a folder tree holds of DICOM series, and what is wrong with each: geometry, numbers and codes only.

Free text of the headers, such as the description of a series, may name a patient and is not read.
"""

from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Progress
from volprep_formats.readers.dicom.reader import stack_series
from volprep_formats.readers.dicom.scan import Series, scan
from volprep_formats.record import Record

_SHORTEST_ENDING = 8


class Problem(Record):
    """Why something cannot be read."""

    code: str
    """Permanent code of the message."""
    summary: str
    """What is wrong, with the numbers."""
    remedy: str
    """What to do about it."""


class ListedSeries(Record):
    """One series."""

    uid: str
    """SeriesInstanceUID."""
    ending: str
    """Shortest ending of it, of eight characters or more, that no other series here has: a name for source.series."""
    modality: str
    """DICOM modality; empty when the series does not say."""
    files: int
    """Number of files that hold its slices."""
    shape_zyx: tuple[int, int, int]
    """Number of slices, and the rows and columns of the first."""
    spacing_mm_zyx: tuple[float | None, float | None, float | None]
    """Distance between voxel centres; none where it is not known or not the same everywhere."""
    problem: Problem | None
    """Why it is no volume; none when it is one."""


class Listing(Record):
    """What a folder tree holds."""

    series: tuple[ListedSeries, ...]
    """All series, in the order of their UIDs."""
    damaged: tuple[Problem, ...]
    """One for each DICOM file that cannot be parsed."""
    other_files: int
    """Number of files that hold no DICOM image."""


def list_series(path: Path, progress: Progress) -> Listing:
    """List the series in the folder tree, or file, `path`.

    Raises VolprepError VP1001 (no such path), VP1003 (unreadable folder) and VP1030 (nothing of DICOM here).
    """
    if not path.exists():
        raise VolprepError("VP1001", path=path)
    scanned = scan(path, progress)
    if not scanned.series and not scanned.damaged:
        raise VolprepError("VP1030", path=path, files=scanned.other_files)
    uids = [series.uid for series in scanned.series]
    return Listing(
        series=tuple(_listed(series, uids) for series in scanned.series),
        damaged=tuple(_problem(error) for error in scanned.damaged),
        other_files=scanned.other_files,
    )


def _listed(series: Series, uids: list[str]) -> ListedSeries:
    first = series.images[0]
    spacing_yx = first.pixel_spacing_mm_yx or (None, None)
    spacing: tuple[float | None, float | None, float | None] = (None, spacing_yx[0], spacing_yx[1])
    problem = None
    try:
        spacing = stack_series(series).grid.spacing_mm_zyx
    except VolprepError as error:
        problem = _problem(error)
    return ListedSeries(
        uid=series.uid,
        ending=_ending(series.uid, uids),
        modality=first.modality,
        files=series.files,
        shape_zyx=(len(series.images), *first.shape_yx),
        spacing_mm_zyx=spacing,
        problem=problem,
    )


def _ending(uid: str, uids: list[str]) -> str:
    for length in range(_SHORTEST_ENDING, len(uid)):
        if sum(other.endswith(uid[-length:]) for other in uids) == 1:
            return uid[-length:]
    return uid


def _problem(error: VolprepError) -> Problem:
    return Problem(code=error.code, summary=error.summary, remedy=error.remedy)
