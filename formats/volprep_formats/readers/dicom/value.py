"""Raw bytes of the pixel data in a file, and the error for data that no decoder accepts."""

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.codecs import NAMES
from volprep_formats.readers.dicom.header import EncodedPixels
from volprep_formats.readers.dicom.inflate import DEFLATED, inflate_into


def undecodable(pixels: EncodedPixels, error: Exception) -> VolprepError:
    """Return the error for damaged pixel data."""
    name = NAMES.get(pixels.transfer_syntax, "values that are not compressed")
    return VolprepError("VP1039", path=pixels.path, syntax=name, error=type(error).__name__)


def value_of(pixels: EncodedPixels) -> bytes | bytearray:
    """Read the raw bytes of the pixel data. Raises VP1031 if the file has become shorter, OSError."""
    data: bytes | bytearray
    if pixels.transfer_syntax == DEFLATED:
        data = bytearray(pixels.size_bytes)
        count = inflate_into(pixels.path, pixels.offset_bytes, memoryview(data))
    else:
        with pixels.path.open("rb") as file:
            file.seek(pixels.offset_bytes)
            data = file.read(pixels.size_bytes)
        count = len(data)
    if count < pixels.size_bytes:
        raise VolprepError("VP1031", path=pixels.path, what=f"only {count} bytes of its pixel data are there")
    return data
