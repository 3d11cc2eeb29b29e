"""A package for the way to its readers: the same texels, as Zstandard frames or plain. spec/texture_files.md."""

import hashlib
from pathlib import Path
from typing import Literal

from volprep_formats.output import write_file
from volprep_formats.package.manifest import FileRecord, Manifest, PlanItem
from volprep_formats.package.manifest_json import encode_manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.progress import Progress
from volprep_formats.textures import ktx2
from volprep_formats.textures.texel_formats import PALETTED

Texels = Literal["plain", "zstd"]
_WORTH = 0.9
"""A texture stays plain if its frames take more than this part of it: every reader would pay for little."""


def write_converted(package: Package, texels: Texels, folder: Path, progress: Progress) -> list[str]:
    """Write the package into the empty folder `folder`, with its texels as wished, and return the names of its files.

    The manifest has the sizes and digests of the files as they are written. Raises what reading a package raises.
    """
    manifest = package.manifest
    progress.start("textures", len(manifest.files))
    records = []
    for record in manifest.files:
        data = _converted(package.read_bytes(record.path), record, manifest, texels)
        (folder / record.path).parent.mkdir(parents=True, exist_ok=True)
        write_file(folder / record.path, data)
        digest = hashlib.sha256(data).hexdigest()
        records.append(record.model_copy(update={"size_bytes": len(data), "sha256": digest}))
        progress.advance()
    plan = tuple(_priced(item, records) for item in manifest.plan)
    write_file(folder / MANIFEST, encode_manifest(manifest.model_copy(update={"files": tuple(records), "plan": plan})))
    return [MANIFEST, *(record.path for record in records)]


def _converted(data: bytes, record: FileRecord, manifest: Manifest, texels: Texels) -> bytes:
    if record.path not in _convertible(manifest):
        return data
    if texels == "plain":
        return ktx2.plain(data, record.path)
    packed = ktx2.supercompressed(data, record.path)
    return packed if len(packed) <= _WORTH * len(data) else data


def _convertible(manifest: Manifest) -> set[str]:
    """Return the KTX 2 files that readers read completely. Boxes are cut by seeking only in the whole-level file."""
    textures = {texture.file for texture in manifest.textures if texture.format != PALETTED}
    pieces, whole = (manifest.subvolumes.pieces, manifest.subvolumes.whole) if manifest.subvolumes else ((), None)
    return (textures | set(pieces)) - {whole}


def _priced(item: PlanItem, records: list[FileRecord]) -> PlanItem:
    """Let an item of the plan have the size of its files."""
    sizes = {record.path: record.size_bytes for record in records}
    if not item.files:
        return item
    return item.model_copy(update={"size_bytes": sum(sizes[path] for path in item.files)})
