"""A scene that asks for mipmaps: sound, one file for all levels, and the pictures of levels apart."""

import numpy as np
import pytest
import scene_builds
from channel_scene import write_channel_scene
from phantom_scene import write_phantom_scene
from scene_builds import view_of

from volprep.render.cut import cut
from volprep.render.renderer import Renderer
from volprep.validation.timing.full_rays import uncut
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.check import check
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.reader import Package

GRID = '\n[grid]\nsize = 12\nlayout = "single"\n'
COLOURS = '\n[render]\nclassification = "preclassified"\n'


def built(folder, profile: str, bits: int, mipmaps: str, table: str = GRID) -> Package:
    folder.mkdir()
    scene = write_phantom_scene(folder, profile)
    # Voxels that are cubes: every level halves all axes, with mipmaps or without.
    text = scene.read_text(encoding="utf-8").replace("[2.5, 0.75, 1.0]", "[1.0, 1.0, 1.0]")
    if table == COLOURS:
        text = text[: text.rindex("[[transfer]]")]
    tables = f"{table}\n[quantize]\nbits = {bits}\n\n[textures]\nmipmaps = {mipmaps}\n"
    scene.write_text(text + tables, encoding="utf-8")
    return scene_builds.built(scene, folder / "phantom.volpkg")


@pytest.mark.long
@pytest.mark.parametrize(("profile", "bits"), [("gles3", 8), ("gles3-norm16", 16)])
def test_mipmaps_hold_and_draw_what_textures_of_their_own_do(tmp_path, profile, bits) -> None:
    apart, chained = (built(tmp_path / mipmaps, profile, bits, mipmaps) for mipmaps in ("false", "true"))
    assert check(chained.path) == []
    assert [level.grid for level in chained.manifest.levels] == [level.grid for level in apart.manifest.levels]
    named = [path for item in chained.manifest.plan if item.kept for path in item.files]
    assert sorted(named) == [record.path for record in chained.manifest.files]
    assert len(chained.manifest.files) == len(apart.manifest.files) - 2
    grid = chained.manifest.grid
    box_from_clip = view_of(grid, "left", "perspective")
    for level in (0, 1, 2):
        np.testing.assert_array_equal(level_texels(chained, level), level_texels(apart, level))
        with Renderer(apart, level=level) as one, Renderer(chained, level=level) as other:
            expected = one.render(box_from_clip, (40, 40))
            assert expected[..., 3].max() > 0.5
            np.testing.assert_allclose(other.render(box_from_clip, (40, 40)), expected, rtol=0, atol=1.01 / 255)
    for program in chained.manifest.level_programs:
        assert uncut(chained, program) is not None
    # The whole level from which boxes are cut is the finest mipmap.
    assert chained.manifest.subvolumes.whole == "textures/volume-scan-0.ktx2"
    start = cut(chained, (20.0, 16.0, 10.0), 9)
    np.testing.assert_array_equal(start.texels, cut(apart, (20.0, 16.0, 10.0), 9).texels)
    assert start.record.texel_bytes_read == 9**3 * bits // 8


def test_voxels_that_are_colours_have_mipmaps_too(tmp_path) -> None:
    apart, chained = (built(tmp_path / mipmaps, "gles3", 8, mipmaps, COLOURS) for mipmaps in ("false", "true"))
    assert check(chained.path) == []
    volumes = [texture for texture in chained.manifest.textures if texture.role == "volume"]
    assert {texture.format for texture in volumes} == {"rgba8unorm"}
    box_from_clip = view_of(chained.manifest.grid, "left")
    for level in (0, 2):
        np.testing.assert_array_equal(level_texels(chained, level), level_texels(apart, level))
        with Renderer(apart, level=level) as one, Renderer(chained, level=level) as other:
            expected = one.render(box_from_clip, (40, 40))
            assert expected[..., 3].max() > 0.5
            np.testing.assert_allclose(other.render(box_from_clip, (40, 40)), expected, rtol=0, atol=1.01 / 255)


@pytest.mark.long
@pytest.mark.parametrize("together", ["packed", "apart"])
def test_channels_have_mipmaps_of_their_own_or_together(tmp_path, together) -> None:
    scene = write_channel_scene(tmp_path)
    wishes = f'[textures]\nmipmaps = true\n[lab.textures]\nchannels = "{together}"\n\n[render]'
    scene.write_text(scene.read_text(encoding="utf-8").replace("[render]", wishes), encoding="utf-8")
    package = scene_builds.built(scene, tmp_path / "a.volpkg")
    assert check(package.path) == []
    volumes = [texture for texture in package.manifest.textures if texture.role == "volume"]
    assert len({texture.file for texture in volumes}) == (1 if together == "packed" else 2)
    assert {texture.format for texture in volumes} == {"rg8unorm" if together == "packed" else "r8unorm"}
    for name, channel in channel_packages(package).items():
        for level in channel.manifest.levels:
            assert level_texels(channel, level.index).shape == level.grid.shape_zyx
            with Renderer(channel, level=level.index) as renderer:
                grid = level.grid
                box_from_clip = view_of(grid, "left", "perspective")
                assert renderer.render(box_from_clip, (16, 16))[..., 3].max() > 0.1, name
