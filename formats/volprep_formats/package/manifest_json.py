"""The manifest as bytes: the same manifest gives the same bytes, and bytes of others are not trusted."""

import json
import re
from pathlib import Path
from typing import NoReturn

import numpy as np
from pydantic import ValidationError

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.storage.contents import holds, open_contents
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.record import problems

MAX_MANIFEST_BYTES = 4 * 1024 * 1024
"""Largest manifest that is read or written. One with 10 000 files has about 3 MiB."""
_VERSION = (1, 0)


def encode_manifest(manifest: Manifest) -> bytes:
    """UTF-8 JSON: keys sorted, two spaces, shortest digits that give each float back, absent fields left out.

    That of a draft is one line: it is written after each stage, for nobody to read, and so takes a third of the time.
    """
    record = manifest.model_dump(mode="json", exclude_none=True)
    indent = 2 if manifest.state == "sealed" else None
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, indent=indent, sort_keys=True)
    return (text + "\n").encode("utf-8")


def decode_manifest(data: bytes, path: Path) -> Manifest:
    """Read a manifest; `path` is the package, for messages.

    Raises VP4002 for what is no manifest, VP4003 for another version, VP4004 for wrong keys or values.
    """
    if len(data) > MAX_MANIFEST_BYTES:
        raise VolprepError("VP4002", path=path, problem=f"{MANIFEST} is larger than {MAX_MANIFEST_BYTES} bytes")
    try:
        text = data.decode("utf-8")
        record = json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise VolprepError("VP4002", path=path, problem=f"{MANIFEST} is not JSON: {error}") from error
    if not isinstance(record, dict) or record.get("format") != "volpkg":
        raise VolprepError("VP4002", path=path, problem=f'{MANIFEST} does not say "format": "volpkg"')
    _check_version(record.get("version"), path)
    try:
        # Numbers near the end of the range overflow in the models' own checks, which then refuse them.
        with np.errstate(all="ignore"):
            return Manifest.model_validate_json(text, strict=True)
    except ValidationError as error:
        raise VolprepError("VP4004", path=path, problems=problems(error)) from error


def read_manifest(package: Path) -> Manifest:
    """Read the manifest of the package at `package`. Raises VP4001 to VP4004, and VP4007 for a symbolic link."""
    if not package.exists():
        raise VolprepError("VP4001", path=package)
    if not package.is_file() and not package.is_dir():
        raise VolprepError("VP4002", path=package, problem="it is neither a folder nor a file")
    if not holds(package, MANIFEST):
        raise VolprepError("VP4002", path=package, problem=f"it has no {MANIFEST}")
    with open_contents(package, MANIFEST) as contents:
        return decode_manifest(contents.read(MAX_MANIFEST_BYTES + 1), package)


def _check_version(version: object, path: Path) -> None:
    match = re.fullmatch(r"(\d{1,4})\.(\d{1,4})", version) if isinstance(version, str) else None
    if match is None:
        raise VolprepError("VP4002", path=path, problem=f"{MANIFEST} has no version of the form major.minor")
    if (int(match[1]), int(match[2])) != _VERSION:
        raise VolprepError("VP4003", path=path, version=version, known=f"{_VERSION[0]}.{_VERSION[1]}")


def _unique_keys(pairs: list[tuple[str, object]]) -> dict[str, object]:
    record = dict(pairs)
    if len(record) != len(pairs):
        # Two parsers may take different ones of two equal keys: one would check what the other does not draw.
        msg = "a key stands twice in one object"
        raise ValueError(msg)
    return record


def _refuse_constant(name: str) -> NoReturn:
    msg = f"{name} is no number in JSON"
    raise ValueError(msg)
