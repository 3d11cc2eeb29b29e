"""Read the looks of a file: JSON, a package, an OME-Zarr group, or glTF binary. spec/looks.md."""

import json
from pathlib import Path

from pydantic import ValidationError

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.look import KEY, VolumeLooks, looks_of
from volprep_formats.package.reader import Package
from volprep_formats.record import problems
from volprep_formats.regular_files import MOST_TEXT_BYTES, open_regular, read_regular
from volprep_formats.untrusted_json import parse_json, read_record

_GLB = b"glTF\2\0\0\0"
_BEFORE_JSON = 20
"""Bytes of a glTF binary before its JSON; the length of the JSON begins at the twelfth."""


def read_looks(path: Path) -> VolumeLooks:
    """Return the looks of a file or folder. Raises VP3042 if it has none, and the errors of opening a package."""
    if path.suffix.lower() == ".zip" or (path / "manifest.json").is_file():
        return looks_of(Package.open(path, allow_draft=True).manifest)
    try:
        document = parse_json(_text(path / "zarr.json" if path.is_dir() else path))
        return read_record(VolumeLooks, json.dumps(_looks_in(document)).encode(), "ignore")
    except OSError as error:
        raise VolprepError("VP3042", path=path, problem=error.strerror) from error
    except ValidationError as error:
        raise VolprepError("VP3042", path=path, problem=problems(error)) from error
    except (ValueError, RecursionError) as error:
        raise VolprepError("VP3042", path=path, problem=error) from error


def is_looks(path: Path) -> bool:
    """Return whether a file looks like a record of looks."""
    try:
        return b'"volume-looks"' in read_regular(path)
    except OSError:
        return False


def _text(path: Path) -> bytes:
    """Return a JSON text, that of a glTF binary included. Raises OSError, or ValueError if it is too long."""
    with open_regular(path) as file:
        text = file.read(_BEFORE_JSON)
        if text.startswith(_GLB):
            size = int.from_bytes(text[12:16], "little")
            text = file.read(min(size, MOST_TEXT_BYTES + 1))
        else:
            text += file.read(MOST_TEXT_BYTES)
    if len(text) > MOST_TEXT_BYTES:
        msg = f"its JSON is larger than {MOST_TEXT_BYTES} bytes"
        raise ValueError(msg)
    return text


def _looks_in(document: object) -> object:
    """Return the record in a document: all of it, or a part of its attributes or of the `extras` of a node."""
    if isinstance(document, dict):
        if document.get("format") == "volume-looks":
            return document
        nodes = document.get("nodes", ())
        extras = [node.get("extras") for node in nodes if isinstance(node, dict)] if isinstance(nodes, list) else []
        for holder in (document.get("attributes"), *extras):
            if isinstance(holder, dict) and KEY in holder:
                return holder[KEY]
    msg = f"it has no record of looks ({KEY})"
    raise ValueError(msg)
