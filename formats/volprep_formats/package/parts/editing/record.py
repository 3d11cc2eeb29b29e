"""Data for apps in which users edit transfer functions: a joint histogram of each coarser level.

A histogram's file holds a matrix of 256 rows and columns whose rows are zero outside a band: first for each row the
column where its band begins and how many columns it has, then the entries of the bands, all as uint16.
"""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Count
from volprep_formats.record import Record
from volprep_formats.source import ChannelName

BINS = 256
"""Number of rows and columns: bin b represents the normalised stored value b / 255."""
WHOLE = 65535
"""Sum of each row."""

Shares = NDArray[np.uint16]


class JointHistogram(Record):
    """Joint histogram of one level and level 0, used to make the level's table of an edited function."""

    level: Count
    """Level."""
    file: str
    """File of the matrix."""
    reference_mm: Annotated[float, Field(gt=0.0)]
    """Length of the path whose opacities are averaged: half a voxel of the level."""
    channel: ChannelName
    """Channel that it is for."""


class Editing(Record):
    """Data for editing a transfer function. Only the tables depend on the function."""

    histograms: tuple[JointHistogram, ...] = ()
    """One for each level except level 0; none for labels, because one table serves all their levels."""


def encode_histogram(shares: Shares) -> bytes:
    """Turn a matrix [256, 256], each of whose rows sums to 65535, into the bytes of its file."""
    bands = np.empty((BINS, 2), "<u2")
    entries = []
    for row, values in enumerate(shares):
        filled = np.flatnonzero(values)
        first, stop = int(filled[0]), int(filled[-1]) + 1
        bands[row] = first, stop - first
        entries.append(values[first:stop].astype("<u2").tobytes())
    return bands.tobytes() + b"".join(entries)


def decode_histogram(data: bytes, path: str) -> Shares:
    """Decode the matrix of a histogram file. Raises VP4032 for invalid bytes; `path` is for the message."""
    words = np.frombuffer(data[: len(data) // 2 * 2], "<u2")
    bands = words[: len(words) // 2 * 2][: 2 * BINS].astype(np.int64).reshape(-1, 2)
    if len(bands) != BINS or len(data) != 2 * (2 * BINS + int(bands[:, 1].sum())):
        raise VolprepError("VP4032", path=path, problem=f"it has {len(data)} bytes, which its bands do not take")
    if (bands.sum(axis=1) > BINS).any():
        raise VolprepError("VP4032", path=path, problem="a band goes beyond the last column")
    shares = np.zeros((BINS, BINS), np.uint16)
    at = 2 * BINS
    for row, (first, count) in enumerate(bands.tolist()):
        shares[row, first : first + count] = words[at : at + count]
        at += count
    if (shares.sum(axis=1, dtype=np.int64) != WHOLE).any():
        raise VolprepError("VP4032", path=path, problem=f"a row does not sum to {WHOLE}")
    return shares
