"""Folders whose pictures are the files of one OME-TIFF."""

from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.ome.metadata import parse_description
from volprep_formats.readers.ome.pages import description_in
from volprep_formats.readers.ome.tiff_chain import description_of
from volprep_formats.readers.pictures.kinds import kind_of, pictures_in
from volprep_formats.regular_files import open_regular

_HEAD_BYTES = 4096


def file_of_set(folder: Path) -> Path | None:
    """Return a file of the OME-TIFF whose files are the pictures of a folder; None if they are anything else.

    Raises VP1220 for a description that is not sound, VP2084 where pictures of the folder belong to no or another set.
    """
    names = sorted(pictures_in(folder))
    # One that does not belong to the set comes rather first or last.
    first = next((folder / name for name in (*names[:1], *names[-1:]) if has_description(folder / name)), None)
    if first is None:
        return None
    description = parse_description(first, description_in(first))
    told = {data.file_name for image in description.images for data in image.data if data.file_name}
    if description.metadata_file is None and not told - {first.name}:
        return None
    if (others := len(set(names) - told)) and description.metadata_file is None:
        raise VolprepError("VP2084", path=folder, files=len(told), others=others)
    return first


def has_description(path: Path) -> bool:
    """Whether a file is a TIFF with OME-XML in its first page."""
    if not path.is_file():
        return False
    with open_regular(path) as file:
        if kind_of(file.read(8)) != "tiff":
            return False
    text = description_of(path, _HEAD_BYTES) or b""
    return b"<OME" in text and b"openmicroscopy.org" in text
