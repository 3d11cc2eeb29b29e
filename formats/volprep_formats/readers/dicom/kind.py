"""Which files are DICOM: by their first bytes, or by their names."""

SUFFIXES = frozenset((".dcm", ".dicom", ".ima"))
"""Endings of DICOM file names, in lower case."""
HEAD_BYTES = 132
"""Number of first bytes needed to recognise a file."""


def has_prefix(head: bytes) -> bool:
    """Whether a file begins as DICOM does, with a preamble of any 128 bytes; old software left it out."""
    return head[128:HEAD_BYTES] == b"DICM"
