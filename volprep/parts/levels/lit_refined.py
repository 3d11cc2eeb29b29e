"""Levels refined through lit rays, after everything else: their voxels move until rays show the shade of level 0, too.

Filters, tables and the refinement of refined.py follow unlit light. Gradients of coarser voxels then shade a folded
surface otherwise than the scan's: that was all of the error beyond the tolerance of levels 2 of five scans. Where the
box cuts a body open, the shade of the cut is all that a picture along an axis shows. Here voxels take accelerated steps
along the adjoint of lit light (`lit_sums` of the native core), with the tables that the level has. Light comes from the
viewer; a level that suits all directions of the viewer suits other lights, too.

Steps are twice as long as the curvature says, and each follows an eighth of the rays, so that levels shake: the mean
over the last eight steps counts. Of some voxels an eighth of the rays passes the edge alone; its curvature is tiny, and
steps were so long that black specks appeared in the air (a fly: RMSE 0.039 in place of 0.029). So the curvature is at
least the mean over the parts. Too many steps fit the rays alone, on some scans sooner. Three means are made. A level is
only replaced by one that is nearer to level 0 in pixels of other views, as large as a voxel, and of these the one is
taken that is nearest in patches of three voxels: there people see a difference. Where the RMSE of pictures hardly
changes between the means, FLIP falls (level 2 of FLAIR: 0.093, 0.083, 0.077). The method is volprep's own.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.appearance import largest_code
from volprep.parts.levels.cut_faces import cut_face_lines, cut_face_voxels
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.light import rmse_of
from volprep.parts.levels.rays import RaySegments, ends_in_box, ray_counts, unit
from volprep.parts.levels.refined import Refinement, rays_at, seen_voxels
from volprep.plan.level_choice import AdaptedTable, PictureErrors
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.parts.normals.record import SOFT_SLOPE, halved_axes

_FEWEST_RAYS = 8000
_AVERAGED = 8
"""Steps of a mean: all parts of the rays."""
_LONGER = 0.5
"""Curvature is divided by two: with all of it the FLIP of level 2 of norm was 0.088, with this 0.078."""
_TIE = 0.001
_PER_VOXEL = 3
"""Samples for each voxel of the level; with two the FLIP was higher by 1 to 8 %."""
_FINE_PER_VOXEL = 2
_MOST_BYTES = 2**24
"""Of level 0, which is in memory meanwhile. Rays through larger ones are long: level 3 of an MR of 33 MB would take 5
seconds, and be beyond the tolerance as before."""
_PIXELS = 600
"""Pixels in which errors are measured, each through another place that is seen."""
_PIXELS_AT_FACES = 200
"""More of them, straight at faces that cut through something."""
_PIXEL, _PATCH = (1, 3), (3, 5)
"""Width of a pixel and of a patch in voxels, and rays along an edge of it."""
_SEED = 41


@dataclass(frozen=True)
class LitBudget:
    """Budget for refining the levels of a channel through lit rays, in samples along all rays together."""

    fine: int
    """Samples of level 0."""
    coarse: int
    """Samples of all levels, in all steps and through all transfer functions."""


LIT_AUTO = LitBudget(fine=160_000_000, coarse=600_000_000)
"""About 5 processor seconds at most."""
LIT_THOROUGH = LitBudget(fine=1_000_000_000, coarse=2_000_000_000)


@dataclass(frozen=True)
class _Effort:
    """Work on one level."""

    rays_per_voxel: int
    """Rays for each voxel that is seen."""
    rays_at_faces: int
    """Rays for each voxel that is seen at a face of the box."""
    means: tuple[int, ...]
    """Steps after which there is a mean. Level 2 of a fly is best after 16, of FLAIR, norm and a shell
    after 48."""


_EFFORTS = (_Effort(3, 12, (16,)), _Effort(6, 12, (16, 32)), _Effort(12, 24, (16, 32, 64)))
"""The least first. Level 2 of FLAIR had RMSE 0.037 with 8 rays for a voxel, with 12 it had 0.029. Level 2 of a sagittal
MR has 0.0356 after 48 steps, and 0.0340 after 64."""


@dataclass(frozen=True)
class _Shading:
    """How the samples of a level are lit."""

    spacing_mm_xyz: Float64Array
    apart_xyz: Float64Array
    """Voxels to each side of central differences."""
    soft_per_mm: float

    @classmethod
    def of(cls, scan: LevelInput, factors: Factors) -> "_Shading":
        """Return the shading of a level with these factors."""
        halved_xyz = halved_axes(factors)[::-1]
        return cls(
            np.array(scan.spacing_mm_zyx(factors)[::-1]),
            np.array([0.5 if halved else 1.0 for halved in halved_xyz]),
            SOFT_SLOPE / min(scan.grid.spacing_mm_zyx),
        )

    @property
    def numbers(self) -> tuple[Float64Array, Float64Array, float]:
        """The shading as the kernels take it."""
        return self.spacing_mm_xyz, self.apart_xyz, self.soft_per_mm

    def rays(
        self, lines: RaySegments, per_voxel: int
    ) -> tuple[Float64Array, Float64Array, Float64Array, NDArray[np.int64]]:
        """Return rays as the kernels take them: with so many samples for each voxel."""
        x_mm, y_mm, z_mm = self.spacing_mm_xyz.tolist()
        counts = ray_counts(lines.lengths_mm, (z_mm, y_mm, x_mm), per_voxel=per_voxel)
        return (
            np.ascontiguousarray(lines.starts_mm_xyz / self.spacing_mm_xyz - 0.5),
            np.ascontiguousarray(lines.directions_xyz / self.spacing_mm_xyz),
            np.ascontiguousarray(lines.lengths_mm),
            np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)]),
        )

    def light(
        self, codes: NDArray[np.generic], lines: RaySegments, table: Float64Array, per_voxel: int
    ) -> Float64Array:
        """Return the lit light [n, 4] of rays through codes [z, y, x]."""
        light = np.empty((len(lines.lengths_mm), 4))
        scale = 1.0 / largest_code(codes.dtype)
        _native.lit_light(codes, scale, *self.rays(lines, per_voxel), *self.numbers, table, light)
        return light


@dataclass(frozen=True, kw_only=True)
class _LitRefinement(Refinement):
    """Target of the refinement of a level: the lit light of rays through level 0."""

    shading: _Shading
    mean_after: tuple[int, ...]

    def means(self, start: Float32Array, spacing_mm_zyx: tuple[float, float, float]) -> Iterator[Float32Array]:
        """Yield the mean over the last steps at some of them."""
        total = np.zeros(start.shape, np.float64)
        for step, level in enumerate(self.moving(start, spacing_mm_zyx, self.tables, self.mean_after[-1]), 1):
            if any(end - _AVERAGED < step <= end for end in self.mean_after):
                total += level
            if step in self.mean_after:
                yield (total / _AVERAGED).astype(np.float32)
                total[:] = 0.0

    def sums(
        self,
        level: Float32Array,
        sloped: Mapping[str, tuple[Float64Array, Float64Array]],
        spacing_mm_zyx: tuple[float, float, float],  # noqa: ARG002 - the shading has it
    ) -> tuple[Float32Array, Float32Array]:
        """Return gradient and curvature of the squared error of light by each voxel, over all transfer functions."""
        sums = np.zeros((*level.shape, 2), np.float32)
        rays = self.shading.rays(self.lines, self.per_voxel)
        weights = np.ones(len(self.lines.lengths_mm))
        voxels = np.ascontiguousarray(level)
        for name, (table, slopes) in sloped.items():
            _native.lit_sums(voxels, *rays, *self.shading.numbers, table, slopes, self.lights[name], weights, sums)
        return sums[..., 0], np.float32(_LONGER) * sums[..., 1]


@dataclass(frozen=True)
class _KnownRays:
    """Rays whose lit light in level 0 is known. All levels share them: the light of level 0 is a fifth of the work."""

    lines: RaySegments
    lights: Mapping[str, Float64Array]
    """[n, 4] for each transfer function."""

    @classmethod
    def joined(cls, parts: "Sequence[_KnownRays]") -> "_KnownRays":
        """Return the rays of all parts."""
        names = parts[0].lights
        lights = {name: np.concatenate([part.lights[name] for part in parts]) for name in names}
        return cls(RaySegments.joined([part.lines for part in parts]), lights)

    def first(self, count: int) -> "_KnownRays":
        """Return the first rays."""
        return self.taken(np.arange(min(count, len(self.lines.lengths_mm))))

    def taken(self, order: NDArray[np.intp]) -> "_KnownRays":
        """Return some rays in another order."""
        return _KnownRays(self.lines.taken(order), {name: light[order] for name, light in self.lights.items()})


class LitLevels:
    """Refines levels of one volume through lit rays."""

    def __init__(self, scan: LevelInput, levels: Sequence[Factors], budget: LitBudget) -> None:
        """Take the volume and its levels, which are refined as far as the budget allows, coarsest first.

        When each has the least effort, the coarsest takes the rest of the budget.
        """
        self._scan = scan
        self._efforts: dict[Factors, _Effort] = {}
        if math.prod(scan.grid.shape_zyx) * scan.volume.dtype.itemsize > _MOST_BYTES:
            return
        coarsest, *others = sorted(levels, key=math.prod, reverse=True)
        least, *more = _EFFORTS
        tried = [*((each, least) for each in (coarsest, *others)), *((coarsest, each) for each in more)]
        for factors, effort in tried:
            wanted = {**self._efforts, factors: effort}
            fine, coarse = self._samples(wanted)
            if fine <= budget.fine and coarse <= budget.coarse:
                self._efforts = wanted

    def _samples(self, efforts: Mapping[Factors, _Effort]) -> tuple[float, float]:
        """Return about how many samples of level 0 and of the levels some efforts take."""
        scan = self._scan
        rays = {factors: self._counts(factors, effort) for factors, effort in efforts.items()}
        # Light starts at any place of the box, and crosses it: rays are about as long as its mean edge.
        mean_mm = float(np.mean(scan.grid.extent_mm_zyx))
        steps = {factors: _PER_VOXEL * effort.means[-1] / _AVERAGED for factors, effort in efforts.items()}
        of_levels = (
            sum(rays[factors]) * mean_mm / min(scan.spacing_mm_zyx(factors)) * steps[factors] for factors in efforts
        )
        fine = sum(map(max, zip(*rays.values(), strict=True)))
        return fine * mean_mm / min(scan.grid.spacing_mm_zyx) * _FINE_PER_VOXEL, sum(of_levels) * len(scan.tables)

    def _counts(self, factors: Factors, effort: _Effort) -> tuple[int, int]:
        """Return the number of rays in all directions, and of those straight at faces that cut through something."""
        blocks = self._scan.looks.seen_blocks
        voxels = seen_voxels(blocks, factors, self._scan.grid.shape_zyx)
        at_faces = int(effort.rays_at_faces * cut_face_voxels(blocks, factors))
        return max(effort.rays_per_voxel * voxels, _FEWEST_RAYS), at_faces

    @cached_property
    def _rays(self) -> tuple["_KnownRays", "_KnownRays"]:
        """Rays of all levels, in random order: those in all directions, and those straight at faces."""
        scan = self._scan
        grid, blocks = scan.grid, scan.looks.seen_blocks
        counts = [self._counts(*each) for each in self._efforts.items()]
        aimed, at_faces = map(max, zip(*counts, strict=True))
        coarsest, finest = (pick(self._efforts, key=math.prod) for pick in (max, min))
        per_voxel = -(-at_faces // max(1, int(cut_face_voxels(blocks, finest))))
        straight = cut_face_lines(grid, blocks, finest, per_voxel, _SEED).part(0, at_faces)
        return self._known(rays_at(grid, blocks, coarsest, aimed)), self._known(straight)

    def _known(self, lines: RaySegments) -> "_KnownRays":
        return _KnownRays(lines, self._light(self._fine, (1, 1, 1), lines, self._scan.tables))

    def _rays_of(self, factors: Factors) -> "_KnownRays":
        """Return the rays of a level, in random order."""
        counts = self._counts(factors, self._efforts[factors])
        rays = _KnownRays.joined([known.first(count) for known, count in zip(self._rays, counts, strict=True)])
        return rays.taken(np.random.default_rng(_SEED).permutation(len(rays.lines.lengths_mm)))

    @cached_property
    def _fine(self) -> NDArray[np.generic]:
        """Codes of level 0."""
        return np.ascontiguousarray(self._scan.volume.read_slab(0, self._scan.volume.shape_zyx[0]))

    def refines(self, factors: Factors) -> bool:
        """Return whether the level with these factors can be refined within the budget."""
        return factors in self._efforts

    def refined(
        self, volume: RawVolume, factors: Factors, own: Sequence[AdaptedTable]
    ) -> tuple[NDArray[np.generic], PictureErrors]:
        """Return a level refined from what `volume` holds, and the errors of both in lit pixels.

        `own` are the tables of its own.
        """
        scan = self._scan
        tables = {**scan.tables, **{each.transfer: np.array(each.entries) for each in own}}
        rays = self._rays_of(factors)
        refinement = _LitRefinement(
            lines=rays.lines,
            lights=rays.lights,
            tables=tables,
            adapt=False,
            per_voxel=_PER_VOXEL,
            parts=_AVERAGED,
            tie=_TIE,
            shading=_Shading.of(scan, factors),
            steady=True,
            mean_after=self._efforts[factors].means,
        )
        before = volume.read_slab(0, volume.shape_zyx[0])
        whole = np.float32(largest_code(volume.dtype))
        means = refinement.means(before.astype(np.float32) / whole, scan.spacing_mm_zyx(factors))
        levels = [before, *(np.rint(level * whole).astype(volume.dtype) for level in means)]
        in_pixels, in_patches = (self._errors(levels, factors, tables, *size) for size in (_PIXEL, _PATCH))
        nearer = [number for number, error in enumerate(in_pixels) if error < in_pixels[0]]
        best = min(nearer or [len(levels) - 1], key=lambda number: in_patches[number])
        return levels[best], PictureErrors(refined=in_pixels[best], other=in_pixels[0])

    def _errors(
        self,
        levels: Sequence[NDArray[np.generic]],
        factors: Factors,
        tables: Mapping[str, Float64Array],
        voxels: int,
        across: int,
    ) -> list[float]:
        """Return the error of levels over seen pixels, so many voxels wide, the mean over transfer functions."""
        pixels = _Pixels.of(self._scan, factors, voxels, across)
        truth = self._in_pixels(self._fine, (1, 1, 1), pixels, self._scan.tables)
        lights = (self._in_pixels(codes, factors, pixels, tables) for codes in levels)
        return [float(np.mean([rmse_of(light[name], true) for name, true in truth.items()])) for light in lights]

    def _in_pixels(
        self, codes: NDArray[np.generic], factors: Factors, pixels: "_Pixels", tables: Mapping[str, Float64Array]
    ) -> dict[str, Float64Array]:
        """Return the light of pixels [n, 4]."""
        light = self._light(codes, factors, pixels.lines, tables)
        return {name: pixels.means(each) for name, each in light.items()}

    def _light(
        self, codes: NDArray[np.generic], factors: Factors, lines: RaySegments, tables: Mapping[str, Float64Array]
    ) -> dict[str, Float64Array]:
        shading = _Shading.of(self._scan, factors)
        per_voxel = _FINE_PER_VOXEL if factors == (1, 1, 1) else _PER_VOXEL
        return {name: shading.light(codes, lines, table, per_voxel) for name, table in tables.items()}


@dataclass(frozen=True)
class _Pixels:
    """Pixels of many views."""

    lines: RaySegments
    """Those of their rays that meet the box."""
    meets: NDArray[np.bool_]
    """Which rays do [pixel, ray]."""

    @classmethod
    def of(cls, scan: LevelInput, factors: Factors, voxels: int, across: int) -> "_Pixels":
        """Return pixels, so many voxels of a level wide, around rays that are aimed at visible voxels."""
        blocks = scan.looks.seen_blocks
        middles = RaySegments.joined(
            [
                aimed_lines(scan.grid, blocks, float(max(factors)), _PIXELS, _SEED),
                cut_face_lines(scan.grid, blocks, factors, 1, _SEED + 1).part(0, _PIXELS_AT_FACES),
            ]
        )
        directions = middles.directions_xyz
        beside = unit(np.cross(directions, np.eye(3)[np.abs(directions).argmin(axis=1)]))
        above = np.cross(directions, beside)
        aside_mm = (np.arange(across) - (across - 1) / 2) * voxels * min(scan.spacing_mm_zyx(factors)) / across
        right_mm, up_mm = (each.reshape(-1, 1) for each in np.meshgrid(aside_mm, aside_mm))
        points_mm = middles.starts_mm_xyz[:, None] + right_mm * beside[:, None] + up_mm * above[:, None]
        points_mm, every = points_mm.reshape(-1, 3), np.repeat(directions, across**2, axis=0)
        enter_mm, leave_mm = ends_in_box(points_mm, every, np.array(scan.grid.extent_mm_zyx[::-1]))
        meets = leave_mm - enter_mm > min(scan.grid.spacing_mm_zyx)
        starts_mm_xyz = (points_mm + enter_mm[:, None] * every)[meets]
        lines = RaySegments(starts_mm_xyz, every[meets], (leave_mm - enter_mm)[meets])
        return cls(lines, meets.reshape(-1, across**2))

    def means(self, light: Float64Array) -> Float64Array:
        """Return the mean light [pixel, 4] of the rays of each pixel; rays that miss the box count as dark."""
        every = np.zeros((*self.meets.shape, 4))
        every[self.meets] = light
        mean: Float64Array = every.mean(axis=1)
        return mean
