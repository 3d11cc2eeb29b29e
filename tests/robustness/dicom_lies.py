"""Files of which two fields that must agree do not, or whose data end early although nothing says so.

Each is made by chance that can be repeated, with the picture that it was made from. It must be refused with a code, or
be read as that picture: anything else is a wrong volume without a word. A new kind of lie adds a line to `LIES`.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import imagecodecs
import numpy as np
from dicom_files import compressed, encoded, image, save
from numpy.typing import NDArray
from pydicom.uid import (
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    HTJ2KLossless,
    ImplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGBaseline8Bit,
    JPEGExtended12Bit,
    JPEGLossless,
    JPEGLosslessSV1,
    JPEGLSLossless,
    RLELossless,
)

from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec

from .mutations import outcome

Chance = np.random.Generator
_END = b"\xff\xd9"
_NATIVE = (ExplicitVRLittleEndian, ImplicitVRLittleEndian, ExplicitVRBigEndian)
_LOSSLESS = (RLELossless, JPEGLossless, JPEGLosslessSV1, JPEGLSLossless, JPEG2000Lossless, HTJ2KLossless)
_LOSSY = (JPEGBaseline8Bit, JPEGExtended12Bit)


@dataclass(frozen=True)
class Lie:
    """A kind of file that contradicts itself."""

    name: str
    make: Callable[[Path, Chance], NDArray[np.generic]]
    """Writes one to a path, and gives the picture [y, x] that it was made from."""


def lie_outcome(lie: Lie, file: Path, seed: int, case: int) -> str:
    """Read case number `case` of a lie: "read" as the truth, or the code that refuses it. Anything else fails."""
    truth = lie.make(file, np.random.default_rng((seed, case)))
    return outcome(file, lambda path: _read_as(path, truth), f"{lie.name} case {case} of seed {seed}")


def lie_outcomes(lie: Lie, folder: Path, *, count: int, seed: int) -> Counter[str]:
    """How often each outcome happened among `count` cases."""
    return Counter(lie_outcome(lie, folder / "lie", seed, case) for case in range(count))


def _read_as(path: Path, truth: NDArray[np.generic]) -> None:
    with open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
        found = source.read_slab(0, source.info.grid.shape_zyx[0])
    assert found.shape == (1, *truth.shape), "read in another shape"
    assert np.array_equal(found[0], truth), "read as other values"


def coded(pixels: NDArray[np.generic], syntax: str, bits: int) -> bytes:
    """One picture in any compressed transfer syntax that is read."""
    if syntax in _LOSSY:
        return bytes(imagecodecs.jpeg8_encode(pixels, level=95))
    if syntax == HTJ2KLossless:
        return bytes(imagecodecs.htj2k_encode(pixels, reversible=True))
    return encoded(pixels, syntax, bits)


def picture(syntax: str, chance: Chance) -> tuple[NDArray[np.generic], int]:
    """Return a noisy picture that the transfer syntax can hold, with values up to the last of its bits."""
    bits = {JPEGBaseline8Bit: 8, JPEGExtended12Bit: 12}.get(syntax) or int(chance.choice([8, 10, 12, 16]))
    shape = tuple(int(n) for n in chance.integers(9, 40, 2))
    pixels = chance.integers(0, 2**bits, shape).astype(np.uint8 if bits == 8 else np.uint16)
    pixels[0, 0], pixels[-1, -1] = 2**bits - 1, 2**bits - 2
    return pixels, bits


def cut(frame: bytes, share: float) -> bytes:
    """Keep a share of the coded values of a picture, and its end marker."""
    begin = next((frame.index(m) + 2 for m in (b"\xff\xda", b"\xff\x93") if m in frame), 64)
    kept = frame[: begin + max(1, round((len(frame) - begin) * share))]
    return kept + _END if frame[:1] == b"\xff" else kept


def _cut_dicom(syntax: str) -> Callable[[Path, Chance], NDArray[np.generic]]:
    def make(file: Path, chance: Chance) -> NDArray[np.generic]:
        pixels, bits = picture(syntax, chance)
        whole = coded(pixels, syntax, bits)
        told = {"BitsStored": bits, "HighBit": bits - 1, "SliceThickness": "1"}
        share = float(chance.choice([0.02, 0.1, 0.5, 0.9, chance.random()]))
        save(compressed(image(pixels, **told), syntax, cut(whole, min(share, 0.98))), file, syntax)
        return _known(pixels, syntax, whole)

    return make


def _false_dicom(syntax: str) -> Callable[[Path, Chance], NDArray[np.generic]]:
    """One attribute of the header says another thing than the pixel data, which were made from sound ones."""

    def make(file: Path, chance: Chance) -> NDArray[np.generic]:
        pixels, bits = picture(syntax, chance)
        told = {"BitsStored": bits, "HighBit": bits - 1, "SliceThickness": "1"}
        data = image(pixels, **told)
        truth: NDArray[np.generic] = pixels
        if syntax not in _NATIVE:
            whole = coded(pixels, syntax, bits)
            truth = _known(pixels, syntax, whole)
            data = compressed(data, syntax, whole)
        lies = [_false_rows, _false_columns, _false_width, _false_frames, _false_samples]
        if syntax not in {*_NATIVE, RLELossless}:  # whose values say nothing of their bits
            lies += [_false_bits, _false_bits]
        if syntax in {JPEG2000Lossless, HTJ2KLossless, *_LOSSY}:
            lies += [_false_sign]
        lies[int(chance.integers(len(lies)))](data, chance)
        save(data, file, syntax)
        return truth

    return make


def _false_rows(data, chance: Chance) -> None:
    data.Rows = int(chance.choice([data.Rows // 2, data.Rows - 1, data.Rows + 1, 2 * data.Rows]))


def _false_columns(data, chance: Chance) -> None:
    data.Columns = int(chance.choice([data.Columns // 2, data.Columns - 1, data.Columns + 1, 2 * data.Columns]))


def _false_width(data, chance: Chance) -> None:
    data.BitsAllocated = int(chance.choice([bits for bits in (8, 16, 32) if bits != data.BitsAllocated]))
    data.BitsStored = min(data.BitsStored, data.BitsAllocated)
    data.HighBit = data.BitsStored - 1


def _false_bits(data, chance: Chance) -> None:
    data.BitsStored = int(chance.integers(1, data.BitsAllocated + 1))
    data.HighBit = data.BitsStored - 1


def _false_sign(data, _chance: Chance) -> None:
    data.PixelRepresentation = 1 - data.PixelRepresentation


def _false_frames(data, chance: Chance) -> None:
    data.NumberOfFrames = int(chance.choice([0, 2, 3, 10**6]))


def _false_samples(data, chance: Chance) -> None:
    data.SamplesPerPixel = int(chance.choice([0, 2, 3, 4]))


def _known(pixels: NDArray[np.generic], syntax: str, whole: bytes) -> NDArray[np.generic]:
    """Return the picture that the whole data hold."""
    return imagecodecs.jpeg8_decode(whole) if syntax in _LOSSY else pixels


LIES = (
    *(Lie(f"DICOM {syntax.name}: a false header", _false_dicom(syntax)) for syntax in (*_NATIVE, *_LOSSLESS, *_LOSSY)),
    *(Lie(f"DICOM {syntax.name}: cut, with an end", _cut_dicom(syntax)) for syntax in (*_LOSSLESS, *_LOSSY)),
)
"""All kinds."""
