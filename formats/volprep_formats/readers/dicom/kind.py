"""Which files are DICOM: by their first bytes, or by their names."""

SUFFIXES = frozenset((".dcm", ".dicom", ".ima"))
"""Names of files end so that say they are DICOM, in lower case."""
HEAD_BYTES = 132
"""First bytes of a file that it takes to know it."""


def has_prefix(head: bytes) -> bool:
    """Whether a file begins as DICOM does, with a preamble of any 128 bytes; old software left it out."""
    return head[128:HEAD_BYTES] == b"DICM"
