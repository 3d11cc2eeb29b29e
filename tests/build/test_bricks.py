"""A scene that asks for bricks: sound, without the empty ones, drawn as the whole level; what cannot be is refused."""

from pathlib import Path

import numpy as np
import pytest
import scene_builds
from channel_scene import write_channel_scene
from judged import validate
from phantom_scene import write_phantom_scene
from scene_builds import planned, view_of

from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.prepare import prepare
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.validation.timing.full_rays import uncut
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

BRICKS = "\n[bricks]\nsize = 4\n"


def scene_with(folder: Path, table: str, profile: str = "gles3", *, crop: str = "auto", bits: int = 8) -> Path:
    folder.mkdir(exist_ok=True)
    scene = write_phantom_scene(folder, profile)
    text = scene.read_text(encoding="utf-8").replace('name = "phantom"', f'name = "phantom"\ncrop = "{crop}"')
    scene.write_text(f"{text}\n[quantize]\nbits = {bits}\n{table}", encoding="utf-8")
    return scene


def built(folder: Path, table: str, profile: str = "gles3", **wishes) -> Package:
    return scene_builds.built(scene_with(folder, table, profile, **wishes), folder / "phantom.volpkg")


def levels_of(package: Package) -> list[int]:
    return [texture.level for texture in package.manifest.textures if texture.bricks is not None]


def layouts(package: Package) -> list:
    return [texture.bricks for texture in package.manifest.textures if texture.bricks is not None]


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("profile", "bits", "crop"), [("gles2-4096", 8, "none"), ("gles3", 8, "none"), ("gles3-norm16", 16, "auto")]
)
def test_a_package_of_bricks_is_sound_and_draws_what_textures_do(tmp_path, profile, bits, crop) -> None:
    whole, bricks = (built(tmp_path / f"{len(t)}", t, profile, bits=bits, crop=crop) for t in ("", BRICKS))
    assert check(bricks.path) == []
    named = [path for item in bricks.manifest.plan if item.kept for path in item.files]
    assert sorted(named) == [record.path for record in bricks.manifest.files]
    grid = bricks.manifest.grid
    box_from_clip = view_of(grid, "left", "perspective")
    assert len(layouts(bricks)) == len(bricks.manifest.levels)
    for program in bricks.manifest.level_programs:
        (level,) = program.levels
        with (
            Renderer(whole, level=level, transfer=program.transfer) as one,
            Renderer(bricks, level=level, transfer=program.transfer) as other,
        ):
            expected = one.render(box_from_clip, (40, 40))
            assert expected[..., 3].max() > 0.3
            np.testing.assert_allclose(other.render(box_from_clip, (40, 40)), expected, rtol=0, atol=1.01 / 255)
        assert uncut(bricks, program) is not None
    if crop == "none":
        # An app whose users edit transfer functions has every voxel.
        for level in levels_of(bricks):
            np.testing.assert_array_equal(level_texels(bricks, level), level_texels(whole, level))


def test_bricks_that_show_nothing_are_left_out(tmp_path) -> None:
    text = scene_with(tmp_path, BRICKS.replace("4", "2")).read_text(encoding="utf-8")
    # The core alone is small, and with its surroundings is what is left.
    start, stop = text.index("[[transfer]]"), text.index("[[transfer]]", text.index("[[transfer]]") + 1)
    (tmp_path / "phantom.toml").write_text(text[:start] + text[stop:], encoding="utf-8")
    package = scene_builds.built(tmp_path / "phantom.toml", tmp_path / "core.volpkg")
    finest = layouts(package)[0]
    assert 0 < finest.stored < np.prod(finest.bricks_zyx)
    volume = next(texture for texture in package.manifest.textures if texture.bricks is not None)
    assert volume.shape_zyx == finest.pool_texels_zyx


@pytest.mark.long
def test_the_verb_makes_what_build_makes(tmp_path) -> None:
    package = built(tmp_path / "built", BRICKS)
    request = load_request(tmp_path / "built" / "phantom.toml")
    import_draft(prepare(request), tmp_path / "phantom.volpkg", Silent())
    for verb in ("quantize", "pyramid", "transfer", "bricks", "skip", "shaders", "seal"):
        run_verb(tmp_path / "phantom.volpkg", verb, lambda scene: scene, Silent())
    assert Package.open(tmp_path / "phantom.volpkg").manifest.files == package.manifest.files


@pytest.mark.parametrize(
    ("table", "profile", "says"),
    [
        (
            "\n[bricks]\nsize = 2\n[lab.bricks]\nreach = 3\n",
            "gles3",
            r"VP3031 bricks of 2 cells .* 3 voxels: a brick would need 7 texels",
        ),
        (BRICKS + '\n[lighting]\nbaked = "occlusion"\n', "gles2-2048", "VP3033 baked light goes with bricks in 3D"),
        (BRICKS + "\n[textures]\nmipmaps = true\n", "gles3", "VP3003 .*bricks do not go with textures.mipmaps"),
        (BRICKS + '\n[render]\nlighting = "headlight"\n', "gles3", "VP3003 .*bricks do not go with render.lighting"),
        ("\n[bricks]\nsize = 0\n", "gles3", "VP3003 .*bricks.size"),
    ],
)
def test_what_cannot_be_bricks_is_refused_with_what_to_do(tmp_path, table, profile, says) -> None:
    with pytest.raises(VolprepError, match=says):
        planned(scene_with(tmp_path, table, profile))


def test_a_level_for_which_all_bricks_have_no_room_is_left_out(tmp_path) -> None:
    profile = (Path(__file__).parents[2] / "volprep" / "scene" / "profiles" / "gles3.toml").read_text(encoding="utf-8")
    small = profile.replace('name = "gles3"', 'name = "small"').replace("1024", "24")
    (tmp_path / "small.toml").write_text(small, encoding="utf-8")
    plan = planned(scene_with(tmp_path, BRICKS, "small.toml"))
    item = next(item for item in plan.items if item.name == "level 0")
    assert not item.kept
    assert "in bricks of 4³ cells do not fit into 24 texels along an axis" in item.reason


@pytest.mark.long
def test_each_of_several_channels_has_bricks_of_its_own(tmp_path) -> None:
    scene = write_channel_scene(tmp_path, more=BRICKS)
    manifest = scene_builds.built(scene, tmp_path / "tissues.volpkg").manifest
    assert check(tmp_path / "tissues.volpkg") == []
    held = {(texture.channels, texture.level) for texture in manifest.textures if texture.bricks is not None}
    assert held == {((channel.name,), level.index) for channel in manifest.channels for level in channel.levels}
    assert validate(tmp_path / "tissues.volpkg", tmp_path / "report", picture_size=16).verdict.passed
