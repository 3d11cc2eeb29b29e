"""TOML files from users or third parties: read within limits of size, depth and time."""

import re
import tomllib
from pathlib import Path

from volprep_formats.regular_files import read_regular

_MOST_KEY_PARTS = 16
"""Parts of a dotted key. The parser's time grows with the square of their number; a scene's keys have two or three."""
_BREAKS = re.compile(r"[=,\[\]{}\n]")
_DOT = re.compile(r"[^.\n]\.")


def read_toml_file(path: Path) -> dict[str, object]:
    """Return the table in a TOML file.

    Raises OSError for a file that cannot be read, is not regular or is larger than 1 MiB, and ValueError, with a
    description, for invalid TOML.
    """
    # Editors on Windows put a byte order mark in front, which TOML does not know.
    text = read_regular(path).decode().removeprefix("\ufeff")
    for piece in _BREAKS.split(text):
        if sum(1 for _ in _DOT.finditer(piece)) > _MOST_KEY_PARTS and not piece.lstrip().startswith("#"):
            msg = f"{piece.strip()[:40]!r}… has more than {_MOST_KEY_PARTS} dots, where keys have two or three parts"
            raise ValueError(msg)
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        msg = "it nests too deeply"
        raise ValueError(msg) from error
