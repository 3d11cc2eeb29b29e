"""The scans below the address of an object store, told by names alone: nothing is fetched to find them."""

from pathlib import PurePosixPath

from volprep.batch.jobs import FoundScan
from volprep.batch.storage import listed
from volprep_formats.diagnostics import VolprepError

_ALONE = (".nii", ".nii.gz", ".nrrd", ".mha", ".vti", ".vtk", ".vdb", ".tif", ".tiff", ".mgh", ".mgz", ".npy", ".npz")
"""Endings of objects that are scans by themselves."""
_FOLDERS = (".zarr", ".volpkg")
"""Endings of folders whose objects are one scan."""
_TOGETHER = (".dcm", ".dicom", ".ima", ".mhd", ".nhdr", ".hdr")
"""Endings of objects that make their folder a scan; so do objects without an ending, as DICOM files often are."""


def scans_in_store(url: str) -> list[FoundScan]:
    """Find all scans at or below `url`. Raises VP8006 if there is none, and what `listed` raises."""
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
        if parent.name.lower().endswith(_FOLDERS):
            return str(parent)
    name = path.name.lower()
    if name.endswith(_ALONE):
        return inside
    return str(path.parent) if name.endswith(_TOGETHER) or "." not in name else None
