"""Small scenes for tests of formats/js: among them they have everything that a package for WebGL may have.

Levels are made by box: a page draws them alike, whatever filter made them. But where rays begin at a mesh or in two
passes, drivers round their first sample: of the coarsest box of `core`, which is a jump, this shows (RMSE 0.0084, and
tests ask for 0.0078). These scenes keep the default filter.
"""

import re
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import nibabel
import numpy as np
from channel_scene import write_channel_scene
from colour_scene import write_colour_blocks, write_colour_scene
from phantom_scene import SHAPE_ZYX, write_phantom_scene
from scene_builds import built

from volprep.parts.light import decision, solve
from volprep_formats.package.reader import Package

_SMALL = """name = "small"
api = "es2.0"
max_texture_size = 64
max_3d_texture_size = 0
texture_units = 8
texture_formats = ["r8unorm", "rg8unorm", "rgb8unorm", "rgba8unorm"]
index_bits = 16
max_texture_bytes = 67_108_864
"""
"""A device whose textures are so small that a mosaic needs several."""
EDIT = [
    {"value": 20.0, "colour": [0.01, 0.05, 1.0], "extinction_per_mm": 0.0},
    {"value": 45.0, "colour": [0.05, 1.0, 0.2], "extinction_per_mm": 0.08},
    {"value": 300.0, "colour": [1.0, 0.02, 0.01], "extinction_per_mm": 0.9},
    {"value": 640.0, "colour": [1.0, 0.02, 0.01], "extinction_per_mm": 0.0},
]
"""Shows the noise around the blobs, which the scene's own functions leave empty, and hides the core of the larger."""


def _phantom(
    tables: str, profile: str = "gles3", before: str = "", level_filter: str = "box"
) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / "small.toml").write_text(_SMALL)
        scene = write_phantom_scene(folder, profile, level_filter)
        scene.write_text(f"{before}\n{scene.read_text()}\n{tables}")
        return scene

    return write


def _one(table: str, profile: str = "gles3") -> Callable[[Path], Path]:
    """The phantom with its first transfer function only."""

    def write(folder: Path) -> Path:
        scene = _phantom(table, profile)(folder)
        text = scene.read_text()
        scene.write_text(text[: text.index('[[transfer]]\nname = "core"')] + table)
        return scene

    return write


def _edited_light(folder: Path) -> Path:
    """The phantom with its first transfer function only, editable, in the shadow of itself."""
    scene = _one('[lighting]\nbaked = "shadow"\nresolution = 4\nlight_mm = [20.0, -30.0, 40.0]\n')(folder)
    scene.write_text(f"editable = true\n{scene.read_text()}")
    return scene


def _cut_light(folder: Path) -> Path:
    """The phantom with its first transfer function only, and light of its own for a cut through the larger blob."""
    planes = "clip_aware = true\nclip_planes = [{ normal = [0.5, 0.0, 0.0], constant_mm = -7.0 }]\n"
    scene = _one(f'[lighting]\nbaked = "occlusion"\nresolution = 2\n{planes}')(folder)
    scene.write_text(scene.read_text().replace("extinction_per_mm = 0.2", "extinction_per_mm = 2.0"))
    return scene


def _compressed(form: str, profile: str = "gles3") -> Callable[[Path], Path]:
    """A volume that is smooth enough for every compressed form."""

    def write(folder: Path) -> Path:
        tables = f'[textures]\ncompression = "{form}"\n[quantize]\nbits = 8\n[render]\npicture_size = 16\n{_ANY_ERROR}'
        scene = _one(tables, profile)(folder)
        waves = [np.sin(np.arange(n) / n * 7 + shift) for shift, n in enumerate(SHAPE_ZYX)]
        field = 450 + 150 * (waves[0][:, None, None] + waves[1][:, None] + waves[2])
        field.astype("<u2").tofile(folder / "phantom.raw")
        scene.write_text(f'crop = "none"\n{scene.read_text()}')
        return scene

    return write


def _labels(folder: Path) -> Path:
    volume = np.zeros((11, 14, 18), np.uint8)
    volume[2:9, 3:10, 4:12] = 3
    volume[5:, 7:, 9:] = 200
    volume.tofile(folder / "labels.raw")
    scene = folder / "labels.toml"
    scene.write_text(_LABELS)
    return scene


def segments_scene(profile: str, styles: str = "") -> Callable[[Path], Path]:
    """Two organs and their overlap with a third, over waves."""

    def write(folder: Path) -> Path:
        x, y, z = np.indices((18, 14, 11))
        values = 128 + 100 * np.sin(x / 3) * np.cos(y / 4) * np.cos(z / 3)
        organs = np.zeros(values.shape, np.int16)
        organs[3:9, 3:12, 2:9] = 1
        organs[9:16, 3:12, 2:9] = 2
        organs[6:12, 5:10, 4:7] = 3
        for name, volume in (("scan", values.astype(np.uint8)), ("organs", organs)):
            nibabel.save(nibabel.Nifti1Image(volume, np.diag([-1.0, -1.0, 1.5, 1.0])), folder / f"{name}.nii")
        scene = folder / "segments.toml"
        scene.write_text(_SEGMENTS.format(profile=profile, styles=styles))
        return scene

    return write


def _first_hits(tables: str) -> Callable[[Path], Path]:
    """The same organs alone, as solids: the first value of 100 or more, in the shadow of the others."""
    lit = _SHADOWS.format("map").replace("[render]\n", '[render]\ncompositing = "first-hit"\n')

    def write(folder: Path) -> Path:
        scene = segments_scene("gles3", f"outside_opacity = 0.0\n{tables}{lit}")(folder)
        # A surface has the opacity of one millimetre.
        dense = re.sub(r"per_mm = 0\.0*([1-9])", r"per_mm = \1.0", scene.read_text())
        scene.write_text(dense.replace("\npoints", "\nisovalue = 100.0\npoints"))
        return scene

    return write


def _surface(tables: str = "[render]\n") -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        scene = _phantom(tables.replace("[render]\n", '[render]\ncompositing = "isosurface"\n'))(folder)
        scene.write_text(scene.read_text().replace("points = [", "isovalue = 800.0\npoints = ["))
        return scene

    return write


def _together(profile: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        return write_channel_scene(
            folder, profile, "box", more='\n[together]\nname = "body"\n[skip]\nkind = "distance"\nblock = 4\n'
        )

    return write


_ANY_ERROR = "[tolerance]\nrmse = 1.0\nmaximum = 1.0\n"
_LABELS = """name = "labels"
crop = "none"
[source]
path = "labels.raw"
labels = true
[source.raw]
shape_zyx = [11, 14, 18]
dtype = "uint8"
[pyramid]
coarsest_longest_axis = 9
[[transfer]]
name = "things"
points = [
    { value = 1.0, colour = "#804020", extinction_per_mm = 0.0 },
    { value = 3.0, colour = "#ffc080", extinction_per_mm = 0.3 },
    { value = 200.0, colour = "#4080ff", extinction_per_mm = 0.5 },
]
"""
_SEGMENTS = """name = "segments"
profile = "{profile}"
[source]
path = "scan.nii"
[pyramid]
coarsest_longest_axis = 9
[[transfer]]
name = "veil"
points = [{{ value = 30.0, colour = "#808080", extinction_per_mm = 0.0 }},
    {{ value = 255.0, colour = "#ffffff", extinction_per_mm = 0.05 }}]
[[transfer]]
name = "inside"
points = [{{ value = 30.0, colour = "#c0c0c0", extinction_per_mm = 0.1 }},
    {{ value = 255.0, colour = "#ffffff", extinction_per_mm = 0.3 }}]
[segments]
source = "organs.nii"
{styles}
"""
_ONE_HIDDEN = "[[segments.style]]\nlabels = [1]\nvisible = false\n[[segments.style]]\nlabels = [2]\nopacity = 0.5\n"
_SKIP = '[skip]\nkind = "{}"\nblock = 4\n'
_PLACED = '[render]\nlighting = "blinn-phong"\n[lighting]\nlight_mm = [{}]\nnormals = "central"\n'
_LIGHT, _ELSEWHERE = "20.0, -30.0, 40.0", "-35.0, 25.0, 10.0"
_SHADOWS = _PLACED.format(_LIGHT) + 'shadows = "{}"\n'
# Few layers: many add up the rounding of half floats, which drivers do differently.
_HALF_ANGLE = _SHADOWS.format("half-angle").replace(
    "[render]\n", '[render]\ntechnique = "view-slices"\nstep_voxels = 1\n'
)
_PERSPECTIVE = '[render]\nprojection = "perspective"\n'
_LIT = '[render]\nlighting = "headlight"\n'


def _edited_turning_light(folder: Path) -> Path:
    """The phantom with its first transfer function only, editable, under light that an app turns."""
    scene = _one(_TURNS, "gles2-2048")(folder)
    scene.write_text(f"editable = true\n{scene.read_text()}")
    return scene


def _edited_coloured_light(folder: Path) -> Path:
    """The phantom with its first transfer function only, editable, under a sky and a ground of two colours."""
    coloured = 'channels = "rgb"\nsky = [0.6, 0.8, 1.0]\nground = [0.5, 0.4, 0.3]\n'
    scene = _one(f'[lighting]\nbaked = "occlusion"\nresolution = 4\n{coloured}')(folder)
    scene.write_text(f"editable = true\n{scene.read_text()}")
    return scene


_TURNS = (
    '[lighting]\nbaked = "occlusion"\nresolution = 4\nturnable = true\nsky = [1.5, 1.0, 0.6]\n'
    "ground = [0.1, 0.2, 0.4]\nsuns = [{ direction = [-1.0, -1.0, 0.5], colour = [2.0, 1.6, 0.8] }]\n"
)
SCENES: dict[str, Callable[[Path], Path]] = {
    "lit, skips by distance": _phantom(_LIT + _SKIP.format("distance")),
    "lit mosaic, skips by distance": _phantom(_LIT + _SKIP.format("distance"), "gles2-4096"),
    "baked light, lit": _one(_LIT + '[lighting]\nbaked = "occlusion"\n'),
    "light that turns, in a mosaic": _one(_TURNS, "gles2-2048"),
    "mipmaps": _phantom("[textures]\nmipmaps = true\n"),
    "pre-integrated": _phantom('[render]\nclassification = "preintegrated"\n'),
    "palette": _phantom('[render]\nclassification = "palette"\n'),
    "mosaic of several textures": _phantom("", "small.toml"),
    "classified voxels": _one('[render]\nclassification = "preclassified"\n'),
    "labels": _labels,
    "maximum": _phantom('[render]\ncompositing = "maximum"\n'),
    "channels together": _together("gles3"),
    "channels together in a mosaic": _together("gles2-2048"),
    "colour": write_colour_scene,
    "colour in a mosaic": lambda folder: write_colour_scene(folder, "gles2-2048"),
    "colour in ASTC": write_colour_blocks,
    "segments": segments_scene("gles3", _LIT),
    "segments in a mosaic": segments_scene("gles2-2048", _LIT),
    "segments with shadows": segments_scene("gles3", _SHADOWS.format("rays")),
    "segments in half-angle slices": segments_scene("gles3", _HALF_ANGLE),
    "segments with a shadow map": _first_hits(""),
    "bricks": _phantom("[bricks]\nsize = 4\n"),
    "lit bricks in mosaics": _phantom(
        "[bricks]\nsize = 4\n[lab.bricks]\nreach = 2\n"
        '[render]\nlighting = "headlight"\n[lighting]\nnormals = "central"\n',
        "gles2-2048",
    ),
    "half floats": _phantom("[quantize]\nbits = 16\n"),
    "norm16, perspective": _phantom('[quantize]\nbits = 16\n[render]\nprojection = "perspective"\n', "gles3-norm16"),
    "EAC": _compressed("eac"),
    "ETC2": _compressed("etc2"),
    "ASTC": _compressed("astc-5x5", "gles3-astc"),
    "meshes": _phantom('[proxy]\nform = "merged"\nblock = 4\n[lab.proxy]\ndraco = "none"\n', level_filter="auto"),
    "meshes on OpenGL ES 2": _phantom(
        '[proxy]\nform = "blocks"\nblock = 4\n[lab.proxy]\ndraco = "none"\n', "gles2-2048"
    ),
    "slabs at meshes": _one('[render]\ntechnique = "slabs"\n[proxy]\nblock = 4\n'),
    "ray casting as published": _one('[render]\ntechnique = "ray-casting-as-published"\n'),
    "slabs": _phantom('[render]\ntechnique = "slabs"\n'),
    "slabs on OpenGL ES 2": _phantom('[render]\ntechnique = "slabs"\n', "gles2-4096"),
    "two passes": _phantom('[render]\ntechnique = "two-pass"\n', level_filter="auto"),
    "two passes on OpenGL ES 2": _phantom('[render]\ntechnique = "two-pass"\n', "gles2-4096", level_filter="auto"),
    "two passes as published": _phantom('[render]\ntechnique = "two-pass-as-published"\n', level_filter="auto"),
    "slices across an axis": _phantom('[render]\ntechnique = "axis-slices"\n', "gles2-4096"),
    "slices across the view": _phantom('[render]\ntechnique = "view-slices"\nprojection = "perspective"\n'),
    "slices as published": _phantom('[render]\ntechnique = "view-slices-as-published"\n'),
    "light with a place": _phantom(_PLACED.format(_LIGHT)),
    "shadow rays": _phantom(_SHADOWS.format("rays").replace("[render]\n", "[render]\nstep_voxels = 0.8\n")),
    "shadow map": _surface(_SHADOWS.format("map")),
    "half-angle slices": _phantom(_HALF_ANGLE),
    "half-angle slices in perspective": _phantom(_HALF_ANGLE.replace("[render]\n", _PERSPECTIVE)),
    "isosurface": _surface(),
    "control points": _phantom('[render]\nclassification = "control-points"\n'),
    "steps of levels": _one("[render]\nstep_voxels = 0.8\n"),
    "mida": _one('[render]\ncompositing = "mida"\n'),
    "pieces": _phantom('[grid]\nsize = 12\nlayout = "both"\n'),
    "editable": _phantom(_SKIP.format("distance"), before="editable = true"),
    "editable, baked light": _edited_light,
    "editable mosaic": _phantom(_SKIP.format("distance"), "gles2-2048", before="editable = true"),
}
OTHERS = {
    "segments, one hidden": segments_scene("gles3", _ONE_HIDDEN + _LIT),
    "segments in a mosaic, one hidden": segments_scene("gles2-2048", _ONE_HIDDEN + _LIT),
    "segments in half-angle slices, one hidden": segments_scene("gles3", _ONE_HIDDEN + _HALF_ANGLE),
    "segments with a shadow map, one hidden": _first_hits(_ONE_HIDDEN),
    "pieces in mosaics": _phantom("[grid]\nsize = 12\n", "gles2-2048"),
    "segments in pieces": segments_scene("gles3", f"[grid]\nsize = 8\n{_LIT}"),
    "segments in pieces, one hidden": segments_scene("gles3", f"{_ONE_HIDDEN}[grid]\nsize = 8\n{_LIT}"),
    "segments in pieces of mosaics": segments_scene("gles2-4096", "[grid]\nsize = 8\n"),
    "editable, light in colour": _edited_coloured_light,
    "editable, light that turns": _edited_turning_light,
    "pieces with light": _one(
        '[grid]\nsize = 12\n[lighting]\nbaked = "shadow"\nresolution = 4\nlight_mm = [20.0, -30.0, 40.0]\n'
    ),
    "slices": _one("", "gles1"),
    "published slices for OpenGL ES 2": _phantom('[render]\ntechnique = "view-slices-as-published"\n', "gles2-4096"),
    "half-angle slices, light at another place": _phantom(_HALF_ANGLE.replace(_LIGHT, _ELSEWHERE)),
    "light at another place": _phantom(_PLACED.format(_ELSEWHERE)),
    "light of a cut": _cut_light,
}


def build_scene(name: str, folder: Path) -> Package:
    """Build the scene of a name."""
    scene = (SCENES | OTHERS)[name](folder)
    target = folder / "p.volpkg"
    # Readers draw light as it is: few samples do.
    with patch.object(solve, "BATCH", 1 << 13), patch.object(decision, "_LEAST_SAMPLES", 1 << 13):
        built(scene, target)
    return Package.open(target)
