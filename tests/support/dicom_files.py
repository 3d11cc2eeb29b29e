"""DICOM files for tests, made with pydicom straight from the attributes: independent of the project's own writer."""

import struct
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydicom import dcmwrite
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.encaps import encapsulate
from pydicom.sequence import Sequence
from pydicom.uid import (
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGLossless,
    JPEGLosslessSV1,
    JPEGLSLossless,
    RLELossless,
)
from pydicom.valuerep import format_number_as_ds

from volprep_formats.readers.dicom.file import slices_of
from volprep_formats.readers.dicom.header import SliceImage
from volprep_formats.readers.dicom.plain import plain_headers

SERIES_UID = "1.2.826.0.1.3680043.9.1"
MR_CLASS = "1.2.840.10008.5.1.4.1.1.4"


def ds(numbers: ArrayLike) -> list[str]:
    """Numbers as DICOM decimal strings of 16 characters at most."""
    return [format_number_as_ds(float(n)) for n in np.asarray(numbers, dtype=np.float64).ravel()]


def image(
    pixels: NDArray[np.generic],
    position_mm_xyz: ArrayLike = (0.0, 0.0, 0.0),
    *,
    orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0),
    spacing_mm_yx: ArrayLike = (1.0, 1.0),
    **attributes: Any,
) -> Dataset:
    """One MR slice of `pixels` [y, x] (8 or 16 bits); `attributes` are set last, and removed where None."""
    data = Dataset()
    data.SOPClassUID = MR_CLASS
    data.SeriesInstanceUID = SERIES_UID
    data.Modality = "MR"
    data.Rows, data.Columns = pixels.shape
    data.SamplesPerPixel = 1
    data.PhotometricInterpretation = "MONOCHROME2"
    data.BitsAllocated = data.BitsStored = 8 * pixels.dtype.itemsize
    data.HighBit = data.BitsStored - 1
    data.PixelRepresentation = int(pixels.dtype.kind == "i")
    data.PixelSpacing = ds(spacing_mm_yx)
    data.ImageOrientationPatient = ds(orientation)
    data.ImagePositionPatient = ds(position_mm_xyz)
    data.PixelData = pixels.astype(pixels.dtype.newbyteorder("<")).tobytes()
    if len(data.PixelData) % 2:
        data.PixelData += b"\0"
    for keyword, value in attributes.items():
        if value is None:
            del data[keyword]
        else:
            setattr(data, keyword, value)
    return data


def save(data: Dataset, path: Path, syntax: str = ExplicitVRLittleEndian) -> Path:
    """Write `data`, whose pixel data is little endian or compressed, as a DICOM file."""
    data.SOPInstanceUID = data.get("SOPInstanceUID") or f"1.2.3.{int.from_bytes(path.name.encode()[:12])}"
    data.file_meta = FileMetaDataset()
    data.file_meta.TransferSyntaxUID = syntax
    data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID
    data.file_meta.MediaStorageSOPInstanceUID = "1.2.3"
    if syntax == ExplicitVRBigEndian and data.BitsAllocated == 16:
        data.PixelData = np.frombuffer(data.PixelData, "<u2").astype(">u2").tobytes()
    path.parent.mkdir(parents=True, exist_ok=True)
    order = {"implicit_vr": syntax == ImplicitVRLittleEndian, "little_endian": syntax != ExplicitVRBigEndian}
    dcmwrite(path, data, enforce_file_format=True, **order)
    return path


def compressed(data: Dataset, syntax: str, frame: bytes | None = None) -> Dataset:
    """Encode the pixels of `data` in place, or put `frame` in their place, which is encoded already."""
    kind = ("u", "i")[data.PixelRepresentation]
    pixels = np.frombuffer(data.PixelData, f"<{kind}{data.BitsAllocated // 8}", count=data.Rows * data.Columns)
    coded = frame or encoded(pixels.reshape(data.Rows, data.Columns), syntax, data.BitsStored)
    data.PixelData = encapsulate([coded])
    data["PixelData"].VR = "OB"
    data["PixelData"].is_undefined_length = True
    return data


def encoded(pixels: NDArray[np.generic], syntax: str, bits: int) -> bytes:
    """One picture [y, x] of values of `bits` bits in a compressed transfer syntax."""
    words = pixels.view(f"u{pixels.dtype.itemsize}")
    if syntax == RLELossless:
        return run_lengths(pixels)
    if syntax == JPEGLSLossless:  # this encoder codes whole words
        return bytes(imagecodecs.jpegls_encode(words))
    if syntax in {JPEGLossless, JPEGLosslessSV1}:
        return bytes(imagecodecs.ljpeg_encode(words & words.dtype.type(2**bits - 1), bitspersample=bits))
    if syntax == JPEG2000Lossless:
        return bytes(imagecodecs.jpeg2k_encode(pixels, level=0, codecformat="J2K", bitspersample=bits, reversible=True))
    msg = f"no encoder for {syntax}"
    raise ValueError(msg)


def run_lengths(pixels: NDArray[np.generic]) -> bytes:
    """One picture [y, x] as DICOM's run lengths: a segment for each byte of a value, the highest first."""
    size = pixels.dtype.itemsize
    planes = np.ascontiguousarray(pixels.astype(pixels.dtype.newbyteorder(">"))).view(np.uint8).reshape(-1, size).T
    segments = [bytes(imagecodecs.packbits_encode(plane.tobytes())) for plane in planes]
    segments = [segment + bytes(len(segment) % 2) for segment in segments]
    offsets = np.cumsum([64, *(len(segment) for segment in segments)])[:size]
    return struct.pack("<16L", size, *offsets, *[0] * (15 - size)) + b"".join(segments)


def stack(count: int = 5, *, pitch_mm: float = 2.5, shape_yx: tuple[int, int] = (3, 4)) -> list[Dataset]:
    """A sound axial series: `count` slices along z whose values are z·100 + y·10 + x."""
    y, x = np.indices(shape_yx)
    return [image((z * 100 + y * 10 + x).astype(np.int16), (0.0, 0.0, z * pitch_mm)) for z in range(count)]


def save_all(images: list[Dataset], folder: Path, syntax: str = ExplicitVRLittleEndian) -> Path:
    """Write a series into `folder`, without extensions."""
    for k, data in enumerate(images):
        save(data, folder / f"I{k:03d}", syntax)
    return folder


def nested(depth: int) -> Sequence:
    """A sequence whose items hold sequences, `depth` deep."""
    item = Dataset()
    item.SOPInstanceUID = "1.2.3"
    item.is_undefined_length_sequence_item = depth != 1
    if depth > 1:
        item.ReferencedImageSequence = nested(depth - 1)
        item["ReferencedImageSequence"].is_undefined_length = True
    return Sequence([item, Dataset()])


def read_slices(path: Path) -> tuple[SliceImage, ...]:
    """Read the header of one DICOM file: its slices."""
    return slices_of(path, plain_headers([path])[0])
