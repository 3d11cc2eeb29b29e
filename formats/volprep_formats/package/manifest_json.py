"""The manifest as bytes: serialised deterministically, and parsed as untrusted input."""

import json
import re
from pathlib import Path

from pydantic import ValidationError

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import VERSION, Manifest
from volprep_formats.package.storage.contents import holds, open_contents
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.record import problems
from volprep_formats.untrusted_json import parse_json, read_record

MAX_MANIFEST_BYTES = 4 * 1024 * 1024
"""Largest manifest that is read or written. One with 10 000 files has about 3 MiB."""


def encode_manifest(manifest: Manifest) -> bytes:
    """UTF-8 JSON: keys sorted, two spaces, shortest digits that give each float back, absent fields left out.

    A draft's manifest is one line: it is rewritten after each stage, and this takes a third of the time.
    """
    record = manifest.model_dump(mode="json", exclude_none=True)
    indent = 2 if manifest.state == "sealed" else None
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, indent=indent, sort_keys=True)
    return (text + "\n").encode("utf-8")


def decode_manifest(data: bytes, path: Path, *, strict: bool = False) -> Manifest:
    """Read a manifest; `path` is the package, for messages.

    Keys that this version does not know are ignored, unless `strict` or in a draft. Raises VP4002 for anything but a
    manifest, VP4003 for another major version, VP4004 for wrong keys or values, VP4070 for a required extension.
    """
    if len(data) > MAX_MANIFEST_BYTES:
        raise VolprepError("VP4002", path=path, problem=f"{MANIFEST} is larger than {MAX_MANIFEST_BYTES} bytes")
    try:
        record = parse_json(data)
    except ValueError as error:
        raise VolprepError("VP4002", path=path, problem=f"{MANIFEST} is not JSON: {error}") from error
    if not isinstance(record, dict) or record.get("format") != "volpkg":
        raise VolprepError("VP4002", path=path, problem=f'{MANIFEST} does not say "format": "volpkg"')
    minor = _minor_version(record.get("version"), path)
    required = record.get("extensions_required")
    if isinstance(required, list) and required:
        raise VolprepError("VP4070", path=path, extensions=", ".join(map(str, required)))
    is_later = minor > VERSION[1]
    is_draft, stages = record.get("state") == "draft", record.get("stages")
    has_stages = not is_draft and isinstance(stages, list) and bool(stages)
    if has_stages:
        # Apps cannot read these records, and need not: no package has any.
        data = json.dumps(record | {"stages": []}).encode()
    forbids = (strict and not is_later) or is_draft
    try:
        manifest = read_record(Manifest, data, "forbid" if forbids else "ignore")
    except ValidationError as error:
        raise VolprepError("VP4004", path=path, problems=problems(error)) from error
    if has_stages:
        raise VolprepError("VP4011", path=path, problem="it is sealed, but has records of stages")
    return manifest


def read_manifest(package: Path, *, strict: bool = False) -> Manifest:
    """Read the manifest of the package at `package`, as `decode_manifest` does.

    Raises VP4001 to VP4004 and VP4070, and VP4007 for a symbolic link.
    """
    if not package.exists():
        raise VolprepError("VP4001", path=package)
    if not package.is_file() and not package.is_dir():
        raise VolprepError("VP4002", path=package, problem="it is neither a folder nor a file")
    if not holds(package, MANIFEST):
        raise VolprepError("VP4002", path=package, problem=f"it has no {MANIFEST}")
    with open_contents(package, MANIFEST) as contents:
        return decode_manifest(contents.read(MAX_MANIFEST_BYTES + 1), package, strict=strict)


def _minor_version(version: object, path: Path) -> int:
    """Return the minor version. Raises VP4002 for a value of another form, VP4003 for another major version."""
    match = re.fullmatch(r"(0|[1-9][0-9]{0,3})\.(0|[1-9][0-9]{0,3})", version) if isinstance(version, str) else None
    if match is None:
        raise VolprepError("VP4002", path=path, problem=f"{MANIFEST} has no version of the form major.minor")
    if int(match[1]) != VERSION[0]:
        raise VolprepError("VP4003", path=path, version=version, known=f"{VERSION[0]}.x")
    return int(match[2])
