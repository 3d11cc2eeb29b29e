"""Light of a volume that planes cut: its truth, the decision about it, its package, and the picture of the cut."""

from dataclasses import replace

import numpy as np
import pytest
from judged import validate
from light_scene import scene_of
from scene_builds import built, view_of
from tiny_packages import function
from traced_places import traced_places

from volprep.parts.light import solve
from volprep.parts.light.lit import views_of_a_cut
from volprep.parts.light.trial import choice_for_a_cut
from volprep.truth.decoded import baked_fields, level_volume
from volprep.truth.path_traced import LitVolume, squares_beyond_noise, traced_picture
from volprep.truth.refined import refined_lit, refined_picture
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.parts.light.planes import ClipPlane, plane_numbers, planes_in_box
from volprep_formats.package.reader import Package

CUT = "clip_aware = true\nclip_planes = [{ normal = [0.0, 2.0, 0.0], constant_mm = -12.0 }]"
WHITE = (1.0, 1.0, 1.0)
OBLIQUE = np.array([[0.6, 0.8, 0.0, -5.0]])


def cube(**wishes) -> LitVolume:
    volume = np.full((8, 8, 8), 200, np.uint8)
    grid = Grid.of(volume.shape, (1.0, 1.0, 1.0))
    model = LightModel(kind="scattering")
    return LitVolume(volume, grid, 1.0, 0.0, function((100.0, WHITE, 0.3)), model, **wishes)


@pytest.mark.parametrize("oracle", ["refined", "traced"])
def test_rays_end_at_planes(oracle) -> None:
    lit = cube(planes=OBLIQUE)
    camera = view_of(lit.grid, "left")
    shape = (24, 24)
    if oracle == "traced":
        drawn, allowed = traced_picture(lit, camera, shape, 256).rgba, 0.13
    else:
        drawn, allowed = refined_lit(lit, camera, shape, baked=None).rgba, 1e-6
    # Rays of this view go along x: at y they are in the cube, behind the plane, for 8 - (5 - 0.8 y) / 0.6.
    ends = (np.arange(24) + 0.5) / 12 - 1
    places = np.array([camera @ [x, 0.0, 0.0, 1.0] for x in ends])
    y_mm = places[:, 1] / places[:, 3]
    length = np.clip(8.0 - np.maximum((5.0 - 0.8 * y_mm) / 0.6, 0.0), 0.0, 8.0) * ((y_mm > 0.0) & (y_mm < 8.0))
    np.testing.assert_allclose(drawn[12, :, 3], 1.0 - np.exp(-0.3 * length), atol=allowed)
    assert drawn[12, :, 3].max() > 0.1


def test_a_cut_through_a_white_furnace_loses_no_light() -> None:
    """Albedo 1 under a sky of 1: what is cut away neither lights nor darkens the rest."""
    lit = cube(planes=OBLIQUE)
    camera = view_of(lit.grid, "anterior-left")
    traced = traced_picture(lit, camera, (16, 16), 64)
    np.testing.assert_allclose(traced.rgba[..., :3], traced.rgba[..., 3:] * np.ones(3), atol=1e-9)


def test_light_behind_a_plane_is_that_of_the_volume_that_ends_there() -> None:
    grey = function((100.0, (0.6, 0.6, 0.6), 0.5))
    lit = replace(cube(planes=np.array([[0.0, 1.0, 0.0, -4.0]])), transfer_function=grey)
    half = replace(lit, volume=lit.volume[:, 4:].copy(), grid=Grid.of((8, 4, 8), (1.0, 1.0, 1.0)), planes=None)
    places = np.random.default_rng(3).uniform([0.5, 0.1, 0.5], [7.5, 3.9, 7.5], (30, 3))
    moved = places + np.array([0.0, 4.0, 0.0])
    found, noise = traced_places(lit, moved, 4000)
    right, more_noise = traced_places(half, places, 4000, seed=2)
    whole, _ = traced_places(replace(lit, planes=None), moved, 4000)
    allowed = 4.5 * np.sqrt(noise + more_noise)
    assert np.all(np.abs(found - right) < allowed)
    assert np.mean(np.abs(whole - right) > allowed) > 0.5


@pytest.mark.parametrize(
    ("errors", "kept", "words"),
    [
        ((0.2, 0.02), True, "14.0 dB from path tracing with the light of the whole volume, 34.0 dB with their own"),
        ((0.2, 0.0), True, "above 60 dB with their own"),
        ((0.004, 0.001), False, "less than half of the tolerance"),
        ((0.2, 0.19), False, "14.4 dB with their own"),
        ((0.0, 0.0), False, "nothing of the volume is seen"),
    ],
)
def test_light_of_a_cut_is_kept_where_pictures_are_better(errors, kept, words) -> None:
    found = choice_for_a_cut(*errors, 0.01)
    assert (found.kept, words in found.reason) == (kept, True), found


def test_planes_of_the_patient_become_planes_of_the_box() -> None:
    grid = Grid.of((4, 5, 6), (1.0, 2.0, 3.0), (10.0, 20.0, 30.0), ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    (plane,) = planes_in_box([ClipPlane(normal=(0.0, 4.0, 0.0), constant_mm=-100.0)], grid)
    places = np.random.default_rng(2).uniform(0.0, 9.0, (20, 3))
    world = np.column_stack([places, np.ones(20)]) @ grid.world_from_box.T
    heights = np.column_stack([places, np.ones(20)]) @ plane_numbers([plane])[0]
    np.testing.assert_allclose(heights, world[:, 1] - 25.0, atol=1e-9)


@pytest.fixture(scope="module")
def bowl(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solve, "BATCH", 1 << 15)
        folder = tmp_path_factory.mktemp("bowl")
        built(scene_of(folder, lighting=CUT), folder / "ball.volpkg")
        report = validate(folder / "ball.volpkg", folder / "report", picture_size=32)
        yield Package.open(folder / "ball.volpkg"), report


@pytest.mark.long
def test_a_package_holds_the_light_of_a_cut_beside_that_of_the_whole(bowl) -> None:
    package, report = bowl
    manifest = package.manifest
    item = next(each for each in manifest.plan if each.name == "baked light of the cut")
    assert item.kept
    assert "cut by 1 plane" in item.reason
    assert "dB with their own" in item.reason
    lights = [each for each in manifest.textures if each.role == "light"]
    whole, cut = sorted(lights, key=lambda each: each.is_of_a_cut)
    assert item.files == (cut.file,)
    assert item.size_bytes == next(file.size_bytes for file in manifest.files if file.path == whole.file)
    assert whole.light.model_copy(update={"planes": cut.light.planes, "samples": 0, "residual": 0.0}) == (
        cut.light.model_copy(update={"samples": 0, "residual": 0.0})
    )
    assert package.read_bytes(whole.file) != package.read_bytes(cut.file)
    assert whole.name in manifest.pictures[0].drawings[0].textures
    assert "residual of 0.0" in next(each for each in manifest.plan if each.name == "baked light").reason
    assert report.verdict.passed
    light = report.programs[0].cut_light
    assert light.pixels > 50
    assert 0.0 < light.rmse < 0.02


@pytest.mark.long
def test_the_picture_of_a_cut_is_nearer_to_its_truth_with_its_own_light(bowl) -> None:
    package, _ = bowl
    volume, transfer = level_volume(package, 0), package.manifest.transfer_functions[0]
    light = next(each.light for each in package.manifest.textures if each.is_of_a_cut)
    planes = plane_numbers(light.planes)
    scan = (volume.stored, volume.grid, volume.slope, volume.intercept, transfer)
    fields = [baked_fields(package, cut=cut)["tissue"] for cut in (False, True)]
    errors = np.zeros(2)
    for view in views_of_a_cut(volume.grid, planes):
        camera = view.box_from_clip(volume.grid, 1.0)
        truth = traced_picture(LitVolume(*scan, light.model, planes=planes), camera, (32, 32), 128)
        for i, field in enumerate(fields):
            drawn = refined_picture(volume, transfer, camera, (32, 32), baked=field, planes=planes)
            errors[i] += squares_beyond_noise(drawn.rgba, truth).mean()
    assert errors[0] > 4 * max(errors[1], 0.0), errors


def test_light_of_a_cut_needs_planes(tmp_path) -> None:
    with pytest.raises(VolprepError) as refused:
        built(scene_of(tmp_path, lighting="clip_aware = true"), tmp_path / "ball.volpkg")
    assert refused.value.code == "VP3243"
