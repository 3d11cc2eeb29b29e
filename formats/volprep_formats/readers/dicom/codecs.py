"""Compressed transfer syntaxes of DICOM that can be read, the decoder of each, and whether it is installed.

Each has exactly one decoder of imagecodecs, because two decoders of lossy data may round differently. Source: DICOM
PS3.6, annex A.
"""

from dataclasses import dataclass
from importlib.util import find_spec

IMPLICIT, EXPLICIT = "1.2.840.10008.1.2", "1.2.840.10008.1.2.1"
"""Transfer syntaxes that are not compressed: little endian, types of values left out or written."""
PACKAGE = "imagecodecs"
"""The Python package that holds all decoders."""
JPEG, JPEG_LS, JPEG_2000, RLE = "libjpeg-turbo", "CharLS", "OpenJPEG", "PackBits"
"""The libraries in it that decode."""
SYNTAXES = (
    ("1.2.840.10008.1.2.4.50", "JPEG baseline", JPEG),
    ("1.2.840.10008.1.2.4.51", "JPEG extended", JPEG),
    ("1.2.840.10008.1.2.4.57", "JPEG lossless", JPEG),
    ("1.2.840.10008.1.2.4.70", "JPEG lossless, first order", JPEG),
    ("1.2.840.10008.1.2.4.80", "JPEG-LS lossless", JPEG_LS),
    ("1.2.840.10008.1.2.4.81", "JPEG-LS near-lossless", JPEG_LS),
    ("1.2.840.10008.1.2.4.90", "JPEG 2000 lossless", JPEG_2000),
    ("1.2.840.10008.1.2.4.91", "JPEG 2000", JPEG_2000),
    ("1.2.840.10008.1.2.4.201", "HTJ2K lossless", JPEG_2000),
    ("1.2.840.10008.1.2.4.202", "HTJ2K lossless RPCL", JPEG_2000),
    ("1.2.840.10008.1.2.4.203", "HTJ2K", JPEG_2000),
    ("1.2.840.10008.1.2.5", "RLE lossless", RLE),
)
"""UID, short name and decoder of the compressed transfer syntaxes of still images. Others need no decoder."""

DECODERS = {uid: decoder for uid, _, decoder in SYNTAXES}
"""The decoder of each."""
NAMES = {uid: name for uid, name, _ in SYNTAXES}
"""The short name of each."""


@dataclass(frozen=True)
class Codec:
    """A transfer syntax and its decoder."""

    name: str
    """Short name of the transfer syntax."""
    decoders: tuple[str, ...]
    """Name of its decoder; empty when it is not installed."""
    missing: tuple[str, ...]
    """Package to install for it; empty if it is installed."""


def is_installed() -> bool:
    """Whether the package that holds the decoders is here. It is not imported."""
    try:
        return find_spec(PACKAGE) is not None
    except ValueError:  # it was hidden: its place in sys.modules holds None
        return False


def codecs() -> tuple[Codec, ...]:
    """All compressed transfer syntaxes of still images, each with its decoder if that is installed."""
    installed = is_installed()
    return tuple(
        Codec(name, (f"{PACKAGE}: {decoder}",) if installed else (), () if installed else (PACKAGE,))
        for _, name, decoder in SYNTAXES
    )
