"""JPEG pictures that were cut off and got their end marker again, at every byte."""

import io

import imagecodecs
import numpy as np
import pytest
from PIL import Image

from volprep_formats.readers.dicom.codestreams import declared
from volprep_formats.readers.dicom.jpeg_ends import with_other_bits

END = b"\xff\xd9"


def noise(bits: int, shape_yx: tuple[int, int] = (19, 23)) -> np.ndarray:
    values = np.random.default_rng(bits).integers(0, 2**bits, shape_yx)
    return values.astype(np.uint8 if bits == 8 else np.uint16)


def smooth(bits: int, shape_yx: tuple[int, int] = (19, 23)) -> np.ndarray:
    y, x = np.indices(shape_yx)
    return ((1 + np.sin(x / 7) * np.cos(y / 5)) * (2 ** (bits - 1) - 1)).astype(np.uint8 if bits == 8 else np.uint16)


def restarting(pixels: np.ndarray, blocks: int) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG", quality=95, restart_marker_blocks=blocks)
    return stream.getvalue()


KINDS = {
    "baseline": imagecodecs.jpeg8_encode(noise(8), level=95),
    "baseline smooth": imagecodecs.jpeg8_encode(smooth(8), level=50),
    "extended 12 bits": imagecodecs.jpeg8_encode(noise(12), level=95),
    "extended smooth": imagecodecs.jpeg8_encode(smooth(12), level=50),
    "lossless": imagecodecs.ljpeg_encode(noise(16), bitspersample=16),
    "lossless smooth": imagecodecs.ljpeg_encode(smooth(12), bitspersample=12),
    "restart markers": restarting(noise(8), 2),
    "restart markers smooth": restarting(smooth(8), 4),
}
each_kind = pytest.mark.parametrize("frame", [bytes(frame) for frame in KINDS.values()], ids=KINDS)


def is_whole(frame: bytes) -> bool:
    other = with_other_bits(frame, declared(frame))
    return other is not None and np.array_equal(imagecodecs.jpeg8_decode(frame), imagecodecs.jpeg8_decode(other))


@each_kind
def test_a_whole_picture_is_whole_with_or_without_padding(frame) -> None:
    assert is_whole(frame)
    assert is_whole(frame + b"\0")
    assert is_whole(frame[:-2] + b"\xff" + END + b"\0")


@each_kind
def test_a_picture_cut_at_any_byte_is_told_or_has_lost_nothing(frame) -> None:
    whole = imagecodecs.jpeg8_decode(frame)
    told = lost = 0
    for size in range(frame.index(b"\xff\xda") + 10, len(frame) - 2):
        cut = frame[:size].rstrip(b"\xff") + END
        if is_whole(cut):
            np.testing.assert_array_equal(imagecodecs.jpeg8_decode(cut), whole)
        else:
            told += 1
        lost += 1
    assert told >= lost - 3, "padding is all that may be missing"


@each_kind
def test_a_picture_without_an_end_is_cut(frame) -> None:
    assert with_other_bits(frame[:-2], declared(frame)) is None


@pytest.mark.parametrize("change", ["one fewer", "in the wrong order", "one more"])
def test_restart_markers_must_all_be_there_in_their_order(change) -> None:
    frame = restarting(noise(8), 2)
    first, second = frame.index(b"\xff\xd0"), frame.index(b"\xff\xd1")
    changed = {
        "one fewer": frame[:first] + frame[second:],
        "in the wrong order": frame[: first + 1] + b"\xd1" + frame[first + 2 :],
        "one more": frame[:-2] + b"\xff\xd3" + END,
    }[change]
    assert is_whole(frame)
    assert not is_whole(changed)


def test_an_interval_within_a_picture_that_was_cut_is_told() -> None:
    frame = restarting(noise(8), 2)
    at = frame.index(b"\xff\xd1")
    assert not is_whole(frame[: at - 20] + frame[at:])
