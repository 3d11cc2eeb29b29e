"""The single-file form of a package: one zip that stores its files uncompressed.

Each file begins at a multiple of 64 bytes, so that an app maps the zip into memory and uploads textures to the GPU in
place. The manifest is the first file, and the others follow in the order in which an app reads them: a page then gets
the coarsest level with the manifest, and the levels up to the finest with one request. Names and bytes equal the
folder's: unzipping restores it.
"""

import json
import shutil
import struct
import zipfile
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO, NamedTuple

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.storage.files import MANIFEST, open_inside
from volprep_formats.package.storage.zip_directory import read_directory
from volprep_formats.progress import Progress

ALIGNMENT = 64
"""Each file begins at a multiple of this many bytes: enough for any texel and any vertex."""

_EPOCH = (1980, 1, 1, 0, 0, 0)
_LOCAL_HEADER = struct.Struct("<4s5H3I2H")
_PADDING = struct.Struct("<HHH")
# Extra field that Android's tools use for alignment.
_PADDING_ID = 0xD935
_ZIP64_FIELD_BYTES = 20
_COPY_BYTES = 1 << 20


class Extent(NamedTuple):
    """Location of a file in the zip."""

    start_bytes: int
    """Offset in the zip."""
    size_bytes: int
    """Size."""
    crc32: int
    """CRC-32 recorded in the zip."""


def write_single_file(folder: Path, names: list[str], file: BinaryIO, progress: Progress) -> None:
    """Write the files `names` of the package at `folder`, the manifest first, as a zip to `file`, which can seek.

    The same package gives the same bytes. Raises VP4007 for a file that is missing or a link.
    """
    progress.start("single file", len(names))
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name in reading_order(folder, names):
            with open_inside(folder, name) as source:
                size = source.seek(0, 2)
                source.seek(0)
                entry = zipfile.ZipInfo(name, _EPOCH)
                entry.create_system = 3
                entry.external_attr = 0o644 << 16
                entry.file_size = size
                entry.extra = _padding(file.tell(), name, size)
                with archive.open(entry, "w") as target:
                    shutil.copyfileobj(source, target, _COPY_BYTES)
            progress.advance()


def reading_order(folder: Path, names: Iterable[str]) -> list[str]:
    """Return names in the order in which an app reads the files of a package.

    The manifest is first, then the shaders of the first picture and the textures of its drawings, from the coarsest to
    the finest; then the same for each other picture, and then all other files by name.
    """
    names = list(names)
    manifest = {}
    if MANIFEST in names:
        with open_inside(folder, MANIFEST) as file:
            manifest = json.load(file)
    programs = {program["name"]: program for program in manifest.get("programs", ())}
    files = {texture["name"]: texture["file"] for texture in manifest.get("textures", ())}
    read = [MANIFEST]
    for picture in manifest.get("pictures", ()):
        drawings = picture.get("drawings", ())
        for program in filter(None, (programs.get(drawing.get("program")) for drawing in drawings)):
            for value in (program, *program.get("before", ())):
                read += [value["vertex"], value["fragment"]]
        read += [files.get(name, "") for drawing in reversed(drawings) for name in drawing["textures"]]
    rank = {name: place for place, name in reversed([*enumerate(read)])}
    return sorted(names, key=lambda name: (rank.get(name, len(read)), name))


def _padding(offset: int, name: str, size: int) -> bytes:
    """Return the extra data that moves a file whose header is at `offset` to the next multiple of ALIGNMENT."""
    # Sizes of 4 GB and more go in a separate field; zipfile adds it slightly earlier.
    large = _ZIP64_FIELD_BYTES if size * 1.05 > zipfile.ZIP64_LIMIT else 0
    begins = offset + _LOCAL_HEADER.size + len(name) + large + _PADDING.size
    zeros = -begins % ALIGNMENT
    return _PADDING.pack(_PADDING_ID, 2 + zeros, ALIGNMENT) + bytes(zeros)


def place_of(package: Path, name: str) -> Extent:
    """Return the location of the file `name` in the zip. Raises VP4007 if it is not there, and as `places`."""
    found = places(package).get(name)
    if found is None:
        raise VolprepError("VP4007", path=package, file=name, error="not in the zip")
    return found


def places(package: Path) -> Mapping[str, Extent]:
    """Return the location of each file in the zip at `package`.

    Raises VP4002 for a file that breaks a rule of spec/README.md: two programs could see two packages in it.
    """
    status = package.stat()
    return _places(package, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=4)
def _places(package: Path, _mtime_ns: int, size: int) -> Mapping[str, Extent]:
    try:
        with package.open("rb") as file:
            found = read_directory(file, size)
    except (OSError, ValueError) as error:
        problem = f"it is neither a folder nor a sound zip: {error}"
        raise VolprepError("VP4002", path=package, problem=problem) from error
    return {name: Extent(start, entry.size_bytes, entry.crc32) for name, (entry, start) in found.items()}
