"""Sizes that compressed pictures declare, before anything is decoded."""

import struct
from pathlib import Path

import numpy as np
import pytest
from dicom_files import compressed, image, save
from pydicom import dcmread
from pydicom.encaps import get_frame
from pydicom.uid import JPEG2000Lossless, JPEGLSLossless, RLELossless

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.dicom.codestreams import Declared, declared
from volprep_formats.source import SourceSpec

pytestmark = pytest.mark.usefixtures("kept_workers")

SIZES = (JPEG2000Lossless, JPEGLSLossless)
SIZE_AT = {JPEG2000Lossless: (b"\xff\x51", 6, ">LL"), JPEGLSLossless: (b"\xff\xf7", 5, ">HH")}


def picture():
    pixels = np.random.default_rng(2).integers(0, 4000, (40, 37)).astype(np.uint16)
    return image(pixels, BitsStored=12, HighBit=11, SliceThickness="1")


def segment(marker: int, content: bytes) -> bytes:
    return bytes((0xFF, marker)) + struct.pack(">H", len(content) + 2) + content


def frame_header(marker: int, rows: int, columns: int, components: int) -> bytes:
    return segment(marker, struct.pack(">BHHB", 8, rows, columns, components) + bytes(3 * components))


@pytest.mark.parametrize("syntax", SIZES)
def test_the_size_is_that_of_the_picture(syntax) -> None:
    frame = get_frame(compressed(picture(), syntax).PixelData, 0, number_of_frames=1)
    found = declared(frame)
    assert (found.rows, found.columns, found.components) == (40, 37, 1)
    assert (found.precision, found.signed) == ({JPEG2000Lossless: 12, JPEGLSLossless: 16}[syntax], False)


def test_runs_declare_no_size() -> None:
    assert declared(get_frame(compressed(picture(), RLELossless).PixelData, 0, number_of_frames=1)) is None


@pytest.mark.parametrize("marker", [0xC0, 0xC1, 0xC2, 0xC3, 0xCF, 0xF7])
def test_every_kind_of_frame_is_found_behind_other_segments_and_fill_bytes(marker) -> None:
    data = b"\xff\xd8" + segment(0xE0, b"JFIF\0") + b"\xff\xff" + segment(0xC4, bytes(30)) + segment(0xDB, bytes(65))
    kinds = {0xC0: "sequential DCT", 0xC1: "sequential DCT", 0xC3: "lossless", 0xF7: "JPEG-LS"}
    kind = kinds.get(marker, "another process of JPEG")
    assert declared(data + frame_header(marker, 300, 65535, 3)) == Declared(kind, 300, 65535, 3, 8, signed=False)


def test_the_grid_of_jpeg_2000_may_begin_anywhere_and_the_file_may_have_boxes() -> None:
    stream = b"\xff\x4f\xff\x51" + struct.pack(">HH8LH", 41, 0, 1100, 700, 100, 200, 64, 64, 0, 0, 2) + b"\7\1\1" * 2
    found = Declared("JPEG 2000", 500, 1000, 2, 8, signed=False, tiles=198)
    assert declared(stream) == found
    assert declared(b"\0\0\0\x0cjP  \r\n\x87\n" + bytes(73) + stream) == found


def test_the_sign_of_jpeg_2000_is_the_first_bit_of_its_depth() -> None:
    stream = b"\xff\x4f\xff\x51" + struct.pack(">HH8LH", 41, 0, 9, 9, 0, 0, 9, 9, 0, 0, 1) + b"\x8b\1\1"
    assert (declared(stream).precision, declared(stream).signed) == (12, True)


def test_every_beginning_of_a_codestream_is_read_without_an_error() -> None:
    for data in (
        b"\xff\x4f\xff\x51" + struct.pack(">HH8LH", 41, 0, 9, 9, 0, 0, 9, 9, 0, 0, 1),
        b"\xff\xd8" + segment(0xE0, b"JFIF\0") + frame_header(0xC0, 3, 4, 1),
        b"\xff\xd8" + segment(0xDA, bytes(20)),
        b"\xff\xd8" + b"\xff" * 40,
        b"\xff\xd8" + bytes(40),
    ):
        for size in range(len(data)):
            assert declared(data[:size]) in {None, Declared("sequential DCT", 3, 4, 1, 8, signed=False)}


@pytest.mark.parametrize("syntax", SIZES)
def test_data_that_declare_more_than_the_header_are_refused_with_both_sizes(tmp_path, syntax) -> None:
    file = save(compressed(picture(), syntax), tmp_path / "slice", syntax)
    data = bytearray(file.read_bytes())
    marker, offset, form = SIZE_AT[syntax]
    struct.pack_into(form, data, data.index(marker) + offset, 60_000, 60_000)
    file.write_bytes(data)
    with open_source(SourceSpec(path=str(file)), Path(), Silent()) as source, pytest.raises(VolprepError) as error:
        source.read_slab(0, 1)
    assert error.value.code == "VP1046"
    assert "37×40" in str(error.value)
    assert "60000×60000" in str(error.value)


def test_the_compressed_scans_declare_what_their_headers_say(scans) -> None:
    found = 0
    for path in sorted((scans / "dicom_compressed_series").rglob("*")):
        if path.is_file() and path.read_bytes()[128:132] == b"DICM":
            data = dcmread(path)
            if data.file_meta.TransferSyntaxUID.is_encapsulated:
                said = declared(get_frame(data.PixelData, 0, number_of_frames=1))
                if said is not None:
                    found += 1
                    size = (said.rows, said.columns, said.components)
                    assert size == (data.Rows, data.Columns, data.SamplesPerPixel)
    assert found > 10
