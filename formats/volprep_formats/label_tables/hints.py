"""Signs that a file is a label map: an intent or a table in its header, a filter of a package, a name by a convention.

NIfTI has the intent NIFTI_INTENT_LABEL (nifti1.h: 1002). BIDS calls discrete segmentations NAME_dseg, FreeSurfer names
its maps aseg, aparc and wmparc, and 3D Slicer saves label maps as NAME-label.
"""

import re
from contextlib import suppress
from pathlib import Path

from volprep_formats.label_tables.nifti import table_text
from volprep_formats.nifti_header import HEADER_BYTES, is_nifti, parsed
from volprep_formats.regular_files import unpacked_head

_INTENT_LABEL = 1002
_BY_NAME = (
    (re.compile(r"_dseg\.nii(\.gz)?$"), "the name ends in dseg, as BIDS calls segmentations"),
    (
        re.compile(r"(^|[._-])(aseg|aparc|wmparc|aparc\.a2009s)([.+_-][\w.+-]*)?\.(mgz|mgh|nii|nii\.gz)$"),
        "the name is that of a segmentation of FreeSurfer",
    ),
    (re.compile(r"-label\.(nrrd|nhdr|nii|nii\.gz|mha|mhd)$"), "the name ends in -label, as 3D Slicer calls label maps"),
)


def label_hint(path: Path) -> str:
    """Return the evidence that the file is a label map, or ""."""
    if _intent(path) == _INTENT_LABEL:
        return "its NIfTI intent is label"
    if table_text(path):
        return "the file holds a table of labels"
    if _is_package_of_labels(path):
        return "the package holds labels"
    return next((said for pattern, said in _BY_NAME if pattern.search(path.name)), "")


def _intent(path: Path) -> int:
    """Return the intent of a NIfTI file; 0 for any other file."""
    with suppress(OSError, ValueError):
        header = parsed(unpacked_head(path, max(HEADER_BYTES.values()))[0])
        return int(header["intent_code"]) if is_nifti(header) else 0
    return 0


def _is_package_of_labels(path: Path) -> bool:
    """Whether a path is a package whose voxels are never interpolated."""
    if path.suffix != ".volpkg" or not path.is_dir():
        return False
    from volprep_formats.package.reader import Package  # noqa: PLC0415 - seldom needed

    return Package.open(path, allow_draft=True).manifest.holds_labels
