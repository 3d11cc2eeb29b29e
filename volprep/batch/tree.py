"""The scans in a folder tree: each DICOM series, and each other file or folder that a reader knows."""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from volprep.batch.facts import facts_of_series, facts_of_source
from volprep.batch.jobs import FoundScan
from volprep.batch.place import is_batch
from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress
from volprep_formats.readers import format_of
from volprep_formats.readers.dicom.scan import Series, scan
from volprep_formats.readers.ome.tiff_chain import count_pages
from volprep_formats.readers.pictures.kinds import kind_of, pictures_in
from volprep_formats.source import SourceSpec

_WHOLE_FOLDERS = {"ome-zarr", "volpkg", "stack"}
"""Formats whose scan is a folder."""
_HEAD_BYTES = 64


def scans_in_tree(root: Path, progress: Progress, *, with_facts: bool = False) -> list[FoundScan]:
    """Find all scans below `root`, in an order that does not change; with what their headers say, if that is wished.

    Raises VP1001 for a path that is not there, VP1003 for a folder that cannot be read, VP8006 if no scan is found.
    """
    if not root.exists():
        raise VolprepError("VP1001", path=root)
    root = root.absolute()
    listed = scan(root, progress)
    found = [_of_series(series, root, with_facts=with_facts) for series in listed.series]
    # A file that claims to be DICOM and is damaged is a scan that fails, not one that is passed over.
    damaged = [path for error in listed.damaged if isinstance(path := error.fields.get("path"), Path)]
    alone = [_of_path(path, root) for path in damaged]
    taken = {path for each in (*found, *alone) for path in (each.files or (each.source,))}
    alone += [_of_path(path, root) for path in _others(root) if path not in taken]
    found += [_with_facts(each) for each in alone] if with_facts else alone
    if not found:
        raise VolprepError("VP8006", path=root, files=listed.other_files)
    return found


def _of_series(series: Series, root: Path, *, with_facts: bool) -> FoundScan:
    files = tuple(sorted({image.path for image in series.images}))
    # The smallest folder that holds all: a build reads the headers of everything below it.
    folder = files[0] if len(files) == 1 else Path(os.path.commonpath([file.parent for file in files]))
    where = path_text(folder.relative_to(root))
    facts = facts_of_series(series) if with_facts else None
    return FoundScan(where, folder, files, series=series.uid, identity=f"series {series.uid}", facts=facts)


def _of_path(path: Path, root: Path) -> FoundScan:
    where = path_text(path.relative_to(root))
    return FoundScan(where, path, identity=f"path {where}")


def _with_facts(scan: FoundScan) -> FoundScan:
    assert scan.source is not None  # noqa: S101 - `_of_path` gave it
    known = _format(scan.source) or ""
    return replace(scan, facts=facts_of_source(SourceSpec(path=path_text(scan.source)), known))


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
        known = _format(folder)
        if known in _WHOLE_FOLDERS and not (known == "stack" and _holds_volumes(folder)):
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
    # A picture between other files is a picture, if it has no pages.
    return _has_pages(path)


def _holds_volumes(folder: Path) -> bool:
    """Whether a folder of pictures is no stack, because one of them, and then each, is a volume of its own."""
    names = sorted(pictures_in(folder))
    return bool(names) and _has_pages(folder / names[0])


def _has_pages(path: Path) -> bool:
    with path.open("rb") as file:
        is_tiff = kind_of(file.read(_HEAD_BYTES)) == "tiff"
    # A damaged chain, too, may be that of a volume: whoever builds it says what is wrong.
    return is_tiff and count_pages(path, 1) != 1


def _format(path: Path) -> str | None:
    try:
        return format_of(path)
    except VolprepError:
        return None
