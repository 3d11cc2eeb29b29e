"""The preview of a package on trial: nothing is decoded but a picture as volprep writes it, of the size that it has."""

import resource
import struct
import zlib
from types import SimpleNamespace

import numpy as np
import OpenImageIO
import pytest

from volprep.validation.comparison import preview
from volprep_formats.png import png_bytes, png_problem

HEIGHT, WIDTH = 37, 53
_GRADIENT = np.indices((HEIGHT, WIDTH)).sum(axis=0)
PICTURE = np.stack([_GRADIENT * 2, 255 - _GRADIENT, _GRADIENT % 7 * 30], axis=2).astype(np.uint8)
GOOD = png_bytes(PICTURE)
HEAD = 8 + 25 + 13


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def with_chunk(kind: bytes, data: bytes) -> bytes:
    """The picture with one more chunk before its pixels."""
    return GOOD[:HEAD] + chunk(kind, data) + GOOD[HEAD:]


def of_pixels(rows: bytes) -> bytes:
    return GOOD[:HEAD] + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def of_pixels_behind(count: int) -> bytes:
    """Zeros, stored as blocks that are repeated: to compress so many takes a second in each worker."""
    block = zlib.compressobj(wbits=-15)
    zeros = block.compress(bytes(count // 200)) + block.flush(zlib.Z_FULL_FLUSH)
    rows = b"\x78\x9c" + 200 * zeros + b"\x03\x00" + struct.pack(">I", _adler_of_zeros(count))
    return GOOD[:HEAD] + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def _adler_of_zeros(count: int) -> int:
    return (count % 65521) << 16 | 1


def of_size(width: int, height: int) -> bytes:
    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    return GOOD[:8] + chunk(b"IHDR", header) + GOOD[33:]


def jpeg(tmp_path) -> bytes:
    path = tmp_path / "p.jpg"
    assert OpenImageIO.ImageBuf(PICTURE).write(str(path))
    return path.read_bytes()


BAD = {
    "hidden text": with_chunk(b"tEXt", b"Comment\0name of a patient"),
    "hidden text, compressed": with_chunk(b"zTXt", b"Comment\0\0" + zlib.compress(b"name of a patient")),
    "another gamma": with_chunk(b"gAMA", struct.pack(">I", 220000)),
    "a colour profile": with_chunk(b"iCCP", b"p\0\0" + zlib.compress(bytes(128))),
    "a second frame": with_chunk(b"acTL", struct.pack(">2I", 2, 0)),
    "bytes behind the end": GOOD + b"hidden",
    "another file behind the end": GOOD + GOOD,
    "a size that takes 12 GB": of_size(65535, 65535),
    "one row more": of_size(WIDTH, HEIGHT + 1),
    "pixels that take 200 MB": of_pixels_behind(200_000_000),
    "pixels that are too few": of_pixels(bytes(10)),
    "bytes behind the pixels": GOOD[:HEAD] + chunk(b"IDAT", GOOD[HEAD + 8 : -16] + b"hidden") + GOOD[-12:],
    "pixels in two chunks": GOOD[:HEAD] + chunk(b"IDAT", b"") + GOOD[HEAD:],
    "a wrong checksum": GOOD[:-20] + bytes([GOOD[-20] ^ 1]) + GOOD[-19:],
    "interlaced": GOOD[:28] + b"\1" + struct.pack(">I", zlib.crc32(GOOD[12:28] + b"\1")) + GOOD[33:],
    "cut off": GOOD[:-1],
    "nothing": b"",
}


@pytest.mark.parametrize("bad", BAD)
def test_a_file_that_is_not_what_volprep_writes_is_refused_without_decoding_it(bad: str) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert png_problem(BAD[bad], WIDTH, HEIGHT, 3) is not None
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000


def test_a_picture_of_another_kind_is_refused(tmp_path) -> None:
    assert png_problem(jpeg(tmp_path), WIDTH, HEIGHT, 3) is not None
    assert png_problem(png_bytes(PICTURE[..., :1]), WIDTH, HEIGHT, 3) is not None


def test_what_volprep_writes_is_taken() -> None:
    for channels in (1, 3, 4):
        picture = np.resize(PICTURE, (HEIGHT, WIDTH, channels))
        assert png_problem(png_bytes(picture), WIDTH, HEIGHT, channels) is None


def found(shipped: bytes, monkeypatch) -> list[str]:
    """What is found of a preview, if this driver draws `PICTURE`."""
    package = SimpleNamespace(manifest=SimpleNamespace(preview="preview.png"), read_bytes=lambda _name: shipped)
    monkeypatch.setattr(preview, "preview_png", lambda _package: GOOD)
    return [each.problem for each in preview.preview_findings(package)]


def test_another_driver_may_draw_one_step_differently(monkeypatch) -> None:
    noise = np.random.default_rng(1).integers(-1, 2, PICTURE.shape)
    assert found(png_bytes(np.clip(PICTURE.astype(int) + noise, 0, 255).astype(np.uint8)), monkeypatch) == []


@pytest.mark.parametrize("change", ["a patch inverted", "the picture mirrored", "hidden text"])
def test_a_preview_that_shows_something_else_is_found(change: str, monkeypatch) -> None:
    picture = PICTURE.copy()
    picture[9:18, 20:29] = 255 - picture[9:18, 20:29]
    shipped = {"a patch inverted": png_bytes(picture), "the picture mirrored": png_bytes(PICTURE[:, ::-1])} | BAD
    assert len(found(shipped[change], monkeypatch)) == 1
