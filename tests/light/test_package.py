"""Packages with light that was computed once: built, drawn, proved, refused."""

import numpy as np
import pytest
from judged import validate
from light_scene import scene_of
from scene_builds import built, view_of

from volprep.parts.light import decision, solve
from volprep.parts.light.trial import choice
from volprep.pipeline.remarks import remarks
from volprep.render.renderer import Renderer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package


@pytest.fixture(scope="module")
def bowl(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solve, "BATCH", 1 << 15)
        folder = tmp_path_factory.mktemp("bowl")
        built(scene_of(folder), folder / "ball.volpkg")
        report = validate(folder / "ball.volpkg", folder / "report", picture_size=32)
        yield Package.open(folder / "ball.volpkg"), report


def test_a_package_with_baked_light_is_proved_against_path_tracing(bowl) -> None:
    package, report = bowl
    assert report.verdict.passed
    item = next(each for each in package.manifest.plan if each.name == "baked light")
    assert "from path tracing at half the resolution" in item.reason
    assert "for the volume cut by a plane through its middle" in item.reason
    light = report.programs[0].light
    assert light.pixels > 100
    assert 0.0 < light.rmse < light.rmse_below < 0.02
    texture = next(each for each in package.manifest.textures if each.role == "light")
    voxels = np.prod(package.manifest.levels[0].grid.shape_zyx)
    assert np.prod(texture.shape_zyx) * 2 <= 0.4 * voxels


def test_what_the_package_draws_is_darker_than_without_the_light(bowl) -> None:
    package, _ = bowl
    grid = package.manifest.grid
    camera = view_of(grid, "superior")
    with Renderer(package) as renderer:
        picture = renderer.render(camera, (32, 32))
    assert "baked_light" in package.read_bytes(package.manifest.level_programs[0].fragment).decode()
    seen = picture[..., 3] > 0.5
    assert 0.1 < picture[seen, :3].mean() < 0.6 * np.mean([0.745, 0.631, 0.527]) + 0.1


@pytest.mark.parametrize(
    ("errors", "wanted", "texels", "factor", "words"),
    [
        ((0.3, 0.03, 0.02, 0.01), "auto", 1000, 1, "0.01 at all of it, 0.3 without the light; half misses"),
        ((0.3, 0.03, 0.02, 0.019), "auto", 1000, 2, "0.019 at all of it"),
        ((0.3, 0.03, 0.02, 0.01), 1, 1000, 1, "as the scene states"),
        ((0.004, 0.002, 0.001), "auto", 1000, None, "hardly change: RMSE 0.004 without"),
        ((0.3, 0.02, 0.01), "auto", 1000, 2, "0.01 from path tracing at half"),
        ((0.3, 0.0104, 0.01), "auto", 1000, 4, "0.01 at a quarter"),
        ((0.3, 0.004, 0.001), "auto", 1000, 4, "0.004 at a quarter"),
        ((0.3, 0.02, 0.01), "auto", 5_000_000, 4, "more than 4000000 texels"),
        ((0.004, 0.002, 0.001), 2, 1000, 2, "as the scene states"),
    ],
)
def test_the_resolution_is_the_coarsest_that_is_near_enough(errors, wanted, texels, factor, words) -> None:
    found = choice(np.array(errors[:3]), 0.01, wanted, texels, *errors[3:])
    assert (found.factor, words in found.reason) == (factor, True), found


def test_a_thin_veil_has_no_light_and_the_plan_says_so(tmp_path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solve, "BATCH", 1 << 12)
        path = scene_of(tmp_path)
        path.write_text(path.read_text().replace("1.2 },", "0.001 },"))
        manifest = built(path, tmp_path / "ball.volpkg").manifest
    item = next(each for each in manifest.plan if each.name == "baked light")
    assert not item.kept
    assert "hardly change" in item.reason
    assert not any(each.role == "light" for each in manifest.textures)
    assert not any(each.baked for each in manifest.programs)
    (told,) = (text for text in remarks(manifest) if "baked light" in text)
    assert told.startswith("baked light is left out: pictures hardly change")


def test_a_build_says_that_its_light_misses_the_tolerance(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(solve, "BATCH", 1 << 12)
    manifest = built(scene_of(tmp_path, more="[tolerance]\nrmse = 0.002"), tmp_path / "ball.volpkg").manifest
    (told,) = (text for text in remarks(manifest) if "baked light" in text)
    assert "more than the tolerance of 0.002" in told
    assert "VP3242" in told


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("more", ["[bricks]\nsize = 4", "[proxy]\nblock = 2"], ids=["bricks", "meshes"])
def test_bricks_and_meshes_have_the_same_light(tmp_path, monkeypatch, more) -> None:
    monkeypatch.setattr(solve, "BATCH", 1 << 13)
    monkeypatch.setattr(decision, "_LEAST_SAMPLES", 1 << 13)
    monkeypatch.setattr(decision, "_SAMPLES_PER_TEXEL", 16)
    lighting = "light_mm = [-20.0, -30.0, 40.0]\nresolution = 2"
    pictures = []
    for name, each in (("plain", ""), ("other", more)):
        (tmp_path / name).mkdir()
        path = scene_of(tmp_path / name, baked="shadow", lighting=lighting, more=each)
        package = built(path, path.parent / "p.volpkg")
        camera = view_of(package.manifest.grid, "superior")
        with Renderer(package) as renderer:
            pictures.append(np.array(renderer.render(camera, (32, 32)), np.float64))
    assert pictures[0][..., :3].max() > 0.3
    np.testing.assert_allclose(pictures[1], pictures[0], atol=2.1 / 255)


@pytest.mark.parametrize(
    ("wishes", "code"),
    [
        ({"profile": "gles1"}, "VP3240"),
        ({"render": 'compositing = "maximum"'}, "VP3240"),
        ({"render": 'technique = "view-slices"'}, "VP3240"),
        ({"render": 'classification = "preintegrated"'}, "VP3240"),
        ({"baked": "shadow", "lighting": "light_mm = [0.0, 0.0, 90.0]\nturnable = true"}, "VP3240"),
        ({"lighting": 'turnable = true\nchannels = "rgb"'}, "VP3240"),
        ({"baked": "shadow"}, "VP3241"),
    ],
    ids=[
        "ES 1.1",
        "maximum",
        "slices",
        "preintegrated",
        "shadows turned",
        "turned in colour",
        "shadow without a light",
    ],
)
def test_what_baked_light_does_not_go_with_is_refused(wishes, code, tmp_path) -> None:
    with pytest.raises(VolprepError) as refused:
        built(scene_of(tmp_path, **wishes), tmp_path / "ball.volpkg")
    assert refused.value.code == code
