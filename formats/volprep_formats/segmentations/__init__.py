"""Segmentations of scans. `open_segmentation` finds the reader."""

from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.path_text import no_such_path
from volprep_formats.progress import Progress
from volprep_formats.regular_files import check_regular_or_folder, open_regular
from volprep_formats.segmentations.records import ScanFrame, Segmentation

_HEAD_BYTES = 132


def open_segmentation(
    path: Path, progress: Progress, scan: Grid | None = None, frame: ScanFrame | None = None
) -> Segmentation:
    """Read DICOM SEG and RTSTRUCT, .seg.nrrd, a label volume of any source format, or a folder of masks.

    The grid of the scan limits the number of voxels; with the images of `frame` it gives the distance of the frames of
    a DICOM SEG.

    Raises VP1001 to VP1003 for what cannot be found or known, VP1310, VP1400 to VP1409, VP1413 to VP1416, VP3290,
    and what readers of volumes raise.
    """
    try:
        check_regular_or_folder(path)
        head = b""
        if not path.is_dir():
            with open_regular(path) as file:
                head = file.read(_HEAD_BYTES)
        return _read(path, head, progress, scan, frame)
    except (FileNotFoundError, NotADirectoryError, ValueError) as error:
        raise no_such_path(path) from error
    except OSError as error:
        raise VolprepError("VP1003", path=path, error=error.strerror or error) from error


def _read(path: Path, head: bytes, progress: Progress, scan: Grid | None, frame: ScanFrame | None) -> Segmentation:
    from volprep_formats.readers import format_of  # noqa: PLC0415 - readers take time to load
    from volprep_formats.readers.dicom.kind import has_prefix  # noqa: PLC0415 - readers take time to load
    from volprep_formats.readers.nrrd import keys_of  # noqa: PLC0415 - readers take time to load
    from volprep_formats.segmentations.dicom_file import sop_class  # noqa: PLC0415 - readers take time to load
    from volprep_formats.segmentations.dicom_seg import SOP_CLASSES, read_dicom_seg  # noqa: PLC0415 - readers take time to load
    from volprep_formats.segmentations.label_volume import read_label_volume  # noqa: PLC0415 - readers take time to load
    from volprep_formats.segmentations.mask_folder import has_masks  # noqa: PLC0415 - readers take time to load
    from volprep_formats.segmentations.rtstruct import SOP_CLASS, read_rtstruct  # noqa: PLC0415 - readers take time to load
    from volprep_formats.segmentations.seg_nrrd import is_segmentation, read_seg_nrrd  # noqa: PLC0415 - readers take time to load
    from volprep_formats.segmentations.zarr_labels import label_image  # noqa: PLC0415 - readers take time to load

    if has_prefix(head):
        kind = sop_class(path)
        if kind in SOP_CLASSES:
            return read_dicom_seg(path, scan, frame)
        if kind == SOP_CLASS:
            return read_rtstruct(path)
    elif head[:4] == b"NRRD":
        if is_segmentation(keys_of(path)):
            return read_seg_nrrd(path, scan)
    elif path.is_dir() and (format_of(path) == "dicom" or has_masks(path)):
        return _read_folder(path, progress, scan, frame)
    return read_label_volume(label_image(path), progress, scan)


def _read_folder(path: Path, progress: Progress, scan: Grid | None, frame: ScanFrame | None) -> Segmentation:
    """Read a folder that holds one DICOM object, or masks."""
    from volprep_formats.readers.dicom.kind import has_prefix  # noqa: PLC0415 - readers take time to load
    from volprep_formats.segmentations.mask_folder import read_mask_folder  # noqa: PLC0415 - readers take time to load

    files = [file for file in sorted(path.iterdir()) if file.is_file()]
    objects = []
    for file in files:
        with open_regular(file) as opened:
            if has_prefix(opened.read(_HEAD_BYTES)):
                objects.append(file)
    if len(objects) == 1:
        return open_segmentation(objects[0], progress, scan, frame)
    if objects:
        raise VolprepError("VP1409", path=path, count=len(objects))
    return read_mask_folder(path, progress, scan)
