"""Packages taken apart, changed, and put together again with right sizes and digests."""

import hashlib
import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from volprep_formats.package.storage.files import MANIFEST

Files = dict[str, bytes]


def files_of(package: Path) -> Files:
    """Files of a package in one file, by name."""
    with zipfile.ZipFile(package) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def packed(files: Files) -> bytes:
    """A zip that holds these files, the manifest first."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        for name in sorted(files, key=lambda name: (name != MANIFEST, name)):
            archive.writestr(zipfile.ZipInfo(name), files[name])
    return target.getvalue()


def with_digests(files: Files) -> Files:
    """The same files, with a manifest that has the sizes and digests that they have now, as far as it is whole."""
    manifest = json.loads(files[MANIFEST])
    records = manifest.get("files") if isinstance(manifest, dict) else None
    for record in records if isinstance(records, list) else []:
        data = files.get(record.get("path", "")) if isinstance(record, dict) else None
        if data is not None:
            record |= {"size_bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    return files | {MANIFEST: json.dumps(manifest).encode()}


def with_manifest(files: Files, change: Callable[[Any], object]) -> Files:
    """The same files, with a manifest that `change` has changed."""
    manifest = json.loads(files[MANIFEST])
    change(manifest)
    return files | {MANIFEST: json.dumps(manifest).encode()}
