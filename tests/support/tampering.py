"""Packages that are damaged with care: size and digest of each changed file stand in the manifest as they should."""

import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scene_builds

from volprep.pipeline.origin import origin_path
from volprep.validation.checks.consistency import open_whole
from volprep.validation.comparison.preview import preview_findings
from volprep.validation.exact.derive import derive
from volprep.validation.subjects.scan import find_scan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.textures.texel_formats import BYTES_PER_TEXEL


class Damaged:
    """A copy of a package, to be changed."""

    def __init__(self, package: Path, folder: Path) -> None:
        self.path = folder / package.name
        shutil.copytree(package, self.path)
        shutil.copy(origin_path(package), folder)
        self.manifest = json.loads((self.path / "manifest.json").read_bytes())

    def texture(self, role: str, level: int | None = None, transfer: str | None = None) -> dict:
        wanted = {"role": role, "level": level, "transfer": transfer}
        named = {key: value for key, value in wanted.items() if value is not None}
        return next(each for each in self.manifest["textures"] if named.items() <= each.items())

    def data(self, file: str) -> bytearray:
        return bytearray((self.path / file).read_bytes())

    def put(self, file: str, data: bytes) -> None:
        (self.path / file).write_bytes(data)
        record = next(each for each in self.manifest["files"] if each["path"] == file)
        record |= {"size_bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        sizes = {each["path"]: each["size_bytes"] for each in self.manifest["files"]}
        for item in self.manifest["plan"]:
            if file in item["files"]:
                item["size_bytes"] = sum(sizes[path] for path in item["files"])

    def texels(self, texture: dict, change: Callable[[np.ndarray], np.ndarray]) -> str:
        """Replace the texels [z, y, x, byte] of a file that holds one texture; give its file."""
        data = self.data(texture["file"])
        shape = texture["shape_zyx"]
        size = BYTES_PER_TEXEL.get(texture["format"], 1)
        body = int(np.prod(shape)) * size
        texels = np.frombuffer(bytes(data[-body:]), np.uint8).reshape(*shape, size)
        changed = np.ascontiguousarray(change(texels.copy()))
        assert changed.shape == texels.shape
        assert (changed != texels).any(), "nothing was damaged"
        self.put(texture["file"], bytes(data[:-body]) + changed.tobytes())
        return texture["file"]

    def text(self, file: str, old: str, new: str) -> str:
        data = self.data(file).decode()
        assert old in data, data
        self.put(file, data.replace(old, new).encode())
        return file

    def json(self, file: str, change: Callable[[dict], None]) -> str:
        record = json.loads(self.data(file))
        change(record)
        self.put(file, json.dumps(record).encode())
        return file

    def save(self) -> Path:
        (self.path / "manifest.json").write_text(json.dumps(self.manifest), encoding="utf-8")
        return self.path


def built(folder: Path, scene: Path) -> Path:
    """Build the package of a scene in `folder`; give its path."""
    scene_builds.built(scene, folder / "tried.volpkg")
    return folder / "tried.volpkg"


def told(path: Path, scene: Path | None = None, *, preview: bool = False) -> str:
    """Return what validation says of a package before it draws views; nothing if all is as it should be."""
    try:
        package = open_whole(path)
        with tempfile.TemporaryDirectory() as scratch:
            findings = [*derive(package, find_scan(path, scene), Path(scratch), Silent()).record.findings]
        findings += preview_findings(package) if preview else ()
    except VolprepError as error:
        return str(error)
    return "\n".join(f"{each.code} {each.item}: {each.problem}" for each in findings)
