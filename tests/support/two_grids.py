"""Two scans of one body on grids of their own: a CT, and what a tracer shows on a coarser, turned grid."""

from pathlib import Path

import nibabel
import numpy as np
from numpy.typing import NDArray
from phantom_scene import with_filter
from scipy.spatial.transform import Rotation

SCENE = """
name = "fused"
profile = "{profile}"

[[source.channels]]
name = "ct"
path = "ct.nii"

[[source.channels]]
name = "pet"
path = "pet.nii"
{pet}

[pyramid]
coarsest_longest_axis = 10

[render]
picture_size = 48

[[transfer]]
name = "body"
points = [
    {{ value = -300.0, colour = "#d8a080", extinction_per_mm = 0.0 }},
    {{ value = 100.0, colour = "#e8c8b0", extinction_per_mm = 0.02 }},
    {{ value = 900.0, colour = "#ffffff", extinction_per_mm = 0.3 }},
]

[[transfer]]
name = "hot"
channel = "pet"
points = [
    {{ value = 1.0, colour = "#401000", extinction_per_mm = 0.0 }},
    {{ value = 4.0, colour = "#ff6000", extinction_per_mm = 0.1 }},
    {{ value = 8.0, colour = "#ffff60", extinction_per_mm = 0.3 }},
]

[together]
name = "both"
{more}
"""


def ct_affine() -> NDArray[np.float64]:
    """Voxels of 2 × 2 × 2.5 mm, RAS."""
    return nibabel.affines.from_matvec(np.diag([2.0, 2.0, 2.5]), (-39.0, -39.0, -38.75))


def pet_affine(degrees: tuple[float, float, float] = (20.0, -15.0, 30.0)) -> NDArray[np.float64]:
    """Voxels of 4 × 3.5 × 5 mm, turned."""
    steps = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix() @ np.diag([4.0, 3.5, 5.0])
    return nibabel.affines.from_matvec(steps, np.array((5.0, -8.0, 6.0)) - steps @ np.array((9.0, 10.0, 7.0)))


def ball(affine: NDArray[np.float64], shape: tuple[int, int, int], centre: tuple[float, ...], radius: float) -> NDArray:
    """A soft ball of height 1 at a place in the world, sampled on a grid."""
    at = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    away = np.linalg.norm(nibabel.affines.apply_affine(affine, at) - centre, axis=-1)
    return np.clip((radius - away) / 5.0 + 0.5, 0.0, 1.0)


def write_two_grids(
    folder: Path,
    *,
    profile: str = "gles3",
    pet: str = "",
    more: str = "",
    placed: NDArray[np.float64] | None = None,
    level_filter: str = "box",
) -> Path:
    """Write both scans and their scene; return the scene's path.

    `placed` moves the file of the tracer: its voxels are those of the body, its header says another place.
    """
    affine, shape = ct_affine(), (40, 40, 32)
    body = -1000 + 1040 * ball(affine, shape, (0, 0, 0), 33) + 900 * ball(affine, shape, (8, 12, 4), 8)
    nibabel.save(nibabel.Nifti1Image(body.astype(np.int16), affine), folder / "ct.nii")
    affine, shape = pet_affine(), (19, 21, 15)
    spots = 8 * ball(affine, shape, (14, -9, 8), 9) + 5 * ball(affine, shape, (-14, 10, -9), 7)
    header = affine if placed is None else placed @ affine
    nibabel.save(nibabel.Nifti1Image(spots.astype(np.float32), header), folder / "pet.nii")
    scene = folder / "fused.toml"
    scene.write_text(with_filter(SCENE.format(profile=profile, pet=pet, more=more), level_filter))
    return scene
