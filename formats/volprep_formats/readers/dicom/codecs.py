"""Which compressed transfer syntaxes of DICOM are read, each by which decoder, and which of these this machine has.

Each has one decoder. pydicom would go on to the next where one refuses, and libjpeg accepts JPEG-LS data that CharLS
finds to be damaged; and two decoders of lossy data need not round alike. Source: DICOM PS3.6, annex A.
"""

from dataclasses import dataclass

IMPLICIT, EXPLICIT = "1.2.840.10008.1.2", "1.2.840.10008.1.2.1"
"""Transfer syntaxes that are not compressed: little endian, types of values left out or written."""
SYNTAXES = (
    ("1.2.840.10008.1.2.4.50", "JPEG baseline", "pylibjpeg"),
    ("1.2.840.10008.1.2.4.51", "JPEG extended", "pylibjpeg"),
    ("1.2.840.10008.1.2.4.57", "JPEG lossless", "pylibjpeg"),
    ("1.2.840.10008.1.2.4.70", "JPEG lossless, first order", "pylibjpeg"),
    ("1.2.840.10008.1.2.4.80", "JPEG-LS lossless", "pyjpegls"),
    ("1.2.840.10008.1.2.4.81", "JPEG-LS near-lossless", "pyjpegls"),
    ("1.2.840.10008.1.2.4.90", "JPEG 2000 lossless", "pylibjpeg"),
    ("1.2.840.10008.1.2.4.91", "JPEG 2000", "pylibjpeg"),
    ("1.2.840.10008.1.2.4.201", "HTJ2K lossless", "pylibjpeg"),
    ("1.2.840.10008.1.2.4.202", "HTJ2K lossless RPCL", "pylibjpeg"),
    ("1.2.840.10008.1.2.4.203", "HTJ2K", "pylibjpeg"),
    ("1.2.840.10008.1.2.5", "RLE lossless", "pydicom"),
)
"""UID, short name and decoder of the compressed transfer syntaxes of still images. Others need no decoder."""

DECODERS = {uid: decoder for uid, _, decoder in SYNTAXES}
"""The decoder of each, by the name that pydicom gives it."""


@dataclass(frozen=True)
class Codec:
    """One transfer syntax and what decodes it here."""

    name: str
    """Short name of the transfer syntax."""
    decoders: tuple[str, ...]
    """Name of its decoder; empty when it is not installed."""
    missing: tuple[str, ...]
    """Its decoder with what that requires; empty when it is installed."""


def codecs() -> tuple[Codec, ...]:
    """All compressed transfer syntaxes of still images, each with the decoders that are installed."""
    from pydicom.pixels.decoders.base import get_decoder  # noqa: PLC0415 -- heavy
    from pydicom.uid import UID  # noqa: PLC0415 -- heavy

    found = []
    for uid, name, wanted in SYNTAXES:
        decoder = get_decoder(UID(uid))
        installed = wanted in decoder.available_plugins
        missing = () if installed else tuple(d for d in decoder.missing_dependencies if d.startswith(wanted))
        found.append(Codec(name, (wanted,) if installed else (), missing))
    return tuple(found)
