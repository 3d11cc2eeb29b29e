"""Sound files in which one of two fields that must agree has been changed. docs/AGREEMENT.md says what each ends in."""

import io
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tifffile

from volprep_formats.source import RawLayout

from .subjects import SUBJECTS, read_volume, sound_file

Edit = Callable[[bytes], bytes]
_BY_NAME = {subject.name: subject for subject in SUBJECTS}


@dataclass(frozen=True)
class Lie:
    """A pair of fields, and a file in which they do not agree."""

    format: str
    """As docs/AGREEMENT.md names it."""
    pair: str
    """What must agree, in its words."""
    codes: frozenset[str]
    """What the file may end in."""
    name: str
    """Of the file."""
    make: Callable[[], bytes]
    read: Callable[[Path], None] = read_volume


def _of(subject: str, pair: str, code: str, edit: Edit, kind: str | None = None) -> Lie:
    known = _BY_NAME[subject]
    make = lambda: known.pack(edit(sound_file(known)))  # noqa: E731 - reads as the sentence that it is
    return Lie(kind or subject, pair, frozenset(code.split()), f"lie{known.suffix}", make, known.read)


def _put(offset: int, form: str, *values: float) -> Edit:
    def edit(whole: bytes) -> bytes:
        data = struct.pack(form, *values)
        return whole[:offset] + data + whole[offset + len(data) :]

    return edit


def _text(old: str, new: str) -> Edit:
    def edit(whole: bytes) -> bytes:
        changed, count = re.subn(old.encode(), new.encode(), whole, count=1)
        assert count, f"no {old} in the sound file"
        return changed

    return edit


def _number(form: str, old: float, new: float) -> Edit:
    def edit(whole: bytes) -> bytes:
        assert struct.pack(form, old) in whole
        return whole.replace(struct.pack(form, old), struct.pack(form, new))

    return edit


def _shorter(whole: bytes) -> bytes:
    return whole[:-8]


def _longer(whole: bytes) -> bytes:
    return whole + bytes(1000)


def _png(width: int, height: int) -> Edit:
    """Another size in the header, with its checksum."""

    def edit(whole: bytes) -> bytes:
        chunk = b"IHDR" + struct.pack(">II", width, height) + whole[24:29]
        return whole[:12] + chunk + struct.pack(">I", zlib.crc32(chunk)) + whole[33:]

    return edit


def tiff(**tags: tuple[int, ...]) -> bytes:
    """Write a page of 8 × 6 16-bit pixels, some of its tags replaced."""
    stream = io.BytesIO()
    tifffile.imwrite(stream, np.arange(48, dtype=np.uint16).reshape(6, 8), photometric="minisblack")
    data = bytearray(stream.getvalue())
    with tifffile.TiffFile(io.BytesIO(data)) as file:
        for name, values in tags.items():
            tag = file.pages.first.tags[name]
            form = {3: "H", 4: "I"}[int(tag.dtype)]
            struct.pack_into(f"<{len(values)}{form}", data, tag.valueoffset, *values)
    return bytes(data)


def _tiff(pair: str, code: str, **tags: tuple[int, ...]) -> Lie:
    return Lie("TIFF", pair, frozenset(code.split()), "lie.tif", lambda: tiff(**tags))


def _zarr(pair: str, code: str, edit: Callable[[dict[str, bytes]], None]) -> Lie:
    """Return an OME-Zarr in a zip, with `edit` applied to its files."""
    known = _BY_NAME["OME-Zarr"]

    def make() -> bytes:
        with zipfile.ZipFile(io.BytesIO(sound_file(known))) as sound:
            files = {name: sound.read(name) for name in sound.namelist()}
        edit(files)
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as output:
            for name, data in files.items():
                output.writestr(zipfile.ZipInfo(name), data)
        return stream.getvalue()

    return Lie("OME-Zarr", pair, frozenset(code.split()), "lie.zarr.zip", make, known.read)


def _without_chunks(files: dict[str, bytes]) -> None:
    for name in [name for name in files if "/c/" in name]:
        del files[name]


def _in_array(old: str, new: str) -> Callable[[dict[str, bytes]], None]:
    def edit(files: dict[str, bytes]) -> None:
        files["0/zarr.json"] = _text(old, new)(files["0/zarr.json"])

    return edit


def _read_raw(path: Path) -> None:
    read_volume(path, RawLayout(shape_zyx=(3, 5, 4), dtype="int16"))


_NIFTI = "NIfTI-1"
LIES = (
    Lie("raw", "shape, type and size of the file", frozenset(["VP1011"]), "lie.raw", lambda: bytes(119), _read_raw),
    Lie("raw", "shape, type and size of the file", frozenset(["VP1011"]), "lie.raw", lambda: bytes(121), _read_raw),
    _of(_NIFTI, "bitpix and datatype", "VP1020", _put(72, "<h", 8), "NIfTI"),
    _of(_NIFTI, "bitpix and datatype", "VP1020", _put(70, "<h", 2), "NIfTI"),
    _of(_NIFTI, "dim and size of the data", "VP1008", _put(40, "<4h", 3, 4, 5, 4), "NIfTI"),
    _of(_NIFTI, "dim and size of the data", "VP1008", _put(40, "<4h", 3, 4, 5, 2), "NIfTI"),
    _of(_NIFTI, "dim and size of the data", "VP1008", _longer, "NIfTI"),
    _of("NIfTI-1 within gzip", "dim and size of the data", "VP1008", _put(40, "<4h", 3, 4, 5, 2), "NIfTI"),
    _of(_NIFTI, "vox_offset and size of the header", "VP1020", _put(108, "<f", 348), "NIfTI"),
    _of(_NIFTI, "dim[0] and the sizes after it", "VP1020", _put(40, "<h", 9), "NIfTI"),
    _of("FreeSurfer", "sizes and size of the data", "VP1008", _put(4, ">i", 3)),
    _of("FreeSurfer", "sizes and size of the data", "VP1008", _put(4, ">i", 5)),
    _of("FreeSurfer", "type and size of the data", "VP1008", _put(20, ">i", 0)),
    _of("FreeSurfer within gzip", "type and size of the data", "VP1008", _put(20, ">i", 0), "FreeSurfer"),
    _of("Analyze header", "dim and size of the data", "VP1008", _put(42, "<h", 3)),
    _of("Analyze header", "datatype and bitpix", "VP1285", _put(72, "<h", 8)),
    _of("MINC 1", "sizes and size of the data", "VP1008 VP1304", _shorter, "MINC"),
    _of("MINC 2", "sizes and size of the data", "VP1304", _shorter, "MINC"),
    _of("MINC 1", "valid_range and type of the voxels", "VP1304", _number(">d", 2000.0, 1e6), "MINC"),
    _of("MINC 2", "valid_range and type of the voxels", "VP1304", _number("<d", 2000.0, 1e6), "MINC"),
    _of("NumPy", "shape and size of the data", "VP1008", _text("5, 4", "5, 3")),
    _of("NumPy", "type and size of the data", "VP1008", _text("<i2", "|u1")),
    _of("NRRD", "sizes and size of the data", "VP1008", _text("sizes: 4 5 3", "sizes: 4 5 2")),
    _of("NRRD", "sizes and size of the data", "VP1008", _text("sizes: 4 5 3", "sizes: 4 5 4")),
    _of("NRRD", "type and size of the data", "VP1008", _text("type: (int16|short)", "type: uint8")),
    _of("NRRD", "dimension and number of sizes", "VP1100 VP1101 VP1103", _text("dimension: 3", "dimension: 4")),
    _of("MetaImage", "DimSize and size of the data", "VP1008", _text("DimSize = 4 5 3", "DimSize = 4 5 2")),
    _of("MetaImage", "DimSize and size of the data", "VP1008", _text("DimSize = 4 5 3", "DimSize = 4 5 4")),
    _of("MetaImage", "ElementType and size of the data", "VP1008", _text("MET_SHORT", "MET_UCHAR")),
    _of("MetaImage", "NDims and number of sizes", "VP1121", _text("NDims = 3", "NDims = 2")),
    _of("MetaImage", "TransformMatrix and unit vectors", "VP2021", _text("Matrix = 0 -1 0", "Matrix = 0 -2 0")),
    _of("VTK XML", "WholeExtent and Extent of the piece", "VP1140", _text('Piece Extent="0 3', 'Piece Extent="0 2')),
    _of("VTK XML", "Direction and unit vectors", "VP2021", _text('Direction="1 0 0', 'Direction="2 0 0')),
    _of("VTK XML", "type and size of the data", "VP1008", _text('type="Int16"', 'type="Int32"')),
    _of("VTK legacy", "DIMENSIONS and POINT_DATA", "VP1140", _text("DIMENSIONS 4 5 3", "DIMENSIONS 4 5 2")),
    _of("VTK legacy", "DIMENSIONS and size of the data", "VP1008", _shorter),
    _of("PNG", "size in the header and data", "VP1165", _png(7, 12)),
    _of("PNG", "size in the header and data", "VP1165", _png(9, 9)),
    _tiff("size and bytes of the strips", "VP1165 VP1167", ImageLength=(60,), RowsPerStrip=(60,)),
    _tiff("bits and bytes of the strips", "VP1165 VP1166", BitsPerSample=(32,)),
    _tiff("bytes of the strips and size of the file", "VP1165 VP1003", StripOffsets=(10**6,)),
    _tiff("samples and bytes of the strips", "VP1164 VP1165 VP1166", SamplesPerPixel=(3,)),
    _tiff("0 and black", "VP1166", PhotometricInterpretation=(0,)),
    _zarr("shape and chunks that are there", "VP1260", _without_chunks),
    _zarr("shape and chunks that are there", "VP1260", _in_array(r'"shape": ?\[\s*2,\s*3,', '"shape": [2, 30,')),
    _zarr("data_type and size of a chunk", "VP1220", _in_array('"int16"', '"int64"')),
    _zarr(
        "chunk_shape and size of a chunk",
        "VP1220 VP1260",
        _in_array(r'"chunk_shape": ?\[\s*1,\s*2,', '"chunk_shape": [1, 1,'),
    ),
    _zarr("axes of array and image", "VP1220", _in_array(r'"shape": ?\[\s*2,', '"shape": [')),
    _of("OME-TIFF", "sizes of OME-XML and pages", "VP1220", _text('SizeZ="3"', 'SizeZ="4"')),
    _of("OME-TIFF", "sizes of OME-XML and pages", "VP1220", _text('SizeX="4"', 'SizeX="8"')),
    _of("OME-TIFF", "Type of OME-XML and pages", "VP1220", _text('Type="int16"', 'Type="uint8"')),
)
