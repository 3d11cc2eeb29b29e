"""The scans below the address of an object store, found by names alone: nothing is fetched to find them."""

from pathlib import PurePosixPath

from volprep.batch.endings import ALONE, FOLDERS, NOT_READ, TOGETHER
from volprep.batch.jobs import FoundScan
from volprep.batch.storage import listed
from volprep_formats.diagnostics import VolprepError

_ALONE = (*ALONE, *NOT_READ, ".tif", ".tiff")
"""Endings of objects that are scans by themselves. A picture in a folder tree is one only if it has pages."""


def scans_in_store(url: str) -> list[FoundScan]:
    """Find all scans at or below `url`. Raises VP8006 if it finds no scan, and the errors of `listed`."""
    root = url.rstrip("/")
    objects = listed(root)
    if set(objects) == {""}:
        return [FoundScan(root, None, url=root, identity="object")]
    places = sorted({place for inside in objects if (place := _scan_of(inside)) is not None})
    if not places:
        raise VolprepError("VP8006", path=url, files=len(objects))
    return [FoundScan(at, None, url=at, identity=f"path {place}") for place in places for at in [_at(root, place)]]


def _at(root: str, place: str) -> str:
    return f"{root}/{place}" if place != "." else root


def _scan_of(inside: str) -> str | None:
    """Return the place of the scan that an object belongs to; None for an object of no scan."""
    path = PurePosixPath(inside)
    if any(part.startswith(".") for part in path.parts):
        return None
    for parent in reversed(path.parents):
        if parent.name.lower().endswith(FOLDERS):
            return str(parent)
    name = path.name.lower()
    if name.endswith(_ALONE):
        return inside
    return str(path.parent) if name.endswith(TOGETHER) or "." not in name else None
