"""Segmentations for tests, made with pydicom straight from the attributes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from dicom_files import ds, save
from numpy.typing import ArrayLike, NDArray
from pydicom.dataset import Dataset

SEG_CLASS = "1.2.840.10008.5.1.4.1.1.66.4"
STRUCT_CLASS = "1.2.840.10008.5.1.4.1.1.481.3"
FRAME = "1.2.826.0.1.3680043.9.77"


def item(**attributes: object) -> Dataset:
    made = Dataset()
    for keyword, value in attributes.items():
        setattr(made, keyword, value)
    return made


def coded(value: str, meaning: str) -> list[Dataset]:
    return [item(CodeValue=value, CodingSchemeDesignator="SCT", CodeMeaning=meaning)]


def seg(
    path: Path,
    frames: Sequence[tuple[int, ArrayLike, NDArray[np.uint8]]],
    *,
    kind: str = "BINARY",
    orientation: ArrayLike = (1, 0, 0, 0, 1, 0),
    pitch_mm: float = 2.0,
    numbers: Sequence[int] = (1, 2),
    **attributes: object,
) -> Path:
    """Write a segmentation of frames (segment number, position, pixels [y, x]); spacing 0.5 and 0.25 mm."""
    data = Dataset()
    data.SOPClassUID = SEG_CLASS
    data.Modality = "SEG"
    data.FrameOfReferenceUID = FRAME
    data.SegmentationType = kind
    data.Rows, data.Columns = frames[0][2].shape
    data.NumberOfFrames = len(frames)
    data.SamplesPerPixel = 1
    data.PhotometricInterpretation = "MONOCHROME2"
    data.PixelRepresentation = 0
    data.BitsAllocated = data.BitsStored = 1 if kind == "BINARY" else 8
    data.HighBit = data.BitsStored - 1
    data.SegmentSequence = [
        item(
            SegmentNumber=number,
            SegmentLabel=f"thing {number}",
            RecommendedDisplayCIELabValue=[41661, 41167, 40792],
            SegmentedPropertyTypeCodeSequence=coded(str(1000 + number), f"Organ {number}"),
        )
        for number in numbers
    ]
    data.SharedFunctionalGroupsSequence = [
        item(
            PlaneOrientationSequence=[item(ImageOrientationPatient=ds(orientation))],
            PixelMeasuresSequence=[item(PixelSpacing=ds([0.5, 0.25]), SpacingBetweenSlices=str(pitch_mm))],
        )
    ]
    data.PerFrameFunctionalGroupsSequence = [
        item(
            PlanePositionSequence=[item(ImagePositionPatient=ds(position))],
            SegmentIdentificationSequence=[item(ReferencedSegmentNumber=number)],
        )
        for number, position, _ in frames
    ]
    pixels = np.stack([plane for _, _, plane in frames])
    packed = np.packbits(pixels.ravel(), bitorder="little") if kind == "BINARY" else pixels.astype(np.uint8)
    data.PixelData = packed.tobytes() + b"\0" * (packed.size % 2)
    for keyword, value in attributes.items():
        setattr(data, keyword, value)
    return save(data, path)


def structure_set(path: Path, rings: Sequence[Sequence[ArrayLike]], images: Sequence[str] = ()) -> Path:
    """Write a structure set: for each structure its contours, [points, xyz] in millimetres, drawn on `images`."""
    data = Dataset()
    data.SOPClassUID = STRUCT_CLASS
    data.Modality = "RTSTRUCT"
    data.StructureSetROISequence = [
        item(ROINumber=n, ReferencedFrameOfReferenceUID=FRAME, ROIName=f"ring {n}") for n in range(1, len(rings) + 1)
    ]
    data.ROIContourSequence = [
        item(
            ReferencedROINumber=n,
            ROIDisplayColor=[255, 0, 51],
            ContourSequence=[
                item(
                    ContourGeometricType="CLOSED_PLANAR",
                    NumberOfContourPoints=len(np.asarray(ring)),
                    ContourData=ds(ring),
                    ContourImageSequence=[item(ReferencedSOPInstanceUID=uid) for uid in images],
                )
                for ring in own
            ],
        )
        for n, own in enumerate(rings, 1)
    ]
    return save(data, path)


def seg_nrrd(path: Path, layers: NDArray[np.uint8], fields: Sequence[str]) -> Path:
    """Write a segmentation of 3D Slicer: layers [layer, z, y, x] and its SegmentN_ fields."""
    count, nz, ny, nx = layers.shape
    header = [
        "NRRD0004",
        "type: unsigned char",
        "dimension: 4",
        "space: left-posterior-superior",
        f"sizes: {count} {nx} {ny} {nz}",
        "space directions: none (0.25,0,0) (0,0.5,0) (0,0,2)",
        "kinds: list domain domain domain",
        "encoding: raw",
        "space origin: (1,2,3)",
        *fields,
    ]
    voxels = np.ascontiguousarray(np.moveaxis(layers, 0, -1))
    path.write_bytes("\n".join(header).encode() + b"\n\n" + voxels.tobytes())
    return path
