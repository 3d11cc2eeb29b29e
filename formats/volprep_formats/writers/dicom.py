"""Write a volume as a DICOM series: one file per slice, Explicit VR Little Endian, exact geometry, no identity.

Numbers are decimal strings of at most 16 characters, as DICOM demands: positions below 10 000 mm keep ten decimals,
direction cosines twelve or more, so that the voxels of any scan stay within 1e-6 mm of their positions. UIDs are
derived from the content: the same volume gives the same bytes. Source: DICOM PS3.3 (A.3 CT, A.4 MR, A.8.1 secondary
capture), PS3.5 (B.2 UIDs), PS3.10.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydicom import dcmwrite
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import UID, CTImageStorage, ExplicitVRLittleEndian, MRImageStorage, SecondaryCaptureImageStorage
from pydicom.valuerep import format_number_as_ds

from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import new_folder
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource

_IMPLEMENTATION_UID = UID("2.25.265462983413424017213146480174219186353")
_SOP_CLASSES = {"CT": CTImageStorage, "MR": MRImageStorage}
_LONGEST_DESCRIPTION = 64
_SLAB_SLICES = 16
_EMPTY = (  # attributes that must be there and may be empty
    "AccessionNumber",
    "AcquisitionNumber",
    "Laterality",
    "Manufacturer",
    "PatientBirthDate",
    "PatientID",
    "PatientName",
    "PatientOrientation",
    "PatientPosition",
    "PatientSex",
    "PositionReferenceIndicator",
    "ReferringPhysicianName",
    "StudyDate",
    "StudyID",
    "StudyTime",
)


@dataclass(frozen=True)
class _Coding:
    """Conversion of voxels to integers: stored = round((physical - intercept) / slope), or unchanged."""

    dtype: np.dtype[np.generic]
    slope: float
    intercept: float
    is_lossless: bool


def write(source: VolumeSource, folder: Path, progress: Progress, *, description: str = "") -> list[Path]:
    """Write `source` into `folder`, which is created atomically. Returns the files, slice 0 first.

    Integer voxels are written as they are; float32 ones too where all are whole and fit 16 bits, and else as 65536 even
    steps from the least to the largest, with the slope and intercept that undo it. A volume whose axes are left-handed
    reads back with its slices in reverse order, at the same places. `description` becomes the SeriesDescription, cut to
    64 characters.

    Raises VolprepError VP1080 (folder not empty), VP1081 (cannot be written), VP1082 (NaN or infinite voxels).
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise VolprepError("VP1080", path=folder)
    description = description.replace("\\", "/")[:_LONGEST_DESCRIPTION]
    progress.start("writing a DICOM series", 2 * source.info.grid.shape_zyx[0])
    with new_folder(folder, "VP1081") as partial:
        digest, coding = _survey(source, folder, description, progress)
        names = _write_slices(source, partial, coding, _template(source.info, coding, digest, description), progress)
    return [folder / name for name in names]


def _survey(source: VolumeSource, folder: Path, description: str, progress: Progress) -> tuple[str, _Coding]:
    """Read the volume once: a digest of all that will be written, and how to code the voxels."""
    info = source.info
    told = (info.grid.model_dump_json(), info.stored_type, info.slope, info.intercept, info.modality, info.unit)
    digest = hashlib.sha256(repr((*told, description)).encode())
    depth = info.grid.shape_zyx[0]
    low, high, whole = np.inf, -np.inf, True
    for z in range(0, depth, _SLAB_SLICES):
        slab = source.read_slab(z, min(z + _SLAB_SLICES, depth))
        digest.update(slab.astype(slab.dtype.newbyteorder("<"), copy=False).tobytes())
        low, high = min(low, float(slab.min())), max(high, float(slab.max()))
        if not np.isfinite([low, high]).all():
            raise VolprepError("VP1082", path=folder)
        whole = whole and np.array_equal(slab, np.round(slab))
        progress.advance(len(slab))
    return digest.hexdigest(), _coding(info, low, high, whole=whole)


def _coding(info: SourceInfo, low: float, high: float, *, whole: bool) -> _Coding:
    if info.stored_type != "float32":
        return _Coding(np.dtype(info.stored_type), info.slope, info.intercept, is_lossless=True)
    if whole:
        for kind in ("int16", "uint16"):
            if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
                return _Coding(np.dtype(kind), info.slope, info.intercept, is_lossless=True)
    least, largest = sorted((info.slope * low + info.intercept, info.slope * high + info.intercept))
    # Rounded to the precision of the file, so that reading inverts this exactly.
    slope = float(_decimal((largest - least) / 65535 or 1.0))
    return _Coding(np.dtype("uint16"), slope, float(_decimal(least)), is_lossless=False)


def _encode(slab: NDArray[Any], info: SourceInfo, coding: _Coding) -> NDArray[Any]:
    """Voxels as 16-bit little-endian integers."""
    if not coding.is_lossless:
        physical = slab.astype(np.float64) * info.slope + info.intercept
        slab = np.clip(np.round((physical - coding.intercept) / coding.slope), 0, 65535)
    return slab.astype("<i2" if coding.dtype.kind == "i" else "<u2")


def _write_slices(
    source: VolumeSource, folder: Path, coding: _Coding, template: Dataset, progress: Progress
) -> list[str]:
    info = source.info
    depth = info.grid.shape_zyx[0]
    world_from_index = info.grid.world_from_index
    names = []
    for z0 in range(0, depth, _SLAB_SLICES):
        slab = _encode(source.read_slab(z0, min(z0 + _SLAB_SLICES, depth)), info, coding)
        for z, pixels in enumerate(slab, start=z0):
            template.InstanceNumber = z + 1
            template.SOPInstanceUID = derived_uid(template.SeriesInstanceUID, f"slice {z}")
            template.file_meta.MediaStorageSOPInstanceUID = template.SOPInstanceUID
            template.ImagePositionPatient = _decimals(world_from_index[:3, :] @ [0.0, 0.0, z, 1.0])
            template.PixelData = pixels.tobytes()
            names.append(f"slice_{z + 1:05d}.dcm")
            dcmwrite(folder / names[-1], template, enforce_file_format=True)
            progress.advance()
    return names


def _template(info: SourceInfo, coding: _Coding, digest: str, description: str) -> Dataset:
    """All that the slices share."""
    data = Dataset()
    for keyword in _EMPTY:
        setattr(data, keyword, None if keyword == "AcquisitionNumber" else "")
    data.SpecificCharacterSet = "ISO_IR 192"
    data.ImageType = ["DERIVED", "SECONDARY", "AXIAL" if info.modality == "CT" else "OTHER"]
    data.Modality = info.modality or "OT"
    data.SOPClassUID = _SOP_CLASSES.get(info.modality, SecondaryCaptureImageStorage)
    data.SeriesDescription = description
    data.SeriesNumber = 1
    data.SeriesInstanceUID = derived_uid(digest, "series")
    data.StudyInstanceUID = derived_uid(digest, "study")
    data.FrameOfReferenceUID = derived_uid(digest, "frame of reference")
    _set_module_of_class(data)
    _set_plane(data, info)
    _set_pixels(data, info, coding)
    data.file_meta = FileMetaDataset()
    data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID
    data.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    data.file_meta.ImplementationClassUID = _IMPLEMENTATION_UID
    data.file_meta.ImplementationVersionName = "VOLPREP"
    return data


def _set_module_of_class(data: Dataset) -> None:
    """Attributes that must be there in this kind of image."""
    if data.SOPClassUID == CTImageStorage:
        data.KVP = None
    elif data.SOPClassUID == MRImageStorage:
        data.ScanningSequence, data.SequenceVariant = "RM", "NONE"
        for keyword in ("ScanOptions", "MRAcquisitionType"):
            setattr(data, keyword, "")
        for keyword in ("RepetitionTime", "EchoTime", "EchoTrainLength"):
            setattr(data, keyword, None)
    else:
        data.ConversionType = "WSD"


def _set_plane(data: Dataset, info: SourceInfo) -> None:
    pitch_mm, row_spacing_mm, column_spacing_mm = info.grid.spacing_mm_zyx
    direction = np.array(info.grid.direction)
    data.Rows, data.Columns = info.grid.shape_zyx[1:]
    data.PixelSpacing = _decimals([row_spacing_mm, column_spacing_mm])
    data.SliceThickness = data.SpacingBetweenSlices = _decimal(pitch_mm)
    data.ImageOrientationPatient = _decimals([*direction[:, 0], *direction[:, 1]])


def _set_pixels(data: Dataset, info: SourceInfo, coding: _Coding) -> None:
    # MR and CT images must have 16 bits allocated; 8-bit voxels set only the bits stored to 8.
    bits = 8 * coding.dtype.itemsize
    data.SamplesPerPixel = 1
    data.PhotometricInterpretation = "MONOCHROME2"
    data.BitsAllocated, data.BitsStored, data.HighBit = 16, bits, bits - 1
    data.PixelRepresentation = int(coding.dtype.kind == "i")
    # MR images are not meant to be rescaled, so they are only where they must be; CT images always are.
    if data.Modality == "CT" or (coding.slope, coding.intercept) != (1.0, 0.0):
        data.RescaleIntercept, data.RescaleSlope = _decimal(coding.intercept), _decimal(coding.slope)
        data.RescaleType = "HU" if info.unit == "HU" else "US"


def derived_uid(*parts: str) -> UID:
    """UID made from `parts`: a UUID of version 8 (made by a hash of one's own choice) below 2.25."""
    number = int.from_bytes(hashlib.sha256("\0".join(parts).encode()).digest()[:16], "big")
    number = number & ~(0xF << 76) & ~(0x3 << 62) | 0x8 << 76 | 0x2 << 62
    return UID(f"2.25.{number}")


def _decimal(number: float) -> str:
    return format_number_as_ds(float(number))


def _decimals(numbers: Any) -> list[str]:
    return [_decimal(number) for number in numbers]
