"""One DICOM object other than an image, parsed by pydicom; its exceptions for damaged bytes become VP1400."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.inflate import DEFLATED, inflated_data_set
from volprep_formats.regular_files import open_regular
from volprep_formats.segmentations.codes import coded
from volprep_formats.segmentations.records import Code

_MOST_BYTES = 2**32
_LONGEST_CODE = 64
_UNDEFINED = 0xFFFFFFFF
_PLAIN_SYNTAXES = frozenset(
    ("", "1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2", "1.2.840.10008.1.2.5", DEFLATED)
)
"""Uncompressed, deflated as a whole, and RLE, which is decoded in Python. A file that does not say is uncompressed."""
_META_BYTES = 1024
"""The file meta information, which has the transfer syntax, begins within these."""

Item = Any
"""A data set or an item of a sequence. pydicom has no types for values."""


@contextmanager
def parsed(path: Path) -> Iterator[Item]:
    """Yield the data set of a file. Any exception for a damaged value in the block becomes VP1400.

    Raises VP1003 (too large or unreadable), VP1400 and VP1403 (compressed).
    """
    if path.stat().st_size > _MOST_BYTES:
        raise VolprepError("VP1003", path=path, error=f"it has more than {_MOST_BYTES} bytes")
    from volprep_formats.readers.dicom.any_file import quiet_pydicom  # noqa: PLC0415 - pydicom takes time to load

    with quiet_pydicom(), open_regular(path) as file:
        try:
            data = _data_set(path, file)
            _require_whole(path, data)
            _require_plain(path, str(data.file_meta.get("TransferSyntaxUID", "")))
            yield data
        except VolprepError:
            raise
        except OSError as error:
            if error.errno is not None:
                raise
            raise VolprepError("VP1400", path=path, problem=str(error)) from error
        except Exception as error:
            raise VolprepError("VP1400", path=path, problem=f"{type(error).__name__}: {error}") from error


def _data_set(path: Path, file: BinaryIO, only: list[str] | None = None) -> Item:
    """Parse a file, or only some elements of it. pydicom would inflate a deflated one without a limit."""
    from pydicom import FileDataset, dcmread  # noqa: PLC0415 - heavy
    from pydicom.filereader import read_dataset, read_file_meta_info  # noqa: PLC0415 - heavy
    from pydicom.tag import Tag  # noqa: PLC0415 - heavy

    head = file.read(_META_BYTES)
    file.seek(0)
    if DEFLATED.encode() not in head:
        return dcmread(file, force=True, stop_before_pixels=only is not None, specific_tags=only)
    with inflated_data_set(path) as stream:
        data = read_dataset(stream, False, True, specific_tags=None if only is None else [Tag(value) for value in only])
        return FileDataset(path, data, file_meta=read_file_meta_info(path), is_implicit_VR=False)


def _require_whole(path: Path, data: Item) -> None:
    """Raise VP1400 for an element shorter than its stated length, which pydicom accepts without an error."""
    for tag in data.keys():  # noqa: SIM118 - iterating over a data set converts its elements
        element = data.get_item(tag)
        value = getattr(element, "value", None)
        stated = getattr(element, "length", None)
        if isinstance(value, bytes) and stated is not None and stated != _UNDEFINED and len(value) < stated:
            raise VolprepError("VP1400", path=path, problem=f"it is cut off within element {tag}")


def _require_plain(path: Path, syntax: str) -> None:
    if syntax not in _PLAIN_SYNTAXES:
        raise VolprepError("VP1403", path=path, syntax=syntax)


def sop_class(path: Path) -> str:
    """Return the SOPClassUID of a file, empty if it has none. Raises VP1400."""
    from volprep_formats.readers.dicom.any_file import quiet_pydicom  # noqa: PLC0415 - pydicom takes time to load

    with quiet_pydicom(), open_regular(path) as file:
        try:
            data = _data_set(path, file, ["SOPClassUID"])
            return str(data.get("SOPClassUID", "") or data.file_meta.get("MediaStorageSOPClassUID", ""))
        except Exception as error:
            raise VolprepError("VP1400", path=path, problem=f"{type(error).__name__}: {error}") from error


def first_item(item: Item, *keywords: str) -> Item | None:
    """Return the first item of a sequence in `item`, and so on down the keywords; None if one is missing."""
    for keyword in keywords:
        sequence = item.get(keyword)
        if not sequence:
            return None
        item = sequence[0]
    return item


def images_in(item: Item, keyword: str) -> frozenset[str]:
    """Return the SOPInstanceUIDs of the images that a sequence refers to."""
    found = (str(image.get("ReferencedSOPInstanceUID", "") or "") for image in item.get(keyword) or ())
    return frozenset(found) - {""}


def code_of(item: Item, keyword: str, modifiers: str = "") -> Code | None:
    """Return the coded name in the sequence `keyword`, with the modifiers inside it; None if it is incomplete.

    Its meaning is that of a public table, or free text of the file.
    """
    first = first_item(item, keyword)
    parts = [] if first is None else [first, *(first.get(modifiers) or () if modifiers else ())]
    values = [str(part.get("CodeValue", "") or part.get("LongCodeValue", "")).strip() for part in parts]
    schemes = {str(part.get("CodingSchemeDesignator", "")).strip() for part in parts}
    meanings = [str(part.get("CodeMeaning", "")).strip() for part in parts]
    if len(schemes) != 1 or not all(values) or not all(meanings) or not schemes.copy().pop():
        return None
    longest = max(len(text) for text in (*values, *meanings))
    if longest > _LONGEST_CODE or not all(text.isprintable() for text in (*values, *meanings)):
        return None
    return coded(schemes.pop(), values, meanings)
