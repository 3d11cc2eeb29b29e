"""A walk over the grid of sub-volumes: which level is shown, and around which point (Schultz and Bailey, 7.3).

There the thresholds of the zoom are chosen by hand. Here they are sizes of voxels in pixels, with room between them, so
that a small change of the zoom does not change the level to and fro. Moves along x and y count from an angle of 22.5°
at both ends of theta: the paper prints 27.5° at one end, and a mirrored view would not give the mirrored move.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from volprep.scene.walk import WalkStep
from volprep.truth.camera import Camera, standard_views
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid, Vector
from volprep_formats.package.manifest import Projection
from volprep_formats.package.parts.subvolumes.places import inner_point, voxel_of
from volprep_formats.package.parts.subvolumes.record import Move, SubvolumeGrid, ViewThresholds

_MIDDLE = (0.5, 0.5, 0.5)


@dataclass(frozen=True)
class Ground:
    """The volume that a walk leads through."""

    grid: SubvolumeGrid
    """The sub-volumes."""
    level_grid: Grid
    """Voxels of level 0."""
    voxel_mm: Mapping[int, float]
    """Shortest side of a voxel by level; level 0 is that of the sub-volumes."""
    projection: Projection
    """Projection of the package."""
    pixels: int
    """Height of the pictures."""

    @property
    def diagonal_mm(self) -> float:
        """Height of a picture whose zoom is 1."""
        return float(np.linalg.norm(self.level_grid.extent_mm_zyx))

    def pixel_mm(self, zoom: float) -> float:
        """Size of a pixel at a zoom."""
        return self.diagonal_mm / zoom / self.pixels

    @property
    def middle(self) -> Vector:
        """The voxel in the middle of the volume."""
        z, y, x = ((n - 1) / 2 for n in self.level_grid.shape_zyx)
        return x, y, z


@dataclass(frozen=True)
class Walker:
    """Where a viewer is."""

    ground: Ground
    """The volume that he walks through."""
    forward: Vector
    """Direction in which he looks, in the patient's space (LPS)."""
    up: Vector
    """Up direction of the picture."""
    zoom: float = 1.0
    """How many times larger the volume is than where its diagonal fills the picture."""
    level: int | None = None
    """The level that is shown; 0 for sub-volumes. None before the first picture."""
    point: int | None = None
    """The point whose sub-volumes are shown, if they are."""
    asked: tuple[Move, ...] = ()
    """Moves that the last step asked for."""
    made: tuple[Move, ...] = ()
    """Those that were legal."""

    @classmethod
    def at_the_front(cls, ground: Ground) -> Self:
        """Return a viewer in front of the patient."""
        view = standard_views(ground.level_grid)["anterior"]
        return cls(ground, view.forward, view.up)

    def after(self, step: WalkStep, number: int) -> "Walker":
        """Return where the viewer is after a step. Raises VP3181 for one that cannot be made, VP5022 for a view."""
        walker = self._turned(step)
        zoom = step.zoom or self.zoom
        level = drawn_level(self.ground.voxel_mm, self.ground.grid.view, self.ground.pixel_mm(zoom), self.level)
        point = None if level else self.point
        if level == 0 and point is None:
            point = inner_point(self.ground.grid, self.ground.middle)
        if step.move is None:
            return replace(walker, zoom=zoom, level=level, point=point, asked=(), made=())
        if point is None:
            raise VolprepError("VP3181", number=number, problem=f"it moves, but level {level} is shown whole")
        x, y, z = walker.direction_xyz if step.move == "forward" else -walker.direction_xyz
        asked = moves_for_view((x, y, z), self.ground.grid.view)
        made = tuple(move for move in asked if move in self.ground.grid.points[point].moves)
        reached = step_from(self.ground.grid, point, asked)
        return replace(walker, zoom=zoom, level=level, point=reached, asked=asked, made=made)

    @property
    def direction_xyz(self) -> Float64Array:
        """Direction of view along the index axes."""
        along: Float64Array = np.array(self.ground.level_grid.direction).T @ np.array(self.forward)
        # The rounding error of a right angle is not a direction.
        return np.where(np.abs(along) < 1e-9 * np.linalg.norm(along), 0.0, along)

    @property
    def looks_at(self) -> Vector:
        """The voxel in the middle of the picture: that of the volume, or of the block of sub-volumes."""
        return self.ground.middle if self.point is None else voxel_of(self.ground.grid, self.point, _MIDDLE)

    def camera(self, voxel_xyz: Vector, field_mm: float) -> Camera:
        """Return a camera that looks at a voxel of level 0, with a picture as high as this there."""
        ground = self.ground
        place = (ground.level_grid.world_from_index @ [*voxel_xyz, 1.0])[:3]
        forward = np.array(self.forward) / np.linalg.norm(self.forward)
        orthographic = ground.projection == "orthographic"
        focus = ground.diagonal_mm * (1.0 if orthographic else 2.0)
        eye = place - forward * focus
        return Camera(
            eye_mm_xyz=(float(eye[0]), float(eye[1]), float(eye[2])),
            forward=self.forward,
            up=self.up,
            height_mm=field_mm,
            focus_mm=focus,
            projection=ground.projection,
        )

    def _turned(self, step: WalkStep) -> "Walker":
        walker = self
        if step.view is not None:
            views = standard_views(self.ground.level_grid)
            if step.view not in views:
                raise VolprepError("VP5022", name=step.view, known=", ".join(views))
            walker = replace(walker, forward=views[step.view].forward, up=views[step.view].up)
        if step.turn is None:
            return walker
        forward = np.array(walker.forward) / np.linalg.norm(walker.forward)
        right = np.cross(forward, np.array(walker.up))
        right /= np.linalg.norm(right)
        above = np.cross(right, forward)
        around, over = np.radians(step.turn)
        # Whoever goes to his right looks to his left then.
        forward = forward * np.cos(around) - right * np.sin(around)
        forward, above = forward * np.cos(over) - above * np.sin(over), above * np.cos(over) + forward * np.sin(over)
        return replace(walker, forward=tuple(forward.tolist()), up=tuple(above.tolist()))


def drawn_level(voxel_mm: Mapping[int, float], view: ViewThresholds, pixel_mm: float, before: int | None) -> int:
    """Return the level to draw at a size of pixels, after the level `before`, or at first."""
    levels = sorted(voxel_mm)
    place = len(levels) - 1 if before is None else levels.index(before)
    while place > 0 and voxel_mm[levels[place]] > view.finer_above_pixels * pixel_mm:
        place -= 1
    while place < len(levels) - 1 and voxel_mm[levels[place]] < view.coarser_below_pixels * pixel_mm:
        place += 1
    return levels[place]


def moves_for_view(direction_xyz: Sequence[float], view: ViewThresholds) -> tuple[Move, ...]:
    """Moves that lead forward for someone who looks along `direction_xyz`, of any length but 0."""
    x, y, z = direction_xyz
    theta = math.degrees(math.acos(z / math.hypot(x, y, z)))
    phi = math.degrees(math.atan2(y, x))
    moves: list[Move] = []
    low, high = view.sideways_between_theta
    if low < theta < high:
        if abs(phi) < view.plus_x_below_phi:
            moves.append("+x")
        elif abs(phi) > view.minus_x_above_phi:
            moves.append("-x")
        if view.y_between_phi[0] < abs(phi) < view.y_between_phi[1]:
            moves.append("+y" if phi > 0 else "-y")
    if theta < view.plus_z_below_theta:
        moves.append("+z")
    elif theta > view.minus_z_above_theta:
        moves.append("-z")
    return tuple(moves)


def step_from(grid: SubvolumeGrid, point: int, moves: Sequence[Move]) -> int:
    """Number of the point to which the legal ones of `moves` lead from `point`."""
    nz, ny, nx = (count + 1 for count in grid.counts_zyx)
    strides = {"x": 1, "y": nx, "z": nx * ny}
    legal = [move for move in moves if move in grid.points[point].moves]
    target = point + sum(strides[move[1]] * (1 if move[0] == "+" else -1) for move in legal)
    assert 0 <= target < nx * ny * nz  # noqa: S101 - legal moves never lead out
    return target
