"""Textures as Zstandard frames: what they hold is the same, they read like plain ones, and no bomb is unpacked."""

import hashlib
import json
import shutil
import struct
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
import scene_builds
from command_line import volprep
from phantom_scene import write_phantom_scene

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.manifest_json import encode_manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.textures import ktx2
from volprep_formats.textures.zstd_frames import FRAME_BYTES, FrameError, compress, decompress, frames


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("transport")
    target = folder / "p.volpkg"
    scene = write_phantom_scene(folder, "gles3", more='\n[grid]\nsize = 12\nlayout = "both"\n')
    scene_builds.built(scene, target)
    return target


def zipped(package: Path, target: Path, texels: str) -> Package:
    done = volprep("zip", package, "-o", target, "--texels", texels)
    assert done.returncode == 0, done.stderr
    return Package.open(target)


def texture(shape_zyx: tuple[int, int, int], levels: int = 1, kind: ktx2.Ktx2Format = "r8unorm") -> bytes:
    finest, *coarser = (
        (np.indices(ktx2.mipmap_shape(shape_zyx, level)).sum(0) // 3 % 100).astype("u1" if kind == "r8unorm" else "<f2")
        for level in range(levels)
    )
    return b"".join(ktx2.encode(ktx2.Ktx2Image(kind, shape_zyx, finest, 3, tuple(coarser))))


def test_a_package_that_travels_smaller_has_the_same_texels(built: Path, tmp_path: Path) -> None:
    small = zipped(built, tmp_path / "small.volpkg.zip", "zstd")
    assert check(small.path) == []
    whole = Package.open(built)
    packed = set()
    for record in whole.manifest.files:
        one, other = whole.read_bytes(record.path), small.read_bytes(record.path)
        if one != other:
            packed.add(record.path)
            assert len(other) <= 0.9 * len(one)
            assert ktx2.plain(other, record.path) == one
            for a, b in zip(ktx2.decode(one, "").levels, ktx2.decode(other, "").levels, strict=True):
                np.testing.assert_array_equal(a, b)
    assert {each.partition("/")[0] for each in packed} == {"subvolumes", "textures"}
    # Any box is cut from the whole level by seeking.
    assert whole.manifest.subvolumes.whole not in packed
    sizes = {record.path: record.size_bytes for record in small.manifest.files}
    for item in small.manifest.plan:
        assert not item.files or item.size_bytes == sum(sizes[path] for path in item.files)


def test_a_whole_level_that_no_box_can_be_cut_from_is_refused(built: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(built, tmp_path / "copy.volpkg"))
    manifest = Package.open(copy).manifest
    whole = manifest.subvolumes.whole
    data = ktx2.supercompressed((copy / whole).read_bytes(), whole)
    (copy / whole).write_bytes(data)
    files = tuple(
        each.model_copy(update={"size_bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()})
        if each.path == whole
        else each
        for each in manifest.files
    )
    (copy / MANIFEST).write_bytes(encode_manifest(manifest.model_copy(update={"files": files})))
    assert [each.code for each in check(copy)] == ["VP4011"]


def test_there_and_back_gives_the_same_bytes(built: Path, tmp_path: Path) -> None:
    one = zipped(built, tmp_path / "one.volpkg.zip", "as-is")
    small = zipped(built, tmp_path / "small.volpkg.zip", "zstd")
    back = zipped(small.path, tmp_path / "back.volpkg.zip", "plain")
    assert back.path.read_bytes() == one.path.read_bytes()
    again = zipped(small.path, tmp_path / "again.volpkg.zip", "zstd")
    assert again.path.read_bytes() == small.path.read_bytes()


@pytest.mark.long
def test_what_was_built_is_proved_as_it_travels(built: Path) -> None:
    # The origin beside the package is also that of its single file.
    small = zipped(built, built.with_name("p.volpkg.zip"), "zstd")
    done = volprep("validate", small.path, "--report", built.with_name("report"), "--size", "48", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["derivation"]["findings"] == []


@pytest.mark.parametrize(("shape", "levels", "kind"), [((5, 40, 30), 1, "r8unorm"), ((16, 32, 36), 3, "r16float")])
def test_textures_come_back_as_they_were(shape, levels, kind) -> None:
    plain = texture(shape, levels, kind)
    packed = ktx2.supercompressed(plain, "t")
    assert ktx2.plain(packed, "t") == plain
    assert ktx2.supercompressed(packed, "t") == packed
    assert ktx2.plain(plain, "t") == plain


def test_frames_hold_a_mebibyte_each() -> None:
    data = (np.arange(2 * FRAME_BYTES + 77) // 1000 % 256).astype(np.uint8).tobytes()
    packed = b"".join(compress(memoryview(data)))
    assert [each.content_bytes for each in frames(memoryview(packed))] == [FRAME_BYTES, FRAME_BYTES, 77]
    assert decompress(memoryview(packed), len(data)).tobytes() == data


def _bomb() -> bytes:
    """A frame of one MiB of zeros, in 3 + 3 · 8 bytes, that says that it holds 64 GiB."""
    return b"\x28\xb5\x2f\xfd" + bytes([0xE0]) + struct.pack("<Q", 1 << 36) + b"\x03\x00\x10\x00"


@pytest.mark.parametrize(
    "damaged",
    [
        _bomb(),
        b"",
        b"\x28\xb5\x2f\xfd",
        imagecodecs.zstd_encode(bytes(1000))[:-1],
        imagecodecs.zstd_encode(bytes(1000)) + b"\0",
        imagecodecs.zstd_encode(bytes(999)),
        imagecodecs.zstd_encode(bytes(FRAME_BYTES + 1)),
        b"\x50\x2a\x4d\x18\x04\0\0\0abcd" + imagecodecs.zstd_encode(bytes(1000)),
        # The head says 1000, the blocks hold 2000.
        imagecodecs.zstd_encode(bytes(1000))[:7] + imagecodecs.zstd_encode(bytes(2000))[7:],
    ],
    ids=["bomb", "empty", "head", "cut off", "more", "too little", "too large", "skippable", "lies"],
)
def test_frames_that_are_not_as_they_must_be_are_refused(damaged: bytes) -> None:
    with pytest.raises(FrameError):
        decompress(memoryview(damaged), 1000)


def test_a_texture_that_says_more_than_its_shape_holds_is_refused() -> None:
    packed = bytearray(ktx2.supercompressed(texture((5, 40, 30)), "t"))
    struct.pack_into("<Q", packed, 80 + 16, 1 << 40)
    with pytest.raises(VolprepError, match="VP4030"):
        ktx2.decode(bytes(packed), "t")


def test_the_descriptor_of_older_editions_of_ktx_2_is_read() -> None:
    packed = bytearray(ktx2.supercompressed(texture((5, 40, 30)), "t"))
    packed[80 + 24 + 20] = 0
    assert ktx2.plain(bytes(packed), "t") == texture((5, 40, 30))
    plain = bytearray(texture((5, 40, 30)))
    plain[80 + 24 + 20] = 0
    with pytest.raises(VolprepError, match="descriptor"):
        ktx2.decode(bytes(plain), "t")
