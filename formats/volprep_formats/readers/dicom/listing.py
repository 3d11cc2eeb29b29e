"""List the DICOM series in a folder tree, with all problems of each.

The description of a series is free text, which may name a patient: it is shown on the screen only and never recorded.
"""

from dataclasses import replace
from pathlib import Path

from pydantic import Field

from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import no_such_path
from volprep_formats.progress import Progress
from volprep_formats.readers.dicom.geometry import repair_of
from volprep_formats.readers.dicom.naming import series_name
from volprep_formats.readers.dicom.reader import stack_series
from volprep_formats.readers.dicom.scan import Series, no_images, scan
from volprep_formats.record import Record
from volprep_formats.source import RepairKind

_SHORTEST_ENDING = 8


class Problem(Record):
    """Why something cannot be read."""

    code: str
    """Permanent code of the message."""
    summary: str
    """Description of the problem, with the numbers."""
    remedy: str
    """Suggested remedy."""


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
    is_localiser: bool
    """Whether the series is a localiser (scout), which is used to plan other series."""
    problems: tuple[Problem, ...]
    """All that keeps it from being a volume; none when it is one."""
    number: int | None = None
    """Number of the series in its study."""
    description: str = Field(default="", exclude=True)
    """The series description; shown on the screen only, never written to JSON."""
    details: str = Field(default="", exclude=True)
    """Kernel, echo, type of image and time, for the screen alone, too."""


class Listing(Record):
    """The series in a folder tree."""

    series: tuple[ListedSeries, ...]
    """All series, in the order of their UIDs."""
    damaged: tuple[Problem, ...]
    """One for each DICOM file that cannot be parsed."""
    other_files: int
    """Number of files that hold no DICOM image."""


def list_series(path: Path, progress: Progress, *, described: bool = False) -> Listing:
    """List the series in the folder tree, or file, `path`; if `described`, with their descriptions, for a screen.

    Raises VolprepError VP1001 (no such path), VP1003 (unreadable folder) and VP1030 or VP1309 (nothing of DICOM here).
    """
    if not path.exists():
        raise no_such_path(path)
    scanned = scan(path, progress)
    if not scanned.series and not scanned.damaged:
        raise no_images(path, scanned.other_files)
    uids = [series.uid for series in scanned.series]
    return Listing(
        series=tuple(_listed(series, uids, described=described) for series in scanned.series),
        damaged=tuple(_problem(error) for error in scanned.damaged),
        other_files=scanned.other_files,
    )


def listed_series(series: Series) -> ListedSeries:
    """Return the facts in the headers of one series, including its description."""
    return _listed(series, [series.uid], described=True)


def _listed(series: Series, uids: list[str], *, described: bool) -> ListedSeries:
    first = series.images[0]
    name = series_name(first.path)
    problems = _problems(series)
    spacing_yx = first.pixel_spacing_mm_yx or (None, None)
    spacing: tuple[float | None, float | None, float | None] = (None, spacing_yx[0], spacing_yx[1])
    if not problems:
        spacing = stack_series(series).grid.spacing_mm_zyx
    return ListedSeries(
        uid=series.uid,
        ending=_ending(series.uid, uids),
        modality=first.modality,
        files=series.files,
        shape_zyx=(len(series.images), *first.shape_yx),
        spacing_mm_zyx=spacing,
        is_localiser=any(image.is_localiser for image in series.images),
        problems=tuple(_problem(error) for error in problems),
        number=name.number,
        description=name.description if described else "",
        details=name.details if described else "",
    )


def _problems(series: Series) -> list[VolprepError]:
    """Return all problems: one error of each kind in the images, then the errors of the sound images together."""
    of_images: dict[str, VolprepError] = {}
    for image in series.images:
        if image.problem is not None:
            of_images.setdefault(image.problem.code, image.problem)
    found = list(of_images.values())
    sound = replace(series, images=tuple(image for image in series.images if image.problem is None))
    repaired: list[RepairKind] = []
    while sound.images:
        try:
            stack_series(sound, repaired)
            break
        except VolprepError as error:
            found.append(error)
            # An error that --gaps or another option can repair may hide another one.
            kind = repair_of(error)
            if kind is None or kind in repaired:
                break
            repaired.append(kind)
    return found


def _ending(uid: str, uids: list[str]) -> str:
    for length in range(_SHORTEST_ENDING, len(uid)):
        if sum(other.endswith(uid[-length:]) for other in uids) == 1:
            return uid[-length:]
    return uid


def _problem(error: VolprepError) -> Problem:
    return Problem(code=error.code, summary=error.summary, remedy=error.remedy)
