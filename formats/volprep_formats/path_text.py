"""Paths as text in records, which hold Unicode only: JSON and TOML can say nothing else.

A path of bytes that are no UTF-8 is written as a file URI (RFC 8089), with %NN for each such byte, and read back as the
same bytes.
"""

import os
from pathlib import Path
from urllib.parse import unquote_to_bytes

from volprep_formats.diagnostics import VolprepError

_URI = "file://"


def path_text(path: Path) -> str:
    """Return a path as text: as it is, or as a file URI where it is no UTF-8, which makes it absolute."""
    text = str(path)
    return text if _is_unicode(text) else path.absolute().as_uri()


def path_of_text(text: str) -> Path:
    """Return the path that `path_text` wrote, or that a user did."""
    return Path(os.fsdecode(unquote_to_bytes(text.removeprefix(_URI)))) if text.startswith(_URI) else Path(text)


def unicode_path(path: Path) -> str:
    """Return a path for a library that opens Unicode names only. Raises VP1071 for another one."""
    if not _is_unicode(str(path)):
        raise VolprepError("VP1071", path=path)
    return str(path)


def _is_unicode(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
