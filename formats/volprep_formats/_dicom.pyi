"""The headers of plain DICOM files, many at a time."""

from collections.abc import Sequence


def plain_headers(paths: Sequence[bytes], wanted: Sequence[int], threads: int) -> list[tuple[bytes, dict[int, bytes], bytes, int, int] | None]:
    """
    Read the headers of plain files: one image, little endian, nothing unusual.

    Parameters
    ----------
    paths
        The files.
    wanted
        Tags, group and element, of the elements whose values are wanted.
    threads
        How many files are read at the same time.

    Returns
    -------
    list
        For each file its transfer syntax, the wanted elements as they stand in the file, the first bytes of the element
        that holds the pixels (tag, type and length, or tag and length), where they begin, and the size of the file. None
        for a file that is not plain or cannot be read.
    """
