"""Stored values of one DICOM picture: read its bytes, undo the transfer syntax, mask unused bits.

Native pixel data is read here, compressed data in compressed.py. Source: DICOM PS3.5, 8.1.1 and annex A.
"""

import os
import sys
import zlib

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.codecs import DECODERS, EXPLICIT, IMPLICIT, NAMES, PACKAGE, is_installed
from volprep_formats.readers.dicom.colours import components_of, picture_of
from volprep_formats.readers.dicom.header import EncodedPixels
from volprep_formats.readers.dicom.inflate import DEFLATED, inflate_into
from volprep_formats.readers.dicom.value import undecodable, value_of

_BIG_ENDIAN = "1.2.840.10008.1.2.2"
_LITTLE_ENDIAN = frozenset((IMPLICIT, EXPLICIT))
_NATIVE = frozenset((*_LITTLE_ENDIAN, _BIG_ENDIAN, DEFLATED))


def check_decodable(pixels: EncodedPixels) -> None:
    """Raise VolprepError when this picture can never be decoded: no decoder, or sizes that contradict each other."""
    if pixels.transfer_syntax not in _NATIVE:
        _check_decoder(pixels)
        return
    if pixels.size_bytes not in {picture_bytes(pixels), picture_bytes(pixels) + picture_bytes(pixels) % 2}:
        raise wrong_length(pixels, pixels.size_bytes)


def picture_bytes(pixels: EncodedPixels) -> int:
    """Length of the picture where it is not compressed; a pad byte makes that of the whole value even."""
    samples = {"": 1, "pairs": 2}.get(pixels.colours, 3)
    return pixels.rows * pixels.columns * samples * pixels.bits_allocated // 8


def wrong_length(pixels: EncodedPixels, actual: int) -> VolprepError:
    """Return the error for pixel data of `actual` bytes, where the header says another number."""
    return VolprepError(
        "VP1040",
        path=pixels.path,
        actual=actual,
        expected=picture_bytes(pixels),
        rows=pixels.rows,
        columns=pixels.columns,
        bits=pixels.bits_allocated,
    )


def stored_range(pixels: EncodedPixels) -> tuple[int, int]:
    """Lowest and highest value that the stored bits can hold."""
    if pixels.signed:
        return -(2 ** (pixels.bits_stored - 1)), 2 ** (pixels.bits_stored - 1) - 1
    return 0, 2**pixels.bits_stored - 1


def slice_of(pixels: EncodedPixels, picture: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return the part of a decoded picture that is the slice."""
    if pixels.tile is None:
        return picture
    row, column, rows, columns = pixels.tile
    return picture[row : row + rows, column : column + columns]


def is_compressed(pixels: EncodedPixels) -> bool:
    """Whether a foreign decoder is needed."""
    return pixels.transfer_syntax not in _NATIVE


def decode_native(pixels: EncodedPixels) -> tuple[NDArray[np.generic], bool]:
    """Stored values of the whole picture as [y, x]: integers of 8, 16 or 32 bits, unused ones masked, or floats.

    Also whether the unused bits held anything.

    Raises VolprepError VP1003 when the file cannot be read, VP1031 when it has become shorter, VP1039 when the data are
    damaged.
    """
    try:
        return _native(pixels, value_of(pixels))
    except OSError as error:
        raise VolprepError("VP1003", path=pixels.path, error=error.strerror or error) from error
    except (zlib.error, ValueError) as error:
        raise undecodable(pixels, error) from error


def is_as_stored(pixels: EncodedPixels, dtype: np.dtype[np.generic]) -> bool:
    """Whether the file holds values of `dtype`, besides unused bits, so that `read_native` can read them."""
    return (
        (pixels.transfer_syntax in _LITTLE_ENDIAN or pixels.transfer_syntax == DEFLATED)
        and sys.byteorder == "little"
        and pixels.bits_allocated == 8 * dtype.itemsize
        and pixels.is_float == (dtype.kind == "f")
        and not pixels.colours
    )


def read_native(pixels: EncodedPixels, target: NDArray[np.generic]) -> bool:
    """Read the picture into `target` [y, x], C-contiguous; only where `is_as_stored`. Raises as `decode_native`.

    Returns whether the unused bits held anything.
    """
    wanted = target.data.cast("B")
    try:
        count = _fill(pixels, wanted)
    except OSError as error:
        raise VolprepError("VP1003", path=pixels.path, error=error.strerror or error) from error
    except zlib.error as error:
        raise undecodable(pixels, error) from error
    if count < len(wanted):
        raise VolprepError("VP1031", path=pixels.path, what=f"only {count} bytes of its pixel data are there")
    if pixels.bits_stored == pixels.bits_allocated:
        return False
    as_stored = target.view(f"{'i' if pixels.signed else 'u'}{target.itemsize}")
    kept = masked(as_stored, pixels)
    above = _has_more(as_stored, kept, pixels)
    as_stored[...] = kept
    return above


def _fill(pixels: EncodedPixels, wanted: memoryview) -> int:
    """Read the bytes of the picture into `wanted`. Return how many there were."""
    if pixels.transfer_syntax == DEFLATED:
        return inflate_into(pixels.path, pixels.offset_bytes, wanted)
    count = 0
    descriptor = os.open(pixels.path, os.O_RDONLY)
    try:
        while more := os.preadv(descriptor, [wanted[count:]], pixels.offset_bytes + count):
            count += more
    finally:
        os.close(descriptor)
    return count


def _has_more(values: NDArray[np.generic], kept: NDArray[np.generic], pixels: EncodedPixels) -> bool:
    """Whether masking changed values whose stored bits are the lowest ones, as those above them held something.

    Bits below the stored ones have a remark of their own. Pixels that are padded with one value throughout count, too.
    """
    if pixels.high_bit != pixels.bits_stored - 1 or pixels.bits_stored == pixels.bits_allocated:
        return False
    if not pixels.signed:
        return bool((values != kept).any())
    # A negative value may be stored without sign extension: its stored bits are the same.
    low_bits = np.bitwise_and(values, values.dtype.type(2**pixels.bits_stored - 1))
    return bool(((values != kept) & (values != low_bits)).any())


def _native(pixels: EncodedPixels, data: bytes | bytearray) -> tuple[NDArray[np.generic], bool]:
    order = ">" if pixels.transfer_syntax == _BIG_ENDIAN else "<"
    kind = "f" if pixels.is_float else "i" if pixels.signed else "u"
    count = pixels.rows * pixels.columns
    if pixels.colours:
        return picture_of(pixels, components_of(pixels, data), is_ybr=pixels.is_ybr), False
    if pixels.bits_allocated == 8 and order == ">" and pixels.has_words:
        # Bytes are packed in words, so the second of each pair comes first.
        words = np.frombuffer(data, dtype=">u2", count=(count + 1) // 2)
        values = words.astype("<u2").view(kind + "1")[:count]
    else:
        values = np.frombuffer(data, dtype=f"{order}{kind}{pixels.bits_allocated // 8}", count=count)
    native = values.reshape(pixels.rows, pixels.columns).astype(values.dtype.newbyteorder("="), copy=False)
    kept = masked(native, pixels)
    return kept, _has_more(native, kept, pixels)


def _check_decoder(pixels: EncodedPixels) -> None:
    """Raise VolprepError VP1037, VP1038 or VP1043 when no decoder here takes this picture."""
    if pixels.transfer_syntax not in DECODERS:
        from pydicom import config  # noqa: PLC0415 - heavy, and only for a message
        from pydicom.uid import UID  # noqa: PLC0415 - as above

        syntax = UID(pixels.transfer_syntax, config.IGNORE)
        name = syntax.name if syntax.is_transfer_syntax else "that its header names"
        raise VolprepError("VP1038", path=pixels.path, syntax=name, missing="none is known")
    if not is_installed():
        name = NAMES[pixels.transfer_syntax]
        raise VolprepError("VP1038", path=pixels.path, syntax=name, missing=f"{PACKAGE} is missing")
    if pixels.is_float:
        raise VolprepError("VP1043", path=pixels.path, bits="compressed floating-point pixels")
    if pixels.high_bit != pixels.bits_stored - 1:
        raise VolprepError("VP1037", path=pixels.path, keyword="HighBit", wanted=str(pixels.bits_stored - 1))


def masked(values: NDArray[np.generic], pixels: EncodedPixels) -> NDArray[np.generic]:
    """Move the stored bits to the bottom, with their sign: the bits above and below them may hold anything."""
    if pixels.bits_stored == pixels.bits_allocated:
        return values
    up = pixels.bits_allocated - 1 - pixels.high_bit
    down = pixels.bits_allocated - pixels.bits_stored
    result: NDArray[np.generic] = np.right_shift(np.left_shift(values, up), down)
    return result
