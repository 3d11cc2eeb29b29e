"""Levels refined through lit rays, after everything else: their voxels move until rays show the shade of level 0, too.

Filters, tables and the refinement of refined.py follow unlit light. Gradients of coarser voxels then shade a folded
surface otherwise than the scan's: that was all of the error beyond the tolerance of levels 2 of five scans. Where the
box cuts a body open, the shade of the cut is all that a picture along an axis shows. Here voxels take accelerated steps
along the adjoint of lit light (`trace_sums` of the native core), with the tables that the level has. Light comes from
the viewer; a level that suits all directions of the viewer suits other lights, too.

Steps are twice as long as the curvature says, and each follows an eighth of the rays, so that levels shake: the mean
over the last eight steps counts. Of some voxels an eighth of the rays passes the edge alone; its curvature is tiny, and
steps were so long that black specks appeared in the air (a fly: RMSE 0.039 in place of 0.029). So the curvature is at
least the mean over the parts. Too many steps fit the rays alone, on some scans sooner. So several means
are made. A level is only replaced by one that is nearer to level 0 in pixels of other views, as large as a voxel, and
of these the one is taken that is nearest in patches of three voxels: there people see a difference. Where the RMSE of
pictures hardly changes between the means, FLIP falls (level 2 of FLAIR: 0.093, 0.083, 0.077). The method is
volprep's own.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.appearance import largest_code
from volprep.parts.levels.cut_faces import cut_face_lines, cut_face_voxels
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.light import rmse_of
from volprep.parts.levels.rays import RaySegments, ends_in_box, unit
from volprep.parts.levels.refined import Refinement, rays_at, seen_voxels
from volprep.parts.levels.traced import Shading, order_in_space
from volprep.plan.level_choice import AdaptedTable, PictureErrors
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import Float32Array, Float64Array

_FEWEST_RAYS = 8000
_PARTS = 8
"""Parts of the rays; each step follows one."""
_AVERAGED = 8
"""Steps of a mean."""
_LONGER = 0.5
"""Curvature is divided by two: with all of it the FLIP of level 2 of norm was 0.088, with this 0.078."""
_TIE = 0.001
_PER_VOXEL = 3
"""Samples for each voxel of the level; with two the FLIP was higher by 1 to 8 %."""
_FINE_PER_VOXEL = 1
"""The same of level 0: with two, levels of four scans were no nearer."""
_MOST_BYTES = 2**24
"""Of level 0, which is in memory meanwhile. Rays through larger ones are long: level 3 of an MR of 33 MB would take 5
seconds, and be beyond the tolerance as before."""
_PAYS = 0.97
"""Error of a mean, as a part of that of the one before, from which on more steps are not worth their time."""
_PIXELS = 600
"""Pixels in which errors are measured, each through another place that is seen."""
_PIXELS_AT_FACES = 200
"""More of them, straight at faces that cut through something."""
_PIXEL, _PATCH = (1, 3), (3, 5)
"""Width of a pixel and of a patch in voxels, and rays along an edge of it."""
_SEED = 41


@dataclass(frozen=True)
class _Effort:
    """Work on one level."""

    rays_per_voxel: int
    """Rays for each voxel that is seen."""
    rays_at_faces: int
    """Rays for each voxel that is seen at a face of the box."""
    steps_at_faces: int
    """Steps along these alone, before all others."""
    means: tuple[int, ...]
    """Steps after which there is a mean, until one is not clearly nearer than the one before."""

    @property
    def steps(self) -> int:
        """All steps."""
        return self.steps_at_faces + self.means[-1]


@dataclass(frozen=True)
class LitBudget:
    """Budget for refining the levels of a channel through lit rays, in samples along all rays together."""

    fine: int
    """Samples of level 0."""
    coarse: int
    """Samples of all levels, in all steps and through all transfer functions."""
    efforts: tuple[_Effort, ...] = (_Effort(2, 8, 12, (8,)), _Effort(12, 24, 0, (16, 32, 48, 64)))
    """What may be done for a level, the least first: every level has the first one, the coarsest as much as it can."""


LIT_AUTO = LitBudget(fine=80_000_000, coarse=600_000_000)
"""About 3 processor seconds at most."""
LIT_THOROUGH = LitBudget(
    fine=500_000_000,
    coarse=2_000_000_000,
    efforts=(_Effort(3, 12, 0, (16,)), _Effort(6, 12, 0, (16, 32)), _Effort(12, 24, 0, (16, 32, 64))),
)


@dataclass(frozen=True)
class _KnownRays:
    """Rays whose lit light in level 0 is known. All levels share them: the light of level 0 is a fifth of the work."""

    lines: RaySegments
    lights: Mapping[str, Float64Array]
    """[n, 4] for each transfer function."""
    places_mm_xyz: Float64Array
    """[n, 3]: where they show most."""

    @classmethod
    def joined(cls, parts: "Sequence[_KnownRays]") -> "_KnownRays":
        """Return the rays of all parts."""
        names = parts[0].lights
        lights = {name: np.concatenate([part.lights[name] for part in parts]) for name in names}
        places_mm_xyz = np.concatenate([part.places_mm_xyz for part in parts])
        return cls(RaySegments.joined([part.lines for part in parts]), lights, places_mm_xyz)

    def first(self, count: int) -> "_KnownRays":
        """Return the first rays."""
        return self.taken(np.arange(min(count, len(self.lines.lengths_mm))))

    def taken(self, order: NDArray[np.intp]) -> "_KnownRays":
        """Return some rays in another order."""
        lights = {name: light[order] for name, light in self.lights.items()}
        return _KnownRays(self.lines.taken(order), lights, self.places_mm_xyz[order])


class LitLevels:
    """Refines levels of one volume through lit rays."""

    def __init__(self, scan: LevelInput, levels: Sequence[Factors], budget: LitBudget) -> None:
        """Take the volume and its levels, which are refined as far as the budget allows, coarsest first.

        When each has the least effort, the coarsest takes the rest of the budget.
        """
        self._scan = scan
        self._efforts: dict[Factors, _Effort] = {}
        self._rays_wanted = Lock()
        self._seen: dict[Factors, int] = {}
        """Voxels of each level that are seen."""
        if math.prod(scan.grid.shape_zyx) * scan.volume.dtype.itemsize > _MOST_BYTES:
            return
        blocks, shape_zyx = scan.looks.seen_blocks, scan.grid.shape_zyx
        self._seen = {factors: seen_voxels(blocks, factors, shape_zyx) for factors in levels}
        coarsest, *others = sorted(levels, key=math.prod, reverse=True)
        least, *more = budget.efforts
        tried = [*((level, least) for level in (coarsest, *others)), *((coarsest, level) for level in more)]
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
        steps = {factors: _PER_VOXEL * effort.steps / _PARTS for factors, effort in efforts.items()}
        of_levels = (
            sum(rays[factors]) * mean_mm / min(scan.spacing_mm_zyx(factors)) * steps[factors] for factors in efforts
        )
        fine = sum(map(max, zip(*rays.values(), strict=True)))
        return fine * mean_mm / min(scan.grid.spacing_mm_zyx) * _FINE_PER_VOXEL, sum(of_levels) * len(scan.tables)

    def _counts(self, factors: Factors, effort: _Effort) -> tuple[int, int]:
        """Return the number of rays in all directions, and of those straight at faces that cut through something."""
        at_faces = int(effort.rays_at_faces * cut_face_voxels(self._scan.looks.seen_blocks, factors))
        return max(effort.rays_per_voxel * self._seen[factors], _FEWEST_RAYS), at_faces

    @cached_property
    def _rays(self) -> tuple["_KnownRays", "_KnownRays"]:
        """Rays of all levels, in random order: those in all directions, and those straight at faces."""
        scan = self._scan
        grid, blocks = scan.grid, scan.looks.seen_blocks
        counts = [self._counts(*value) for value in self._efforts.items()]
        aimed, at_faces = map(max, zip(*counts, strict=True))
        coarsest, finest = (pick(self._efforts, key=math.prod) for pick in (max, min))
        per_voxel = -(-at_faces // max(1, int(cut_face_voxels(blocks, finest))))
        straight = cut_face_lines(grid, blocks, finest, per_voxel, _SEED).part(0, at_faces)
        return self._known(rays_at(grid, blocks, coarsest, aimed)), self._known(straight)

    def _known(self, lines: RaySegments) -> "_KnownRays":
        shading, lights = Shading.of(self._scan, (1, 1, 1)), {}
        for name, table in self._scan.tables.items():
            lights[name], places_mm_xyz = shading.light(self._fine, lines, table, _FINE_PER_VOXEL)
        return _KnownRays(lines, lights, places_mm_xyz)

    def _target(self, rays: "_KnownRays", factors: Factors, tables: Mapping[str, Float64Array]) -> Refinement:
        """Return what refines a level along rays, neighbours in space beside each other.

        A step then takes a third of the time, and each part of the rays sees the same share of each place.
        """
        rays = rays.taken(order_in_space(rays.places_mm_xyz, max(self._scan.grid.extent_mm_zyx)))
        return Refinement(
            lines=rays.lines,
            lights=rays.lights,
            tables=tables,
            adapt=False,
            per_voxel=_PER_VOXEL,
            parts=_PARTS,
            longer=_LONGER,
            tie=_TIE,
            shading=Shading.of(self._scan, factors),
            steady=True,
        )

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
        tables = {**scan.tables, **{table.transfer: np.array(table.entries) for table in own}}
        effort = self._efforts[factors]
        counts = self._counts(factors, effort)
        # Levels are refined in threads; one of them finds the rays of all.
        with self._rays_wanted:
            rays = self._rays
        aimed, at_faces = (known.first(count) for known, count in zip(rays, counts, strict=True))
        before = volume.read_slab(0, volume.shape_zyx[0])
        whole = np.float32(largest_code(volume.dtype))
        start, spacing_mm_zyx = before.astype(np.float32) / whole, scan.spacing_mm_zyx(factors)
        if effort.steps_at_faces and len(at_faces.lines.lengths_mm):
            target = self._target(at_faces, factors, tables)
            (start,) = _means(target, start, spacing_mm_zyx, (effort.steps_at_faces,))
        target = self._target(_KnownRays.joined([aimed, at_faces]), factors, tables)
        means = _means(target, start, spacing_mm_zyx, effort.means)
        in_pixels = self._pixels(factors, tables, *_PIXEL)
        levels, errors = [before], [in_pixels(before)]
        for mean in means:
            levels.append(np.rint(mean * whole).astype(volume.dtype))
            errors.append(in_pixels(levels[-1]))
            if len(errors) > 2 and errors[-1] > _PAYS * errors[-2]:
                break
        nearer = [number for number, error in enumerate(errors) if error < errors[0]] or [len(levels) - 1]
        best = nearer[0]
        if len(nearer) > 1:
            in_patches = self._pixels(factors, tables, *_PATCH)
            best = min(nearer, key=lambda number: in_patches(levels[number]))
        return levels[best], PictureErrors(refined=errors[best], other=errors[0])

    def _pixels(
        self, factors: Factors, tables: Mapping[str, Float64Array], voxels: int, across: int
    ) -> Callable[[NDArray[np.generic]], float]:
        """Return what gives the error of a level over seen pixels, so many voxels wide, the mean over functions."""
        pixels = _Pixels.of(self._scan, factors, voxels, across)
        truth = self._in_pixels(self._fine, (1, 1, 1), pixels, self._scan.tables)

        def error(codes: NDArray[np.generic]) -> float:
            light = self._in_pixels(codes, factors, pixels, tables)
            return float(np.mean([rmse_of(light[name], true) for name, true in truth.items()]))

        return error

    def _in_pixels(
        self, codes: NDArray[np.generic], factors: Factors, pixels: "_Pixels", tables: Mapping[str, Float64Array]
    ) -> dict[str, Float64Array]:
        """Return the light of pixels [n, 4]."""
        lit, count = Shading.of(self._scan, factors), _FINE_PER_VOXEL if factors == (1, 1, 1) else _PER_VOXEL
        return {name: pixels.means(lit.light(codes, pixels.lines, table, count)[0]) for name, table in tables.items()}


def _means(
    target: Refinement, start: Float32Array, spacing_mm_zyx: tuple[float, float, float], after: Sequence[int]
) -> Iterator[Float32Array]:
    """Yield the mean over the last steps, after some of them."""
    total = np.zeros(start.shape, np.float64)
    for step, level in enumerate(target.moving(start, spacing_mm_zyx, target.tables, after[-1]), 1):
        if any(end - _AVERAGED < step <= end for end in after):
            total += level
        if step in after:
            yield (total / _AVERAGED).astype(np.float32)
            total[:] = 0.0


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
        right_mm, up_mm = (offset.reshape(-1, 1) for offset in np.meshgrid(aside_mm, aside_mm))
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
