"""Normals of every level that the package holds, measured at level 0 and encoded in one pass, slab by slab.

Coarse normals are made from the fine gradients, not from coarse values: their mean over a voxel's block. Normals of
labels are normals of their extinction, which does not depend on how labels are numbered, at each level: with means of
fine ones, the inside of coarse voxels at a border was as dark as the border.
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.gradient import direction_scale
from volprep.parts.mosaic.packing import pack_mosaic
from volprep.parts.stage import Shapes, Stage, Work, any_channel, required
from volprep.parts.work import codes_of_level, codes_of_source, grid_of_level
from volprep.plan.products import NormalsPlan, NormalTexturePlan
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.scan.slabs import bytes_of, slab_ranges
from volprep_formats.arrays import UInt8Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.normals.record import DIRECTION_BYTES, Normals
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture, dimension_of
from volprep_formats.progress import Progress
from volprep_formats.record import Record, present
from volprep_formats.textures import ktx2


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    shown = plan.transfer_functions if plan.quantize.labels else ()
    return (plan.grid, plan.quantize, *plan.levels, *shown, *present(plan.part(NormalsPlan)))


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    normals = required(plan.part(NormalsPlan))
    encoder = _Encoder(draft, plan, normals, progress)
    for texture in normals.textures:
        for part, path in enumerate(texture.files):
            draft.write(path, "texture", encoder.file(texture, part))
    meaning = Normals(kernel=normals.kernel, code=normals.code)
    textures = tuple(
        Texture(
            name=name,
            role="normals",
            file=path,
            part=part,
            shape_zyx=texture.shape_zyx,
            format=normals.format,
            dimension=dimension_of(texture.mosaic),
            level=texture.level,
            channels=(plan.channel,),
            mosaic=texture.mosaic,
            filter=normals.filter,
            normals=meaning,
        )
        for texture in normals.textures
        for part, (name, path) in enumerate(zip(texture.names, texture.files, strict=True))
    )
    return Contribution(textures=textures)


class _Encoder:
    """Encodes the gradients of level 0, or of labels of each level, for one level after the other."""

    def __init__(self, draft: Draft, plan: ChannelPlan, normals: NormalsPlan, progress: Progress) -> None:
        self._draft = draft
        self._plan = plan
        self._normals = normals
        self._source = codes_of_source(draft, plan)
        self._progress = progress
        progress.start("normals", self._source.shape_zyx[0] * len(normals.textures))
        self._scale = direction_scale(plan.grid)
        self._factors_zyx = (1, 1, 1)
        self._shown = _extinctions(plan) if plan.quantize.labels else None

    def file(self, texture: NormalTexturePlan, part: int) -> Iterator[bytes | memoryview]:
        """Return a KTX 2 file of a level in pieces: its 3D texture, or one of the textures of its mosaic."""
        level = self._plan.level(texture.level)
        self._measure_on(level)
        if texture.mosaic is None:
            yield ktx2.header(self._normals.format, texture.shape_zyx, 3)
            factor = self._factors_zyx[0]
            depth, slice_bytes = self._source.shape_zyx[0], self._source.slice_bytes
            for z0, z1 in slab_ranges(depth, slice_bytes, multiple=factor):
                yield bytes_of(self._codes(level, z0 // factor, -(-z1 // factor)))
            return
        yield ktx2.header(self._normals.format, texture.shape_zyx, 2)
        for strip in pack_mosaic(partial(self._codes, level), texture.mosaic, part):
            yield bytes_of(strip)

    def _measure_on(self, level: LevelPlan) -> None:
        """Take the gradients for a level from its labels, or the gradients of level 0."""
        self._factors_zyx = level.factors_zyx
        if self._shown is not None:
            self._source, self._factors_zyx = codes_of_level(self._draft, self._plan, level.index), (1, 1, 1)
            self._scale = direction_scale(grid_of_level(self._plan, level))

    def _codes(self, level: LevelPlan, z0: int, z1: int) -> UInt8Array:
        """Encode slices z0 to z1 - 1 of a level as [z, y, x, byte]."""
        _, height, width = level.shape_zyx
        codes = np.empty((z1 - z0, height, width, DIRECTION_BYTES[self._normals.code]), np.uint8)
        factor = self._factors_zyx[0]
        begin, end = z0 * factor, min(z1 * factor, self._source.shape_zyx[0])
        for first, last in slab_ranges(end - begin, self._source.slice_bytes, multiple=factor):
            slab, halo = self._slab(begin + first, begin + last)
            self._encode(slab, halo, codes[first // factor : -(-last // factor)])
        return codes

    def _encode(self, slab: NDArray[Any], halo: tuple[bool, bool], codes: UInt8Array) -> None:
        normals, factors = self._normals, self._factors_zyx
        if factors == (1, 1, 1):
            _native.normals(slab, normals.kernel, halo, self._scale, normals.code, codes)
        else:
            _native.coarse_normals(slab, normals.kernel, halo, factors, self._scale, normals.code, codes)

    def _slab(self, z0: int, z1: int) -> tuple[NDArray[Any], tuple[bool, bool]]:
        """Slices of level 0 with their neighbours' next slices, and which of these there are."""
        halo = (z0 > 0, z1 < self._source.shape_zyx[0])
        slab = self._source.read_slab(z0 - halo[0], z1 + halo[1])
        self._progress.advance(z1 - z0)
        return slab if self._shown is None else self._shown[slab], halo


def _extinctions(plan: ChannelPlan) -> NDArray[np.uint16]:
    """Return the extinction of each code of labels, as part of the largest one."""
    low, high = plan.quantize.window
    values = np.linspace(low, high, 2**plan.quantize.bits)
    extinctions = np.minimum(Table.exact(plan.transfer_functions[0]).at(values)[1], 1e9)
    parts: NDArray[np.uint16] = np.rint(65535 * extinctions / max(extinctions.max(), 1e-12)).astype(np.uint16)
    return parts


def _shapes(_draft: Draft, plan: ChannelPlan) -> Shapes:
    textures = required(plan.part(NormalsPlan)).textures
    return {path: texture.shape_zyx for texture in textures for path in texture.files}


STAGE = Stage(
    name="normals",
    summary="Write the normals of every level, even if the scene needs none.",
    options=("normals", ("kernel", "code")),
    reads=("quantize", "pyramid"),
    channel=Work(_settings, _run, _shapes),
    is_needed=any_channel(lambda plan: plan.part(NormalsPlan)),
)
