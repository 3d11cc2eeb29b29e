"""Write the segments of a package as a DICOM Segmentation of the series that they belong to, with highdicom.

Patient and study are those of the series, which a segmentation must repeat. The same input gives the same bytes: UIDs
are derived from the content, and dates are the series'. Source: DICOM PS3.3, A.51 and C.8.20.
"""

import hashlib
from collections.abc import Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydicom import dcmread
from pydicom.dataset import Dataset
from pydicom.errors import InvalidDicomError
from pydicom.sr.coding import Code

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.installation import require_extra
from volprep_formats.output import new_file
from volprep_formats.package.parts.segments.record import SegmentCode
from volprep_formats.progress import Progress
from volprep_formats.regular_files import open_regular
from volprep_formats.source import VolumeSource
from volprep_formats.writers.dicom import derived_uid
from volprep_formats.writers.label_image import LabelImage, WrittenSegment

_TISSUE = Code("85756007", "SCT", "Tissue")
_MANUAL = Code("123109", "DCM", "Manual Processing")
_OFF_PLACE = 0.02
"""How far the centre of a voxel may lie from one of the series, in voxels."""


def write(image: LabelImage, source: VolumeSource, path: Path, progress: Progress, *, series: Path) -> None:
    """Write the labels `source` of one level of `image` for the series in the folder `series`.

    Raises VP7005 (highdicom is missing), VP1331 (no series, or several), VP1332 (the voxels are not those of the
    series) and VP4020.
    """
    require_extra("seg")
    import highdicom  # noqa: PLC0415 - in an extra

    images = _images(series)
    grid = source.info.grid
    _require_place(grid, images, series)
    progress.start("writing a DICOM segmentation", 1)
    values = source.read_slab(0, grid.shape_zyx[0])
    digest = hashlib.sha256(np.ascontiguousarray(values, "<u2").tobytes()).hexdigest()
    uid = derived_uid(str(images[0].SeriesInstanceUID), digest, repr(image.segments))
    data = highdicom.seg.Segmentation(
        source_images=images,
        pixel_array=_volume(image, values, grid, images[0]),
        segmentation_type="BINARY",
        segment_descriptions=[_description(number, segment) for number, segment in enumerate(image.segments, start=1)],
        series_instance_uid=uid,
        series_number=1,
        sop_instance_uid=derived_uid(uid, "instance"),
        instance_number=1,
        manufacturer="volprep",
        manufacturer_model_name="volprep export",
        software_versions=version("volprep"),
        device_serial_number="0",
        content_label="SEGMENTATION",
    )
    _make_repeatable(data, images[0])
    with new_file(path) as file:
        data.save_as(file, enforce_file_format=True)
    progress.advance()


def _images(folder: Path) -> list[Dataset]:
    """Return the headers of the series in a folder."""
    found = [] if not folder.is_dir() else [*_headers(sorted(folder.iterdir()))]
    series = {str(header.SeriesInstanceUID) for header in found}
    if len(series) != 1:
        raise VolprepError("VP1331", path=folder, problem=f"{len(series)} series of images")
    return found


def _headers(files: Sequence[Path]) -> Iterator[Dataset]:
    for path in files:
        if not path.is_file():
            continue
        with open_regular(path) as file:
            try:
                data = dcmread(file, stop_before_pixels=True)
            except InvalidDicomError:
                continue
        if {"ImagePositionPatient", "PixelSpacing", "SeriesInstanceUID"} <= {*data.dir()}:
            yield data


def _require_place(grid: Grid, images: Sequence[Dataset], series: Path) -> None:
    """Raise VP1332 unless the first voxel of each slice is a voxel of an image of the series."""
    rows = np.array([image.ImageOrientationPatient for image in images], np.float64)
    across, down = rows[0, :3], rows[0, 3:]
    column_mm, row_mm = (float(value) for value in images[0].PixelSpacing[::-1])
    origins = np.array([image.ImagePositionPatient for image in images], np.float64)
    normal = np.cross(across, down)
    first = grid.world_from_index[:3] @ np.array([[0.0, 0.0, z, 1.0] for z in range(grid.shape_zyx[0])]).T
    heights, planes = normal @ first, origins @ normal
    nearest = np.abs(heights[:, None] - planes).argmin(axis=1)
    apart = first.T - origins[nearest]
    in_voxels = np.stack([apart @ across / column_mm, apart @ down / row_mm, apart @ normal / grid.spacing_mm_zyx[0]])
    off = np.abs(in_voxels - np.rint(in_voxels) * [[1.0], [1.0], [0.0]]).max()
    steps = grid.world_from_index[:3, :3] / [column_mm, row_mm, grid.spacing_mm_zyx[0]]
    turned = np.abs(steps[:, :2] - np.stack([across, down], axis=1)).max()
    if not max(off, turned) <= _OFF_PLACE:
        raise VolprepError("VP1332", path=series, off=f"{max(off, turned):.3g}")


def _volume(image: LabelImage, values: NDArray[np.generic], grid: Grid, first: Dataset) -> Any:
    """Return the masks [z, y, x, segment] at their places."""
    import highdicom  # noqa: PLC0415 - in an extra

    masks = np.zeros((*values.shape, len(image.segments)), np.uint8)
    for entry in image.entries:
        masks[values == entry.value] |= np.isin(np.arange(len(image.segments)), entry.members).astype(np.uint8)
    affine = grid.world_from_index[:, [2, 1, 0, 3]]
    numbers = [*range(1, len(image.segments) + 1)]
    return highdicom.Volume(masks, affine, "PATIENT", first.FrameOfReferenceUID, channels={"SegmentNumber": numbers})


def _description(number: int, segment: WrittenSegment) -> Any:
    import highdicom  # noqa: PLC0415 - in an extra
    from highdicom.color import CIELabColor  # noqa: PLC0415 - in an extra

    method = highdicom.AlgorithmIdentificationSequence("unknown", _MANUAL, "unknown")
    return highdicom.seg.SegmentDescription(
        segment_number=number,
        segment_label=segment.name[:64],
        segmented_property_category=_TISSUE,
        segmented_property_type=_TISSUE if segment.code is None else _code(segment.code),
        algorithm_type="SEMIAUTOMATIC",
        algorithm_identification=method,
        display_color=CIELabColor.from_rgb(*segment.rgb),
    )


def _code(code: SegmentCode) -> Code:
    """Return the code without its modifiers."""
    return Code(code.value.split("+")[0], code.scheme, code.meaning.split(", ")[0][:64])


def _make_repeatable(data: Dataset, first: Dataset) -> None:
    """Replace what differs from run to run: random UIDs, and the time of writing by the time of the study."""
    date, time = first.get("StudyDate") or "19000101", first.get("StudyTime") or "000000"
    told = {"InstanceCreationDate": date, "InstanceCreationTime": time, "ContentDate": date, "ContentTime": time}
    told["ContributionDateTime"] = f"{date}{time}"
    told["DimensionOrganizationUID"] = derived_uid(data.SOPInstanceUID, "dimensions")
    for element in data.iterall():
        if element.keyword in told:
            element.value = told[element.keyword]
