"""Which transfer syntaxes of DICOM can be decoded on this machine. Source: DICOM PS3.6, annex A; pydicom's decoders."""

from dataclasses import dataclass

SYNTAXES = (
    ("1.2.840.10008.1.2.4.50", "JPEG baseline"),
    ("1.2.840.10008.1.2.4.51", "JPEG extended"),
    ("1.2.840.10008.1.2.4.57", "JPEG lossless"),
    ("1.2.840.10008.1.2.4.70", "JPEG lossless, first order"),
    ("1.2.840.10008.1.2.4.80", "JPEG-LS lossless"),
    ("1.2.840.10008.1.2.4.81", "JPEG-LS near-lossless"),
    ("1.2.840.10008.1.2.4.90", "JPEG 2000 lossless"),
    ("1.2.840.10008.1.2.4.91", "JPEG 2000"),
    ("1.2.840.10008.1.2.4.201", "HTJ2K lossless"),
    ("1.2.840.10008.1.2.4.202", "HTJ2K lossless RPCL"),
    ("1.2.840.10008.1.2.4.203", "HTJ2K"),
    ("1.2.840.10008.1.2.5", "RLE lossless"),
)
"""UID and short name of the compressed transfer syntaxes of still images. Native and deflated ones need no decoder."""


@dataclass(frozen=True)
class Codec:
    """One transfer syntax and what decodes it here."""

    name: str
    """Short name of the transfer syntax."""
    decoders: tuple[str, ...]
    """Names of the installed decoders; empty when it cannot be decoded."""
    missing: tuple[str, ...]
    """Decoders that could be installed, with what each requires."""


def codecs() -> tuple[Codec, ...]:
    """All compressed transfer syntaxes of still images, each with the decoders that are installed."""
    from pydicom.pixels.decoders.base import get_decoder  # noqa: PLC0415 -- heavy
    from pydicom.uid import UID  # noqa: PLC0415 -- heavy

    decoders = [(name, get_decoder(UID(uid))) for uid, name in SYNTAXES]
    return tuple(
        Codec(name, tuple(decoder.available_plugins), tuple(decoder.missing_dependencies)) for name, decoder in decoders
    )
