"""Frame of reference of a DICOM series: contours and segmentations of the scan must name the same one."""

from pathlib import Path

from volprep_formats.progress import Progress
from volprep_formats.readers.dicom.kind import has_prefix
from volprep_formats.readers.dicom.scan import choose_series, scan
from volprep_formats.regular_files import open_regular
from volprep_formats.segmentations.records import ScanFrame
from volprep_formats.source import SourceSpec

_HEAD_BYTES = 132


def frame_of_scan(spec: SourceSpec, progress: Progress) -> ScanFrame:
    """Return the frame of a DICOM series; an empty one for other formats.

    The path of `spec` is absolute. Raises what reading the series raises.
    """
    path = spec.place(Path("/"))
    if spec.format not in {"auto", "dicom"} or not _is_dicom(path):
        return ScanFrame()
    images = choose_series(scan(path, progress), spec).images
    uid = next((image.frame_of_reference for image in images if image.frame_of_reference), "")
    return ScanFrame(uid, frozenset(image.instance_uid for image in images if image.instance_uid))


def _is_dicom(path: Path) -> bool:
    if path.is_dir():
        from volprep_formats.readers import format_of  # noqa: PLC0415 - which imports the readers

        return format_of(path) == "dicom"
    with open_regular(path) as file:
        return has_prefix(file.read(_HEAD_BYTES))
