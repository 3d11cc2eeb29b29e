"""Stored values of one DICOM picture: read its bytes, undo the transfer syntax, mask unused bits.

`decode_picture` depends on nothing but its argument, which can be sent to another process. Native pixel data is read
here; compressed data goes to the decoders behind pydicom, which are foreign code: `decode_request` is for a worker
process. Call all of it within `quiet_pydicom`. Source: DICOM PS3.5, 8.1.1 and annex A.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydicom.encaps import get_frame
from pydicom.pixels.decoders.base import get_decoder
from pydicom.uid import UID, JPEGLSTransferSyntaxes, JPEGTransferSyntaxes

from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import Request
from volprep_formats.readers.codestreams import declared_size
from volprep_formats.readers.dicom_codecs import DECODERS
from volprep_formats.readers.dicom_file import DEFLATED, inflated_data_set, quiet_pydicom
from volprep_formats.readers.dicom_header import EncodedPixels

_BIG_ENDIAN = "1.2.840.10008.1.2.2"
_EMPTY_TABLE, _END = b"\xfe\xff\x00\xe0" + bytes(4), b"\xfe\xff\xdd\xe0" + bytes(4)
_ENDING_WITH_EOI = frozenset((*JPEGTransferSyntaxes, *JPEGLSTransferSyntaxes))
# OpenJPEG, the greediest, takes 12 bytes and 0.2 µs for each pixel.
_MEMORY_BYTES, _MEMORY_BYTES_PER_PIXEL = 2**28, 40
_SECONDS, _SECONDS_PER_PIXEL = 30.0, 10e-6
_NATIVE = frozenset(("1.2.840.10008.1.2", "1.2.840.10008.1.2.1", _BIG_ENDIAN, DEFLATED))


def check_decodable(pixels: EncodedPixels) -> None:
    """Raise VolprepError when this picture can never be decoded: no decoder, or sizes that contradict each other."""
    if pixels.transfer_syntax not in _NATIVE:
        _check_decoder(pixels)
        return
    expected = pixels.rows * pixels.columns * pixels.bits_allocated // 8
    # A pad byte makes lengths even. More than a whole picture too much means that the header is wrong.
    if not expected <= pixels.size_bytes < 2 * expected + 2:
        raise VolprepError(
            "VP1040",
            path=pixels.path,
            actual=pixels.size_bytes,
            expected=expected,
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
    """Give the part of a decoded picture that is the slice."""
    if pixels.tile is None:
        return picture
    row, column, rows, columns = pixels.tile
    return picture[row : row + rows, column : column + columns]


def is_compressed(pixels: EncodedPixels) -> bool:
    """Whether a foreign decoder is needed."""
    return pixels.transfer_syntax not in _NATIVE


def decode_request(pixels: EncodedPixels) -> Request:
    """Ask for `decode_picture` in a worker process."""
    count = pixels.rows * pixels.columns
    return Request(
        function=_decode_alone,
        argument=pixels,
        path=pixels.path,
        result_bytes=count * pixels.bits_allocated // 8,
        memory_bytes=_MEMORY_BYTES + _MEMORY_BYTES_PER_PIXEL * count,
        seconds=_SECONDS + _SECONDS_PER_PIXEL * count,
    )


def decode_picture(pixels: EncodedPixels) -> NDArray[np.generic]:
    """Stored values of the whole picture as [y, x]: integers of 8, 16 or 32 bits, unused ones masked, or floats.

    Raises VolprepError VP1031 when the file has become shorter, VP1039 when the data cannot be decoded, VP1046 when
    the compressed data declare another size.
    """
    try:
        data = _value(pixels)
        if pixels.transfer_syntax in _NATIVE:
            return _native(pixels, data)
        return _compressed(pixels, data)
    except OSError as error:
        raise VolprepError("VP1003", path=pixels.path, error=error.strerror or error) from error
    except (VolprepError, MemoryError):
        raise
    except Exception as error:  # decoders let any error through on damaged bytes
        raise VolprepError(
            "VP1039", path=pixels.path, syntax=UID(pixels.transfer_syntax).name, error=type(error).__name__
        ) from error


def _decode_alone(pixels: EncodedPixels) -> NDArray[np.generic]:
    with quiet_pydicom():
        return decode_picture(pixels)


def _value(pixels: EncodedPixels) -> bytes:
    if pixels.transfer_syntax == DEFLATED:
        data = inflated_data_set(pixels.path)[pixels.offset_bytes :][: pixels.size_bytes]
    else:
        with pixels.path.open("rb") as file:
            file.seek(pixels.offset_bytes)
            data = file.read(pixels.size_bytes)
    if len(data) < pixels.size_bytes:
        raise VolprepError("VP1031", path=pixels.path, what=f"only {len(data)} bytes of its pixel data are there")
    return data


def _native(pixels: EncodedPixels, data: bytes) -> NDArray[np.generic]:
    order = ">" if pixels.transfer_syntax == _BIG_ENDIAN else "<"
    kind = "f" if pixels.is_float else "i" if pixels.signed else "u"
    count = pixels.rows * pixels.columns
    if pixels.bits_allocated == 8 and order == ">" and pixels.has_words:
        # Bytes are packed in words, so the second of each pair comes first.
        words = np.frombuffer(data, dtype=">u2", count=(count + 1) // 2)
        values = words.astype("<u2").view(kind + "1")[:count]
    else:
        values = np.frombuffer(data, dtype=f"{order}{kind}{pixels.bits_allocated // 8}", count=count)
    native = values.reshape(pixels.rows, pixels.columns).astype(values.dtype.newbyteorder("="), copy=False)
    return _masked(native, pixels)


def _masked(values: NDArray[np.generic], pixels: EncodedPixels) -> NDArray[np.generic]:
    """Move the stored bits to the bottom, with their sign: the bits above and below them may hold anything."""
    if pixels.bits_stored == pixels.bits_allocated:
        return values
    up = pixels.bits_allocated - 1 - pixels.high_bit
    down = pixels.bits_allocated - pixels.bits_stored
    result: NDArray[np.generic] = np.right_shift(np.left_shift(values, up), down)
    return result


def _compressed(pixels: EncodedPixels, data: bytes) -> NDArray[np.generic]:
    options: dict[str, Any] = {  # pydicom types each of these as the whole set
        "rows": pixels.rows,
        "columns": pixels.columns,
        "samples_per_pixel": 1,
        "number_of_frames": 1,
        "bits_allocated": pixels.bits_allocated,
        "bits_stored": pixels.bits_stored,
        "pixel_representation": int(pixels.signed),
        "photometric_interpretation": "MONOCHROME2",
        "pixel_keyword": "PixelData",
    }
    syntax = UID(pixels.transfer_syntax)
    if pixels.is_bare:
        data = _EMPTY_TABLE + data + _END
    frame = get_frame(data, 0, number_of_frames=1)
    _check_declared(pixels, frame)
    if syntax in _ENDING_WITH_EOI and not frame.rstrip(b"\0").endswith(b"\xff\xd9"):
        msg = "the picture is cut off"  # libjpeg fills up what is missing and says nothing
        raise ValueError(msg)
    decoder = get_decoder(syntax)
    values, _ = decoder.as_array(data, index=0, raw=True, decoding_plugin=DECODERS[syntax], **options)
    if values.shape != (pixels.rows, pixels.columns):
        msg = "another shape than the header says"
        raise ValueError(msg)
    return values


def _check_declared(pixels: EncodedPixels, frame: bytes) -> None:
    declared = declared_size(frame)
    if declared is None:  # RLE declares none
        return
    if (declared.rows, declared.columns, declared.components) != (pixels.rows, pixels.columns, 1):
        raise VolprepError(
            "VP1046",
            path=pixels.path,
            rows=pixels.rows,
            columns=pixels.columns,
            actual=f"{declared.columns}×{declared.rows} pixels of {declared.components}",
        )


def _check_decoder(pixels: EncodedPixels) -> None:
    syntax = UID(pixels.transfer_syntax)
    plugin = DECODERS.get(syntax)
    if plugin is None:
        name = syntax.name if syntax.is_transfer_syntax else "that its header names"
        raise VolprepError("VP1038", path=pixels.path, syntax=name, missing="none is known")
    if plugin not in get_decoder(syntax).available_plugins:
        raise VolprepError("VP1038", path=pixels.path, syntax=syntax.name, missing=f"{plugin} is missing")
    if pixels.is_float:
        raise VolprepError("VP1043", path=pixels.path, bits="compressed floating-point pixels")
    if pixels.high_bit != pixels.bits_stored - 1:
        raise VolprepError("VP1037", path=pixels.path, keyword="HighBit", wanted=str(pixels.bits_stored - 1))
