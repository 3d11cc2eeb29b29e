"""One DICOM file: is it one, where does its pixel data lie, are all its bytes there.

Source: DICOM PS3.10 (file format), PS3.5 (7.1 data elements, A.4 encapsulated pixel data, A.5 deflated data sets).
"""

import io
import struct
import warnings
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import pydicom
from pydicom import config
from pydicom.dataset import Dataset
from pydicom.filereader import read_dataset, read_file_meta_info
from pydicom.tag import BaseTag
from pydicom.uid import UID, ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom_frames import frame_count, frame_slices
from volprep_formats.readers.dicom_header import (
    MAX_SLICE_PIXELS,
    PRIVATE_TAGS,
    TAGS,
    PixelElement,
    SliceImage,
    raw_text,
    raw_value,
    slice_image,
)
from volprep_formats.readers.dicom_mosaic import is_mosaic, mosaic_slices

DEFLATED = "1.2.840.10008.1.2.1.99"

_HEAD_BYTES = 2**12
_META_OFFSET_BYTES = 128 + 4 + 12
"""Preamble, "DICM", and the element that holds the length of the rest of group 0002."""
_SUFFIXES = frozenset((".dcm", ".dicom", ".ima"))
_MAX_INFLATED_BYTES = 2 * MAX_SLICE_PIXELS + 2**26
_BARE_BEGINNINGS = frozenset((b"\x02\0\0\0", b"\x08\0\0\0", b"\x08\0\x05\0", b"\x08\0\x08\0", b"\x08\0\x16\0"))
_UNDEFINED_LENGTH = 0xFFFFFFFF
_PIXEL_DATA = (0x7FE0, 0x0010)
_PIXEL_GROUP = 0x7FE0
_ITEM, _DELIMITER = (0xFFFE, 0xE000), (0xFFFE, 0xE0DD)
_TAGS: list[BaseTag | int] = [*TAGS.values(), *PRIVATE_TAGS]
_MOST_ITEMS = 2**20


@contextmanager
def quiet_pydicom() -> Iterator[None]:
    """Keep pydicom from judging and printing: what matters is checked here, and said in our own words."""
    with config.disable_value_validation(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def has_prefix(head: bytes) -> bool:
    """Whether these first bytes (at least 132) are those of a DICOM file."""
    return head[128:132] == b"DICM"


def read_slices(path: Path) -> tuple[SliceImage, ...]:
    """Read the header of one DICOM file: its slices; none when it is sound but holds no image (reports, plans).

    Call it within `quiet_pydicom`. Raises VolprepError VP1003 when the file cannot be read, VP1032 when it begins as
    DICOM and cannot be parsed, VP1031 when it ends within its header, or its name says DICOM and it is none. Lesser
    faults stand in the `problem` of what it returns, which then may be the picture as a whole.
    """
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
            cut_off = has_prefix(head) and path.stat().st_size < _meta_end_bytes(head)
            if _looks_like_dicom(head) and not cut_off:
                file.seek(0)
                return _read(path, file, deflated=DEFLATED.encode() in head)
    except VolprepError:
        raise
    except OSError as error:
        raise VolprepError("VP1003", path=path, error=error.strerror or error) from error
    except Exception as error:  # pydicom lets any error of a parser through on damaged bytes
        if has_prefix(head):
            raise VolprepError("VP1032", path=path, error=type(error).__name__) from error
        return ()
    if cut_off:
        raise VolprepError("VP1031", path=path, what="it ends before its data set begins")
    # macOS leaves a "._NAME" with its own data beside NAME.
    if path.suffix.lower() in _SUFFIXES and not path.name.startswith("._"):
        raise VolprepError("VP1031", path=path, what="it has no DICOM header")
    return ()


def inflated_data_set(path: Path) -> bytes:
    """Inflate the data set of a deflated file.

    Raises zlib.error when it is damaged, cut off, or larger than the largest slice that would be accepted.
    """
    with path.open("rb") as file:
        file.seek(_meta_end_bytes(file.read(_HEAD_BYTES)))
        stream = zlib.decompressobj(-zlib.MAX_WBITS)
        data = stream.decompress(file.read(), _MAX_INFLATED_BYTES)
    if not stream.eof:
        msg = "cut off, or larger than the largest slice"
        raise zlib.error(msg)
    return data


def _meta_end_bytes(head: bytes) -> int:
    """Where group 0002 ends: its first element, which must be there, holds the length of the others."""
    return _META_OFFSET_BYTES + int.from_bytes(head[_META_OFFSET_BYTES - 4 : _META_OFFSET_BYTES], "little")


def _looks_like_dicom(head: bytes) -> bool:
    # Old software left out the prefix, and with it group 0002 or not: such files begin with the length of that group,
    # or with the length of group 0008, the character set, the image type or the class, little endian.
    return has_prefix(head) or head[:4] in _BARE_BEGINNINGS


def _read(path: Path, file: BinaryIO, *, deflated: bool) -> tuple[SliceImage, ...]:
    stream: BinaryIO
    if deflated:
        meta, implicit, little = read_file_meta_info(path), False, True
        stream = io.BytesIO(inflated_data_set(path))
        data: Dataset = read_dataset(stream, implicit, little, stop_when=_at_pixels, specific_tags=_TAGS)
    else:
        stream = file
        whole = pydicom.dcmread(stream, stop_before_pixels=True, force=True, specific_tags=_TAGS)
        data, meta = whole, whole.file_meta
        implicit, little = (bool(said) for said in whole.original_encoding)
    syntax = UID(str(meta.get("TransferSyntaxUID", ""))) or _bare_syntax(implicit, little)
    encapsulated = syntax.is_transfer_syntax and syntax.is_encapsulated
    element = _pixel_element(stream, implicit, little, encapsulated=encapsulated)
    sop_class = UID(str(meta.get("MediaStorageSOPClassUID", "")) or raw_text(data, "SOPClassUID"))
    if element is None:
        if not raw_value(data, "Rows")[0] and "Image Storage" not in sop_class.name:
            return ()
        # Not kept for later as the problem of this image: even the series that it names may be cut off.
        raise VolprepError("VP1031", path=path, what="it ends before the pixel data")
    image = slice_image(path, data, str(syntax), element)
    frames = frame_count(data)
    if frames is not None:
        return frame_slices(image, data, element, frames)
    return mosaic_slices(image, data) if is_mosaic(data) else (image,)


def _at_pixels(tag: BaseTag, _vr: str | None, _length: int) -> bool:
    return tag.group == _PIXEL_GROUP


def _bare_syntax(implicit: bool, little: bool) -> UID:
    """Transfer syntax of a file that does not name it."""
    if implicit:
        return ImplicitVRLittleEndian
    return ExplicitVRLittleEndian if little else ExplicitVRBigEndian


def _pixel_element(stream: BinaryIO, implicit: bool, little: bool, *, encapsulated: bool) -> PixelElement | None:
    """Find the pixel data, at which the parser stopped; None when the file ends before it."""
    start = stream.tell()
    size = stream.seek(0, io.SEEK_END)
    stream.seek(start)
    order = "<" if little else ">"
    header = stream.read(8 if implicit else 12)
    if len(header) < (8 if implicit else 12):
        return None
    tag = struct.unpack(order + "HH", header[:4])
    if tag[0] != _PIXEL_GROUP:
        return None
    (length,) = struct.unpack(order + "L", header[-4:])
    offset = stream.tell()
    end = offset + length
    items: list[tuple[int, int]] = []
    table: tuple[int, ...] = ()
    if length == _UNDEFINED_LENGTH or encapsulated:
        end = _walk(stream, size, items)
        table = _table(stream, items)
    return PixelElement(
        is_float=tag != _PIXEL_DATA,
        has_words=not implicit and header[4:6] == b"OW",
        offset_bytes=offset,
        size_bytes=None if end > size else end - offset,
        present_bytes=size - offset,
        items=tuple(items),
        table=table,
    )


def _walk(stream: BinaryIO, size: int, items: list[tuple[int, int]]) -> int:
    """Collect the items of encapsulated pixel data; give the end of its delimiter, past `size` when it is cut off."""
    while len(items) < _MOST_ITEMS:
        header = stream.read(8)
        if len(header) < 8:
            return size + 1
        group, element, length = struct.unpack("<HHL", header)
        if (group, element) == _DELIMITER:
            return stream.tell()
        if (group, element) != _ITEM:
            return size + 1
        items.append((stream.tell(), length))
        stream.seek(length, io.SEEK_CUR)
    return size + 1


def _table(stream: BinaryIO, items: Sequence[tuple[int, int]]) -> tuple[int, ...]:
    """Basic offset table, the value of the first item."""
    if not items or items[0][1] % 4 or items[0][1] > 4 * _MOST_ITEMS:
        return ()
    stream.seek(items[0][0])
    value = stream.read(items[0][1])
    return struct.unpack(f"<{len(value) // 4}L", value) if len(value) == items[0][1] else ()
