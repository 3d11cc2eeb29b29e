"""Pairs of files of Analyze and NIfTI: NAME.hdr describes the voxels of NAME.img."""

from pathlib import Path

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.readers.detached import data_file

_VOXELS = (".img", ".img.gz", ".IMG")
_HEADERS = (".hdr", ".HDR")


def header_beside(path: Path) -> Path:
    """Return the header of a file of voxels, or `path` itself if it is another file or has no header beside it."""
    ending = next((voxel for voxel in _VOXELS if path.name.endswith(voxel)), None)
    if ending is None:
        return path
    stem = path.name.removesuffix(ending)
    return next((path.with_name(stem + header) for header in _HEADERS if path.with_name(stem + header).is_file()), path)


def voxels_beside(header: Path) -> Path:
    """Return the file of the voxels of a header. Raises VP1006 if it is missing or not a file of the same folder."""
    there = [voxel for voxel in _VOXELS if header.with_suffix(voxel).is_file()]
    if not there:
        raise VolprepError("VP1006", path=header, name=header.with_suffix(".img").name, problem=SafeText("is missing"))
    return data_file(header, header.with_suffix(there[0]).name)
