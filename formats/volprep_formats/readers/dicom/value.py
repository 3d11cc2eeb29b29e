"""The bytes of the pixel data as they stand in a file, and the error for those that no decoder takes."""

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.codecs import NAMES
from volprep_formats.readers.dicom.header import EncodedPixels
from volprep_formats.readers.dicom.inflate import DEFLATED, inflated_data_set


def undecodable(pixels: EncodedPixels, error: Exception) -> VolprepError:
    """Return the error for damaged pixel data."""
    name = NAMES.get(pixels.transfer_syntax, "values that are not compressed")
    return VolprepError("VP1039", path=pixels.path, syntax=name, error=type(error).__name__)


def value_of(pixels: EncodedPixels) -> bytes:
    """Bytes of the pixel data as they stand in the file. Raises VP1031 when it has become shorter, OSError."""
    if pixels.transfer_syntax == DEFLATED:
        data = inflated_data_set(pixels.path)[pixels.offset_bytes :][: pixels.size_bytes]
    else:
        with pixels.path.open("rb") as file:
            file.seek(pixels.offset_bytes)
            data = file.read(pixels.size_bytes)
    if len(data) < pixels.size_bytes:
        raise VolprepError("VP1031", path=pixels.path, what=f"only {len(data)} bytes of its pixel data are there")
    return data
