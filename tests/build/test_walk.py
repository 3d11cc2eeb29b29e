"""A walk through a package: each picture is what the oracle makes of the texels that are drawn."""

import json
from itertools import product
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
import scene_builds
from command_line import volprep
from phantom_scene import write_phantom_scene

from volprep.lab.walk.study import walk
from volprep.render.cut import cut
from volprep.render.renderer import Renderer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

STEPS = """
size = 48
[[step]]
zoom = 1.5
[[step]]
view = "anterior-right"
zoom = 12.0
[[step]]
move = "forward"
[[step]]
move = "back"
[[step]]
tap = [0.25, 0.5, 0.75]
cut_size = 10
[[step]]
show = "place"
turn = [10.0, 5.0]
[[step]]
zoom = 0.3
"""
PROFILES = Path(__file__).parents[2] / "volprep/scene/profiles"


LIMITS = {
    "gles3": ("max_3d_texture_size = 1024", "max_3d_texture_size = 32"),
    "gles2-2048": ("max_texture_bytes = 67_108_864", "max_texture_bytes = 28_000"),
}


def built(  # noqa: PLR0917 - what a scene says
    folder: Path,
    render: str = "",
    top: str = 'crop = "none"',
    size: int = 12,
    shown_from: float = 200.0,
    profile: str = "gles3",
    level_filter: str = "auto",
) -> Package:
    """Build a package whose device class cannot hold level 0 whole."""
    text = (PROFILES / f"{profile}.toml").read_text().replace(*LIMITS[profile])
    (folder / "small.toml").write_text(text)
    scene = write_phantom_scene(folder, "small.toml", level_filter)
    text = scene.read_text(encoding="utf-8").replace('name = "phantom"', f'name = "phantom"\n{top}')
    # Something to see of the least and of the mean value, too.
    text = text.replace("value = 200.0", f"value = {shown_from}")
    text += f"\n[render]\nopacity_cutoff = 1.0\nstep_voxels = 0.25\n{render}\n[grid]\nsize = {size}\n"
    scene.write_text(text, encoding="utf-8")
    return scene_builds.built(scene, folder / "phantom.volpkg")


def walked(package: Package, folder: Path, steps: str = STEPS):
    (folder / "walk.toml").write_text(steps)
    return walk(package.path, folder / "walk.toml", folder / "pictures", Silent(), force=True)


@pytest.mark.long
@pytest.mark.parametrize(
    ("compositing", "profile"),
    [
        ("emission-absorption", "gles2-2048"),
        ("emission-absorption", "gles3"),
        ("maximum", "gles3"),
        ("minimum", "gles3"),
        ("average", "gles3"),
    ],
)
def test_every_picture_of_a_walk_is_the_integral_of_what_it_shows(tmp_path, compositing, profile) -> None:
    low = compositing in {"minimum", "average"}
    package = built(tmp_path, f'compositing = "{compositing}"', shown_from=2.0 if low else 200.0, profile=profile)
    assert check(package.path) == []
    assert min(level.index for level in package.manifest.levels) == 1
    report = walked(package, tmp_path)
    shown = [picture.shown for picture in report.pictures]
    # Mosaics are held of the finest level, and of one with an eighth of its voxels.
    near, middle, far = (1, 2, 3) if profile == "gles3" else (4, 4, 4)
    assert shown[0] == f"level {near}"
    assert shown[-1] == f"level {far}"
    assert [text.startswith("sub-volumes around point") for text in shown] == [False, *[True] * 3, *[False] * 3]
    assert shown[4:6] == ["a box of level 0", f"the place of a box in level {middle}"]
    there, on, back = report.pictures[1:4]
    assert on.made
    assert on.point != there.point == back.point
    for picture in report.pictures:
        assert picture.rmse < (0.004 if compositing == "emission-absorption" else 0.01), picture
        drawn = OpenImageIO.ImageBuf(str(tmp_path / "pictures" / picture.file)).get_pixels(OpenImageIO.UINT8)
        assert drawn.shape == (48, 48, 3)
        assert drawn.max() > 0
    assert report.failed == ()
    place = report.pictures[4].cut
    assert place.overall_xyz == (0.25, 0.5, 0.75)
    assert all(
        start <= at < stop
        for start, at, stop in zip(place.start_zyx, place.voxel_xyz[::-1], place.stop_zyx, strict=True)
    )
    assert report.pictures[5].cut == place
    stored = json.loads((tmp_path / "pictures" / "walk.json").read_text())
    assert [each["file"] for each in stored["pictures"]] == [f"walk-{n:03}.png" for n in range(1, 8)]


@pytest.mark.long
def test_a_walker_chooses_which_values_are_shown_and_how_opaque(tmp_path) -> None:
    package = built(tmp_path, top="editable = true")
    values = STEPS.replace('[[step]]\nmove = "forward"', "[[step]]\nminimum = 300.0\nmaximum = 700.0\nalpha = 0.4")
    plain, chosen = (walked(package, tmp_path, steps) for steps in (STEPS, values))
    assert chosen.failed == ()
    # Jumps are as steep as an entry of the table is wide.
    assert max(picture.rmse for picture in chosen.pictures) < 0.01
    assert plain.pictures[1] == chosen.pictures[1]
    assert plain.pictures[4].rmse != chosen.pictures[4].rmse


def test_values_of_a_package_that_cannot_be_edited_are_refused(tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP5023"):
        walked(built(tmp_path, level_filter="box"), tmp_path, "[[step]]\nminimum = 300.0\n")


@pytest.mark.long
def test_a_walk_through_lit_pieces_is_judged_with_their_light(tmp_path) -> None:
    report = walked(built(tmp_path, 'lighting = "headlight"'), tmp_path)
    assert report.failed == ()


@pytest.mark.long
def test_a_walk_in_perspective_is_judged_as_well(tmp_path) -> None:
    report = walked(built(tmp_path, 'projection = "perspective"'), tmp_path)
    assert max(picture.rmse for picture in report.pictures) < 0.004
    assert report.failed == ()


@pytest.mark.long
def test_pieces_that_nobody_sees_change_no_picture(tmp_path) -> None:
    package = built(tmp_path, top='crop = "auto"', size=6)
    assert len(package.manifest.subvolumes.pieces) < 4 * 7 * 9
    report = walked(package, tmp_path, STEPS.replace("zoom = 12.0", "zoom = 9.0"))
    assert max(picture.rmse for picture in report.pictures) < 0.004


@pytest.mark.long
def test_a_voxel_that_a_stored_piece_shares_with_an_empty_one_keeps_its_code(tmp_path) -> None:
    (tmp_path / "all").mkdir()
    window = "\n[quantize]\nwindow = [0.0, 1000.0]\n"
    kept, whole = (
        cut(built(folder, window, f'crop = "{crop}"', size=6), (0.0, 0.0, 0.0), 100)
        for folder, crop in ((tmp_path, "auto"), (tmp_path / "all", "none"))
    )
    assert kept.record.empty_pieces > 0
    start_xyz = np.linalg.inv(whole.record.grid.world_from_index) @ [*kept.record.grid.origin_mm_xyz, 1.0]
    start = np.rint(start_xyz[2::-1]).astype(int)
    part = whole.texels[tuple(slice(a, a + n) for a, n in zip(start, kept.texels.shape, strict=True))]
    different = kept.texels != part
    assert different.any()
    # The filter mixes what is seen with its neighbours.
    values = whole.volume.slope * part.astype(float) + whole.volume.intercept
    seen = np.pad(values > 200.0, 1)
    assert seen.any()
    beside = np.zeros_like(different)
    for shift in product((-1, 0, 1), repeat=3):
        beside |= np.roll(seen, shift, (0, 1, 2))[1:-1, 1:-1, 1:-1]
    assert not (different & beside).any()


@pytest.mark.long
def test_pieces_have_a_table_where_every_level_has_one_of_its_own(tmp_path) -> None:
    package = built(tmp_path)
    tables = {texture.level for texture in package.manifest.textures if texture.role == "transfer"}
    assert tables == {None, *(level.index for level in package.manifest.levels)}
    with Renderer(package, point=0) as renderer:
        assert renderer.level.index == 0


@pytest.mark.long
def test_the_verb_prints_the_walk_and_ends_with_1_beyond_the_tolerance(tmp_path) -> None:
    package = built(tmp_path)
    (tmp_path / "walk.toml").write_text(STEPS)
    done = volprep("study", "walk", package.path, tmp_path / "walk.toml", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "sub-volumes around point" in done.stdout
    again = volprep("study", "walk", package.path, tmp_path / "walk.toml", "-o", tmp_path / "out")
    assert again.returncode == 6
    assert "VP1251" in again.stderr
    manifest = package.path / "manifest.json"
    stored = json.loads(manifest.read_text())
    stored["render"]["tolerance"]["rmse"] = 1e-6
    manifest.write_text(json.dumps(stored))
    strict = volprep("study", "walk", package.path, tmp_path / "walk.toml", "-o", tmp_path / "out", "--force", "--json")
    assert strict.returncode == 1
    assert "VP5051" in strict.stderr
    assert not any(picture["passed"] for picture in json.loads(strict.stdout)["pictures"][:3])


@pytest.mark.long
def test_pieces_have_a_step_of_their_own(tmp_path) -> None:
    scene = built(tmp_path).path.parent / "phantom.toml"
    scene.write_text(scene.read_text().replace("step_voxels = 0.25\n", ""), encoding="utf-8")
    package = scene_builds.built(scene, tmp_path / "auto.volpkg")
    picture = package.manifest.pictures[0]
    assert min(each.level for each in picture.drawings) > 0
    assert picture.pieces.step_mm < picture.drawings[0].step_mm
    assert check(package.path) == []


def test_a_box_that_was_not_cut_is_not_shown(tmp_path) -> None:
    with pytest.raises(VolprepError, match=r"VP3181 step 1 .*none was cut"):
        walked(built(tmp_path, level_filter="box"), tmp_path, "[[step]]\nshow = 'place'\n")


def test_a_package_without_sub_volumes_has_no_walk(built_package, tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP4050"):
        walked(Package.open(built_package), tmp_path)
