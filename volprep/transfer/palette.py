"""Palettes: a transfer function in few colours.

Devices with shader constants but no room for more took 60 entries (mobile volume rendering thesis, section 7.3 and
appendix: `uniform vec4 paletteLUT[60]`, because few GPUs of its time had 256 constants); those with the fixed-function
pipeline take 16 or 256 for GL_PALETTE4_RGBA8_OES and GL_PALETTE8_RGBA8_OES (Moser and Weiskopf 2008, section 4).

`even_palette` is the first: equidistant entries; a shader takes the nearest (the thesis takes the one
below, half an entry off). `best_palette` is the second: each code names its entry, so that entries lie where colours
change.
"""

from dataclasses import dataclass

import numpy as np

from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction


@dataclass(frozen=True)
class IndexedColours:
    """Colours, and which one each code gets."""

    colours: UInt8Array
    """[entry, 4] RGBA, in the order of the first code that uses them."""
    indices: UInt8Array
    """[code]: the entry of each code."""
    rmse: float
    """Root mean square difference of a channel over the codes, weighted, of 0 to 1."""
    maximum: float
    """Largest difference of a channel of a code with weight, of 0 to 1."""


def even_palette(
    function: TransferFunction, window: tuple[float, float], entries: int
) -> tuple[Float64Array, Float64Array]:
    """Colours [entry, 3] and extinctions per millimetre [entry]; entry j is for values nearest to j / (entries - 1)."""
    return Table.exact(function).at(np.linspace(*window, entries))


def palette_of_codes(rgba: UInt8Array) -> IndexedColours:
    """Return the palette whose entry j is the colour of code j, so that another function needs no other texels."""
    return IndexedColours(colours=rgba, indices=np.arange(len(rgba), dtype=np.uint8), rmse=0.0, maximum=0.0)


def best_palette(rgba: UInt8Array, entries: int, weights: Float64Array | None = None) -> IndexedColours:
    """Choose the best `entries` colours for the colours of codes.

    Codes keep their order: neighbours share a colour, the mean of theirs. Of all ways to cut the codes into so many
    runs this is the one with the least sum of squares (dynamic programming, after Fisher 1958). Runs with one colour
    then share an entry, so that a palette with room for all different colours is exact.

    Parameters
    ----------
    rgba
        Colour of each code, [code, 4] uint8, at most 256 codes; premultiplied or not, as it will be used.
    entries
        Most colours, 1 to 256.
    weights
        Number of times each code occurs; equal for all if absent. Codes with weight 0 get a colour all the same.
    """
    count = len(rgba)
    if not 1 <= entries <= 256 or not 1 <= count <= 256:
        msg = f"{entries} entries for {count} codes, expected 1 to 256 of each"
        raise ValueError(msg)
    share = np.ones(count) if weights is None else np.asarray(weights, dtype=np.float64)
    # A trace of weight keeps runs of codes that do not occur from being undefined.
    share = np.maximum(share / max(share.max(), 1e-300), 1e-9)
    colours, indices = np.unique(rgba, axis=0, return_inverse=True)
    if len(colours) > entries:
        means = np.empty((count, 4))
        for low, high in _runs(rgba.astype(np.float64), share, entries):
            means[low:high] = np.average(rgba[low:high], axis=0, weights=share[low:high])
        colours, indices = np.unique(np.rint(means).astype(np.uint8), axis=0, return_inverse=True)
    _, first = np.unique(indices, return_index=True)
    order = np.argsort(first)
    rank = np.argsort(order)
    found = rank[indices.ravel()].astype(np.uint8)
    error = (colours[order][found].astype(np.float64) - rgba) / 255
    seen = error if weights is None else error[np.asarray(weights) > 0]
    return IndexedColours(
        colours=np.ascontiguousarray(colours[order]),
        indices=found,
        rmse=float(np.sqrt(np.average(np.mean(error**2, axis=1), weights=share))),
        maximum=float(np.abs(seen).max(initial=0.0)),
    )


def _runs(rgba: Float64Array, weights: Float64Array, entries: int) -> list[tuple[int, int]]:
    """Cut codes into at most `entries` runs with the least sum of squared distances to their means."""
    count = len(rgba)
    mass = np.concatenate([[0.0], np.cumsum(weights)])
    first = np.concatenate([np.zeros((1, 4)), np.cumsum(weights[:, None] * rgba, axis=0)])
    second = np.concatenate([[0.0], np.cumsum(weights * (rgba**2).sum(axis=1))])
    low, high = np.triu_indices(count + 1, 1)
    cost = np.full((count + 1, count + 1), np.inf)
    total = first[high] - first[low]
    cost[low, high] = second[high] - second[low] - (total**2).sum(axis=1) / (mass[high] - mass[low])
    # ends[k][j]: least cost of the codes before j in k + 1 runs; starts[k][j]: where the last of these runs begins.
    ends = [cost[0]]
    starts = [np.zeros(count + 1, dtype=np.intp)]
    for _ in range(1, min(entries, count)):
        through = ends[-1][:, None] + cost
        starts.append(through.argmin(axis=0))
        ends.append(through.min(axis=0))
    runs = []
    stop = count
    for start in reversed(starts):
        runs.append((int(start[stop]), stop))
        stop = int(start[stop])
    return runs[::-1]
