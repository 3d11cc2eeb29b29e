"""Labels of coarser levels: the most frequent label of each block, with more votes for labels that would vanish.

With the most frequent label alone, structures thinner than a block vanish. So a label that keeps less than half of its
volume, or of its light (volprep/truth/labelled_light.py), gets more votes, until it keeps that much. Values of a level
are means over blocks: a thin bright label keeps less light than volume. It may then grow to twice its volume, but only
if it can keep half of its light at all. Looks that an app changes do not count, nor what hides a label.

With 188 labels of a brain and levels of a half, a quarter and an eighth, 2, 8 and 59 labels kept less than half of
their volume, and now 0, 1 and 4, each of less than half a voxel of the level. In pictures of all segments, of the 60
smallest and of a random half of them the error over seen pixels rose by at most 0.3 %, and fell by 2 to 12 % at an
eighth, where the light of the smallest was 0.71 and 0.82 of the truth's in two views, and is 1.01 and 1.06.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.segmentations.records import LabelArray

LEAST_SHARE = 0.5
"""Part of its volume, and of its light, that a label keeps."""
_MOST_GROWTH = 2.0
"""A label that lacks light grows to this many times its volume at most."""
_MORE_VOTES = 1.02
_ROUNDS = 640
"""After so many rounds a single voxel has more votes than 100,000 others of its block."""
_SPREAD_ZYX, _SPREAD_LABEL = (0.8191725133961645, 0.6710436067037893, 0.5497004779019702), 0.6180339887498949
"""Multiples of them, without their whole part, are spread evenly over blocks along each axis, and over labels."""


class LevelLight(NamedTuple):
    """Inputs of the light that the labels of a level give."""

    wanted: Float64Array
    """Light of each label in the scan, in voxels of the level times extinction."""
    extinctions: Float64Array
    """Extinction per millimetre of each style, [style, code]."""
    style_of: NDArray[np.intp]
    """Style of each label."""
    codes: NDArray[np.generic]
    """Codes of the level [z, y, x]."""

    def of(self, blocks: NDArray[np.int64], labels: LabelArray) -> Float64Array:
        """Return the light of blocks, if these labels have them."""
        found: Float64Array = self.extinctions[self.style_of[labels], self.codes.reshape(-1)[blocks]]
        return found


class _Contested(NamedTuple):
    """The labels of blocks that have several: entries in the order of blocks, and of labels in each."""

    block: NDArray[np.int64]
    label: LabelArray
    voxels: NDArray[np.int64]

    @classmethod
    def of(cls, parts: "list[_Contested]") -> "_Contested":
        block, label, voxels = (np.concatenate(value) for value in zip(*parts, strict=True))
        return cls(block, label, voxels)

    def only(self, chosen: NDArray[np.bool_]) -> "_Contested":
        return _Contested(self.block[chosen], self.label[chosen], self.voxels[chosen])

    @property
    def starts(self) -> NDArray[np.intp]:
        """First entry of each block."""
        return np.flatnonzero(np.diff(self.block, prepend=-1))

    def most_in_block(self, numbers: Float64Array) -> Float64Array:
        """Return, for each entry, the largest number of the entries of its block."""
        starts = self.starts
        lengths = np.diff(starts, append=len(self.block))
        return np.repeat(np.maximum.reduceat(numbers, starts), lengths)


def coarse_labels(labels: LabelArray, factors_zyx: tuple[int, int, int], light: LevelLight | None = None) -> LabelArray:
    """Return the labels of a level [z, y, x] whose voxels are blocks of `factors_zyx` voxels, fewer at the end.

    Without `light` only volumes count.
    """
    shape = tuple(-(-n // f) for n, f in zip(labels.shape, factors_zyx, strict=True))
    result = np.empty(shape, np.uint16)
    rows = np.arange(labels.shape[1]) // factors_zyx[1] * shape[2]
    columns = np.arange(labels.shape[2]) // factors_zyx[2]
    blocks = np.broadcast_to((rows[:, None] + columns)[None], (factors_zyx[0], *labels.shape[1:]))
    parts = []
    for z in range(shape[0]):
        own = labels[z * factors_zyx[0] : (z + 1) * factors_zyx[0]]
        result[z] = own[0, :: factors_zyx[1], :: factors_zyx[2]]
        if not (own == own[0, 0, 0]).all():
            parts.append(_contested(own.ravel(), blocks[: len(own)].ravel(), z * shape[1] * shape[2]))
    if parts:
        _choose(result, _Contested.of(parts), int(labels.max()) + 1, light)
    return result


def _contested(labels: LabelArray, blocks: NDArray[np.intp], first: int) -> _Contested:
    """Count the labels of blocks, which are numbered from `first` on."""
    keys, voxels = np.unique(blocks.astype(np.int64) << 16 | labels, return_counts=True)
    found = _Contested((keys >> 16) + first, (keys & 0xFFFF).astype(np.uint16), voxels)
    _, which, entries = np.unique(found.block, return_inverse=True, return_counts=True)
    return found.only(entries[which] > 1)


def _choose(level: LabelArray, contested: _Contested, labels: int, light: LevelLight | None) -> None:
    """Set contested blocks to the label with the most votes; of labels that vanish, voxels have more and more votes."""
    if not len(contested.block):
        return
    alone = np.ones(level.size, np.bool_)
    alone[contested.block] = False
    settled = np.bincount(level.reshape(-1)[alone], minlength=labels)
    shares = contested.voxels / _sum_over_blocks(contested)
    wanted = settled + np.bincount(contested.label, weights=shares, minlength=labels)
    is_dark = None if light is None else _darkness(level, contested, np.flatnonzero(alone), light)
    votes = np.ones(labels)
    open_ = contested
    for _ in range(_ROUNDS):
        _vote(level, open_, votes)
        count = np.bincount(level.reshape(-1), minlength=labels)
        low = count < LEAST_SHARE * wanted
        if is_dark is not None:
            low |= is_dark(labels) & (count < _MOST_GROWTH * wanted)
        # Less than half a voxel of the level is nearer to none than to one.
        low &= wanted >= 0.5
        if not low.any():
            return
        votes[low] *= _MORE_VOTES
        # Elsewhere nothing changes.
        open_ = contested.only(contested.most_in_block(votes[contested.label]) > 1.0)


def _darkness(
    level: LabelArray, contested: _Contested, alone: NDArray[np.intp], light: LevelLight
) -> Callable[[int], NDArray[np.bool_]]:
    """Return a function that says which labels keep too little light in `level` as it is, and could keep enough."""
    flat, blocks = level.reshape(-1), np.unique(contested.block)
    settled = np.bincount(flat[alone], light.of(alone, flat[alone]), len(light.wanted))
    most = settled + np.bincount(contested.label, light.of(contested.block, contested.label), len(settled))
    enough = LEAST_SHARE * light.wanted
    possible = most >= enough

    def is_dark(labels: int) -> NDArray[np.bool_]:
        held = settled + np.bincount(flat[blocks], light.of(blocks, flat[blocks]), len(settled))
        dark: NDArray[np.bool_] = ((held < enough) & possible)[:labels]
        return dark

    return is_dark


def _sum_over_blocks(contested: _Contested) -> Float64Array:
    starts = contested.starts
    lengths = np.diff(starts, append=len(contested.block))
    return np.repeat(np.add.reduceat(contested.voxels, starts), lengths).astype(np.float64)


def _vote(level: LabelArray, contested: _Contested, votes: Float64Array) -> None:
    """Set each block to the label with the most votes, the smallest of equals."""
    # From votes to their square, by the block: of equal blocks along a thin structure only some are won.
    own = votes[contested.label]
    along = zip(_SPREAD_ZYX, np.unravel_index(contested.block, level.shape), strict=True)
    phase = (sum(step * place for step, place in along) + _SPREAD_LABEL * contested.label) % 1.0
    cast = contested.voxels * own * (1.0 + (own - 1.0) * phase)
    winners = np.flatnonzero(cast == contested.most_in_block(cast))
    # Entries of a block are in the order of labels: later ones are written first.
    level.reshape(-1)[contested.block[winners[::-1]]] = contested.label[winners[::-1]]
