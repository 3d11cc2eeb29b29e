"""Modality LUTs: tables in the header that map stored values to output values.

A table maps whole numbers from `first` on; lower values map to its first entry, higher values to its last. Source:
DICOM PS3.3, C.11.1.1.1.
"""

import struct
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.fields import Elements, raw_text, raw_value
from volprep_formats.readers.dicom.header import SliceImage, ValueTable

_MOST_ENTRIES = 2**16
_BITS = range(8, 17)
_UNITS = {"HU": "HU"}


def with_table(image: SliceImage, item: Elements) -> SliceImage:
    """Return the slice with the table of `item` of its ModalityLUTSequence, or with a problem."""
    if image.problem is not None or image.pixels is None:
        return image
    try:
        if image.pixels.is_float or image.pixels.colours:
            raise _refused(image, "does not fit pixels that are no integers of one value each")
        if (image.slope, image.intercept) != (1.0, 0.0):
            raise _refused(image, "and RescaleSlope with RescaleIntercept are both present; either can be meant")
        table = _table(image, item, signed=image.pixels.signed)
    except VolprepError as error:
        return replace(image, problem=error)
    return replace(image, table=table, unit=_UNITS.get(raw_text(item, "ModalityLUTType").upper(), ""))


def looked_up(table: ValueTable, values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Entries of the table for stored values."""
    entries = _entries(table)
    places = np.clip(values.astype(np.int64) - table.first, 0, len(entries) - 1)
    found: NDArray[np.generic] = entries[places]
    return found


def table_range(table: ValueTable) -> tuple[int, int]:
    """Lowest and highest value that its entries can have."""
    return 0, 2**table.bits - 1


@lru_cache(maxsize=64)
def _entries(table: ValueTable) -> NDArray[np.generic]:
    return np.frombuffer(table.entries, dtype="u1" if table.is_bytes else f"{table.order}u2").astype(np.uint16)


def _table(image: SliceImage, item: Elements, *, signed: bool) -> ValueTable:
    descriptor, order = raw_value(item, "LUTDescriptor")
    data, data_order = raw_value(item, "LUTData")
    if len(descriptor) != 6:
        raise _refused(image, "has no descriptor of three numbers")
    count, first, bits = struct.unpack(f"{order}H{'h' if signed else 'H'}H", descriptor)
    count = count or _MOST_ENTRIES
    if bits not in _BITS:
        raise _refused(image, f"has entries of {bits} bits; 8 to 16 are possible")
    is_bytes = bits == _BITS[0] and len(data) in {count, count + count % 2} and len(data) != 2 * count
    if not is_bytes and len(data) != 2 * count:
        raise _refused(image, f"declares {count} entries of {bits} bits, but holds {len(data)} bytes")
    table = ValueTable(first, bits, data[:count] if is_bytes else data, data_order, is_bytes)
    highest = int(_entries(table).max())
    if highest > table_range(table)[1]:
        raise _refused(image, f"declares entries of {bits} bits, but holds {highest}")
    return table


def _refused(image: SliceImage, what: str) -> VolprepError:
    return VolprepError("VP1050", path=image.path, what=what)
