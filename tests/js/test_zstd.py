"""The decoder of Zstandard in formats/js gives what the library gives, and damaged frames a code."""

import base64
import hashlib
import json
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
from command_line import ended
from npm_package import npm_package
from web_pictures import TWO_STEPS, box_from_clip_of, drawn_by_reference, drawn_in_page, rmse
from web_scenes import EDIT

from volprep_formats.package.reader import Package
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.package.transport import write_converted
from volprep_formats.progress import Silent
from volprep_formats.textures import ktx2
from volprep_formats.textures.zstd_frames import FRAME_BYTES, FrameError, decompress

THREE = "0.187.0"
HERE = Path(__file__).parent
LEVELS = (1, 3, 7, 12, 19)


def unpacked(rows: list[tuple[int, bytes]]) -> list[tuple[str, float]]:
    """What formats/js says of frames that must hold so many bytes: digest or code; and the milliseconds it took."""
    lines = "".join(f"{size} {base64.b64encode(frames).decode()}\n" for size, frames in rows)
    command = ["node", str(HERE / "unpack.mjs")]
    done = ended(command, input=lines, timeout=240)
    assert done.returncode == 0, done.stderr
    return [tuple(json.loads(line)) for line in done.stdout.splitlines()]


def kinds() -> dict[str, bytes]:
    """Bytes that make encoders use every kind of block, of literals and of tables."""
    rng = np.random.default_rng(5)
    words = [rng.integers(0, 256, n, dtype=np.uint8).tobytes() for n in rng.integers(3, 60, 90)]
    z, y, x = np.indices((40, 60, 70))
    return {
        "one byte": b"a",
        "constant": bytes(200_000),
        "noise": rng.integers(0, 256, 150_000, dtype=np.uint8).tobytes(),
        "few values": rng.choice([0, 1, 7], 300_000, p=[0.9, 0.05, 0.05]).astype("u1").tobytes(),
        "words": b"".join(words[i] for i in rng.integers(0, 90, 9000)),
        "smooth volume": (90 + 60 * np.sin(x / 9) * np.cos(y / 7 + z / 5)).astype("u1").tobytes(),
        "noisy volume": (90 + x + rng.normal(0, 3, x.shape)).astype("<u2").tobytes(),
        "half floats": rng.normal(0, 3, 90_000).astype("<f2").tobytes(),
        "long matches": b"abcde" + b"xy" * 70_000 + bytes(range(256)) * 300,
        "text": Path(__file__).read_bytes() * 5,
        "several frames": (np.arange(2 * FRAME_BYTES + 77) // 37 % 251).astype("u1").tobytes(),
    }


def in_frames(data: bytes, level: int) -> bytes:
    return b"".join(
        imagecodecs.zstd_encode(data[at : at + FRAME_BYTES], level=level) for at in range(0, len(data), FRAME_BYTES)
    )


def test_every_kind_of_block_is_unpacked_as_the_library_does() -> None:
    datas = [data for data in kinds().values() for _ in LEVELS]
    rows = [(len(data), in_frames(data, level)) for data in kinds().values() for level in LEVELS]
    assert [said for said, _ in unpacked(rows)] == [hashlib.sha256(data).hexdigest() for data in datas]


def test_damaged_frames_give_a_code_or_what_the_library_gives() -> None:
    rng = np.random.default_rng(11)
    rows = []
    for data in (each[:6000] for each in kinds().values()):
        for level in (1, 7, 19):
            sound = in_frames(data, level)
            rows.append((len(data), sound))
            for k in range(60):
                damaged = bytearray(sound)
                # Most of what can go wrong stands in heads and tables, near the start.
                reach = len(sound) if k % 3 else min(len(sound), 40)
                for at in rng.integers(0, reach, 1 + k % 3):
                    damaged[at] = rng.integers(0, 256)
                rows.append((len(data), bytes(damaged[: rng.integers(1, reach + 1)] if k % 10 == 9 else damaged)))
    said = unpacked(rows)
    drawn = 0
    for (size, frames), (found, took) in zip(rows, said, strict=True):
        assert took < 5000
        try:
            wanted = hashlib.sha256(decompress(memoryview(frames), size).tobytes()).hexdigest()
        except FrameError:
            wanted = "VP4030"
        # Where the library takes what RFC 8878 does not allow, a code is right, too.
        assert found in {wanted, "VP4030"}
        drawn += found == wanted != "VP4030"
    assert drawn > 33 + 200


def test_a_bomb_is_refused_before_it_is_unpacked() -> None:
    mebibyte = imagecodecs.zstd_encode(bytes(FRAME_BYTES), level=7)
    huge = b"\x28\xb5\x2f\xfd\xe0" + (1 << 40).to_bytes(8, "little") + b"\x03\x00\x10\x00"
    said = unpacked([(1000, mebibyte), (1000, huge), (FRAME_BYTES, mebibyte * 3), (FRAME_BYTES, mebibyte)])
    assert [code for code, _ in said[:3]] == ["VP4030"] * 3
    assert said[3][0] == hashlib.sha256(bytes(FRAME_BYTES)).hexdigest()


def test_an_offset_that_leads_before_the_frame_is_refused() -> None:
    noise = np.random.default_rng(1).integers(0, 256, 1 << 17, dtype=np.uint8).tobytes()
    sound = imagecodecs.zstd_encode(noise + noise, level=3)
    # Its second block repeats the first, which lies as far back as a block is long.
    second = sound.index(noise) + len(noise)
    lies = b"\x28\xb5\x2f\xfd\xa0" + ((1 << 17) + 10).to_bytes(4, "little") + b"\x50\0\0" + noise[:10] + sound[second:]
    assert [said for said, _ in unpacked([(1 << 18, sound), ((1 << 17) + 10, lies)])] == [
        hashlib.sha256(noise + noise).hexdigest(),
        "VP4030",
    ]


@pytest.fixture(scope="module")
def travelling(scene_package, tmp_path_factory):
    """A package with its textures as frames, by the name of its scene: a folder and a zip."""

    def convert(name: str) -> tuple[Package, Path]:
        folder = tmp_path_factory.mktemp("travelling")
        package = scene_package(name)
        names = write_converted(package, "zstd", folder / "p.volpkg", Silent())
        with (folder / "p.volpkg.zip").open("wb") as file:
            write_single_file(folder / "p.volpkg", names, file, Silent())
        return Package.open(folder / "p.volpkg"), folder / "p.volpkg.zip"

    return convert


def packed_textures(package: Package) -> list[str]:
    return [
        each.file
        for each in package.manifest.textures
        if ktx2.is_supercompressed(package.read_start(each.file, ktx2.HEADER_BYTES))
    ]


@pytest.mark.long
@pytest.mark.parametrize("name", ["mipmaps", "mosaic of several textures", "ETC2"])
def test_a_page_draws_it_as_the_plain_package(browser, server, scene_package, travelling, name) -> None:
    package, zipped = travelling(name)
    assert packed_textures(package)
    matrices = box_from_clip_of(package)[::4]
    kind = "webgl2" if package.manifest.profile.api == "es3.0" else "webgl"
    wanted = drawn_by_reference(scene_package(name), matrices)
    for path in (package.path, zipped):
        found = drawn_in_page(browser, server, path, matrices, kind=kind)
        assert found.said["error"] == 0
        assert max(map(rmse, found.pictures, wanted)) < TWO_STEPS


def test_edits_read_packed_tables_and_ranges(browser, server, scene_package, travelling) -> None:
    package, _ = travelling("editable mosaic")
    matrices = box_from_clip_of(package)[:2]
    edit = {"points": EDIT}
    plain = drawn_in_page(browser, server, scene_package("editable mosaic").path, matrices, kind="webgl", edit=edit)
    found = drawn_in_page(browser, server, package.path, matrices, kind="webgl", edit=edit)
    for one, other in zip(found.pictures, plain.pictures, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.long
def test_nothing_is_unpacked_by_packages_without_frames(browser, server, scene_package, travelling) -> None:
    def loaded(path: Path) -> bool:
        browser.open(f"{server.url}/")
        drawn_in_page(browser, server, path, box_from_clip_of(scene_package("mipmaps"))[:1])
        return bool(
            browser.run("return performance.getEntriesByType('resource').some(({ name }) => name.endsWith('zstd.js'))")
        )

    assert not loaded(scene_package("mipmaps").path)
    assert loaded(travelling("mipmaps")[0].path)


def test_three_js_reads_the_textures(browser, server, tmp_path) -> None:
    texels = (np.indices((50, 60, 70)).sum(0) // 3 % 200).astype("u1")
    plain = b"".join(ktx2.encode(ktx2.Ktx2Image("r8unorm", texels.shape, texels, 3)))
    frames = ktx2.supercompressed(plain, "t")
    # Several frames in a row, as large levels have them.
    assert len(frames) < len(plain) // 2
    large = (np.arange(2 * FRAME_BYTES) // 999 % 256).astype("u1").reshape(2, 1024, 1024)
    packed = ktx2.supercompressed(b"".join(ktx2.encode(ktx2.Ktx2Image("r8unorm", large.shape, large, 3))), "t")
    (tmp_path / "one.ktx2").write_bytes(frames)
    (tmp_path / "two.ktx2").write_bytes(packed)
    server.folders["textures"] = tmp_path
    server.folders["three-all"] = npm_package("three", THREE) / "node_modules" / "three"
    server.folders["three"] = npm_package("three", THREE) / "node_modules" / "three"
    browser.open(f"{server.url}/")
    script = """
    const THREE = await import("three");
    const { KTX2Loader } = await import("/three-all/examples/jsm/loaders/KTX2Loader.js");
    const renderer = new THREE.WebGLRenderer({ canvas: new OffscreenCanvas(4, 4) });
    const loader = new KTX2Loader().detectSupport(renderer);
    const found = [];
    for (const name of ["one", "two"]) {
      const { image } = await loader.loadAsync(`/textures/${name}.ktx2`);
      const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", image.data));
      const hexadecimal = Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
      found.push([image.width, image.height, image.depth, hexadecimal]);
    }
    renderer.dispose();
    return found;
    """
    assert browser.run(script) == [
        [70, 60, 50, hashlib.sha256(texels.tobytes()).hexdigest()],
        [1024, 1024, 2, hashlib.sha256(large.tobytes()).hexdigest()],
    ]
