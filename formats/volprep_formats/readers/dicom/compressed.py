"""Compressed DICOM pictures: their declared properties, and their values. Decoders run in worker processes.

Source: DICOM PS3.5, 8.2 and annexes A and G.
"""

import re
import struct
from collections.abc import Callable, Container, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import WorkerRequest
from volprep_formats.readers.dicom.codecs import DECODERS, JPEG, JPEG_2000, JPEG_LS, NAMES, RLE
from volprep_formats.readers.dicom.codestreams import MOST_TILES, Coding, Declared, declared, jpeg_transform
from volprep_formats.readers.dicom.colours import picture_of
from volprep_formats.readers.dicom.header import EncodedPixels
from volprep_formats.readers.dicom.jpeg_ends import with_other_bits
from volprep_formats.readers.dicom.pixels import masked, stored_range, wrong_length
from volprep_formats.readers.dicom.value import undecodable, value_of
from volprep_formats.source import ColourChannel

_ITEM, _SEQUENCE_END = 0xFFFE_E000, 0xFFFE_E0DD
# OpenJPEG, the greediest, takes 12 bytes and 0.2 µs for each pixel.
_MEMORY_BYTES, _MEMORY_BYTES_PER_PIXEL = 2**28, 40
_SECONDS, _SECONDS_PER_PIXEL = 30.0, 10e-6
# The end of one picture, and the beginning of another; neither can occur among coded values.
_NEXT_PICTURE = re.compile(rb"\xff\xd9\0*\xff(?:\xd8\xff|\x4f\xff\x51)")
_RLE_HEADER = struct.Struct("<16L")
_RLE_EXPANSION = 64
_TILE_HEADER_BYTES = 14
_PRECISIONS: dict[Coding, Container[int]] = {
    "sequential DCT": (8, 12),
    "lossless": range(2, 17),
    "JPEG-LS": range(2, 17),
    "JPEG 2000": range(1, 33),
}
_LOSSLESS_JPEG = frozenset(("1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70"))


def decode_request(pixels: EncodedPixels) -> WorkerRequest:
    """Ask for `decode_compressed` in a worker process."""
    count, samples = pixels.rows * pixels.columns, _samples(pixels)
    wanted = pixels.grey
    item = np.dtype(wanted.dtype).itemsize if isinstance(wanted, ColourChannel) else pixels.bits_allocated // 8
    return WorkerRequest(
        function=decode_compressed,
        argument=pixels,
        path=pixels.path,
        result_bytes=count * item,
        memory_bytes=_MEMORY_BYTES + _MEMORY_BYTES_PER_PIXEL * samples * count,
        seconds=_SECONDS + _SECONDS_PER_PIXEL * samples * count,
    )


def decode_compressed(pixels: EncodedPixels) -> NDArray[np.generic]:
    """Stored values of the whole picture as [y, x]: integers of 8, 16 or 32 bits. Colours become the wanted component.

    Raises VolprepError VP1003 when the file cannot be read, VP1031 when it has become shorter, VP1039 when the data
    cannot be decoded, VP1046 to VP1049 when they declare another size, are cut off, are of another kind, or hold values
    that the header does not allow.
    """
    try:
        frame = b"".join(_fragments(value_of(pixels), is_bare=pixels.is_bare))
        if DECODERS[pixels.transfer_syntax] == RLE:
            values = _run_lengths(pixels, frame)
            return picture_of(pixels, values, is_ybr=pixels.is_ybr) if pixels.colours else masked(values, pixels)
        said = _checked(pixels, frame)
        values = _fitted(pixels, said, _decoded(pixels, said, frame))
        return picture_of(pixels, values, is_ybr=_is_ybr(pixels, frame)) if pixels.colours else values
    except OSError as error:
        raise VolprepError("VP1003", path=pixels.path, error=error.strerror or error) from error
    except (VolprepError, MemoryError):
        raise
    except Exception as error:  # decoders let any error through on damaged bytes
        raise undecodable(pixels, error) from error


def _samples(pixels: EncodedPixels) -> int:
    return 3 if pixels.colours else 1


def _is_ybr(pixels: EncodedPixels, frame: bytes) -> bool:
    """Whether decoded components are luminance and differences.

    JPEG data may say it, and are right where the header says something else: writers copy old headers.
    """
    transform = jpeg_transform(frame) if DECODERS[pixels.transfer_syntax] == JPEG else None
    return pixels.is_ybr if transform is None else transform


def _fragments(value: bytes | bytearray, *, is_bare: bool) -> Iterator[bytes]:
    """Return the items of one picture. The first item of a whole value is a table, and is skipped."""
    at, is_table = 0, not is_bare
    while at + 8 <= len(value):
        group, number, length = struct.unpack_from("<HHL", value, at)
        tag = group << 16 | number
        if tag == _SEQUENCE_END:
            return
        if tag != _ITEM or length > len(value) - at - 8:
            msg = "an item is cut off"
            raise ValueError(msg)
        if not is_table:
            yield bytes(value[at + 8 : at + 8 + length])
        is_table = False
        at += 8 + length


def _checked(pixels: EncodedPixels, frame: bytes) -> Declared:
    """Return the properties that the data declares, after checking them against the header."""
    if _NEXT_PICTURE.search(frame):
        told = {"frames": 1, "expected": "one compressed picture", "actual": "several"}
        raise VolprepError("VP1045", path=pixels.path, **told)
    said = declared(frame)
    if said is None:
        msg = "no frame header"
        raise ValueError(msg)
    codings: dict[str, Coding] = {JPEG: "sequential DCT", JPEG_LS: "JPEG-LS", JPEG_2000: "JPEG 2000"}
    wanted = "lossless" if pixels.transfer_syntax in _LOSSLESS_JPEG else codings[DECODERS[pixels.transfer_syntax]]
    if said.coding != wanted:
        name = NAMES[pixels.transfer_syntax]
        raise VolprepError("VP1048", path=pixels.path, syntax=name, wanted=wanted, actual=said.coding)
    if (said.rows, said.columns, said.components) != (pixels.rows, pixels.columns, _samples(pixels)):
        raise VolprepError(
            "VP1046",
            path=pixels.path,
            rows=pixels.rows,
            columns=pixels.columns,
            actual=f"{said.columns}×{said.rows} pixels of {said.components}",
        )
    if said.precision not in _PRECISIONS[said.coding]:
        msg = f"{said.precision} bits, which {said.coding} data cannot have"
        raise ValueError(msg)
    if said.tiles > MOST_TILES or 8 * len(frame) < _fewest_bits(said):
        msg = "fewer data than the smallest such picture has"
        raise ValueError(msg)
    return said


def _fewest_bits(said: Declared) -> int:
    """Fewest bits that can code such a picture. Less data than that would only keep the decoder busy."""
    if said.coding == "lossless":  # a code for each pixel
        return said.rows * said.columns
    if said.coding == "sequential DCT":  # two codes for each block
        return 2 * -(-said.rows // 8) * -(-said.columns // 8)
    return 8 * _TILE_HEADER_BYTES * said.tiles if said.coding == "JPEG 2000" else 0


def _decoded(pixels: EncodedPixels, said: Declared, frame: bytes) -> NDArray[np.generic]:
    """Return the values in the decoder's type."""
    import imagecodecs  # noqa: PLC0415 - a worker alone needs it

    decoder = DECODERS[pixels.transfer_syntax]
    if decoder == JPEG:
        # Components as they are coded: a decoder would guess their colour space.
        coded = "RGB" if pixels.colours else None
        decode = partial(imagecodecs.jpeg8_decode, colorspace=coded, outcolorspace=coded)
        values = _whole_jpeg(pixels, said, frame, decode)
    elif decoder == JPEG_LS:
        if not frame.rstrip(b"\0").endswith(b"\xff\xd9"):
            raise VolprepError("VP1047", path=pixels.path)
        values = imagecodecs.jpegls_decode(frame)
    else:
        values = imagecodecs.jpeg2k_decode(frame, numthreads=1)
    if values.shape != (pixels.rows, pixels.columns, *((3,) if pixels.colours else ())):
        msg = "another shape than the data say"
        raise ValueError(msg)
    return values


def _whole_jpeg(
    pixels: EncodedPixels, said: Declared, frame: bytes, decode: Callable[[bytes], NDArray[np.generic]]
) -> NDArray[np.generic]:
    """Decode a JPEG picture twice, to see that all of it is there; see `jpeg_ends`."""
    other = with_other_bits(frame, said)
    if other is None:
        raise VolprepError("VP1047", path=pixels.path)
    values = decode(frame)
    if not np.array_equal(values, decode(other)):
        raise VolprepError("VP1047", path=pixels.path)
    return values


def _fitted(pixels: EncodedPixels, said: Declared, values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Values as the header types them, where all are possible by its BitsStored and PixelRepresentation.

    The data may declare more bits than the header, as where a whole word was coded for each value, and fewer. Signed
    values are coded as they are in JPEG 2000, and in lossless JPEG and JPEG-LS as unsigned ones, in two's complement.
    """
    low, high = int(values.min()), int(values.max())
    if high >= 2**said.precision:
        msg = "values of more bits than the data say"
        raise ValueError(msg)
    sign = 2 ** (said.precision - 1)
    # Of fewer bits than the header says, the highest may be a sign or none.
    is_clear = True
    if pixels.signed and said.coding in {"lossless", "JPEG-LS"} and high >= sign:
        is_clear = said.precision >= pixels.bits_stored
        values = (values.astype(np.int64) ^ sign) - sign
        low, high = int(values.min()), int(values.max())
    lowest, highest = stored_range(pixels)
    if not is_clear or low < lowest or high > highest:
        raise VolprepError(
            "VP1049",
            path=pixels.path,
            stored=f"{pixels.bits_stored}-bit {'signed' if pixels.signed else 'unsigned'}",
            precision=f"{said.precision}-bit{' signed' if said.signed else ''}",
            low=low,
            high=high,
        )
    return values.astype(f"{'i' if pixels.signed else 'u'}{pixels.bits_allocated // 8}", copy=False)


def _run_lengths(pixels: EncodedPixels, frame: bytes) -> NDArray[np.generic]:
    """Undo run lengths: one segment for each byte of each component, the highest first (PS3.5, annex G)."""
    import imagecodecs  # noqa: PLC0415 - a worker alone needs it

    parts, count = pixels.bits_allocated // 8, pixels.rows * pixels.columns
    planes = parts * _samples(pixels)
    segments, *offsets = _RLE_HEADER.unpack_from(frame)
    begins = offsets[:segments] if segments <= len(offsets) else []
    if len(begins) != planes or begins[0] != _RLE_HEADER.size or begins != sorted(begins) or begins[-1] > len(frame):
        msg = "segments that are not there, or not as many as a value has bytes"
        raise ValueError(msg)
    result = np.empty((count, planes), np.uint8)
    for k, (begin, end) in enumerate(zip(begins, (*begins[1:], len(frame)), strict=True)):
        if count > _RLE_EXPANSION * (end - begin):
            msg = "too few runs for the picture"
            raise ValueError(msg)
        plane = imagecodecs.packbits_decode(frame[begin:end])
        if len(plane) != count:
            raise wrong_length(pixels, len(plane) * planes)
        sample, part = divmod(k, parts)
        result[:, sample * parts + parts - 1 - part] = np.frombuffer(plane, np.uint8)
    kind = "i" if pixels.signed else "u"
    shape = (pixels.rows, pixels.columns, *((3,) if pixels.colours else ()))
    return result.view(f"<{kind}{parts}").reshape(shape)
