"""Frames of a time series: made by one plan, held once where they are equal, drawn and judged one by one."""

import shutil
from pathlib import Path

import nibabel
import numpy as np
import pytest
from command_line import volprep
from judged import validate
from scene_builds import built, planned, view_of
from time_series import SHAPE_ZYX, STILL_X, moving, write_series

from volprep.render.renderer import Renderer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2


@pytest.fixture(scope="module")
def series(tmp_path_factory) -> Package:
    return built(write_series(tmp_path_factory.mktemp("series"), moving(4)))


def texels(package: Package, level: int) -> np.ndarray:
    (texture,) = (each for each in package.manifest.textures if each.role == "volume" and each.level == level)
    return ktx2.decode(package.read_bytes(texture.file), texture.file).data


def picture(package: Package, level: int, view: str) -> np.ndarray:
    with Renderer(package, level=level) as renderer:
        return renderer.render(view_of(package.manifest.grid, view), (40, 40))


@pytest.mark.parametrize("classification", ["lookup", "control-points"])
def test_a_series_of_equal_frames_draws_what_its_volume_draws_and_holds_its_textures_once(
    classification: str, tmp_path: Path
) -> None:
    frame, more = moving(4)[1], f'[render]\nclassification = "{classification}"\n'
    (tmp_path / "one").mkdir()
    (tmp_path / "many").mkdir()
    one = built(write_series(tmp_path / "one", frame, chosen="", more=more))
    many = built(write_series(tmp_path / "many", np.stack([frame] * 3), more=more))
    assert [each.time_s for each in many.manifest.frames or ()] == pytest.approx([0.0, 0.04, 0.08])
    # A coarse level of one volume may have a table that was fitted to it.
    fitted = [each for each in one.manifest.textures if each.role == "transfer" and each.level is not None]
    assert bool(fitted) == (classification == "lookup")
    assert [*many.whole.textures] == [each for each in one.manifest.textures if each not in fitted]
    for texture in many.whole.textures:
        assert many.read_bytes(texture.file) == one.read_bytes(texture.file)
    (item,) = (each for each in many.manifest.plan if each.kind == "frames")
    assert (item.files, item.size_bytes) == ((), 0)
    assert "100.0% of the bytes of later frames are held once" in item.reason
    same = {0, *(each.index for each in one.manifest.levels if not fitted)}
    for number in range(3):
        for level in same:
            for view in ("anterior", "posterior-left"):
                found, wanted = (picture(each, level, view) for each in (many.at_frame(number), one))
                np.testing.assert_array_equal(found, wanted)


def test_a_still_voxel_has_the_same_texel_in_all_frames_at_every_level(series: Package) -> None:
    start = series.manifest.grid.origin_mm_xyz[0]
    frames = [series.at_frame(number) for number in range(4)]
    assert [each.index for each in series.manifest.levels] == [0, 1, 2]
    for level in series.manifest.levels:
        first, *others = (texels(frame, level.index) for frame in frames)
        # The grid of NIfTI has its first column at 0, to the left in LPS.
        still = int((STILL_X + 1 - abs(start)) // level.factors_zyx[2])
        assert still > 0
        for other in others:
            np.testing.assert_array_equal(other[..., :still], first[..., :still])
            assert (other != first).any()


def test_one_plan_holds_for_all_frames(series: Package) -> None:
    (picture,) = series.whole.pictures
    assert [(each.frame or 0, each.level) for each in picture.drawings] == [
        (f, level) for f in range(4) for level in range(3)
    ]
    alike = {(each.level, each.program, each.step_mm, each.values, each.cost) for each in picture.drawings}
    assert len(alike) == 3
    tables = {name for each in picture.drawings for name in each.textures if name.startswith("transfer")}
    assert len(tables) == 1


def test_the_crop_holds_what_moves_in_any_frame(series: Package, tmp_path: Path) -> None:
    frames = moving(4)
    shown = np.argwhere((frames > 30).any(axis=0))
    size = series.manifest.grid.shape_zyx
    assert all(n >= high - low + 1 for n, low, high in zip(size, shown.min(axis=0), shown.max(axis=0), strict=True))
    alone = built(write_series(tmp_path, frames[0], chosen="")).manifest.grid.shape_zyx
    assert size != alone


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("profile", "more"),
    [
        ("gles2-2048", '[render]\nlighting = "headlight"\n'),
        ("gles3", '[render]\nclassification = "preintegrated"\n[quantize]\nbits = 16\n'),
        ("gles3", '[render]\nclassification = "preclassified"\n'),
        ("gles3", '[render]\ncompositing = "maximum"\n[skip]\nkind = "distance"\n'),
    ],
)
def test_frames_are_drawn_as_the_same_volumes_alone_in_every_form(profile: str, more: str, tmp_path: Path) -> None:
    frames, window = moving(3), "[quantize]\nwindow = [0, 255]\n"
    more = more.replace("[quantize]\n", window) if "[quantize]" in more else more + window
    more = f'crop = "none"\n{more}'
    (tmp_path / "many").mkdir()
    many = built(write_series(tmp_path / "many", frames, profile=profile, more=more))
    level = many.manifest.levels[0].index
    for number, frame in enumerate(frames):
        place = tmp_path / str(number)
        place.mkdir()
        one = built(write_series(place, frame, chosen="", profile=profile, more=more))
        found, wanted = (picture(each, level, "posterior-left") for each in (many.at_frame(number), one))
        assert wanted[..., 3].max() > 0.3
        # The step of all frames may be finer than that of one.
        np.testing.assert_allclose(found, wanted, rtol=0, atol=0.02)


def test_frames_are_chosen_by_their_numbers(tmp_path: Path) -> None:
    plan = planned(write_series(tmp_path, moving(6), chosen='frames = "2:6:2"'))
    assert [frame.time_s for frame in plan.frames] == pytest.approx([0.04, 0.12, 0.2])
    assert "3 frames from 0.04 to 0.2 s" in next(item.reason for item in plan.items if item.kind == "frames")
    with pytest.raises(VolprepError, match=r"VP1341 .*3:9 chooses 0 frames of a series of 6"):
        planned(write_series(tmp_path, moving(6), chosen='frames = "3:9"'))
    with pytest.raises(VolprepError, match=r"VP1341 .*all chooses 1025 frames .*; a package has 1 to 1024"):
        planned(write_series(tmp_path, np.zeros((1025, 2, 2, 2), np.uint8)))


def test_a_plan_before_the_build_is_the_plan_of_the_build(series: Package, tmp_path: Path) -> None:
    plan = planned(write_series(tmp_path, moving(4)))
    assert plan.shared.grid == series.manifest.grid
    steps = [each.step_mm for each in series.manifest.pictures[0].drawings]
    assert plan.shared.rays.step_of(0) == steps[0]


@pytest.mark.parametrize(
    ("more", "what"),
    [
        ("editable = true", "editable"),
        ("[normals]\n", r"\[normals\]"),
        ("[skip]\nranges = true\n", "skip.ranges"),
        ("[bricks]\nsize = 16\n", r"\[bricks\]"),
        ("[grid]\nsize = 8\n", r"\[grid\]"),
        ("[proxy]\n", r"\[proxy\]"),
        ('[lighting]\nbaked = "occlusion"\n', "lighting.baked"),
        ("[textures]\nmipmaps = true\n", "textures.mipmaps"),
    ],
)
def test_what_is_made_for_one_volume_is_refused_in_the_plan(more: str, what: str, tmp_path: Path) -> None:
    with pytest.raises(VolprepError, match=f"VP3073 .*{what}"):
        planned(write_series(tmp_path, moving(2), more=more))


@pytest.mark.parametrize(
    ("render", "made_by"),
    [("", "box"), ('compositing = "maximum"', "maximum"), ('classification = "preclassified"', "least-squares")],
)
def test_the_filter_of_levels_is_fixed_if_the_scene_names_none(render: str, made_by: str, tmp_path: Path) -> None:
    scene = write_series(tmp_path, moving(2), more=f"[render]\n{render}\n")
    scene.write_text(scene.read_text().replace('filter = "box"\n', ""))
    (channel,) = planned(scene).channels
    assert [level.filter for level in channel.levels] == ["none", made_by, made_by]


def test_a_filter_that_follows_the_data_and_devices_without_shaders_are_refused(tmp_path: Path) -> None:
    scene = write_series(tmp_path, moving(2))
    scene.write_text(scene.read_text().replace('filter = "box"', 'filter = "appearance"'))
    with pytest.raises(VolprepError, match=r"VP3073 .*pyramid.filter"):
        planned(scene)
    with pytest.raises(VolprepError, match=r"VP3073 .*no shaders"):
        planned(write_series(tmp_path, moving(2)), profile="gles1")


def test_frames_of_another_type_are_refused(tmp_path: Path) -> None:
    wide = np.stack([np.full(SHAPE_ZYX, 40, np.int32), np.full(SHAPE_ZYX, 70_000, np.int32)])
    with pytest.raises(VolprepError, match=r"VP1342 .*frame 2 of the series .*stored_type is"):
        planned(write_series(tmp_path, wide))


def test_a_frame_that_is_not_there_is_refused(series: Package) -> None:
    with pytest.raises(VolprepError, match=r"VP4054 .*there is no frame 4; the package has 4"):
        Package.open(series.path, frame=4)


@pytest.mark.long(keep=1)
def test_an_export_writes_one_frame_and_says_which(series: Package, tmp_path: Path) -> None:
    frames = moving(4).transpose(0, 3, 2, 1)
    for frame in (0, 2):
        told = volprep("export", series.path, tmp_path / f"{frame}.nii", "--frame", str(frame))
        assert f"frame {frame} of 4" in told.stderr
        written = nibabel.load(tmp_path / f"{frame}.nii")
        start = np.rint(written.affine[:3, 3] / (1.0, 1.0, 1.5)).astype(int)
        part = tuple(slice(low, low + n) for low, n in zip(start, written.shape, strict=True))
        assert np.abs(np.asarray(written.dataobj) - frames[frame][part]).max() <= 0.5
        assert np.abs(frames[0][part].astype(int) - frames[2][part]).max() > 40
    for name in ("x.ome.zarr", "x.glb"):
        more = ("--volume",) if name == "x.glb" else ()
        told = volprep("export", series.path, tmp_path / name, *more)
        assert told.returncode == 0
        assert "frame 0 of 4" in told.stderr
    assert "VP4054" in volprep("export", series.path, tmp_path / "4.nii", "--frame", "4").stderr


def test_every_frame_is_judged_and_a_changed_texel_of_one_is_found(series: Package, tmp_path: Path) -> None:
    place = tmp_path / "p.volpkg"
    shutil.copytree(series.path, place)
    origin = series.path.with_name("series.volpkg.origin.json")
    shutil.copy(origin, tmp_path / "p.volpkg.origin.json")
    report = validate(place)
    assert report.verdict.passed
    (program,) = report.programs
    frames = [each for each in program.others if each.item.startswith("frame ")]
    assert [each.item for each in frames] == [f"frame {number} with tracer" for number in (1, 2, 3)]
    # The truth of another frame is far away.
    assert max(each.rmse for each in frames) < 0.005


@pytest.mark.long
def test_a_swap_of_two_frames_is_found(series: Package, tmp_path: Path) -> None:
    place = tmp_path / "p.volpkg"
    shutil.copytree(series.path, place)
    shutil.copy(series.path.with_name("series.volpkg.origin.json"), tmp_path / "p.volpkg.origin.json")
    text = (place / "manifest.json").read_text()
    changed = text.replace("-0-frame1", "-0-frame9").replace("-0-frame3", "-0-frame1").replace("-0-frame9", "-0-frame3")
    (place / "manifest.json").write_text(changed)
    report = validate(place)
    assert not report.verdict.passed
    assert report.derivation.findings
