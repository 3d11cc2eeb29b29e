"""Package reader of apps, the renderer and the validation."""

import hashlib
import os
from copy import copy
from pathlib import Path
from typing import Self

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.gate import require_sound
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.manifest_json import read_manifest
from volprep_formats.package.storage.contents import Contents, open_contents
from volprep_formats.package.texture import Texture


class Package:
    """An open package. Reads only files that the manifest names, and checks that they are complete."""

    def __init__(self, path: Path, manifest: Manifest, channel: str = "") -> None:
        """Use `open`; `channel` is the one that `manifest` shows alone."""
        self._path = path
        self._whole = self._manifest = manifest
        self._channel = channel
        self._records = {record.path: record for record in manifest.files}

    @classmethod
    def open(cls, path: Path, *, allow_draft: bool = False, frame: int = 0) -> Self:
        """Open the package at `path`, a folder or a zip, as that of one frame where it is a time series.

        Ignores keys, and files and textures of roles, that a later minor version may add. Raises VP4001 if there is
        none, VP4002 for another kind of thing, VP4003 for another major version, VP4004 for a manifest that breaks the
        schema, VP4005 for a draft unless `allow_draft`, VP4070 for a required extension. For a sealed package in which
        anything is wrong that shows without reading its files: VP4007, VP4008, VP4010, VP4011. VP4054 if there is no
        such frame.
        """
        package = cls.open_any(path, allow_draft=allow_draft)
        if package.manifest.state == "sealed":
            require_sound(path, package.manifest)
        return package.at_frame(frame)

    @classmethod
    def open_any(cls, path: Path, *, allow_draft: bool = False, strict: bool = False) -> Self:
        """Open a package to find all that is wrong with it; `strict` also refuses keys that this version does not know.

        Raises VP4001 to VP4005 and VP4070 as `open` does.
        """
        manifest = read_manifest(path, strict=strict)
        if manifest.state != "sealed" and not allow_draft:
            raise VolprepError("VP4005", path=path)
        return cls(path, manifest)

    def __fspath__(self) -> str:
        """Return the path, so that functions that take the path of a package take an open one."""
        return os.fspath(self._path)

    def __repr__(self) -> str:
        return f"Package({os.fspath(self._path)!r})"

    @property
    def path(self) -> Path:
        """Folder or zip of the package."""
        return self._path

    @property
    def manifest(self) -> Manifest:
        """The manifest."""
        return self._manifest

    @property
    def whole(self) -> Manifest:
        """The manifest with all frames and channels."""
        return self._whole

    @property
    def channel(self) -> str:
        """Channel that is shown alone; "" where all are shown."""
        return self._channel

    def seen_as(self, manifest: Manifest, channel: str) -> Self:
        """Return the package as `manifest` shows one channel of it alone; files are read as this package reads them."""
        seen = copy(self)
        seen._manifest, seen._channel = manifest, channel
        return seen

    def at_frame(self, frame: int) -> Self:
        """Return the package as it is for one frame of a time series. Raises VP4054 if there is no such frame."""
        count = len(self._whole.frames or (None,))
        if not 0 <= frame < count:
            raise VolprepError("VP4054", path=self._path, frame=frame, count=count)
        return self.seen_as(self._whole.at_frame(frame), "") if self._whole.frames else self

    def component_of(self, texture: Texture) -> int:
        """Component of the texels of a volume that holds the channel, 0 for red or luminance."""
        held = texture.channels
        return held.index(self._channel) if self._channel in held else 0

    def read_bytes(self, path: str) -> bytes:
        """Read a file of the package.

        Raises VP4014 if the manifest does not name it, VP4007 if it is missing or a link, VP4008 if its size is not
        the manifest's, VP4009 if its SHA-256 is not.
        """
        with self._opened(path) as contents:
            data = contents.read()
        self._compare(path, hashlib.sha256(data))
        return data

    def read_start(self, path: str, most: int) -> bytes:
        """Read the first `most` bytes of a file, and compare its size and SHA-256 a block at a time.

        Raises as `read_bytes` does.
        """
        digest, start = hashlib.sha256(), b""
        with self._opened(path) as contents:
            for block in contents.blocks():
                digest.update(block)
                start += block[: most - len(start)]
        self._compare(path, digest)
        return start

    def read_part(self, path: str, begin: int, count: int) -> bytes:
        """Read some bytes of a file that `read_start` has compared. Raises as `read_bytes` does, but for VP4009."""
        with self._opened(path) as contents:
            return contents.part(begin, count)

    def _opened(self, path: str) -> Contents:
        record = self._records.get(path)
        if record is None:
            raise VolprepError("VP4014", path=self._path, file=path)
        contents = open_contents(self._path, path)
        if contents.size_bytes != record.size_bytes:
            contents.file.close()
            size, expected = contents.size_bytes, record.size_bytes
            raise VolprepError("VP4008", path=self._path, file=path, size=size, expected=expected)
        return contents

    def _compare(self, path: str, digest: "hashlib._Hash") -> None:
        if digest.hexdigest() != self._records[path].sha256:
            raise VolprepError("VP4009", path=self._path, file=path)

    def read_text(self, path: str) -> str:
        """Read a text file of the package, in UTF-8. Raises as `read_bytes` does, and VP4011 for other bytes."""
        try:
            return self.read_bytes(path).decode("utf-8")
        except UnicodeDecodeError as error:
            raise VolprepError("VP4011", path=self._path, problem=f"{path} is not UTF-8 text") from error
