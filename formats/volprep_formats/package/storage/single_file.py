"""The single-file form of a package: one zip that holds its files as they are, not compressed.

Each begins at a multiple of 64 bytes, so that an app maps the zip into memory and gives textures to the GPU from where
they are. The manifest is the first file. Names and bytes are those of the folder: unzipping gives it back.
"""

import shutil
import struct
import zipfile
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO, NamedTuple

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.storage.files import MANIFEST, open_inside
from volprep_formats.progress import Progress

ALIGNMENT = 64
"""Each file begins at a multiple of this many bytes: enough for any texel and any vertex."""

_EPOCH = (1980, 1, 1, 0, 0, 0)
_LOCAL_HEADER = struct.Struct("<4s5H3I2H")
_PADDING = struct.Struct("<HHH")
# The field of the extra data with which Android's tools align.
_PADDING_ID = 0xD935
_ZIP64_FIELD_BYTES = 20
_COPY_BYTES = 1 << 20
_UNSOUND = (zipfile.BadZipFile, OSError, ValueError, OverflowError, NotImplementedError, EOFError, struct.error)
"""What the library raises over damaged zips."""


class Extent(NamedTuple):
    """Where a file of the zip is."""

    start_bytes: int
    """Where it begins in the zip."""
    size_bytes: int
    """Size."""
    crc32: int
    """CRC-32 of its bytes, as the zip says."""


_NO_32_BITS = 0xFFFFFFFF
"""What a local header says of a size that stands in a field of its own."""
_ENCRYPTED_OR_SAID_LATER = 0b1001
"""Flags of an entry: encrypted; sizes and CRC stand behind the bytes and not before them."""


def write_single_file(folder: Path, names: list[str], file: BinaryIO, progress: Progress) -> None:
    """Write the files `names` of the package at `folder`, the manifest first, as a zip to `file`, which can seek.

    The same package gives the same bytes. Raises VP4007 for a file that is missing or a link.
    """
    progress.start("single file", len(names))
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name in sorted(names, key=lambda name: (name != MANIFEST, name)):
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


def _padding(offset: int, name: str, size: int) -> bytes:
    """Return the extra data that moves a file whose header is at `offset` to the next multiple of ALIGNMENT."""
    # Sizes of 4 GB and more are told in a field of their own; zipfile adds it a little earlier.
    large = _ZIP64_FIELD_BYTES if size * 1.05 > zipfile.ZIP64_LIMIT else 0
    begins = offset + _LOCAL_HEADER.size + len(name) + large + _PADDING.size
    zeros = -begins % ALIGNMENT
    return _PADDING.pack(_PADDING_ID, 2 + zeros, ALIGNMENT) + bytes(zeros)


def place_of(package: Path, name: str) -> Extent:
    """Return where the file `name` is in the zip. Raises VP4007 if it is not there, and as `places`."""
    found = places(package).get(name)
    if found is None:
        raise VolprepError("VP4007", path=package, file=name, error="not in the zip")
    return found


def places(package: Path) -> Mapping[str, Extent]:
    """Return where each file is in the zip at `package`.

    Raises VP4002 for what is no zip, or one whose files are compressed, encrypted, doubled, beyond its end or on top of
    each other, or whose headers do not say what its directory says: two programs could read it as two packages.
    """
    status = package.stat()
    return _places(package, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=4)
def _places(package: Path, _mtime_ns: int, size: int) -> Mapping[str, Extent]:
    try:
        with package.open("rb") as file:
            return _read_places(file, size)
    except _UNSOUND as error:
        problem = f"it is neither a folder nor a sound zip: {error}"
        raise VolprepError("VP4002", path=package, problem=problem) from error


def _read_places(file: BinaryIO, size: int) -> dict[str, Extent]:
    with zipfile.ZipFile(file) as archive:
        entries = archive.infolist()
    found: dict[str, Extent] = {}
    for entry in entries:
        name = entry.filename
        is_plain = entry.compress_type == zipfile.ZIP_STORED and entry.file_size == entry.compress_size
        if not is_plain or entry.flag_bits & _ENCRYPTED_OR_SAID_LATER:
            raise ValueError(f"{name!r} is compressed, encrypted, or has its sizes behind it")
        if name in found:
            raise ValueError(f"{name!r} is there twice")
        file.seek(entry.header_offset)
        head = _LOCAL_HEADER.unpack(file.read(_LOCAL_HEADER.size))
        if head[0] != b"PK\x03\x04" or file.read(head[9]) != name.encode():
            raise ValueError(f"{name!r} has another name at its place")
        if not _says_the_same(head, entry):
            raise ValueError(f"{name!r} has another CRC, size or kind at its place than in the directory")
        start = entry.header_offset + _LOCAL_HEADER.size + head[9] + head[10]
        found[name] = Extent(start, entry.file_size, entry.CRC)
    # Each file lies between its header and the next one, and so does none on top of another.
    heads = sorted((entry.header_offset, entry.filename) for entry in entries)
    for (_, name), (following, _) in pairwise([*heads, (size, "")]):
        if found[name].start_bytes + found[name].size_bytes > following:
            raise ValueError(f"{name!r} reaches into what follows")
    return found


def _says_the_same(head: tuple[int, ...], entry: zipfile.ZipInfo) -> bool:
    """Return whether a local header has the flags, the method, the CRC and the sizes of the directory's entry."""
    flags, method, crc, *sizes = head[2], head[3], *head[6:9]
    same_sizes = all(size in {entry.file_size, _NO_32_BITS} for size in sizes)
    return (flags, method, crc) == (entry.flag_bits, entry.compress_type, entry.CRC) and same_sizes
