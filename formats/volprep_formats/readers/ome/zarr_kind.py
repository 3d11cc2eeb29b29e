"""Which folders and zips are Zarr stores."""

from pathlib import Path

METADATA = ("zarr.json", ".zgroup", ".zattrs", ".zarray")
"""Metadata files; each node of a store has one of them."""


def is_zarr(path: Path, head: bytes) -> bool:
    """Whether a folder, or a zip that begins with `head`, is a Zarr store."""
    if path.is_dir():
        return any((path / name).is_file() for name in METADATA)
    # The first entry is metadata, or a folder on the way there, or the extension says it.
    return head[:4] == b"PK\x03\x04" and (path.name.endswith(".zarr.zip") or _first_name(head) in METADATA)


def _first_name(head: bytes) -> str:
    return head[30 : 30 + int.from_bytes(head[26:28], "little")].decode("utf-8", "replace").rpartition("/")[2]
