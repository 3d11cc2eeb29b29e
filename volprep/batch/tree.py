"""The scans in a folder tree: each DICOM series, and each other file or folder that a reader knows or should know.

A file with the name of a scan counts even if it is empty or damaged: its job then fails by name. Links to folders are
followed, each folder once, so that a link into its own tree does not go on for ever.
"""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from volprep.batch.endings import ALONE, FOLDERS, NOT_READ, TOGETHER
from volprep.batch.facts import facts_of_series, facts_of_source
from volprep.batch.jobs import FoundScan
from volprep.batch.place import is_batch
from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress
from volprep_formats.readers import format_of
from volprep_formats.readers.dicom.scan import Scan, Series, scan
from volprep_formats.readers.header_pair import header_beside
from volprep_formats.readers.ome.tiff_chain import count_pages
from volprep_formats.readers.pictures.kinds import kind_of, pictures_in
from volprep_formats.regular_files import open_regular
from volprep_formats.source import SourceSpec

_WHOLE_FOLDERS = {"ome-tiff", "ome-zarr", "stack", "volpkg"}
"""Formats whose scan is a folder."""
_HEAD_BYTES = 64
_NAMES = (*ALONE, *TOGETHER, *FOLDERS, *NOT_READ)


def scans_in_tree(root: Path, progress: Progress, *, with_facts: bool = False) -> list[FoundScan]:
    """Find all scans below `root`, in a stable order; with the facts from their headers, if requested.

    Raises VP1001 for a missing path, VP1003 for a folder that cannot be read, VP8006 if no scan is found.
    """
    if not root.exists():
        raise VolprepError("VP1001", path=root)
    root = root.absolute()
    found: list[FoundScan] = []
    other_files = 0
    for folder in (root, *_linked_folders(root)):
        listed = scan(folder, progress)
        found += _in_folder(listed, folder, root, with_facts=with_facts)
        other_files += listed.other_files
    if not found:
        raise VolprepError("VP8006", path=root, files=other_files)
    return found


def _in_folder(listed: Scan, folder: Path, root: Path, *, with_facts: bool) -> list[FoundScan]:
    """Return the scans in one folder tree, links left out."""
    found = [_of_series(series, root, with_facts=with_facts) for series in listed.series]
    # A damaged file that claims to be DICOM is a scan that fails; it is not skipped.
    damaged = [path for error in listed.damaged if isinstance(path := error.fields.get("path"), Path)]
    alone = [_of_path(path, root) for path in damaged]
    taken = {path for scan in (*found, *alone) for path in (scan.files or (scan.source,))}
    alone += [_of_path(path, root) for path in _others(folder) if path not in taken]
    return found + ([_with_facts(scan) for scan in alone] if with_facts else alone)


def _linked_folders(root: Path) -> Iterator[Path]:
    """Return the links to folders below `root` and below each other; none leads to a folder that was seen before."""
    seen: set[tuple[int, int]] = set()
    waiting = [root]
    while waiting:
        links: list[Path] = []
        for place, folders, _ in os.walk(waiting.pop(0)):
            state = os.stat(place)  # noqa: PTH116 - os.walk gives text
            seen.add((state.st_dev, state.st_ino))
            links += [path for name in sorted(folders) if (path := Path(place, name)).is_symlink()]
        for link in links:
            state = link.stat()
            if (state.st_dev, state.st_ino) not in seen:
                seen.add((state.st_dev, state.st_ino))
                waiting.append(link)
                yield link


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
        if _is_broken_store(folder, known):
            folders.clear()
            yield folder
            continue
        if known in _WHOLE_FOLDERS and not (known == "stack" and _holds_volumes(folder)):
            folders.clear()
            yield folder
            continue
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(files):
            if not name.startswith(".") and _is_scan(folder / name):
                yield folder / name


def _is_broken_store(folder: Path, known: str | None) -> bool:
    """Whether a folder has the name of a store but is not a whole one: its files are no scans of their own."""
    return known not in _WHOLE_FOLDERS and folder.name.lower().endswith(FOLDERS)


def _is_scan(path: Path) -> bool:
    found = _format(path)
    if found is None:
        return path.name.lower().endswith(_NAMES)
    if found != "stack":
        # Voxels with their header beside them are found as the header.
        return found != "dicom" and header_beside(path) == path
    # A picture among other files is just a picture, if it has no pages.
    return _has_pages(path)


def _holds_volumes(folder: Path) -> bool:
    """Whether the pictures of a folder are volumes of their own, not a stack: decided by the first one."""
    names = sorted(pictures_in(folder))
    return bool(names) and _has_pages(folder / names[0])


def _has_pages(path: Path) -> bool:
    try:
        with open_regular(path) as file:
            is_tiff = kind_of(file.read(_HEAD_BYTES)) == "tiff"
    except OSError:  # its build reports it
        return False
    # A damaged chain may also be that of a volume: its build reports the damage.
    return is_tiff and count_pages(path, 1) != 1


def _format(path: Path) -> str | None:
    try:
        return format_of(path)
    except VolprepError:
        return None
