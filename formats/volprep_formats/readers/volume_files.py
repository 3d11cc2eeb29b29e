"""Which files of a folder are volumes, by their names: as scanners' converters and organ segmenters write them."""

from pathlib import Path

HEADERS = (".nhdr", ".mhd")
"""Endings of headers whose voxels lie in a data file."""
SUFFIXES = (".nii", ".nii.gz", ".nrrd", ".mha", ".mgz", ".mgh", ".mif", ".mif.gz", *HEADERS)
"""Endings of files that hold a volume each, in lower case."""


def volumes_in(folder: Path) -> int:
    """Return the number of volumes directly in a folder, without hidden files. Raises OSError."""
    names = (entry.name.lower() for entry in folder.iterdir() if not entry.name.startswith("."))
    return sum(name.endswith(SUFFIXES) for name in names)
