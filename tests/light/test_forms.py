"""Forms of light that was computed once: mosaics, sub-volumes, light in colour, and light that an app turns."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scene_builds
from light_scene import scene_of
from scene_builds import view_of
from traced_places import traced_places
from turned_light import turned_by

from volprep.parts.editing.inputs import FunctionEdit
from volprep.parts.light import decision, solve
from volprep.parts.light.stage import solve_turnable
from volprep.render.inputs import Inputs
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep.truth.decoded import baked_fields
from volprep.truth.path_traced import LitVolume
from volprep.truth.refined import refined_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.environment import (
    CORNERS,
    WHITE,
    environment_of,
    environment_uniform,
    shares_of,
    turned,
)
from volprep_formats.package.parts.light.model import LightModel, Sun
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.progress import Silent

SKY = "sky = [0.6, 0.4, 0.3]\nground = [0.1, 0.2, 0.4]\nresolution = 2\n"
TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
PIXELS = (32, 32)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Build the bowl with some settings, once each."""
    made: dict[str, Package] = {}

    def build_once(name: str, **wishes: str) -> Package:
        if name not in made:
            folder = tmp_path_factory.mktemp(name.replace(" ", "-"))
            made[name] = scene_builds.built(scene_of(folder, **wishes), folder / "ball.volpkg")
        return made[name]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solve, "BATCH", 1 << 12)
        patch.setattr(decision, "_LEAST_SAMPLES", 1 << 14)
        patch.setattr(decision, "_SAMPLES_PER_TEXEL", 16)
        yield build_once


def drawn(package: Package, view: str = "anterior-left", step_mm: float | None = None, **how) -> np.ndarray:
    grid = package.manifest.grid
    camera = view_of(grid, view)
    with Renderer(package, **how) as renderer:
        return np.array(renderer.render(camera, PIXELS, step_mm), np.float64)


def truth_of_codes(package: Package, view: str, turn: np.ndarray | None) -> np.ndarray:
    """The scan under the package's own light, by the oracle."""
    voxels = np.fromfile(package.path.parent / "ball.raw", np.uint8).reshape(15, 13, 17)
    scan = Grid.of((15, 13, 17), (1.2, 1.0, 0.9))
    camera = standard_views(package.manifest.grid)[view].box_from_clip(scan, 1.0)
    function = package.manifest.transfer_functions[0]
    baked = baked_fields(package, turn)[function.name]
    return refined_picture(Volume(voxels, scan), function, camera, PIXELS, 1e-3, baked=baked).rgba


FORMS = {
    "a brightness": {},
    "in colour": {"lighting": f'{SKY}channels = "rgb"'},
    "turnable": {"lighting": f"{SKY}turnable = true"},
}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_a_picture_has_the_light_that_the_texels_hold(built, form, profile) -> None:
    wishes = {"lighting": SKY, **FORMS[form], "profile": profile}
    package = built(f"{form} {profile}", **wishes)
    (held,) = [each for each in package.manifest.textures if each.role == "light"]
    assert (held.mosaic is not None) == (profile == "gles2-2048")
    picture = drawn(package)
    np.testing.assert_allclose(picture, truth_of_codes(package, "anterior-left", None), atol=0.02)
    assert picture[..., :3].max() > 0.15


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("form", FORMS)
def test_light_in_a_mosaic_draws_the_same_picture_as_in_a_3d_texture(built, form) -> None:
    pictures = [
        drawn(built(f"{form} {profile}", **{"lighting": SKY, **FORMS[form], "profile": profile}))
        for profile in ("gles3", "gles2-2048")
    ]
    # The lookup table of OpenGL ES 2 has 8 bits.
    np.testing.assert_allclose(pictures[0], pictures[1], atol=2.1 / 255)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("form", ["a brightness", "turnable"])
@pytest.mark.parametrize("profile", ["gles3", "gles2-4096"])
def test_sub_volumes_have_the_light_of_the_whole_volume(built, form, profile) -> None:
    wishes = {"lighting": SKY, **FORMS[form], "more": "[grid]\nsize = 9", "profile": profile}
    package = built(f"{form} in pieces {profile}", **wishes)
    program = next(each for each in package.manifest.programs if each.sampling == "subvolumes")
    assert program.baked
    # The four pieces around the point in the middle are the whole volume.
    points = [
        drawn(package, point=point)
        for point in range(np.prod([len(each) for each in _cuts(package)]))
        if _is_inner(package, point)
    ]
    assert points
    assert min(np.abs(each - drawn(package)).max() for each in points) < 2.1 / 255


def _cuts(package: Package) -> list[list[int]]:
    return json.loads(package.read_text(package.manifest.subvolumes.grid))["cuts_zyx"]


def _is_inner(package: Package, point: int) -> bool:
    counts = [len(each) for each in _cuts(package)]
    place = np.unravel_index(point, counts)
    return all(0 < at < count - 1 or count == 2 for at, count in zip(place, counts, strict=True))


def test_an_app_turns_the_light_and_the_picture_is_that_of_the_turned_light(built) -> None:
    package = built("turnable gles3", lighting=FORMS["turnable"]["lighting"], profile="gles3")
    own, turned_picture = drawn(package), drawn(package, edit=turned_by(TURN))
    assert np.abs(own - turned_picture).max() > 0.05
    np.testing.assert_allclose(turned_picture, truth_of_codes(package, "anterior-left", TURN), atol=0.02)


def test_light_that_turns_is_that_of_the_samples_although_its_ends_are_read_between_them(built) -> None:
    packages = [
        built(f"{form} gles3", **{"lighting": SKY, **FORMS[form], "profile": "gles3"})
        for form in ("a brightness", "turnable")
    ]
    # Along the rays, a voxel from sample to sample: half a step is a light of 0.01.
    fixed, turns = (drawn(package, "left", step_mm=0.9, target="rgba32f", edit=with_ramps) for package in packages)
    assert fixed[..., 0].max() > 0.1
    # 0.0004 with any finer steps: codes of light that turns are 0.01 apart. 0.0011 without half a step of change.
    assert np.sqrt(np.mean((turns - fixed) ** 2)) < 0.0007


def with_ramps(_package: Package, inputs: Inputs) -> Inputs:
    """Light that rises along x where the share is 0, and falls where it is 1."""
    texture = next(each for each in inputs.textures if each.light is not None)
    light = texture.light
    z, y, x = texture.shape_zyx
    ramp = 255.0 * (np.linspace(0.0, 0.3, x) + light.subtracted) / light.largest
    ends = np.rint(np.stack([ramp, ramp[::-1]], axis=-1)).astype(np.uint8)
    texels = np.broadcast_to(ends, (z, y, x, 2))
    values = dict(inputs.values)
    if light.model.turnable:
        halves = [np.broadcast_to(end[:, None], (z // 2, y, x, 4)) for end in ends.T]
        texels, values["environment"] = np.concatenate(halves), environment_uniform(WHITE)
    return replace(inputs, texels={**inputs.texels, texture.name: np.ascontiguousarray(texels)}, values=values)


def test_light_in_colour_costs_twice_the_bytes_and_the_plan_says_what_it_is_worth(built) -> None:
    grey, colour = (
        built(f"{form} gles3", **{"lighting": SKY, **FORMS[form], "profile": "gles3"})
        for form in ("a brightness", "in colour")
    )
    items = [next(each for each in p.manifest.plan if each.name == "baked light") for p in (grey, colour)]
    # Heads of files count, too.
    assert 1.7 < items[1].size_bytes / items[0].size_bytes < 2.1
    assert "a brightness is RMSE" in items[0].reason
    assert "in the colours of two lights" in items[1].reason
    assert "do not lie between two colours" not in items[1].reason
    red, _, blue = drawn(colour)[..., :3].reshape(-1, 3).max(axis=0) / drawn(grey)[..., :3].reshape(-1, 3).max(axis=0)
    assert red > 1.2 * blue


def test_the_plan_says_that_suns_of_several_hues_have_more_than_two_colours(built) -> None:
    suns = (
        f"{{ direction = {direction}, colour = {colour}, size_degrees = 40.0 }}"
        for direction, colour in (([1.0, -1.0, 0.0], [1.5, 0.1, 0.1]), ([-1.0, -1.0, 0.0], [0.1, 0.1, 1.5]))
    )
    lighting = f'suns = [{", ".join(suns)}]\nresolution = 2\nchannels = "rgb"'
    (item,) = (each for each in built("suns", lighting=lighting).manifest.plan if each.name == "baked light")
    assert "its hues do not lie between two colours, which leave out RMSE" in item.reason
    assert 'lighting.channels = "luminance"' in item.reason


def test_four_environments_make_every_environment_that_changes_like_a_cosine() -> None:
    environment = np.random.default_rng(3).uniform(-1.0, 1.0, (4, 3))
    ways = np.random.default_rng(4).normal(size=(20, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    of_four = (1.0 + ways @ CORNERS.T) @ shares_of(environment)
    np.testing.assert_allclose(of_four, environment[0] + ways @ environment[1:], atol=1e-12)
    np.testing.assert_allclose(environment_uniform(WHITE)[:3], 0.25)


def test_sky_and_ground_are_exact_and_a_sun_is_spread_over_half_of_the_sky() -> None:
    model = LightModel(
        kind="occlusion",
        sky=(0.8, 0.6, 0.4),
        ground=(0.2, 0.2, 0.2),
        suns=(Sun(direction=(3.0, 0.0, 0.0), colour=(0.5, 0.4, 0.3)),),
        turnable=True,
    )
    up, front = (np.array(way) for way in ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)))
    environment = environment_of(model)
    np.testing.assert_allclose(environment[0] + up @ environment[1:], [1.3, 1.0, 0.7])
    np.testing.assert_allclose(environment[0] + front @ environment[1:], [0.5, 0.4, 0.3])
    turned_once = turned(environment, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    np.testing.assert_allclose(turned_once[2], [0.5, 0.4, 0.3])


@pytest.mark.long
def test_the_field_of_four_environments_is_the_light_of_any_of_them(monkeypatch) -> None:
    monkeypatch.setattr(solve, "BATCH", 1 << 15)
    scan = Grid.of(
        (12, 12, 12), (1.0, 1.0, 1.0), direction=np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    )
    voxels = np.zeros((12, 12, 12), np.uint8)
    voxels[3:9, 3:9, 3:9] = 200
    model = LightModel(kind="scattering", sky=(1.0, 0.5, 0.2), ground=(0.1, 0.1, 0.4), turnable=True)
    lit = LitVolume(voxels, scan, 1.0, 0.0, _steep(), model)
    field = solve_turnable(lit, 2, 1 << 17, Silent())
    places = np.array([[2.9, 6.0, 6.0], [6.0, 9.0, 6.0], [6.0, 6.0, 8.9], [6.0, 2.9, 6.0]])
    values = np.full(4, 100.0)
    environment = turned(environment_of(model), TURN)
    truth, variance = traced_places(LitVolume(voxels, scan, 1.0, 0.0, _steep(), model, environment), places, 20_000)
    found = field.at(places, values) @ shares_of(environment)
    assert np.sqrt(variance).max() < 0.01
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.06


def _steep():
    points = ((50.0, 0.0), (150.0, 2.0))
    return TransferFunction(
        name="t", points=tuple(TransferPoint(value=v, colour=(0.8, 0.6, 0.4), extinction_per_mm=e) for v, e in points)
    )


@pytest.mark.long
def test_an_edit_leaves_out_light_that_an_app_turns(built) -> None:
    lit = built("edited", lighting=FORMS["turnable"]["lighting"], head="editable = true")
    unlit = built("edited unlit", baked="none", head="editable = true")
    function = _steep().model_copy(update={"name": "tissue"})
    np.testing.assert_allclose(
        drawn(lit, edit=FunctionEdit(function)), drawn(unlit, edit=FunctionEdit(function)), atol=1.1 / 255
    )
