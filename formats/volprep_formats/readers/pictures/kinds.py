"""Which files are pictures: by their first bytes, or by their names where a folder is looked through."""

from pathlib import Path

from volprep_formats.readers.dicom import kind as dicom_kind
from volprep_formats.readers.volume_files import volumes_in
from volprep_formats.regular_files import open_regular
from volprep_formats.tree import files_below

SUFFIXES = frozenset((".png", ".tif", ".tiff", ".jpg", ".jpeg", ".exr", ".bmp"))
"""File names that count as pictures in a folder, in lower case."""

_MAGIC = {
    b"\x89PNG": "png",
    b"II*\0": "tiff",
    b"MM\0*": "tiff",
    b"II+\0": "tiff",
    b"MM\0+": "tiff",
    b"\xff\xd8\xff": "jpeg",
    b"\x76\x2f\x31\x01": "openexr",
    b"BM": "bmp",
}


def kind_of(head: bytes) -> str | None:
    """Return the kind of a picture from its first bytes, under OpenImageIO's name for it; None for anything else."""
    return next((kind for magic, kind in _MAGIC.items() if head.startswith(magic)), None)


def pictures_in(folder: Path) -> list[str]:
    """Return the names of the pictures directly in a folder, without the system's hidden files.

    Links to missing files count, so that a stack without some of its pictures is not read as a shorter one.
    """
    return [
        entry.name
        for entry in folder.iterdir()
        if entry.suffix.lower() in SUFFIXES
        and not entry.name.startswith(".")
        and (entry.is_file() or not entry.exists())
    ]


def holds_only_pictures(folder: Path) -> bool:
    """Whether there are pictures in a folder, more than volumes, and no DICOM files in it or below. Raises OSError.

    A picture among volumes is a preview of them, and no scan.
    """
    return len(pictures_in(folder)) > volumes_in(folder) and not any(
        _is_dicom(Path(entry.path)) for entry in files_below(folder)
    )


def _is_dicom(file: Path) -> bool:
    if file.name == "DICOMDIR" or file.suffix.lower() in dicom_kind.SUFFIXES:
        return True
    if file.suffix.lower() in SUFFIXES:
        return False
    with open_regular(file) as data:
        return dicom_kind.has_prefix(data.read(dicom_kind.HEAD_BYTES))
