"""Paths of files of a package: names of devices, which Windows cannot unpack, are refused by all readers."""

import json
from pathlib import Path

from repack import Files, files_of, packed
from three_readers import READ, Readers

from volprep_formats.package.storage.files import MANIFEST

DEVICES = ("con", "aux.png", "nul", "a/prn", "com1.x/b", "a/lpt9.x.png")
ORDINARY = ("con-1", "console", "a/nul_b.png", "com0", "com10", "x.con", "lpt.png", "acon/b")


def with_preview_at(files: Files, path: str) -> Files:
    """The same package, with another path of its preview."""
    manifest = json.loads(files[MANIFEST])
    older, manifest["preview"] = manifest["preview"], path
    for record in manifest["files"]:
        record["path"] = path if record["path"] == older else record["path"]
    for item in manifest["plan"]:
        item["files"] = [path if each == older else each for each in item.get("files", [])]
    manifest["files"].sort(key=lambda record: record["path"])
    return {path if name == older else name: data for name, data in files.items()} | {
        MANIFEST: json.dumps(manifest).encode()
    }


def test_names_of_devices_are_no_paths(readers: Readers, kinds, tmp_path: Path) -> None:
    files = files_of(kinds["house"])
    paths = [tmp_path / f"{number}.zip" for number in range(len(DEVICES) + len(ORDINARY))]
    for path, name in zip(paths, (*DEVICES, *ORDINARY), strict=True):
        path.write_bytes(packed(with_preview_at(files, name)))
    said = readers.all(paths)
    assert said[: len(DEVICES)] == [({"VP4004"}, "VP4004", "VP4004")] * len(DEVICES)
    assert said[len(DEVICES) :] == [({READ}, READ, READ)] * len(ORDINARY)
