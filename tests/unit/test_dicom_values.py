"""What the values of DICOM slices mean: tables in the header, and what compressed data say of their bits and sign."""

from pathlib import Path

import imagecodecs
import numpy as np
import pytest
from dicom_files import compressed, image, save, save_all
from pydicom.dataset import Dataset
from pydicom.encaps import encapsulate, get_frame
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGBaseline8Bit,
    JPEGExtended12Bit,
    JPEGLossless,
    JPEGLosslessSV1,
    JPEGLSLossless,
    RLELossless,
)

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec

pytestmark = pytest.mark.usefixtures("kept_workers")

NATIVE = [ImplicitVRLittleEndian, ExplicitVRLittleEndian, ExplicitVRBigEndian, DeflatedExplicitVRLittleEndian]
DOWN = list(range(400, 0, -100))
PIXELS = np.array([[0, 5, 6, 7], [8, 9, 200, 1]], np.uint8)


def read(folder: Path) -> tuple[np.ndarray, object]:
    with open_source(SourceSpec(path="."), folder, Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0]), source.info


def refusal(folder: Path) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        read(folder)
    return error.value


def table(entries, first: int = 5, *, bits: int = 16, count: int | None = None, order: str = "<", kind: str = "US"):
    item = Dataset()
    item.add_new("LUTDescriptor", kind, [len(entries) if count is None else count, first, bits])
    item.ModalityLUTType = kind
    item["ModalityLUTType"].value = "HU" if kind == "SS" else "US"
    item.add_new("LUTData", "OW", np.asarray(entries, f"{order}u2").tobytes())
    return [item]


@pytest.mark.parametrize("syntax", NATIVE)
def test_a_table_of_values_is_applied_though_it_turns_the_scan_round(tmp_path, syntax) -> None:
    order = ">" if syntax == ExplicitVRBigEndian else "<"
    save(image(PIXELS, SliceThickness="1", ModalityLUTSequence=table(DOWN, order=order)), tmp_path / "a", syntax)
    values, info = read(tmp_path)
    assert values[0].tolist() == [[400, 400, 300, 200], [100, 100, 100, 400]]
    assert (info.stored_type, info.slope, info.intercept) == ("uint16", 1.0, 0.0)
    assert any("ModalityLUTSequence" in remark for remark in info.remarks)


def test_a_table_is_applied_whether_its_sequence_says_its_length_or_not(tmp_path) -> None:
    data = image(PIXELS, SliceThickness="1", ModalityLUTSequence=table(DOWN))
    data["ModalityLUTSequence"].is_undefined_length = True
    save(data, tmp_path / "a")
    assert read(tmp_path)[0][0, 0].tolist() == [400, 400, 300, 200]


def test_a_table_may_begin_below_zero_and_its_entries_may_be_bytes(tmp_path) -> None:
    item = table([0], first=-2, kind="SS")
    item[0].add_new("LUTDescriptor", "SS", [3, -2, 8])
    item[0].LUTData = bytes([30, 20, 10, 0])
    pixels = np.array([[-9, -2, -1, 0, 9]], np.int16)
    save(image(pixels, SliceThickness="1", ModalityLUTSequence=item), tmp_path / "a")
    values, info = read(tmp_path)
    assert values[0].tolist() == [[30, 30, 20, 10, 10]]
    assert (info.stored_type, info.unit) == ("uint8", "HU")


def test_slices_with_tables_of_their_own_are_looked_up_each_in_its_own(tmp_path) -> None:
    pixels = np.array([[5, 6]], np.uint8)
    save_all([image(pixels, (0, 0, z), ModalityLUTSequence=table([z, 50 * z])) for z in range(4)], tmp_path)
    assert read(tmp_path)[0][:, 0].tolist() == [[0, 0], [1, 50], [2, 100], [3, 150]]


def test_compressed_slices_are_looked_up_too(tmp_path) -> None:
    pixels = np.tile(PIXELS, (8, 8))
    data = image(pixels, SliceThickness="1", ModalityLUTSequence=table(DOWN))
    save(compressed(data, JPEGLSLossless), tmp_path / "a", JPEGLSLossless)
    assert read(tmp_path)[0][0, 0, :4].tolist() == [400, 400, 300, 200]


def test_monochrome1_is_turned_round_after_the_table(tmp_path) -> None:
    told = {"PhotometricInterpretation": "MONOCHROME1", "ModalityLUTSequence": table(DOWN)}
    save(image(PIXELS, SliceThickness="1", **told), tmp_path / "a")
    assert read(tmp_path)[0][0, 0].tolist() == [65535 - v for v in (400, 400, 300, 200)]


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"ModalityLUTSequence": table(DOWN, count=5)}, "declares 5 entries of 16 bits, but holds 8 bytes"),
        ({"ModalityLUTSequence": table(DOWN, bits=7)}, "entries of 7 bits"),
        ({"ModalityLUTSequence": table(DOWN), "RescaleSlope": "2"}, "RescaleSlope"),
        ({"ModalityLUTSequence": table([600, 100], bits=9)}, "9 bits, but holds 600"),
        ({"ModalityLUTSequence": [Dataset()]}, "no descriptor"),
    ],
)
def test_a_table_that_cannot_be_trusted_is_refused(tmp_path, told, said) -> None:
    save(image(PIXELS, SliceThickness="1", **told), tmp_path / "a")
    error = refusal(tmp_path)
    assert error.code == "VP1050"
    assert said in str(error)


def test_a_mapping_to_real_world_values_is_remarked_and_not_applied(tmp_path) -> None:
    save(image(PIXELS, SliceThickness="1", RealWorldValueMappingSequence=[Dataset()]), tmp_path / "a")
    values, info = read(tmp_path)
    assert np.array_equal(values[0], PIXELS)
    assert any("RealWorldValueMappingSequence" in remark for remark in info.remarks)


def test_bits_at_the_top_of_a_word_are_remarked(tmp_path) -> None:
    save(image(PIXELS.astype(np.uint16) << 4, BitsStored=12, HighBit=15, SliceThickness="1"), tmp_path / "a")
    values, info = read(tmp_path)
    assert np.array_equal(values[0], PIXELS)
    assert any("HighBit" in remark for remark in info.remarks)


def put(folder: Path, pixels: np.ndarray, syntax: str, frame: bytes, **told: object) -> Path:
    data = image(pixels, SliceThickness="1")
    data.update(told)
    data.HighBit = data.BitsStored - 1
    save(compressed(data, syntax, bytes(frame)), folder / "a", syntax)
    return folder


SIGNED = np.random.default_rng(6).integers(-2048, 2048, (17, 21)).astype(np.int16)
WORDS = SIGNED.view(np.uint16)


@pytest.mark.parametrize(
    ("syntax", "frame", "told"),
    [
        (JPEGLosslessSV1, imagecodecs.ljpeg_encode(WORDS, bitspersample=16), {"BitsStored": 16}),
        (JPEGLosslessSV1, imagecodecs.ljpeg_encode(WORDS, bitspersample=16), {"BitsStored": 12}),
        (JPEGLosslessSV1, imagecodecs.ljpeg_encode(WORDS & 0xFFF, bitspersample=12), {"BitsStored": 12}),
        (JPEGLossless, imagecodecs.jpeg8_encode(WORDS & 0xFFF, lossless=True, predictor=6), {"BitsStored": 12}),
        (JPEGLSLossless, imagecodecs.jpegls_encode(WORDS), {"BitsStored": 12}),
        (
            JPEG2000Lossless,
            imagecodecs.jpeg2k_encode(SIGNED, level=0, codecformat="J2K", bitspersample=12, reversible=True),
            {"BitsStored": 16},
        ),
    ],
    ids=["lossless 16", "lossless 16 for 12", "lossless 12", "lossless predictor 6", "JPEG-LS", "JPEG 2000"],
)
def test_signed_values_come_back_from_as_many_bits_as_were_coded(tmp_path, syntax, frame, told) -> None:
    values, _ = read(put(tmp_path, SIGNED, syntax, frame, **told))
    assert np.array_equal(values[0], SIGNED)


@pytest.mark.parametrize(
    ("syntax", "frame", "told", "said"),
    [
        (JPEGLosslessSV1, imagecodecs.ljpeg_encode(WORDS, bitspersample=16), {"BitsStored": 11}, "11-bit signed"),
        (
            JPEGLosslessSV1,
            imagecodecs.ljpeg_encode(WORDS & 0xFFF, bitspersample=12),
            {"BitsStored": 16},
            "the compressed data are 12-bit ones",
        ),
        (
            JPEG2000Lossless,
            imagecodecs.jpeg2k_encode(SIGNED, level=0, codecformat="J2K", reversible=True),
            {"PixelRepresentation": 0},
            "16-bit unsigned values (BitsStored, PixelRepresentation), but the compressed data are 16-bit signed",
        ),
        (
            JPEG2000Lossless,
            imagecodecs.jpeg2k_encode(WORDS, level=0, codecformat="J2K", reversible=True),
            {},
            "16-bit signed values (BitsStored, PixelRepresentation), but the compressed data are 16-bit ones",
        ),
        (
            JPEGExtended12Bit,
            imagecodecs.jpeg8_encode(WORDS & 0xFFF, level=95),
            {"BitsAllocated": 8, "BitsStored": 8},
            "8-bit signed",
        ),
    ],
    ids=["too many bits", "sign unknown", "signed in unsigned", "unsigned in signed", "12 bits in 8"],
)
def test_values_that_the_header_does_not_allow_are_refused_with_both(tmp_path, syntax, frame, told, said) -> None:
    error = refusal(put(tmp_path, SIGNED, syntax, frame, **told))
    assert error.code == "VP1049"
    assert said in str(error)


@pytest.mark.parametrize(
    ("syntax", "frame", "wanted"),
    [
        (JPEGBaseline8Bit, imagecodecs.ljpeg_encode(PIXELS), "sequential DCT"),
        (JPEGLossless, imagecodecs.jpeg8_encode(PIXELS), "lossless"),
        (JPEGLSLossless, imagecodecs.jpeg8_encode(PIXELS), "JPEG-LS"),
        (JPEG2000Lossless, imagecodecs.jpegls_encode(PIXELS), "JPEG 2000"),
    ],
)
def test_data_of_another_process_than_the_transfer_syntax_names_are_refused(tmp_path, syntax, frame, wanted) -> None:
    error = refusal(put(tmp_path, PIXELS, syntax, frame))
    assert error.code == "VP1048"
    assert wanted in str(error)


def test_several_pictures_in_the_data_of_one_are_refused(tmp_path) -> None:
    for syntax in (JPEGLosslessSV1, JPEGLSLossless, JPEG2000Lossless):
        data = compressed(image(PIXELS, SliceThickness="1"), syntax)
        frame = get_frame(data.PixelData, 0, number_of_frames=1)
        data.PixelData = encapsulate([frame, frame])
        save(data, tmp_path / "a", syntax)
        assert refusal(tmp_path).code == "VP1045"


def test_run_lengths_of_a_larger_picture_are_refused(tmp_path) -> None:
    data = compressed(image(np.tile(PIXELS, (2, 1)), SliceThickness="1"), RLELossless)
    data.Rows = 2
    save(data, tmp_path / "a", RLELossless)
    assert refusal(tmp_path).code == "VP1040"
