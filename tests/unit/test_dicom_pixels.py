"""Stored bits of DICOM images: every integer layout that is read, as the values it means."""

from pathlib import Path

import numpy as np
import pytest
from dicom_files import compressed, image, save, save_all
from pydicom.encaps import encapsulate, get_frame
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    JPEGLSLossless,
    RLELossless,
)

from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec

pytestmark = pytest.mark.usefixtures("kept_workers")

NATIVE = [ImplicitVRLittleEndian, ExplicitVRLittleEndian, ExplicitVRBigEndian, DeflatedExplicitVRLittleEndian]


def read(folder: Path) -> tuple[np.ndarray, object]:
    with open_source(SourceSpec(path="."), folder, Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0]), source.info


def read_one(folder: Path, data, syntax=ExplicitVRLittleEndian) -> tuple[np.ndarray, object]:
    data.SliceThickness = "1"
    save(data, folder / "I0", syntax)
    return read(folder)


@pytest.mark.parametrize("syntax", NATIVE)
@pytest.mark.parametrize("dtype", ["uint8", "int8", "uint16", "int16"])
def test_all_integer_types_keep_their_extremes_in_all_native_syntaxes(tmp_path, syntax, dtype) -> None:
    limits = np.iinfo(dtype)
    pixels = np.array([[limits.min, limits.max, 1], [0, 2, limits.max - 1], [7, 8, 9]], dtype=dtype)
    values, info = read_one(tmp_path, image(pixels), syntax)
    assert np.array_equal(values[0], pixels)
    assert info.stored_type == {"int8": "int16"}.get(dtype, dtype)


def test_bytes_in_big_endian_words_are_put_back_in_order(tmp_path) -> None:
    pixels = np.arange(15, dtype=np.uint8).reshape(3, 5)
    data = image(pixels)
    data["PixelData"].VR = "OW"
    data.PixelData = np.frombuffer(data.PixelData, "<u2").byteswap().tobytes()
    values, _ = read_one(tmp_path, data, ExplicitVRBigEndian)
    assert np.array_equal(values[0], pixels)


def test_rubbish_in_unused_high_bits_is_masked(tmp_path) -> None:
    pixels = np.array([[0x0123, 0x0FFF]], dtype=np.uint16)
    values, info = read_one(tmp_path, image(pixels | 0xA000, BitsStored=12, HighBit=11))
    assert np.array_equal(values[0], pixels)
    assert info.stored_type == "int16"


def test_a_signed_value_is_extended_from_its_own_sign_bit(tmp_path) -> None:
    stored = np.array([[0x0FFF, 0x0800, 0x07FF]], dtype=np.int16)
    values, _ = read_one(tmp_path, image(stored, BitsStored=12, HighBit=11))
    assert values[0].tolist() == [[-1, -2048, 2047]]


def test_bits_stored_at_the_top_of_a_word_are_moved_down(tmp_path) -> None:
    stored = np.array([[0x1235, 0xFFF7]], dtype=np.uint16)
    values, _ = read_one(tmp_path, image(stored, BitsStored=12, HighBit=15))
    assert values[0].tolist() == [[0x123, 0xFFF]]


def test_eight_bits_stored_in_sixteen_are_read_as_bytes(tmp_path) -> None:
    values, info = read_one(tmp_path, image(np.array([[1, 255]], dtype=np.uint16), BitsStored=8, HighBit=7))
    assert info.stored_type == "uint8"
    assert values[0].tolist() == [[1, 255]]


def test_slices_with_different_bits_share_the_smallest_type_that_holds_all(tmp_path) -> None:
    signed = image(np.array([[-5]], dtype=np.int16), (0, 0, 0))
    unsigned = image(np.array([[65535]], dtype=np.uint16), (0, 0, 1))
    save_all([signed, unsigned], tmp_path)
    values, info = read(tmp_path)
    assert info.stored_type == "float32"
    assert values.ravel().tolist() == [-5, 65535]


def test_one_rescale_for_all_is_kept_beside_the_stored_values(tmp_path) -> None:
    rescale = {"RescaleSlope": "2.5", "RescaleIntercept": "-1024", "Modality": "CT"}
    values, info = read_one(tmp_path, image(np.array([[7]], dtype=np.int16), **rescale))
    assert (values.dtype, values.item(), info.slope, info.intercept, info.unit) == (np.int16, 7, 2.5, -1024.0, "HU")


def test_a_rescale_of_each_slice_gives_physical_values(tmp_path) -> None:
    pixels = np.array([[10]], dtype=np.uint16)
    save_all([image(pixels, (0, 0, z), RescaleSlope=str(z + 0.5), RescaleIntercept=str(z)) for z in range(3)], tmp_path)
    values, info = read(tmp_path)
    assert (info.stored_type, info.slope, info.intercept) == ("float32", 1.0, 0.0)
    assert values.ravel().tolist() == [5.0, 16.0, 27.0]
    assert any("slope and intercept differ" in remark for remark in info.remarks)


def test_monochrome1_without_a_unit_is_turned_round_over_its_stored_bits(tmp_path) -> None:
    pixels = np.array([[0, 1, 4095]], dtype=np.uint16)
    inverted = {"PhotometricInterpretation": "MONOCHROME1", "BitsStored": 12, "HighBit": 11}
    values, info = read_one(tmp_path, image(pixels, **inverted))
    assert values[0].tolist() == [[4095, 4094, 0]]
    assert any("turned round" in remark for remark in info.remarks)


def test_signed_monochrome1_is_turned_round_to_the_other_extreme(tmp_path) -> None:
    pixels = np.array([[-32768, 0, 32767]], dtype=np.int16)
    values, _ = read_one(tmp_path, image(pixels, PhotometricInterpretation="MONOCHROME1"))
    assert values[0].tolist() == [[32767, -1, -32768]]


def test_monochrome1_in_hounsfield_units_keeps_its_values(tmp_path) -> None:
    told = {
        "PhotometricInterpretation": "MONOCHROME1",
        "RescaleSlope": "1",
        "RescaleIntercept": "0",
        "RescaleType": "HU",
    }
    values, info = read_one(tmp_path, image(np.array([[5]], dtype=np.int16), Modality="CT", **told))
    assert values.item() == 5
    assert any("MONOCHROME1" in remark and "HU" in remark for remark in info.remarks)


def test_padding_and_burned_in_text_are_remarked(tmp_path) -> None:
    data = image(np.array([[5]], dtype=np.int16), PixelPaddingValue=0, BurnedInAnnotation="YES")
    data["PixelPaddingValue"].VR = "SS"
    _, info = read_one(tmp_path, data)
    assert any("padding" in remark for remark in info.remarks)
    assert any("burned" in remark for remark in info.remarks)


@pytest.mark.parametrize("syntax", [RLELossless, JPEGLSLossless])
def test_compressed_signed_slices_read_as_their_originals(tmp_path, syntax) -> None:
    pixels = np.random.default_rng(5).integers(-2048, 2048, (9, 11)).astype(np.int16)
    values, _ = read_one(tmp_path, compressed(image(pixels, BitsStored=12, HighBit=11), syntax), syntax)
    assert np.array_equal(values[0], pixels)


def test_a_slice_in_several_fragments_is_read_whole(tmp_path) -> None:
    data = compressed(image(np.arange(120, dtype=np.uint8).reshape(10, 12)), JPEGLSLossless)
    data.PixelData = encapsulate([get_frame(data.PixelData, 0, number_of_frames=1)], fragments_per_frame=3)
    values, _ = read_one(tmp_path, data, JPEGLSLossless)
    assert np.array_equal(values[0].ravel(), np.arange(120))


def test_a_slab_is_the_slices_that_were_asked_for(tmp_path) -> None:
    save_all([image(np.full((2, 3), z, dtype=np.int16), (0, 0, z)) for z in range(7)], tmp_path)
    with open_source(SourceSpec(path="."), tmp_path, Silent()) as source:
        assert source.read_slab(2, 5)[:, 0, 0].tolist() == [2, 3, 4]
        assert source.read_slab(6, 7)[:, 1, 2].tolist() == [6]
        assert source.read_slab(3, 3).shape == (0, 2, 3)


@pytest.mark.parametrize("syntax", NATIVE)
@pytest.mark.parametrize("dtype", ["uint32", "int32"])
def test_wide_integers_are_read_as_floats_and_rounding_is_remarked(tmp_path, syntax, dtype) -> None:
    pixels = np.array([[0, 2**24, 2**24 + 1, np.iinfo(dtype).max, np.iinfo(dtype).min]], dtype=dtype)
    data = image(pixels)
    if syntax == ExplicitVRBigEndian:
        data.PixelData = pixels.astype(">u4" if dtype == "uint32" else ">i4").tobytes()
    values, info = read_one(tmp_path, data, syntax)
    assert info.stored_type == "float32"
    assert np.array_equal(values[0], pixels.astype(np.float32))
    assert values[0, 0, :2].tolist() == [0, 2**24]
    assert any("beyond 2^24 are rounded" in remark for remark in info.remarks)


def test_integers_of_24_bits_in_32_are_exact_and_need_no_remark(tmp_path) -> None:
    pixels = np.array([[-(2**23), 2**23 - 1, -1]], dtype=np.int32)
    rubbish = (pixels & 0xFFFFFF) | 0x5A000000
    values, info = read_one(tmp_path, image(rubbish.astype(np.int32), BitsStored=24, HighBit=23))
    assert values[0].tolist() == pixels.tolist()
    assert not info.remarks or not any("rounded" in remark for remark in info.remarks)


def test_twelve_bits_in_32_become_the_smallest_type(tmp_path) -> None:
    values, info = read_one(tmp_path, image(np.array([[4095, 7]], np.uint32), BitsStored=12, HighBit=11))
    assert (info.stored_type, values[0].tolist()) == ("int16", [[4095, 7]])


@pytest.mark.parametrize(("keyword", "dtype"), [("FloatPixelData", "<f4"), ("DoubleFloatPixelData", "<f8")])
def test_floating_point_pixels_are_read_with_their_rescale(tmp_path, keyword, dtype) -> None:
    pixels = np.array([[1.5, -2.25e20, 1e-30], [0.1, 3e38, -0.0]])
    data = image(np.zeros((2, 3), np.int16), BitsAllocated=8 * int(dtype[-1]), RescaleSlope="2", RescaleIntercept="1")
    for gone in ("PixelData", "BitsStored", "HighBit", "PixelRepresentation"):
        del data[gone]
    setattr(data, keyword, pixels.astype(dtype).tobytes())
    values, info = read_one(tmp_path, data)
    assert np.array_equal(values[0], pixels.astype(np.float32))
    assert (info.stored_type, info.slope, info.intercept) == ("float32", 2.0, 1.0)
    assert any("64-bit" in remark for remark in info.remarks) == (dtype == "<f8")
