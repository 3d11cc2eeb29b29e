"""Paths as text in records. JSON and TOML hold Unicode only.

A path of bytes that are not UTF-8 is written as a file URI (RFC 8089), with %NN for each such byte, and read back as
the same bytes.
"""

import os
from pathlib import Path
from urllib.parse import unquote_to_bytes

from volprep_formats.diagnostics import VolprepError
from volprep_formats.shown import address_in

_URI = "file://"


def path_text(path: Path) -> str:
    """Return a path as text: unchanged, or as an absolute file URI if it is not UTF-8."""
    text = str(path)
    return text if _is_unicode(text) else path.absolute().as_uri()


def path_of_text(text: str) -> Path:
    """Return the path that `path_text` wrote, or that a user did."""
    return Path(os.fsdecode(unquote_to_bytes(text.removeprefix(_URI)))) if text.startswith(_URI) else Path(text)


def unicode_path(path: Path) -> str:
    """Whether the source has this format, by the scene, the path, and the file's first bytes, unpacked."""
    if not _is_unicode(str(path)):
        raise VolprepError("VP1071", path=path)
    return str(path)


def no_such_path(path: Path) -> VolprepError:
    """Return VP1001 for a path with nothing there, or VP1306 if it is an address, which only a batch fetches."""
    address = address_in(str(path))
    return VolprepError("VP1001", path=path) if address is None else VolprepError("VP1306", address=address)


def _is_unicode(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
