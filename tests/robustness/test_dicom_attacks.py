"""DICOM files made to break readers, one of each class that was found in readers of DICOM and of its codecs.

Fragments longer than the file, sizes whose product overflows, JPEG 2000 with more tiles than there can be, run lengths
whose segments lie elsewhere, sequences within sequences without end, tables and presets beyond their data. Each is
refused with a code, soon, and without the memory that it asks for.
"""

import os
import struct
import time
from collections.abc import Callable
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
from dicom_files import compressed, encoded, image, save
from pydicom.dataset import Dataset
from pydicom.uid import JPEG2000Lossless, JPEGBaseline8Bit, JPEGLosslessSV1, JPEGLSLossless, RLELossless

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.dicom.listing import list_series
from volprep_formats.source import SourceSpec

from .mutations import outcome

pytestmark = pytest.mark.usefixtures("kept_workers")

SECONDS = 20.0
MEMORY_BYTES = 300e6
PIXELS = np.random.default_rng(8).integers(0, 4096, (40, 36)).astype(np.uint16)
LARGE = 16384
ENCODED = {syntax: encoded(PIXELS, syntax, 16) for syntax in (RLELossless, JPEGLSLossless, JPEG2000Lossless)}
ENCODED[JPEGLosslessSV1] = encoded(PIXELS, JPEGLosslessSV1, 16)
ENCODED[JPEGBaseline8Bit] = bytes(imagecodecs.jpeg8_encode(PIXELS.astype(np.uint8)))

Change = Callable[[bytearray], None]
Attack = tuple[str, str, Change, dict[str, int]]


def most_memory() -> dict[str, int]:
    """Most bytes that this process and each of its workers ever had, by process."""
    pids = ["self", *Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()]
    found = {}
    for pid in pids:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
        found[pid] = next((int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:")), 0)
    return found


def refusal(path: Path) -> str:
    """Code of the error, which must come soon and without much memory."""
    before = most_memory()
    start = time.perf_counter()
    with pytest.raises(VolprepError) as error, open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
        source.read_slab(0, source.info.grid.shape_zyx[0])
    assert time.perf_counter() - start < SECONDS
    for pid, most in most_memory().items():
        assert most - before.get(pid, 0) < MEMORY_BYTES, f"{(most - before.get(pid, 0)) / 1e6:.0f} MB more"
    return error.value.code


def pack(at: int, form: str, *values: int, marker: bytes = b"") -> Change:
    """Write numbers at a place, or so far behind a marker."""

    def change(data: bytearray) -> None:
        struct.pack_into(form, data, at + (data.index(marker) if marker else 0), *values)

    return change


def all_of(*changes: Change) -> Change:
    def change(data: bytearray) -> None:
        for one in changes:
            one(data)

    return change


SIZ, COD, SOT = b"\xff\x51", b"\xff\x52", b"\xff\x90"
LARGE_GRID = pack(6, ">LL", LARGE, LARGE, marker=SIZ)
LARGE_HEADER = {"Rows": LARGE, "Columns": LARGE}
ONE_TILE = pack(22, ">LL", LARGE, LARGE, marker=SIZ)
ATTACKS: list[Attack] = [
    ("a large grid of one large tile", JPEG2000Lossless, all_of(LARGE_GRID, ONE_TILE), LARGE_HEADER),
    ("tiles of one pixel", JPEG2000Lossless, all_of(LARGE_GRID, pack(22, ">LL", 1, 1, marker=SIZ)), LARGE_HEADER),
    ("65536 tiles", JPEG2000Lossless, all_of(LARGE_GRID, pack(22, ">LL", 64, 64, marker=SIZ)), LARGE_HEADER),
    ("64000 tiles", JPEG2000Lossless, all_of(LARGE_GRID, pack(22, ">LL", 64, 66, marker=SIZ)), LARGE_HEADER),
    ("tiles of no size", JPEG2000Lossless, pack(22, ">LL", 0, 0, marker=SIZ), {}),
    ("tiles that begin beyond the picture", JPEG2000Lossless, pack(30, ">LL", 2**31, 2**31, marker=SIZ), {}),
    ("a picture that ends before it begins", JPEG2000Lossless, pack(14, ">LL", 2**31, 2**31, marker=SIZ), {}),
    ("16384 components", JPEG2000Lossless, pack(38, ">H", 16384, marker=SIZ), {}),
    ("128 bits", JPEG2000Lossless, pack(40, ">B", 0x7F, marker=SIZ), {}),
    ("subsampled by nothing", JPEG2000Lossless, pack(41, ">BB", 0, 0, marker=SIZ), {}),
    ("subsampled by 255", JPEG2000Lossless, pack(41, ">BB", 255, 255, marker=SIZ), {}),
    ("255 resolutions", JPEG2000Lossless, pack(9, ">B", 255, marker=COD), {}),
    ("blocks of 2^17 pixels", JPEG2000Lossless, pack(10, ">BB", 15, 15, marker=COD), {}),
    ("a tile that is not there", JPEG2000Lossless, pack(4, ">H", 65534, marker=SOT), {}),
    ("a part of a tile as long as can be", JPEG2000Lossless, pack(6, ">L", 2**32 - 1, marker=SOT), {}),
    ("a part of a tile shorter than its header", JPEG2000Lossless, pack(6, ">L", 3, marker=SOT), {}),
    ("a segment beyond the data", RLELossless, pack(8, "<L", 2**32 - 1), {}),
    ("segments in reverse", RLELossless, pack(4, "<LL", 1000, 64), {}),
    ("a segment within the header", RLELossless, pack(4, "<L", 4), {}),
    ("no segments", RLELossless, pack(0, "<L", 0), {}),
    ("four billion segments", RLELossless, pack(0, "<L", 2**32 - 1), {}),
    ("a large picture of few runs", RLELossless, lambda data: None, LARGE_HEADER),
    ("a large picture of few bits", JPEGLosslessSV1, pack(5, ">HH", LARGE, LARGE, marker=b"\xff\xc3"), LARGE_HEADER),
    ("a large picture of few blocks", JPEGBaseline8Bit, pack(5, ">HH", LARGE, LARGE, marker=b"\xff\xc0"), LARGE_HEADER),
    ("a picture without rows", JPEGBaseline8Bit, pack(5, ">H", 0, marker=b"\xff\xc0"), {}),
    ("0 bits", JPEGLosslessSV1, pack(4, ">B", 0, marker=b"\xff\xc3"), {}),
    ("255 bits", JPEGLosslessSV1, pack(4, ">B", 255, marker=b"\xff\xc3"), {}),
    ("a table of codes with 4080 codes", JPEGLosslessSV1, pack(5, ">16B", *[255] * 16, marker=b"\xff\xc4"), {}),
    ("a predictor that is not there", JPEGLosslessSV1, pack(7, ">B", 99, marker=b"\xff\xda"), {}),
    ("a scan of four components", JPEGBaseline8Bit, pack(4, ">B", 4, marker=b"\xff\xda"), {}),
    ("255 bits in JPEG-LS", JPEGLSLossless, pack(4, ">B", 255, marker=b"\xff\xf7"), {}),
    ("near by 255", JPEGLSLossless, pack(7, ">B", 255, marker=b"\xff\xda"), {}),
    ("interleaved in a way that is not there", JPEGLSLossless, pack(8, ">B", 9, marker=b"\xff\xda"), {}),
]  # fmt: skip


@pytest.mark.parametrize("attack", ATTACKS, ids=[f"{name} {k}" for k, (name, *_) in enumerate(ATTACKS)])
def test_a_hostile_codestream_is_refused_soon_and_with_little_memory(tmp_path, attack) -> None:
    _, syntax, change, told = attack
    frame = bytearray(ENCODED[syntax])
    change(frame)
    pixels = PIXELS.astype(np.uint8) if syntax == JPEGBaseline8Bit else PIXELS
    data = compressed(image(pixels, SliceThickness="1"), syntax, bytes(frame))
    data.update(told)
    save(data, tmp_path / "a", syntax)
    assert refusal(tmp_path / "a") in {"VP1039", "VP1040", "VP1046", "VP1047", "VP1049"}


def test_layers_of_jpeg_2000_that_are_not_there_change_nothing(tmp_path) -> None:
    frame = bytearray(ENCODED[JPEG2000Lossless])
    pack(6, ">H", 65535, marker=COD)(frame)
    save(
        compressed(image(PIXELS, SliceThickness="1"), JPEG2000Lossless, bytes(frame)), tmp_path / "a", JPEG2000Lossless
    )
    with open_source(SourceSpec(path=str(tmp_path / "a")), Path(), Silent()) as source:
        assert np.array_equal(source.read_slab(0, 1)[0], PIXELS)


@pytest.mark.parametrize("length", [0xFFFFFFFF, 0xFFFFFFFE, 0x80000000, 0x7FFFFFFF, 100_000])
@pytest.mark.parametrize("item", [0, 1], ids=["table", "fragment"])
def test_a_fragment_that_is_longer_than_the_file_is_refused(tmp_path, item, length) -> None:
    file = save(compressed(image(PIXELS, SliceThickness="1"), JPEGLSLossless), tmp_path / "a", JPEGLSLossless)
    data = bytearray(file.read_bytes())
    at = data.index(b"\xfe\xff\x00\xe0")
    at = data.index(b"\xfe\xff\x00\xe0", at + 8) if item else at
    struct.pack_into("<L", data, at + 4, length)
    file.write_bytes(data)
    assert refusal(file) == "VP1031"


@pytest.mark.long
def test_fragments_without_end_are_refused(tmp_path) -> None:
    file = save(compressed(image(PIXELS, SliceThickness="1"), RLELossless), tmp_path / "a", RLELossless)
    data = file.read_bytes()
    file.write_bytes(data[: data.index(b"\xfe\xff\x00\xe0")] + b"\xfe\xff\x00\xe0\0\0\0\0" * 1_100_000)
    assert refusal(file) == "VP1031"


@pytest.mark.parametrize("length", [0xFFFFFFFE, 0x80000000, 2 * PIXELS.size + 2**31])
def test_pixels_longer_than_the_file_are_refused(tmp_path, length) -> None:
    file = save(image(PIXELS, SliceThickness="1"), tmp_path / "a")
    data = bytearray(file.read_bytes())
    struct.pack_into("<L", data, len(data) - 2 * PIXELS.size - 4, length)
    file.write_bytes(data)
    assert refusal(file) == "VP1031"


@pytest.mark.parametrize(
    ("told", "code"),
    [
        ({"Rows": 65535, "Columns": 65535}, "VP1044"),
        ({"Rows": LARGE, "Columns": LARGE}, "VP1040"),
        ({"Rows": 0}, "VP1037"),
        ({"Rows": 32768, "Columns": 2, "BitsAllocated": 32, "BitsStored": 32, "HighBit": 31}, "VP1040"),
        ({"NumberOfFrames": "2147483647"}, "VP1041"),
        ({"NumberOfFrames": "-1"}, "VP1041"),
        ({"NumberOfFrames": "1048576", "Rows": LARGE, "Columns": LARGE}, "VP1041"),
        ({"SamplesPerPixel": 65535}, "VP1037"),
        ({"BitsStored": 17}, "VP1037"),
        ({"BitsStored": 0}, "VP1037"),
    ],
    ids=str,
)
def test_sizes_whose_product_is_not_there_are_refused(tmp_path, told, code) -> None:
    data = image(PIXELS, SliceThickness="1")
    data.update(told)
    assert refusal(save(data, tmp_path / "a")) == code


@pytest.mark.parametrize("depth", [7, 9, 300, 3000])
def test_sequences_within_sequences_are_read_or_refused(tmp_path, depth) -> None:
    file = save(image(PIXELS, SliceThickness="1"), tmp_path / "a")
    data = file.read_bytes()
    begin = b"\x40\0\x75\x02SQ\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff"
    end = b"\xfe\xff\x0d\xe0\0\0\0\0\xfe\xff\xdd\xe0\0\0\0\0"
    at = len(data) - 2 * PIXELS.size - 12
    file.write_bytes(data[:at] + begin * depth + end * depth + data[at:])

    def read(path: Path) -> None:
        with open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
            assert np.array_equal(source.read_slab(0, 1)[0], PIXELS)

    assert outcome(file, read, f"depth {depth}") in ({"read"} if depth < 100 else {"read", "VP1032"})


def test_a_table_of_values_larger_than_its_data_is_refused(tmp_path) -> None:
    item = Dataset()
    item.add_new("LUTDescriptor", "US", [0, 0, 16])
    item.add_new("LUTData", "OW", bytes(64))
    assert refusal(save(image(PIXELS, SliceThickness="1", ModalityLUTSequence=[item]), tmp_path / "a")) == "VP1050"


def test_an_overlay_larger_than_its_data_is_not_looked_at(tmp_path) -> None:
    data = image(PIXELS, SliceThickness="1")
    data.add_new(0x6000_0010, "US", 65535)
    data.add_new(0x6000_0011, "US", 65535)
    data.add_new(0x6000_3000, "OW", bytes(4))
    with open_source(SourceSpec(path=str(save(data, tmp_path / "a"))), Path(), Silent()) as source:
        assert np.array_equal(source.read_slab(0, 1)[0], PIXELS)


HOSTILE = "1.2.3\x1b[2J\nvolprep: all is well\r4"


def test_a_hostile_uid_is_refused_and_never_shown_as_it_is(tmp_path) -> None:
    file = save(image(PIXELS, SliceThickness="1"), tmp_path / "a")
    data = file.read_bytes()
    uid = b"1.2.826.0.1.3680043.9.1\0"
    bad = HOSTILE.encode()[: len(uid)]
    assert len(bad) == len(uid)
    file.write_bytes(data.replace(uid, bad))
    with pytest.raises(VolprepError) as error, open_source(SourceSpec(path=str(file)), Path(), Silent()):
        pass
    assert error.value.code == "VP1052"
    listed = list_series(tmp_path, Silent()).series[0]
    shown = f"{error.value}{listed.uid}{listed.ending}{listed.problems[0].summary}"
    assert not set(shown) & set("\x1b\n\r")
    assert listed.uid.startswith("1.2.3\\x1b[2J\\nvolprep")
