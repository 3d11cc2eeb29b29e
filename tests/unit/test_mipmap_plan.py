"""Which levels are mipmaps of one texture, and how large it is."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plans import PlanOfOne, plan_of_one
from volumes import shapes

from volprep.parts.texture.mipmaps import mipmap_levels
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.profiles import load_profile
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.source import SourceInfo
from volprep_formats.textures.ktx2 import mipmap_shape

GLES3 = load_profile("gles3", Path())
MIPMAPS = {"mipmaps": True}
COARSE = {"coarsest_longest_axis": 16}


def scene(**tables) -> Scene:
    points = [{"value": v, "colour": "#ff8040", "extinction_per_mm": e} for v, e in ((100.0, 0.0), (200.0, 0.5))]
    transfer = {"name": "a", "points": points}
    return Scene.model_validate({"name": "s", "source": {"path": "x"}, "transfer": [transfer], **tables})


def plan(wanted: Scene, profile=GLES3) -> PlanOfOne:
    """Plan for 9×70×33 voxels of noise."""
    voxels = np.random.default_rng(3).integers(0, 256, (9, 70, 33)).astype(np.uint8)
    info = SourceInfo(format="raw", grid=Grid.of(voxels.shape, (1.0, 1.0, 1.0)), stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    return plan_of_one(wanted, profile, info, gauge.result("0" * 64))


def item(decided: PlanOfOne, name: str):
    return next(each for each in decided.items if each.name == name)


@given(shapes, st.integers(1, 9), st.tuples(*[st.floats(0.1, 9.0)] * 3))
def test_levels_are_those_of_the_pyramid_and_texels_those_of_opengl(shape, coarsest, spacing) -> None:
    grid = Grid.of(shape, spacing)
    levels = mipmap_levels("scan", grid, coarsest, GLES3, "box")
    longest = [max(level.shape_zyx) for level in levels]
    assert longest[-1] <= coarsest
    assert all(length > coarsest for length in longest[:-1])
    for index, level in enumerate(levels):
        assert level.shape_zyx == grid.coarser(level.factors_zyx).shape_zyx
        assert level.texels_zyx == mipmap_shape(levels[0].texels_zyx, index)
        for n, m, first, texels in zip(shape, level.shape_zyx, levels[0].texels_zyx, level.texels_zyx, strict=True):
            assert m <= texels
            # The same texture coordinates, and less than one voxel of the coarsest level more than there is.
            assert first * level.factors_zyx[0] >= texels
            assert first < n + 2 ** (len(levels) - 1)
        scale = {first // texels for first, texels in zip(levels[0].texels_zyx, level.texels_zyx, strict=True)}
        assert scale <= set(level.factors_zyx)


def test_the_finest_level_holds_the_file_and_the_item_says_what_halving_costs() -> None:
    decided = plan(scene(textures=MIPMAPS, pyramid=COARSE))
    assert [volume.shape_zyx for volume in decided.volumes] == [(16, 72, 40), (8, 36, 20), (4, 18, 10), (2, 9, 5)]
    assert {volume.files for volume in decided.volumes} == {("textures/volume-scan-0.ktx2",)}
    assert [len(item(decided, f"level {index}").files) for index in range(4)] == [1, 0, 0, 0]
    texels = sum(math.prod(volume.shape_zyx) for volume in decided.volumes)
    voxels = sum(math.prod(level.shape_zyx) for level in decided.levels)
    assert f"{texels - voxels} bytes more" in item(decided, "mipmaps").reason
    assert sum(item(decided, f"level {index}").size_bytes for index in range(4)) == texels
    assert "40×72×16 texels, so that 33×70×9 voxels" in item(decided, "mipmaps").reason
    assert decided.programs[0].levels == (0, 1, 2, 3)


def test_levels_stay_apart_unless_the_scene_asks() -> None:
    decided = plan(scene())
    assert {volume.mipmap for volume in decided.volumes} == {None}
    assert not item(decided, "mipmaps").kept


@pytest.mark.parametrize(
    ("limit", "says"),
    [
        (
            {"max_3d_texture_size": 70},
            r"its mipmaps need 40×72×16 texels, but a 3D texture of profile gles3 holds at most 70",
        ),
        ({"max_texture_bytes": 50_000}, r"bytes with mipmaps, and \d+ for other textures, are more than the 50000"),
    ],
)
def test_a_level_that_fits_alone_but_not_with_its_mipmaps_is_left_out(limit, says) -> None:
    profile = GLES3.model_copy(update=limit)
    wanted = scene(textures=MIPMAPS, pyramid=COARSE)
    decided = plan(wanted, profile)
    assert item(plan(scene(), profile), "level 0").kept
    assert [volume.level for volume in decided.volumes] == [1, 2, 3]
    assert [volume.mipmap for volume in decided.volumes] == [0, 1, 2]
    assert decided.volumes[0].files == ("textures/volume-scan-1.ktx2",)
    assert re.search(says, item(decided, "level 0").reason)


def test_a_profile_without_3d_textures_has_no_mipmaps() -> None:
    with pytest.raises(VolprepError, match=r"VP3071 .*gles2-2048"):
        plan(scene(textures=MIPMAPS), load_profile("gles2-2048", Path()))


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"textures": MIPMAPS | {"compression": "eac"}}, "textures.mipmaps needs 3D textures"),
        ({"textures": MIPMAPS, "render": {"lighting": "headlight"}}, "normals, which have no mipmaps"),
    ],
)
def test_what_has_no_mipmaps_cannot_be_asked_for_with_them(tables, says) -> None:
    with pytest.raises(ValueError, match=says):
        scene(**tables)


def test_voxels_that_are_colours_have_mipmaps_too() -> None:
    decided = plan(scene(textures=MIPMAPS, render={"classification": "preclassified"}))
    assert [(volume.format, volume.mipmap) for volume in decided.volumes] == [("rgba8unorm", 0), ("rgba8unorm", 1)]
