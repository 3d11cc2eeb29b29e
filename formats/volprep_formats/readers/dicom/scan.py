"""Find the DICOM series in a folder tree that may hold anything else, and choose the one that is meant."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from volprep_formats.diagnostics import Lines, SafeText, VolprepError
from volprep_formats.progress import Progress
from volprep_formats.readers.dicom.copies import without_copies
from volprep_formats.readers.dicom.file import NO_HEADER, slices_of
from volprep_formats.readers.dicom.header import SliceImage
from volprep_formats.readers.dicom.naming import series_name
from volprep_formats.readers.dicom.plain import PlainHeader, plain_headers
from volprep_formats.readers.foreign_formats import Other, recognised
from volprep_formats.readers.volume_files import volumes_in
from volprep_formats.regular_files import unpacked_head
from volprep_formats.source import SourceSpec
from volprep_formats.tree import broken_links_in, files_below

_FEWEST_SLICES = 4
"""Localisers and key images come in ones, twos and threes."""
_LONGEST_NUMBER, _MOST_NUMBERED = 9, 100
_HEAD_BYTES = 512
_TOGETHER = 256
"""Files whose headers are in memory at the same time."""


@dataclass(frozen=True)
class Series:
    """The slices that share one SeriesInstanceUID, in the order of their paths."""

    uid: str
    images: tuple[SliceImage, ...]
    copies: int = 0
    """Number of copies of these images, which are left out."""

    @property
    def files(self) -> int:
        """Number of files that hold them."""
        return len({image.path for image in self.images})

    def is_volume(self, *, in_colour: bool) -> bool:
        """Whether this can be the volume that a user means: no localiser, more than a few slices, grey or not."""
        is_colour = any(i.problem is not None and i.problem.code == "VP1035" for i in self.images)
        is_localiser = any(i.is_localiser for i in self.images)
        return is_colour == in_colour and not is_localiser and len(self.images) >= _FEWEST_SLICES

    def __str__(self) -> str:
        first = self.images[0]
        parts = [f"{len(self.images)} images of {first.shape_yx[1]}×{first.shape_yx[0]}"]
        if first.modality:
            parts.insert(0, first.modality)
        if any(i.is_localiser for i in self.images):
            parts.append("localiser")
        problems = sorted({i.problem.code for i in self.images if i.problem is not None})
        if problems:
            parts.append("not usable: " + " ".join(problems))
        return f"{self.uid} ({', '.join(parts)})"


@dataclass(frozen=True)
class Scan:
    """The series in a folder tree."""

    path: Path
    series: tuple[Series, ...]
    damaged: tuple[VolprepError, ...]
    """One for each DICOM file that cannot be parsed. Each may hold a slice of any series."""
    other_files: int
    """Files that hold no DICOM image."""


_LAST: list[tuple[list[tuple[Path, int, int]], Scan]] = []
"""Names, sizes and times of the files scanned last, and the result: each frame of a series is opened by itself."""


def scan(path: Path, progress: Progress) -> Scan:
    """Read the headers of all files below `path`, or of the one file that it is.

    Links to folders are not followed. Raises VolprepError VP1003 for a folder that cannot be read.
    """
    files = [path] if path.is_file() else _files(path)
    state = [(file, status.st_size, status.st_mtime_ns) for file in files for status in [file.stat()]]
    if not _LAST or _LAST[-1][0] != state:
        _LAST[:] = [(state, _scan(path, files, progress))]
    scanned = _LAST[-1][1]
    missing = [] if path.is_file() else _missing(scanned.series)
    return replace(scanned, damaged=(*scanned.damaged, *missing))


def _scan(path: Path, files: Sequence[Path], progress: Progress) -> Scan:
    progress.start("reading DICOM headers", len(files))
    series: dict[str, list[SliceImage]] = {}
    damaged: list[VolprepError] = []
    for file, plain in _with_headers(files):
        try:
            slices = slices_of(file, plain)
        except VolprepError as error:
            damaged.append(error)
            slices = ()
        for image in slices:
            series.setdefault(image.series_uid, []).append(image)
        progress.advance()
    found = tuple(Series(uid, tuple(images)) for uid, images in sorted(series.items()))
    other_files = len(files) - len(damaged) - sum(s.files for s in found)
    return Scan(path, tuple(map(_without_copies, found)), tuple(damaged), other_files)


def _without_copies(series: Series) -> Series:
    kept = without_copies(series.images)
    return replace(series, images=kept, copies=len(series.images) - len(kept))


def no_images(path: Path, files: int) -> VolprepError:
    """Return VP1030; or VP1309 if all files below `path` are of one format without a reader, as GIF.

    VP2083 if `path` is a folder with volumes of other formats.
    """
    if path.is_dir() and (count := volumes_in(path)):
        return VolprepError("VP2083", path=path, count=count)
    seen = [] if path.is_file() else [file for file in _files(path) if not file.name.startswith(".")]
    found = _only_format(seen)
    if found is None:
        return VolprepError("VP1030", path=path, files=files)
    return VolprepError("VP1309", path=path, files=len(seen), what=SafeText(found.what), how=SafeText(found.how))


def _only_format(files: Sequence[Path]) -> Other | None:
    """Return the known format of all files; None if they differ, if one is not known, or if there is no file."""
    found: Other | None = None
    for file in files:
        try:
            head, is_gzip = unpacked_head(file, _HEAD_BYTES)
        except OSError:
            return None
        other = recognised(file, head, is_gzip=is_gzip)
        if other is None or found not in {None, other}:
            return None
        found = other
    return found


def choose_series(scanned: Scan, spec: SourceSpec) -> Series:
    """Return the series whose UID is, or ends with, `spec.series`; without it, the only one that can be meant.

    That is one in colour if `spec.colour` is a channel, and grey if not.

    Raises the error of the first damaged file, and VolprepError VP1030 or VP1309 (no images), VP1033 (several could be
    meant) or VP1034 (`spec.series` fits none or several).
    """
    wanted = spec.series
    # A file without a header belongs to no named series.
    damaged = [error for error in scanned.damaged if wanted is None or error.fields.get("what") != NO_HEADER]
    if damaged:
        raise damaged[0]
    if not scanned.series:
        raise no_images(scanned.path, scanned.other_files)
    if wanted is not None:
        by_number = _with_number(scanned.series, wanted)
        if len(by_number) == 1:
            return by_number[0]
        fitting = [s for s in scanned.series if s.uid.endswith(wanted)]
        fitting = [s for s in fitting if s.uid == wanted] or fitting
        if len(fitting) != 1:
            fits = "no series" if not fitting else f"{len(fitting)} series"
            if len(by_number) > 1:
                raise VolprepError(
                    "VP1302", path=scanned.path, wanted=wanted, count=len(by_number), found=_listed(tuple(by_number))
                )
            raise VolprepError("VP1034", path=scanned.path, wanted=wanted, fits=fits, found=_listed(scanned.series))
        return fitting[0]
    volumes = [s for s in scanned.series if s.is_volume(in_colour=spec.colour is not None)]
    if len(volumes) == 1:
        return volumes[0]
    if len(scanned.series) == 1:
        return scanned.series[0]
    raise VolprepError("VP1033", path=scanned.path, count=len(scanned.series), found=_listed(scanned.series))


def _with_number(series: Sequence[Series], wanted: str) -> list[Series]:
    """Return the series with the number `wanted`; none if it is not a number."""
    if not wanted.isdecimal() or len(wanted) > _LONGEST_NUMBER:
        return []
    return [listed for listed in series if series_name(listed.images[0].path).number == int(wanted)]


def _with_headers(files: Sequence[Path]) -> Iterator[tuple[Path, PlainHeader | None]]:
    for first in range(0, len(files), _TOGETHER):
        some = files[first : first + _TOGETHER]
        yield from zip(some, plain_headers(some), strict=True)


def _files(folder: Path) -> list[Path]:
    try:
        files = [Path(entry.path) for entry in files_below(folder)]
    except OSError as error:
        raise VolprepError("VP1003", path=error.filename, error=error.strerror) from error
    # The parts as key: paths compare themselves in Python, which took longer for a folder than to read its headers.
    return sorted(files, key=lambda file: file.parts)


def _missing(series: Sequence[Series]) -> list[VolprepError]:
    """Return an error for each link to a missing file that is named as the slices beside it: it may be one of them."""
    endings: dict[Path, set[str]] = {}
    for listed in series:
        for image in listed.images:
            endings.setdefault(image.path.parent, set()).add(_ending(image.path))
    links = [link for folder, usual in endings.items() for link in broken_links_in(folder) if _ending(link) in usual]
    what = SafeText("it is a link to a file that is missing")
    return [VolprepError("VP1003", path=link, error=what) for link in sorted(links)]


def _ending(file: Path) -> str:
    """Return the ending of a name in lower case; a number, as in a UID, does not count as an ending."""
    ending = file.suffix.lower()
    return "" if ending[1:].isdecimal() else ending


def _listed(series: tuple[Series, ...]) -> Lines:
    numbers = [series_name(listed.images[0].path).number for listed in series[:_MOST_NUMBERED]]
    told = [f"number {number}: " if number is not None else "" for number in numbers] + [""] * len(series)
    return Lines(f"{number}{value}" for number, value in zip(told, series, strict=False))
