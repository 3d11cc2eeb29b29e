"""Normals of every level that the package holds, measured at level 0 and encoded in one pass, slab by slab.

Coarse normals are made from the fine gradients, not from coarse values: their mean over a voxel's block.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep import _native
from volprep.normals.codes import DIRECTION_BYTES, LARGEST_LENGTH
from volprep.normals.gradient import direction_matrix, length_scale
from volprep.plan import NormalsPlan, NormalTexturePlan, Plan
from volprep.render.gl_formats import KTX2_FORMAT, gl_format
from volprep.slabs import RawVolume, bytes_of, slab_ranges
from volprep.stages import Changes, Stage, with_textures
from volprep.work import codes_of_source
from volprep_formats.package.draft import Draft
from volprep_formats.package.manifest import Texture
from volprep_formats.package.normals import Normals
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2


def _settings(plan: Plan) -> tuple[Record, ...]:
    return (plan.grid, plan.quantize, *plan.levels, *(() if plan.normals is None else (plan.normals,)))


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    normals = plan.normals
    if normals is None:
        return {}
    source = codes_of_source(draft, plan)
    progress.start("normals", source.shape_zyx[0] * (len(normals.textures) + normals.magnitude))
    encoder = _Encoder(plan, normals, source, progress)
    for texture in normals.textures:
        draft.write(texture.file, "texture", encoder.file(texture))
    meaning = Normals(
        kernel=normals.kernel,
        code=normals.code,
        space=normals.space,
        largest_gradient=encoder.largest_gradient if normals.magnitude else None,
    )
    textures = tuple(
        Texture(
            name=texture.name,
            role="normals",
            file=texture.file,
            shape_zyx=texture.shape_zyx,
            gl=gl_format(normals.format, "TEXTURE_3D", plan.profile.api),
            level=texture.level,
            filter=normals.filter,
            normals=meaning,
        )
        for texture in normals.textures
    )
    return {"textures": with_textures(draft.manifest, textures)}


class _Encoder:
    """Encodes the gradients of level 0, for one level after the other."""

    def __init__(self, plan: Plan, normals: NormalsPlan, source: RawVolume, progress: Progress) -> None:
        self._plan = plan
        self._normals = normals
        self._source = source
        self._progress = progress
        self._matrix = direction_matrix(plan.grid, normals.space)
        self._longest = self._longest_vector() if normals.magnitude else 0.0
        low, high = plan.quantize.window
        physical_per_code = (high - low) / (2**plan.quantize.bits - 1)
        self.largest_gradient = self._longest * length_scale(plan.grid, normals.kernel, physical_per_code)
        """Longest gradient of level 0, in physical units per millimetre: none of a coarser level is longer."""

    def file(self, texture: NormalTexturePlan) -> Iterator[bytes | memoryview]:
        """Give the KTX 2 file of a level in pieces."""
        yield ktx2.header(KTX2_FORMAT[self._normals.format], texture.shape_zyx, 3)
        factors = self._plan.level(texture.level).factors_zyx
        for slab, halo in self._slabs(factors[0]):
            yield bytes_of(self._codes(slab, halo, factors))

    def _codes(self, slab: NDArray[Any], halo: tuple[bool, bool], factors: tuple[int, int, int]) -> NDArray[np.uint8]:
        normals = self._normals
        inner = (slab.shape[0] - sum(halo), *slab.shape[1:])
        shape = tuple(-(-n // factor) for n, factor in zip(inner, factors, strict=True))
        codes = np.empty((*shape, DIRECTION_BYTES[normals.code] + normals.magnitude), np.uint8)
        # A volume of one value has no length to scale by, and every code of a length is 0.
        per_length = LARGEST_LENGTH[normals.code] / (self._longest or 1.0) if normals.magnitude else 0.0
        if factors == (1, 1, 1):
            _native.normals(slab, normals.kernel, halo, self._matrix, normals.code, per_length, codes)
        else:
            _native.coarse_normals(slab, normals.kernel, halo, factors, self._matrix, normals.code, per_length, codes)
        return codes

    def _longest_vector(self) -> float:
        return max(
            _native.largest_gradient(slab, self._normals.kernel, halo, self._matrix) for slab, halo in self._slabs(1)
        )

    def _slabs(self, multiple: int) -> Iterator[tuple[NDArray[Any], tuple[bool, bool]]]:
        """Slabs of whole blocks with their neighbours' next slices, and which of these there are."""
        depth = self._source.shape_zyx[0]
        for z0, z1 in slab_ranges(depth, self._source.slice_bytes, multiple=multiple):
            halo = (z0 > 0, z1 < depth)
            yield self._source.read_slab(z0 - halo[0], z1 + halo[1]), halo
            self._progress.advance(z1 - z0)


STAGE = Stage(name="normals", reads=("quantize",), settings=_settings, run=_run)
