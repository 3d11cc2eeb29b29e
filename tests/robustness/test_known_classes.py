"""Classes of holes that were found in readers of these formats in 2025 and 2026, a file of each: refused with a code.

Sizes that multiply beyond 32 or 64 bits and wrap, sizes that a buffer is made of before the data are looked at, counts
of rows or samples that the strips do not have, chains of directories that lead back or nowhere, names of files that
lead out, and data that unpack to more than was declared.
"""

import gzip
import resource
import struct
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest

from volprep_formats.diagnostics import VolprepError

from .lies import tiff
from .subjects import SUBJECTS, read_volume, sound_file

pytestmark = pytest.mark.usefixtures("kept_workers")

SECONDS, KILOBYTES = 20.0, 400_000
_SOUND = {subject.name: subject for subject in SUBJECTS}


def _tiff_that_leads_back() -> bytes:
    """The next directory of the first one is the first one."""
    data = bytearray(tiff())
    (first,) = struct.unpack_from("<I", data, 4)
    (entries,) = struct.unpack_from("<H", data, first)
    struct.pack_into("<I", data, first + 2 + 12 * entries, first)
    return bytes(data)


def _tiff_of_entries(count: int) -> bytes:
    """A directory of more entries than there are bytes."""
    data = bytearray(tiff())
    (first,) = struct.unpack_from("<I", data, 4)
    struct.pack_into("<H", data, first, count)
    return bytes(data)


def _metaimage(*lines: str) -> bytes:
    fields = {"NDims": "3", "DimSize": "4 5 3", "ElementType": "MET_UCHAR", "ElementDataFile": "LOCAL"}
    fields |= dict(line.split(" = ") for line in lines)
    last = fields.pop("ElementDataFile")
    return "".join(f"{k} = {v}\n" for k, v in fields.items()).encode() + f"ElementDataFile = {last}\n".encode() + b"x"


def _nrrd(sizes: str, encoding: str = "raw", data: bytes = b"x", extra: str = "") -> bytes:
    head = f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {sizes}\nencoding: {encoding}\n{extra}\n"
    return head.encode() + data


def _nifti(offset: int, form: str, *values: float) -> bytes:
    data = bytearray(sound_file(_SOUND["NIfTI-1"]))
    struct.pack_into(form, data, offset, *values)
    return bytes(data)


def _vti_of_blocks(count: int, block: int) -> bytes:
    """Compressed data whose header promises so many blocks."""
    head = struct.pack("<4I", count, block, 0, 4)
    return (
        b'<VTKFile type="ImageData" byte_order="LittleEndian" header_type="UInt32" compressor="vtkZLibDataCompressor">'
        b'<ImageData WholeExtent="0 3 0 4 0 2"><Piece Extent="0 3 0 4 0 2"><PointData Scalars="v">'
        b'<DataArray type="UInt8" Name="v" format="appended" offset="0"/></PointData></Piece></ImageData>'
        b'<AppendedData encoding="raw">_' + head + zlib.compress(bytes(60))
    )


CASES: dict[str, tuple[str, Callable[[], bytes]]] = {
    "TIFF, rows beyond all strips": (".tif", lambda: tiff(ImageLength=(2**32 - 1,), RowsPerStrip=(2**32 - 1,))),
    "TIFF, columns that wrap": (".tif", lambda: tiff(ImageWidth=(2**32 - 1,))),
    "TIFF, rows times columns that wrap": (".tif", lambda: tiff(ImageWidth=(65536,), ImageLength=(65536,))),
    "TIFF, no rows in a strip": (".tif", lambda: tiff(RowsPerStrip=(0,))),
    "TIFF, samples that strips do not have": (".tif", lambda: tiff(SamplesPerPixel=(65535,))),
    "TIFF, strips at the end of the address space": (".tif", lambda: tiff(StripOffsets=(2**32 - 1,))),
    "TIFF, a strip of 4 GB": (".tif", lambda: tiff(StripByteCounts=(2**32 - 1,), ImageLength=(2**31,))),
    "TIFF, a chain that leads back": (".tif", _tiff_that_leads_back),
    "TIFF, a directory beyond the end": (".tif", lambda: _tiff_of_entries(65535)),
    "TIFF, a compression that nobody knows": (".tif", lambda: tiff(Compression=(65000,))),
    "NIfTI, more axes than the field has": (".nii", lambda: _nifti(40, "<h", 30000)),
    "NIfTI, sizes that wrap": (".nii", lambda: _nifti(40, "<8h", 7, *[32767] * 7)),
    "NIfTI, a negative size": (".nii", lambda: _nifti(42, "<h", -4)),
    "NIfTI, an extension beyond the end": (".nii", lambda: _nifti(108, "<f", 2.0**30)),
    "NIfTI, packed zeros": (".nii.gz", lambda: gzip.compress(_nifti(40, "<4h", 3, 32767, 32767, 4) + bytes(10**7))),
    "MetaImage, sizes that wrap at 32 bits": (".mha", lambda: _metaimage("DimSize = 65536 65536 1")),
    "MetaImage, sizes that wrap at 64 bits": (".mha", lambda: _metaimage("DimSize = 2147483647 2147483647 5")),
    "MetaImage, axes beyond its arrays": (".mha", lambda: _metaimage("NDims = 90")),
    "MetaImage, data in another folder": (".mhd", lambda: _metaimage("ElementDataFile = ../../../etc/passwd")),
    "MetaImage, a pattern of names": (".mhd", lambda: _metaimage("ElementDataFile = %99999999d 1 2 1")),
    "NRRD, sizes that wrap at 64 bits": (".nrrd", lambda: _nrrd("2147483647 2147483647 5")),
    "NRRD, a skip before the file": (".nrrd", lambda: _nrrd("4 5 3", extra="byte skip: -2\n")),
    "NRRD, data that unpack to more": (".nrrd", lambda: _nrrd("4 5 3", "gzip", gzip.compress(bytes(10**7)))),
    "NRRD, a data file in another folder": (".nhdr", lambda: _nrrd("4 5 3", extra="data file: /etc/passwd\n")),
    "VTK XML, blocks without end": (".vti", lambda: _vti_of_blocks(2**32 - 1, 1)),
    "VTK XML, blocks whose sizes wrap": (".vti", lambda: _vti_of_blocks(2, 2**31 + 30)),
    "VTK XML, a last block that is larger": (".vti", lambda: _vti_of_blocks(1, 50)),
}


@pytest.mark.parametrize("name", CASES)
def test_a_file_of_each_class_is_refused_without_time_or_memory(tmp_path: Path, name: str) -> None:
    suffix, make = CASES[name]
    path = tmp_path / f"file{suffix}"
    path.write_bytes(make())
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = time.monotonic()
    with pytest.raises(VolprepError) as error:
        read_volume(path)
    assert error.value.code[:3] in {"VP1", "VP2"}
    assert error.value.code not in {"VP1270", "VP1271"}, "its decoder crashed or hung"
    assert time.monotonic() - began < SECONDS
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < KILOBYTES


def test_the_sound_files_are_read(tmp_path: Path) -> None:
    """Or every case could be refused for the same wrong reason."""
    for name, whole in {
        "a.tif": tiff(),
        "a.mha": _metaimage()[:-1] + bytes(60),
        "a.nrrd": _nrrd("4 5 3", data=bytes(60), extra="spacings: 1 1 1\n"),
        "a.vti": _vti_of_blocks(1, 60).replace(
            struct.pack("<4I", 1, 60, 0, 4), struct.pack("<4I", 1, 60, 0, len(zlib.compress(bytes(60))))
        ),
    }.items():
        (tmp_path / name).write_bytes(whole)
        read_volume(tmp_path / name)
