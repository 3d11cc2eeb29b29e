"""Packages in one file of every kind: each part that a package may have is in one of them.

`python tests/support/every_kind.py FOLDER` writes them for `make fuzz-c`.
"""

import sys
from collections.abc import Callable, Collection
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import nibabel
import numpy as np
from channel_scene import write_channel_scene
from colour_scene import write_colour_blocks, write_colour_scene
from phantom_scene import write_phantom_scene
from scene_builds import built
from tamper_scenes import KINDS, SHAPE_ZYX, write_kind

from volprep_formats.package.storage.files import names_in
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.progress import Silent

SMALL_PROFILE = """
name = "small"
api = "es2.0"
max_texture_size = 64
max_3d_texture_size = 0
texture_units = 8
texture_formats = ["r8unorm", "rg8unorm", "rgb8unorm", "rgba8unorm"]
index_bits = 16
max_texture_bytes = 67_108_864
"""


def single_file(package: Path, target: Path | None = None) -> Path:
    """Write all files of a package, sound or not, as one file, which lies beside it if not told; give its path."""
    target = target or package.with_name(f"{package.name}.zip")
    with target.open("wb") as file:
        write_single_file(package, names_in(package), file, Silent())
    return target


def write_together(folder: Path) -> Path:
    return write_channel_scene(folder, more='\n[together]\nname = "body"\n')


def _several_units(folder: Path) -> Path:
    (folder / "small.toml").write_text(SMALL_PROFILE)
    scene = write_phantom_scene(folder, "gles2-2048", "box")
    text = scene.read_text().replace('profile = "gles2-2048"', 'profile = "small.toml"')
    light = '[lighting]\nlight_mm = [20.0, -30.0, 40.0]\nshininess = 5.0\nnormals = "central"\n'
    lit = f'[render]\nprojection = "perspective"\nlighting = "blinn-phong"\n{light}'
    scene.write_text(f"{text}\n{lit}[grid]\nsize = 20\n")
    return scene


def _hybrid(folder: Path) -> Path:
    return write_phantom_scene(
        folder, "gles3", "box", more='\n[render]\ntechnique = "tiles"\n[hybrid]\nlongest_side = 32\n'
    )


def write_segments(folder: Path, *, even_piece: bool = False) -> Path:
    """Write a scan with two segments that overlap, drawn with two transfer functions.

    With `even_piece` the last sub-volume has one value and one label.
    """
    scene = write_kind(folder, "house")
    values = np.fromfile(folder / "tried.raw", np.uint8).reshape(SHAPE_ZYX).T
    labels = np.zeros(values.shape, np.int16)
    labels[3:9, 3:9, 2:7] = 1
    labels[8:14, 6:12, 3:9] = 2
    if even_piece:
        values, labels[9:, 6:] = values.copy(), 2
        values[9:, 6:] = 150
    affine = np.diag([-0.75, -1.0, 1.5, 1.0])
    nibabel.save(nibabel.Nifti1Image(values, affine), folder / "scan.nii")
    nibabel.save(nibabel.Nifti1Image(labels, affine), folder / "labels.nii")
    scene.write_text(SEGMENTS)
    return scene


SEGMENTS = """
name = "tried"
crop = "none"
[source]
path = "scan.nii"
[pyramid]
coarsest_longest_axis = 8
[[transfer]]
name = "veil"
points = [
    { value = 60.0, colour = "#802040", extinction_per_mm = 0.0 },
    { value = 220.0, colour = "#40ffff", extinction_per_mm = 0.2 },
]
[[transfer]]
name = "inside"
points = [
    { value = 0.0, colour = "#c0c0c0", extinction_per_mm = 0.1 },
    { value = 220.0, colour = "#ffffff", extinction_per_mm = 0.9 },
]
[grid]
size = 10
[segments]
source = "labels.nii"
outside_opacity = 0.5
[[segments.style]]
labels = [1]
tint = "#ff4020"
[[segments.style]]
labels = [2]
tint = "#20c0ff"
opacity = 0.5
[skip]
kind = "distance"
block = 2
[render]
lighting = "headlight"
"""


def _shadowed(shadows: str, render: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        scene = write_kind(folder, "plain")
        scene.write_text(scene.read_text().replace("\npoints", "\nisovalue = 140.0\npoints"))
        lit = f'[lighting]\nlight_mm = [60.0, -80.0, 90.0]\nnormals = "central"\nshadows = "{shadows}"\n'
        scene.write_text(f'{scene.read_text()}\n[render]\n{render}\nlighting = "phong"\n{lit}')
        return scene

    return write


def _kind(kind: str) -> Callable[[Path], Path]:
    return lambda folder: write_kind(folder, kind)


SCENES: dict[str, Callable[[Path], Path]] = {
    **{kind: _kind(kind) for kind in KINDS},
    "together": write_together,
    "several-units": _several_units,
    "colour": write_colour_scene,
    "colour-blocks": write_colour_blocks,
    "hybrid": _hybrid,
    "segments": write_segments,
    "shadow-map": _shadowed("map", 'compositing = "isosurface"'),
    "half-angle": _shadowed("half-angle", 'technique = "view-slices"'),
}
"""Each kind, with what writes its scene and its scan into a folder and gives the path of the scene."""


def write_every_kind(folder: Path, only: Collection[str] = ()) -> dict[str, Path]:
    """Build a package of each kind in a folder, or of some; give its single file, by the name of the kind."""
    made = {}
    with patch("os.fsync"):
        for kind, write in ((kind, write) for kind, write in SCENES.items() if not only or kind in only):
            package = folder / f"{kind}.volpkg"
            with TemporaryDirectory() as place:
                built(write(Path(place)), package)
            made[kind] = single_file(package)
    return made


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    if not list(target.glob("*.zip")):
        write_every_kind(target)
