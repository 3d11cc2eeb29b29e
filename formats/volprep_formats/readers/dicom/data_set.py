"""Elements and sequences of a data set that pydicom parsed: the wanted ones, as raw values."""

from collections.abc import Sequence

from pydicom.dataelem import RawDataElement
from pydicom.dataset import Dataset

from volprep_formats.readers.dicom.fields import PRIVATE_TAGS, TAGS, Elements


def elements_of(data: Dataset) -> Elements:
    """Return the raw values of the wanted elements of a data set."""
    found = {}
    for tag in (*TAGS.values(), *PRIVATE_TAGS):
        element: object = data.get_item(tag) if tag in data else None
        if isinstance(element, RawDataElement) and isinstance(element.value, bytes):
            found[tag] = (element.value, "<" if element.is_little_endian else ">")
    return found


def sequence(data: Dataset, keyword: str) -> Sequence[Dataset]:
    """Return the items of a sequence; empty if it is missing or not a sequence."""
    element = data.get(TAGS[keyword])
    return element.value if element is not None and element.VR == "SQ" else []
