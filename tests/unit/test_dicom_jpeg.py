"""JPEG baseline and high-throughput JPEG 2000, from pictures whose values are known without a decoder."""

import struct

import imagecodecs
import numpy as np
import OpenImageIO
import pytest
from dicom_files import image, save
from pydicom.encaps import encapsulate
from pydicom.uid import HTJ2K, HTJ2KLossless, HTJ2KLosslessRPCL, JPEGBaseline8Bit

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec

pytestmark = pytest.mark.usefixtures("kept_workers")

BLOCKS = np.random.default_rng(5).integers(0, 256, (5, 6)).astype(np.uint8)


def jpeg(pixels, path) -> bytes:
    output = OpenImageIO.ImageOutput.create(str(path))
    spec = OpenImageIO.ImageSpec(pixels.shape[1], pixels.shape[0], 1, "uint8")
    spec.attribute("Compression", "jpeg:100")
    assert output.open(str(path), spec)
    assert output.write_image(np.ascontiguousarray(pixels[..., None]))
    output.close()
    return path.read_bytes()


def high_throughput(shape_yx: tuple[int, int]) -> bytes:
    """A codestream of 128 everywhere.

    OpenJPEG writes no such codestreams. One of mid-grey has no code block at all, so that only the markers differ: Rsiz
    and CAP announce the part of the standard, the style of the code blocks says how they are coded (ITU-T T.814, A.2
    to A.4).
    """
    plain = bytearray(imagecodecs.jpeg2k_encode(np.full(shape_yx, 128, np.uint8), level=0, codecformat="J2K"))
    struct.pack_into(">H", plain, 6, 0x4000)
    plain[plain.index(b"\xff\x52") + 12] |= 0x40
    end_of_siz = 4 + struct.unpack_from(">H", plain, 4)[0]
    capabilities = b"\xff\x50" + struct.pack(">HLH", 8, 0x0002_0000, 0)
    return bytes(plain[:end_of_siz]) + capabilities + bytes(plain[end_of_siz:])


def read(folder, frame: bytes, shape_yx: tuple[int, int], syntax: str):
    data = image(np.zeros(shape_yx, np.uint8), SliceThickness="1")
    data.PixelData = encapsulate([frame])
    save(data, folder / "slice", syntax)
    with open_source(SourceSpec(path=str(folder / "slice")), folder, Silent()) as source:
        return source.read_slab(0, 1)[0]


def test_blocks_of_one_value_come_back_exactly_from_jpeg_baseline(tmp_path) -> None:
    # With quantisation steps of 1, the only coefficient of a block, 8 · (value - 128), is exact.
    pixels = np.kron(BLOCKS, np.ones((8, 8), np.uint8))
    found = read(tmp_path, jpeg(pixels, tmp_path / "a.jpg"), pixels.shape, JPEGBaseline8Bit)
    np.testing.assert_array_equal(found, pixels)


def test_a_smooth_picture_of_odd_size_is_what_another_decoder_says(tmp_path) -> None:
    y, x = np.indices((37, 29))
    pixels = (128 + 100 * np.sin(x / 7) * np.cos(y / 5)).astype(np.uint8)
    found = read(tmp_path, jpeg(pixels, tmp_path / "a.jpg"), pixels.shape, JPEGBaseline8Bit)
    other = OpenImageIO.ImageBuf(str(tmp_path / "a.jpg")).get_pixels(OpenImageIO.UINT8)[..., 0]
    # Each may be off by one from the exact inverse transform (ITU-T T.83).
    assert np.abs(found.astype(int) - other.astype(int)).max() <= 2
    # Steps of 1: each of the 64 coefficients is off by half at most, and their errors add up in no worse way.
    assert np.abs(found.astype(int) - pixels).mean() < 1


def test_a_jpeg_that_is_cut_off_is_refused(tmp_path) -> None:
    pixels = np.kron(BLOCKS, np.ones((8, 8), np.uint8))
    whole = jpeg(pixels, tmp_path / "a.jpg")
    with pytest.raises(VolprepError, match="VP1047"):
        read(tmp_path, whole[: len(whole) * 2 // 3], pixels.shape, JPEGBaseline8Bit)


@pytest.mark.parametrize("syntax", [HTJ2KLossless, HTJ2KLosslessRPCL, HTJ2K], ids=lambda syntax: syntax.name)
def test_high_throughput_jpeg_2000_is_decoded(tmp_path, syntax) -> None:
    assert (read(tmp_path, high_throughput((40, 36)), (40, 36), syntax) == 128).all()


def test_high_throughput_jpeg_2000_of_another_size_is_refused(tmp_path) -> None:
    with pytest.raises(VolprepError, match=r"VP1046.*36×40"):
        read(tmp_path, high_throughput((40, 36)), (40, 32), HTJ2KLossless)
