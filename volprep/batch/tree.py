"""The scans in a folder tree: each DICOM series, and each other file or folder that a reader knows."""

import os
from collections.abc import Iterator
from pathlib import Path

from volprep.batch.jobs import FoundScan
from volprep.batch.place import is_batch
from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress
from volprep_formats.readers import format_of
from volprep_formats.readers.dicom.scan import Series, scan
from volprep_formats.readers.pictures.kinds import kind_of

_WHOLE_FOLDERS = {"ome-zarr", "volpkg", "stack"}
"""Formats whose scan is a folder."""
_HEAD_BYTES = 64


def scans_in_tree(root: Path, progress: Progress) -> list[FoundScan]:
    """Find all scans below `root`, in an order that does not change.

    Raises VP1001 for a path that is not there, VP1003 for a folder that cannot be read, VP8006 if no scan is found.
    """
    if not root.exists():
        raise VolprepError("VP1001", path=root)
    root = root.absolute()
    listed = scan(root, progress)
    found = [_of_series(series, root) for series in listed.series]
    # A file that claims to be DICOM and is damaged is a scan that fails, not one that is passed over.
    damaged = [path for error in listed.damaged if isinstance(path := error.fields.get("path"), Path)]
    found += [_of_path(path, root) for path in damaged]
    taken = {path for each in found for path in (each.files or (each.source,))}
    found += [_of_path(path, root) for path in _others(root) if path not in taken]
    if not found:
        raise VolprepError("VP8006", path=root, files=listed.other_files)
    return found


def _of_series(series: Series, root: Path) -> FoundScan:
    files = tuple(sorted({image.path for image in series.images}))
    # The smallest folder that holds all: a build reads the headers of everything below it.
    folder = files[0] if len(files) == 1 else Path(os.path.commonpath([file.parent for file in files]))
    where = path_text(folder.relative_to(root))
    return FoundScan(where, folder, files, series=series.uid, identity=f"series {series.uid}")


def _of_path(path: Path, root: Path) -> FoundScan:
    where = path_text(path.relative_to(root))
    return FoundScan(where, path, identity=f"path {where}")


def _others(root: Path) -> Iterator[Path]:
    """Files and folders that readers other than that of DICOM know; the packages of a batch are no scans to it."""
    if root.is_file():
        if _is_scan(root):
            yield root
        return
    for place, folders, files in os.walk(root):
        folder = Path(place)
        if is_batch(folder):
            folders.clear()
            continue
        if _format(folder) in _WHOLE_FOLDERS:
            folders.clear()
            yield folder
            continue
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(files):
            if not name.startswith(".") and _is_scan(folder / name):
                yield folder / name


def _is_scan(path: Path) -> bool:
    found = _format(path)
    if found != "stack":
        return found not in {None, "dicom"}
    # A picture between other files is a picture; only TIFF has pages.
    with path.open("rb") as file:
        return kind_of(file.read(_HEAD_BYTES)) == "tiff"


def _format(path: Path) -> str | None:
    try:
        return format_of(path)
    except VolprepError:
        return None
