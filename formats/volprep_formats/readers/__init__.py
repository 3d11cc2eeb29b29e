"""Source formats, one file each. `open_source` finds the reader."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.path_text import no_such_path, path_of_text, path_text
from volprep_formats.progress import Progress
from volprep_formats.readers.dicom.kind import has_prefix
from volprep_formats.readers.foreign_formats import recognised
from volprep_formats.readers.header_pair import header_beside
from volprep_formats.readers.ome.zarr_kind import is_zarr
from volprep_formats.readers.pictures.kinds import holds_only_pictures, kind_of, pictures_in
from volprep_formats.readers.time_axis import TimeAxis
from volprep_formats.readers.volume_files import folder_frames, series_in
from volprep_formats.readers.voxel_file import check_axes
from volprep_formats.regular_files import check_regular_or_folder, unpacked_head
from volprep_formats.source import SourceFormat, SourceSpec, VolumeSource
from volprep_formats.uneven_source import UnevenSource

_HEAD_BYTES = 4096


@dataclass(frozen=True)
class Reader:
    """A source format: its name, the module that reads it, and how to know it."""

    name: SourceFormat
    module: str
    """Module with `open_volume(spec, path, progress) -> VolumeSource`; imported on demand, because it is heavy."""
    knows: Callable[[SourceSpec, Path, bytes], bool]
    """Whether the source is of this format, by what the scene says, the path, and a file's first bytes, unpacked."""
    title: str
    """What it is, for people, with an article."""
    keys: tuple[str, ...] = ()
    """Keys of [source] that some formats alone have, and this one too."""
    numbers: Literal["channel", "volume"] | None = None
    """Key that chooses one of several channels of a file by its number; None if files have one channel."""


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
    Reader("raw", "raw", lambda spec, _path, _head: spec.raw is not None, "a raw volume", ("raw",)),
    Reader(
        "mosaic", "mosaic", lambda spec, _path, _head: spec.mosaic is not None, "a mosaic of slices", ("rgb", "mosaic")
    ),
    Reader(
        "volpkg",
        "volpkg",
        lambda _spec, path, _head: _is_package(path),
        "a volume package",
        ("channel", "level"),
        numbers="channel",
    ),
    Reader(
        "ome-zarr",
        "ome.zarr_image",
        lambda _spec, path, head: is_zarr(path, head),
        "an OME-Zarr volume",
        ("series", "volume", "frames", "channel", "level", "missing", "colour"),
        numbers="channel",
    ),
    Reader(
        "ome-tiff",
        "ome.tiff",
        _is_ome_tiff,
        "an OME-TIFF volume",
        ("series", "volume", "frames", "channel", "colour"),
        numbers="channel",
    ),
    Reader(
        "dicom",
        "dicom.reader",
        lambda spec, path, head: (
            has_prefix(head) or (path.is_dir() and (spec.series is not None or not _is_stack(spec, path)))
        ),
        "a DICOM series",
        ("series", "volume", "frames", "volumes_by", "repair", "rgb", "colour"),
    ),
    Reader(
        "stack",
        "pictures.stack",
        lambda spec, path, head: path.is_dir() or spec.stack is not None or kind_of(head) is not None,
        "a stack of pictures",
        ("volume", "frames", "channel", "rgb", "colour", "stack"),
        numbers="channel",
    ),
    Reader(
        "nifti",
        "nifti",
        lambda _spec, _path, head: head[344:347] in {b"n+1", b"ni1"} or head[4:7] in {b"n+2", b"ni2"},
        "a NIfTI volume",
        ("volume", "frames", "colour"),
        numbers="volume",
    ),
    Reader(
        "metaimage",
        "metaimage",
        lambda _spec, _path, head: re.search(rb"^[ \t]*NDims[ \t]*=", head, re.MULTILINE) is not None,
        "a MetaImage volume",
        ("volume", "frames", "colour"),
    ),
    Reader(
        "mrtrix", "mrtrix", lambda _spec, _path, head: head.startswith(b"mrtrix image"), "an MRtrix image", ("volume",)
    ),
    Reader(
        "nrrd", "nrrd", lambda _spec, _path, head: head[:4] == b"NRRD", "an NRRD volume", ("volume", "frames", "colour")
    ),
    Reader("vdb", "vdb.reader", lambda _spec, _path, head: head[:4] == b" BDV", "an OpenVDB grid", ("colour", "grid")),
    Reader("vti", "vtk.vti", lambda _spec, _path, head: b"<VTKFile" in head, "a VTK volume", ("colour",)),
    Reader(
        "npy",
        "numpy_array",
        lambda _spec, path, head: head[:6] == b"\x93NUMPY" or (_ends(path, ".npz") and head[:4] == b"PK\3\4"),
        "a NumPy array",
        ("volume", "frames", "colour", "array"),
    ),
    Reader("mrc", "mrc", lambda _spec, _path, head: head[208:212] in {b"MAP ", b"MAP\0"}, "an MRC volume"),
    Reader("minc", "minc.reader", _is_minc, "a MINC volume", ("volume", "frames")),
    # A version of 1 is weak evidence: the name must agree.
    Reader(
        "mgh",
        "mgh",
        lambda _spec, path, head: head[:4] == b"\0\0\0\1" and _ends(path, ".mgh", ".mgz", ".gz"),
        "a FreeSurfer volume",
        ("volume",),
    ),
    # The size of the header, in either byte order. NIfTI's has the same, and has been asked for before.
    Reader(
        "analyze",
        "analyze",
        lambda _spec, path, head: head[:4] in {b"\x5c\1\0\0", b"\0\0\1\x5c"} and _ends(path, ".hdr"),
        "an Analyze volume",
        ("volume",),
    ),
    Reader("vtk", "vtk.legacy", lambda _spec, _path, head: head[:14] == b"# vtk DataFile", "a VTK volume", ("colour",)),
)
"""All source formats, in the order in which they are tried."""
_KEYS = tuple(dict.fromkeys(key for reader in READERS for key in reader.keys))
"""Keys of [source] that some formats alone have."""


def title_of(name: str) -> str:
    """Return what a source format is, for people; one that this version does not know has its name."""
    return next((reader.title for reader in READERS if reader.name == name), f"a {name} volume")


def open_source(spec: SourceSpec, base: Path, progress: Progress) -> VolumeSource:
    """Open the source that `spec` describes, of a series its first frame; a relative path starts at `base`.

    Raises VolprepError VP1001 (no such path), VP1002 (unknown format), VP1003 (unreadable), VP1004 (settings of another
    format), VP1310 (too long an axis), and the errors of the reader.
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
    _, _, reader = _found(spec, base)
    return reader.name


def channels_of(path: Path) -> list[str]:
    """Names of the channels of a file or folder, "" where they have none. Raises what `list_channels` raises."""
    spec = SourceSpec(path=path_text(path))
    return [""] if _found(spec, Path())[2].numbers is None else list_channels(spec, Path())[1]


def list_channels(spec: SourceSpec, base: Path) -> tuple[Literal["channel", "volume"], list[str]]:
    """Return the field of a source that chooses a channel by its number, and the names of all, "" where they have none.

    Raises what `open_source` raises, and VP1242 for a format whose files have one channel.
    """
    _, path, reader = _found(spec, base)
    if reader.numbers is None:
        raise VolprepError("VP1242", path=path, format=reader.name)
    names: list[str] = import_module(f"{__name__}.{reader.module}").channel_names(spec, path)
    return reader.numbers, names


def time_axis_of(spec: SourceSpec, base: Path) -> TimeAxis:
    """Return the frames that the file or folder of a series has.

    Raises what `open_source` raises, VP1340 if its volumes are not frames, and VP1343 if some are missing.
    """
    files = _volumes_of(spec.place(base))
    if files:
        return folder_frames(files)
    _, path, reader = _found(spec, base)
    if "frames" not in reader.keys:
        raise VolprepError("VP1004", path=path, key="frames", format=reader.name)
    axis: TimeAxis = import_module(f"{__name__}.{reader.module}").time_axis(spec, path)
    return axis


def _found(spec: SourceSpec, base: Path) -> tuple[SourceSpec, Path, Reader]:
    """Return the source itself, or the one file that it means in a folder of volumes; its path, and its reader."""
    spec = _member(spec, base)
    path = header_beside(spec.place(base))
    try:
        check_regular_or_folder(path)
        path = _of_set(spec, path)
    except (FileNotFoundError, NotADirectoryError, ValueError) as error:  # ValueError: a zero byte
        raise no_such_path(path) from error
    except OSError as error:
        raise VolprepError("VP1003", path=path, error=error.strerror or error) from error
    return spec, path, _reader(spec, path)


def _member(spec: SourceSpec, base: Path) -> SourceSpec:
    """Return the source of the file that is volume or frame number N of a folder of volumes; others as they are.

    Raises VP1003 for a folder that cannot be read, and VP2017 for a number without a file.
    """
    number, folder = spec.at_frame().volume, spec.place(base)
    files = [] if number is None else _volumes_of(folder)
    if number is None or not files:
        return spec
    if number > len(files):
        raise VolprepError("VP2017", path=folder, volume=number, count=len(files))
    path = path_text(path_of_text(spec.path) / files[number - 1].name)
    return spec.model_copy(update={"path": path, "volume": None, "frames": None})


def _volumes_of(folder: Path) -> list[Path]:
    """Return the files of a folder that holds little but volumes; nothing for any other path."""
    try:
        return series_in(folder) if folder.is_dir() else []
    except OSError as error:
        raise VolprepError("VP1003", path=folder, error=error.strerror or error) from error


def _open(spec: SourceSpec, base: Path, progress: Progress, function: str) -> Any:
    spec, path, reader = _found(spec, base)
    for key in _KEYS:
        # `repair` is an empty tuple if it is absent.
        if getattr(spec, key) not in (None, ()) and key not in reader.keys:
            raise VolprepError("VP1004", path=path, key=key, format=reader.name)
    try:
        module = import_module(f"{__name__}.{reader.module}")
        source = getattr(module, function)(spec.at_frame(), path, progress)
    except OSError as error:
        raise VolprepError("VP1003", path=path, error=error.strerror or error) from error
    info = source.nominal if isinstance(source, UnevenSource) else source.info
    try:
        check_axes(path, info.grid.shape_zyx)
    except VolprepError:
        with source:
            raise
    return source


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
        known = SafeText(", ".join(sorted(reader.name for reader in READERS)))
        raise VolprepError("VP1002", path=path, problem=problem, known=known)
    return found
