"""Compare truth and package with the NumPy integrator on some pixels of every standard view."""

from collections.abc import Iterator, Sequence

import numpy as np

from volprep.validation.comparison.views import Statement
from volprep.validation.witness.check import WitnessCheck
from volprep.validation.witness.independent.camera import Box, rays
from volprep.validation.witness.independent.normals import WitnessedLight
from volprep.validation.witness.independent.rays import WitnessedMedium, picture
from volprep.validation.witness.independent.scan import Floats
from volprep.validation.witness.independent.scene import WitnessedScene
from volprep.validation.witness.read_checks import NUMPY
from volprep_formats.package.program import LAID_OVER

_ACROSS = 13
"""Pixels along an edge of each view that are compared."""
_STEP_VOXELS = 0.3
_FINE_STEP_VOXELS = 0.1
"""Where one sample makes the pixel. With 0.3, 7 % of the rays through thin vessels were further off than they knew."""
_OF_ONE_SAMPLE = frozenset(("maximum", "minimum"))
_SAFETY, _FLOOR = 3.0, 0.004
"""A ray agrees if it is nearer than `_SAFETY` times its change by half the step, plus the floor: half of 1/128."""
_CHANGES, _ROUNDING = 1.5, 1e-6
"""All rays together agree if their difference is below so many times their change, plus rounding: rules of second order
are off by a third of their last change, rules of first order by all of it. Where one sample makes the pixel, its change
is chance."""
_MOST_RAYS_OFF = 0.02
"""Rays along an edge of a voxel or a silhouette may meet a jump at one of two steps, or miss it."""
_OPAQUE, _DENSE = 0.9, 0.99
_LEAST_DENSE_RAYS = 8
_DENSE_OFF = 0.015
"""Largest error of the mean opacity of nearly opaque rays: ending early at 0.9 makes it 0.05."""


def check_pictures(
    asked: Statement,
    shown: Sequence[WitnessedMedium],
    box: Box,
    scene: WitnessedScene,
    lights: Sequence[WitnessedLight | None],
) -> Iterator[WitnessCheck]:
    """Draw some pixels of each view and compare them with the truth's and the package's."""
    pixels = asked.bench.subject.shape_hw[0]
    at = np.unique(np.rint((np.arange(_ACROSS) + 0.37) / _ACROSS * pixels - 0.5).astype(np.intp))
    rows, columns = (value.ravel() for value in np.meshgrid(at, at, indexing="ij"))
    spacing = np.linalg.norm(shown[0].scan.world_from_index[:3, :3], axis=0)
    voxels = _FINE_STEP_VOXELS if scene.compositing in _OF_ONE_SAMPLE else _STEP_VOXELS
    step_mm = voxels * float(spacing.min())
    fines, changes, truth_pixels, drawn_pixels = [], [], [], []
    for view, truth in asked.viewed.truths.items():
        through = rays(view, box, pixels, rows.astype(float), columns.astype(float))
        coarse, best = (picture(shown, through, scene.compositing, h, lights) for h in (step_mm, step_mm / 2))
        fines.append(best)
        changes.append(np.abs(coarse - best))
        truth_pixels.append(truth[rows, columns].astype(np.float64))
        drawn_pixels.append(asked.viewed.drawn[view][rows, columns].astype(np.float64))
    fine, errors, truths, drawn = (np.concatenate(parts) for parts in (fines, changes, truth_pixels, drawn_pixels))
    yield from compared(asked.program.name, (fine, errors), truth=truths, drawn=drawn, scene=scene)
    # Filtering the colours of classified voxels makes the whole picture slightly brighter or darker.
    if not asked.bench.subject.is_classified:
        yield _brightness(asked.program.name, drawn - fine, scene.rmse)


def compared(
    name: str, integrated: tuple[Floats, Floats], *, truth: Floats, drawn: Floats, scene: WitnessedScene
) -> Iterator[WitnessCheck]:
    """Compare pixels [ray, 4] of the integrator, and its own errors, with the truth's and the package's pixels."""
    fine, errors = integrated
    seen = (fine[:, 3] > _FLOOR) | (truth[:, 3] > _FLOOR)
    off = (np.abs(truth - fine) > _SAFETY * errors + _FLOOR).any(axis=1)
    rays_seen = max(int(seen.sum()), 1)
    yield WitnessCheck(
        item=f"truth of {name}",
        by=NUMPY,
        what=f"part of {rays_seen} rays that are further apart than the integrator's own error",
        found=float(off.sum()) / rays_seen,
        limit=_MOST_RAYS_OFF,
    )
    if scene.compositing not in _OF_ONE_SAMPLE:
        near = seen & ~off
        yield WitnessCheck(
            item=f"rays of the truth of {name}",
            by=NUMPY,
            what="root mean square difference of the other rays that show something",
            found=_rms((truth - fine)[near]),
            limit=_CHANGES * _rms(errors[near]) + _ROUNDING,
        )
    yield WitnessCheck(
        item=f"pictures of {name}",
        by=NUMPY,
        what="root mean square difference of the rays that show something",
        found=_rms((drawn - fine)[seen]),
        limit=_rms(_SAFETY * errors[seen]) + 0.5 / 255 + scene.rmse * float(np.sqrt(len(fine) / rays_seen)),
    )
    dense = (fine[:, 3] > _OPAQUE) & (fine[:, 3] < min(_DENSE, scene.opacity_cutoff))
    if scene.compositing in LAID_OVER and dense.sum() >= _LEAST_DENSE_RAYS:
        yield WitnessCheck(
            item=f"opacity of {name}",
            by=NUMPY,
            what=f"mean error of {dense.sum()} rays that are nearly opaque",
            found=abs(float((drawn - fine)[dense, 3].mean())),
            limit=_DENSE_OFF,
        )


def _brightness(name: str, difference: Floats, rmse: float) -> WitnessCheck:
    """Judge the mean error: steps and codes err to both sides, a wrong isovalue or table to one."""
    different = np.abs(difference).max(axis=1) > 0.25 / 255
    return WitnessCheck(
        item=f"brightness of {name}",
        by=NUMPY,
        what="largest mean error of a channel over the rays that differ",
        found=float(np.abs(difference[different].mean(axis=0)).max()) if different.any() else 0.0,
        limit=0.5 * rmse + 0.5 / 255,
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
