"""Compressed DICOM pictures, by the decoders behind pydicom. They are foreign code, and run in worker processes.

Source: DICOM PS3.5, 8.2 and annex A.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydicom import config
from pydicom.encaps import get_frame
from pydicom.pixels.decoders.base import get_decoder
from pydicom.uid import UID, JPEGLSTransferSyntaxes, JPEGTransferSyntaxes

from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import Request
from volprep_formats.readers.dicom.any_file import quiet_pydicom
from volprep_formats.readers.dicom.codecs import DECODERS
from volprep_formats.readers.dicom.codestreams import declared_size
from volprep_formats.readers.dicom.header import EncodedPixels
from volprep_formats.readers.dicom.value import undecodable, value_of

_EMPTY_TABLE, _END = b"\xfe\xff\x00\xe0" + bytes(4), b"\xfe\xff\xdd\xe0" + bytes(4)
_ENDING_WITH_EOI = frozenset((*JPEGTransferSyntaxes, *JPEGLSTransferSyntaxes))
# OpenJPEG, the greediest, takes 12 bytes and 0.2 µs for each pixel.
_MEMORY_BYTES, _MEMORY_BYTES_PER_PIXEL = 2**28, 40
_SECONDS, _SECONDS_PER_PIXEL = 30.0, 10e-6


def decode_request(pixels: EncodedPixels) -> Request:
    """Ask for `decode_compressed` in a worker process."""
    count = pixels.rows * pixels.columns
    return Request(
        function=decode_compressed,
        argument=pixels,
        path=pixels.path,
        result_bytes=count * pixels.bits_allocated // 8,
        memory_bytes=_MEMORY_BYTES + _MEMORY_BYTES_PER_PIXEL * count,
        seconds=_SECONDS + _SECONDS_PER_PIXEL * count,
    )


def decode_compressed(pixels: EncodedPixels) -> NDArray[np.generic]:
    """Stored values of the whole picture as [y, x]: integers of 8, 16 or 32 bits.

    Raises VolprepError VP1003 when the file cannot be read, VP1031 when it has become shorter, VP1039 when the data
    cannot be decoded, VP1046 when they declare another size.
    """
    try:
        with quiet_pydicom():
            return _decoded(pixels, value_of(pixels))
    except OSError as error:
        raise VolprepError("VP1003", path=pixels.path, error=error.strerror or error) from error
    except (VolprepError, MemoryError):
        raise
    except Exception as error:  # decoders let any error through on damaged bytes
        raise undecodable(pixels, error) from error


def check_decoder(pixels: EncodedPixels) -> None:
    """Raise VolprepError VP1037, VP1038 or VP1043 when no decoder here takes this picture."""
    syntax = UID(pixels.transfer_syntax, config.IGNORE)
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


def _decoded(pixels: EncodedPixels, data: bytes) -> NDArray[np.generic]:
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
