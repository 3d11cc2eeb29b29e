"""Source formats, one file each. `open_source` finds the reader."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.path_text import no_such_path, path_text
from volprep_formats.progress import Progress
from volprep_formats.readers.dicom.kind import has_prefix
from volprep_formats.readers.header_pair import header_beside
from volprep_formats.readers.ome.zarr_kind import is_zarr
from volprep_formats.readers.others import recognised
from volprep_formats.readers.pictures.kinds import holds_only_pictures, kind_of, pictures_in
from volprep_formats.regular_files import check_regular_or_folder, unpacked_head
from volprep_formats.source import SourceFormat, SourceSpec, UnevenSource, VolumeSource

_HEAD_BYTES = 4096
_OME = frozenset(("ome-tiff", "ome-zarr"))
_CHANNEL_KEYS: dict[str, Literal["channel", "volume"]] = {
    "nifti": "volume",
    "ome-tiff": "channel",
    "ome-zarr": "channel",
    "stack": "channel",
    "volpkg": "channel",
}
"""Formats whose files may hold several channels, and the field of a source that chooses one by its number."""


_IN_COLOUR = frozenset(("dicom", "metaimage", "nifti", "npy", "nrrd", "stack", "vdb", "vti", "vtk", *_OME))
"""Formats whose voxels may have colours."""


@dataclass(frozen=True)
class Reader:
    """A source format: its name, the module that reads it, and how to know it."""

    name: SourceFormat
    module: str
    """Module with `open_volume(spec, path, progress) -> VolumeSource`; imported on demand, because it is heavy."""
    knows: Callable[[SourceSpec, Path, bytes], bool]
    """Whether the source is of this format, by what the scene says, the path, and a file's first bytes, unpacked."""


def _is_stack(spec: SourceSpec, folder: Path) -> bool:
    return spec.stack is not None or holds_only_pictures(folder)


def _is_ome_tiff(spec: SourceSpec, path: Path, head: bytes) -> bool:
    if spec.stack is not None or kind_of(head) != "tiff":
        return False
    from volprep_formats.readers.ome.tiff_set import has_description  # noqa: PLC0415 - seldom needed

    return has_description(path)


def _of_set(spec: SourceSpec, path: Path) -> Path:
    """Return a file of the OME-TIFF whose files are the pictures of the folder `path`, or `path` itself."""
    if spec.stack is not None or spec.format not in {"auto", "ome-tiff"} or not path.is_dir() or not pictures_in(path):
        return path
    from volprep_formats.readers.ome.tiff_set import file_of_set  # noqa: PLC0415 - seldom needed

    return file_of_set(path) or path


def _ends(path: Path, *suffixes: str) -> bool:
    return path.suffix.lower() in suffixes


def _is_minc(_spec: SourceSpec, path: Path, head: bytes) -> bool:
    # NetCDF and HDF5 hold anything: the name must agree, or names of MINC at the beginning of the file.
    is_container = re.match(rb"CDF[\1\2]|\x89HDF\r\n\x1a\n", head) is not None
    is_named = path.name.lower().endswith((".mnc", ".mnc.gz"))
    return is_container and (is_named or b"minc-2.0" in head or b"xspace" in head)


def _is_package(folder: Path) -> bool:
    return folder.suffix == ".volpkg" and (folder / "manifest.json").is_file()


READERS = (
    Reader("raw", "raw", lambda spec, _path, _head: spec.raw is not None),
    Reader("mosaic", "mosaic", lambda spec, _path, _head: spec.mosaic is not None),
    Reader("volpkg", "volpkg", lambda _spec, path, _head: _is_package(path)),
    Reader("ome-zarr", "ome.zarr_image", lambda _spec, path, head: is_zarr(path, head)),
    Reader("ome-tiff", "ome.tiff", _is_ome_tiff),
    Reader(
        "dicom",
        "dicom.reader",
        lambda spec, path, head: (
            has_prefix(head) or (path.is_dir() and (spec.series is not None or not _is_stack(spec, path)))
        ),
    ),
    Reader(
        "stack",
        "pictures.stack",
        lambda spec, path, head: path.is_dir() or spec.stack is not None or kind_of(head) is not None,
    ),
    Reader(
        "nifti",
        "nifti",
        lambda _spec, _path, head: head[344:347] in {b"n+1", b"ni1"} or head[4:7] in {b"n+2", b"ni2"},
    ),
    Reader(
        "metaimage",
        "metaimage",
        lambda _spec, _path, head: re.search(rb"^[ \t]*NDims[ \t]*=", head, re.MULTILINE) is not None,
    ),
    Reader("mrtrix", "mrtrix", lambda _spec, _path, head: head.startswith(b"mrtrix image")),
    Reader("nrrd", "nrrd", lambda _spec, _path, head: head[:4] == b"NRRD"),
    Reader("vdb", "vdb.reader", lambda _spec, _path, head: head[:4] == b" BDV"),
    Reader("vti", "vtk.vti", lambda _spec, _path, head: b"<VTKFile" in head),
    Reader(
        "npy",
        "numpy_array",
        lambda _spec, path, head: head[:6] == b"\x93NUMPY" or (_ends(path, ".npz") and head[:4] == b"PK\3\4"),
    ),
    Reader("mrc", "mrc", lambda _spec, _path, head: head[208:212] in {b"MAP ", b"MAP\0"}),
    Reader("minc", "minc.reader", _is_minc),
    # A version of 1 is weak evidence: the name must agree.
    Reader("mgh", "mgh", lambda _spec, path, head: head[:4] == b"\0\0\0\1" and _ends(path, ".mgh", ".mgz", ".gz")),
    # The size of the header, in either byte order. NIfTI's has the same, and has been asked for before.
    Reader(
        "analyze",
        "analyze",
        lambda _spec, path, head: head[:4] in {b"\x5c\1\0\0", b"\0\0\1\x5c"} and _ends(path, ".hdr"),
    ),
    Reader("vtk", "vtk.legacy", lambda _spec, _path, head: head[:14] == b"# vtk DataFile"),
)
"""All source formats, in the order in which they are tried."""


def open_source(spec: SourceSpec, base: Path, progress: Progress) -> VolumeSource:
    """Open the source that `spec` describes; a relative path starts at `base`.

    Raises VolprepError VP1001 (no such path), VP1002 (unknown format), VP1003 (unreadable), VP1004 (settings of another
    format), and the errors of the reader.
    """
    source: VolumeSource = _open(spec, base, progress, "open_volume")
    return source


def open_slices(spec: SourceSpec, base: Path, progress: Progress) -> VolumeSource | UnevenSource:
    """Open a source as `open_source` does; slices that form no grid come as they are if `spec.repair` allows it.

    Raises what `open_source` raises.
    """
    source: VolumeSource | UnevenSource = _open(spec, base, progress, "open_slices" if spec.repair else "open_volume")
    return source


def format_of(path: Path) -> SourceFormat:
    """Name the format of a file or folder. Raises VP1001 to VP1003."""
    return format_of_source(SourceSpec(path=path_text(path)), Path())


def format_of_source(spec: SourceSpec, base: Path) -> SourceFormat:
    """Name the format that a source is read as; a relative path starts at `base`. Raises VP1001 to VP1003."""
    _, reader = _found(spec, base)
    return reader.name


def channels_of(path: Path) -> list[str]:
    """Names of the channels of a file or folder, "" where they have none. Raises what `list_channels` raises."""
    several = format_of(path) in _CHANNEL_KEYS
    return list_channels(SourceSpec(path=path_text(path)), Path())[1] if several else [""]


def list_channels(spec: SourceSpec, base: Path) -> tuple[Literal["channel", "volume"], list[str]]:
    """Return the field of a source that chooses a channel by its number, and the names of all, "" where they have none.

    Raises what `open_source` raises, and VP1242 for a format whose files have one channel.
    """
    path, reader = _found(spec, base)
    if reader.name not in _CHANNEL_KEYS:
        raise VolprepError("VP1242", path=path, format=reader.name)
    names: list[str] = import_module(f"{__name__}.{reader.module}").channel_names(spec, path)
    return _CHANNEL_KEYS[reader.name], names


def _found(spec: SourceSpec, base: Path) -> tuple[Path, Reader]:
    path = header_beside(spec.place(base))
    try:
        check_regular_or_folder(path)
        path = _of_set(spec, path)
    except (FileNotFoundError, NotADirectoryError, ValueError) as error:  # ValueError: a zero byte
        raise no_such_path(path) from error
    except OSError as error:
        raise VolprepError("VP1003", path=path, error=error.strerror or error) from error
    return path, _reader(spec, path)


def _open(spec: SourceSpec, base: Path, progress: Progress, function: str) -> Any:
    path, reader = _found(spec, base)
    for key, value, format_names in (
        ("raw", spec.raw, {"raw"}),
        ("series", spec.series, {"dicom", *_OME}),
        (
            "volume",
            spec.volume,
            {"analyze", "dicom", "metaimage", "mgh", "minc", "mrtrix", "nifti", "nrrd", "stack", *_OME},
        ),
        ("volumes_by", spec.volumes_by, {"dicom"}),
        ("channel", spec.channel, {"stack", "volpkg", *_OME}),
        ("level", spec.level, {"ome-zarr", "volpkg"}),
        ("missing", spec.missing, {"ome-zarr"}),
        ("repair", spec.repair or None, {"dicom"}),
        ("rgb", spec.rgb, {"dicom", "stack", "mosaic"}),
        ("colour", spec.colour, _IN_COLOUR),
        ("grid", spec.grid, {"vdb"}),
        ("stack", spec.stack, {"stack"}),
        ("mosaic", spec.mosaic, {"mosaic"}),
        ("array", spec.array, {"npy"}),
    ):
        if value is not None and reader.name not in format_names:
            raise VolprepError("VP1004", path=path, key=key, format=reader.name)
    try:
        return getattr(import_module(f"{__name__}.{reader.module}"), function)(spec, path, progress)
    except OSError as error:
        raise VolprepError("VP1003", path=path, error=error.strerror or error) from error


def _reader(spec: SourceSpec, path: Path) -> Reader:
    if spec.format != "auto":
        return next(reader for reader in READERS if reader.name == spec.format)
    try:
        head, is_gzip = (b"", False) if path.is_dir() else unpacked_head(path, _HEAD_BYTES)
        # No reader unpacks DICOM, whose preamble may begin like a picture.
        packed = is_gzip and has_prefix(head)
        found = None if packed else next((reader for reader in READERS if reader.knows(spec, path, head)), None)
    except OSError as error:
        raise VolprepError("VP1003", path=error.filename or path, error=error.strerror or error) from error
    if found is None or found.name in {"vti", "vtk"}:
        other = recognised(path, head, is_gzip=is_gzip)
        if other is not None:
            raise VolprepError("VP1289", path=path, what=SafeText(other.what), how=SafeText(other.how))
    if found is None:
        problem = SafeText("no reader knows this format" if head or path.is_dir() else "the file is empty")
        known = SafeText(", ".join(sorted(each.name for each in READERS)))
        raise VolprepError("VP1002", path=path, problem=problem, known=known)
    return found
