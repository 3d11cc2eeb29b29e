"""Loops that a driver ends: what would be missing behind is refused, and what is drawn is whole."""

import numpy as np
import pytest
from blobs import blobs
from scene_builds import view_of
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.pipeline.preview import preview_png
from volprep.render.egl import Context
from volprep.render.gl import Gl
from volprep.render.proxy_renderer import ProxyRenderer
from volprep.render.renderer import Renderer
from volprep.render.turns import CERTAIN_TURNS, counted_turns, step_mm_of_turns, turns_of_rays
from volprep.scene.scene import ProxySettings
from volprep.validation.timing.full_rays import unskipped
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package

FOG = function((0.0, (1.0, 1.0, 1.0), 0.02), (255.0, (1.0, 1.0, 1.0), 0.02))
SHELLS = function((0.0, (1.0, 0.2, 0.1), 0.0), (60.0, (1.0, 0.2, 0.1), 0.0), (90.0, (1.0, 1.0, 1.0), 0.3))
ASKED = 200_000


@pytest.fixture(scope="module")
def made():
    """Turns of a loop that the driver makes, of many."""
    with Context("es3.0") as context:
        gl = Gl(context)
        found = counted_turns(gl, ASKED)
        gl.close()
    if found == ASKED:
        pytest.skip("this driver ends no loops")
    return found


def picture(package, step_mm, kind=Renderer, view="superior"):
    grid = package.manifest.grid
    with kind(package, target="rgba32f") as renderer:
        return renderer.render(view_of(grid, view), (8, 8), step_mm)


def with_step(package, step_mm, step_mm_min=None):
    """The package as one that wants this step, and has no bound of its own unless one is given."""
    manifest = package.manifest
    (picture,) = manifest.pictures
    drawings = tuple(each.model_copy(update={"step_mm": step_mm}) for each in picture.drawings)
    pictures = (picture.model_copy(update={"drawings": drawings}),)
    programs = tuple(each.model_copy(update={"step_mm_min": step_mm_min}) for each in manifest.programs)
    return Package(package.path, manifest.model_copy(update={"pictures": pictures, "programs": programs}))


@pytest.mark.parametrize("api", ["es2.0", "es3.0"])
@pytest.mark.parametrize("turns", [0, 1, 255, 256, CERTAIN_TURNS])
def test_turns_that_every_driver_makes_are_counted_to_the_last(api, turns):
    with Context(api) as context:
        gl = Gl(context)
        assert counted_turns(gl, turns) == turns
        gl.close()


def test_a_step_for_which_the_driver_ends_the_loop_is_refused_and_the_one_that_it_names_is_drawn(tmp_path, made):
    package = tiny_package(tmp_path / "p", np.zeros((60, 20, 24), np.uint8), FOG)
    longest_mm = np.linalg.norm(package.manifest.grid.extent_mm_zyx)
    with pytest.raises(VolprepError, match=rf"VP5024 .* ends them after {made}") as caught:
        picture(package, longest_mm / made / 1.01)
    (program,) = package.manifest.level_programs
    least_mm = step_mm_of_turns(package.manifest, program, 0, made)
    assert f"{least_mm:.3g} mm or more" in str(caught.value)
    drawn = picture(package, least_mm * 1.001)
    # 60 mm of fog. Some 65,000 depths are added in float32.
    assert drawn[4, 4, 3] == pytest.approx(1 - np.exp(-0.02 * 60), abs=1e-4)


@pytest.mark.parametrize("profile", [ES2, ES3], ids=["es2", "es3"])
def test_a_package_whose_own_step_is_too_fine_is_refused_as_a_wish_is(tmp_path, profile):
    package = tiny_package(tmp_path / "p", np.zeros((6, 4, 3), np.uint8), FOG, profile)
    for step_mm in (1e-30, 1e-300):
        for refused in (with_step(package, step_mm, 1e-6), with_step(package, step_mm)):
            with pytest.raises(VolprepError, match=r"VP5019|VP5024"):
                picture(refused, None)
            with pytest.raises(VolprepError, match=r"VP5019|VP5024"):
                preview_png(refused)


def test_a_preview_takes_no_finer_steps_than_half_a_voxel(tmp_path):
    voxels = np.random.default_rng(5).integers(0, 255, (6, 4, 3), dtype=np.uint8)
    package = tiny_package(tmp_path / "p", voxels, SHELLS)
    half_mm = min(package.manifest.grid.spacing_mm_zyx) / 2
    fine, half, longer = (preview_png(with_step(package, step_mm)) for step_mm in (half_mm / 6, half_mm, 4 * half_mm))
    assert fine == half
    assert longer != half


def test_a_renderer_says_which_steps_it_draws(tmp_path, made):
    package = tiny_package(tmp_path / "p", np.zeros((60, 20, 24), np.uint8), FOG)
    (program,) = package.manifest.level_programs
    least_mm = step_mm_of_turns(package.manifest, program, 0, made)
    with Renderer(package) as renderer:
        assert [renderer.draws_step(step_mm) for step_mm in (0.5, least_mm * 1.001, least_mm * 0.99, -1.0)] == [
            True,
            True,
            False,
            False,
        ]


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("classification", ["lookup", "preintegrated"])
@pytest.mark.parametrize("profile", [ES2, ES3], ids=["es2", "es3"])
def test_the_finest_step_that_is_drawn_with_a_skip_table_is_whole(tmp_path, made, profile, classification):
    codes = blobs(31, (30, 28, 26))
    package = tiny_package(
        tmp_path / "p",
        codes,
        SHELLS,
        profile,
        skip=("distance", 4),
        proxy=ProxySettings(),
        classification=classification,
        entries=64,
        # The loop of ES 2 is long enough for an eighth of the package's own step.
        step_mm=0.01,
    )
    (program,) = package.manifest.level_programs
    step_mm = step_mm_of_turns(package.manifest, program, 0, made) * 1.001
    assert turns_of_rays(package.manifest, program, 0, step_mm) > 0.99 * made
    for view in ("superior", "anterior-left"):
        whole = picture(unskipped(package, program), step_mm, view=view)
        assert whole[..., 3].max() > 0.1
        for kind in (Renderer, ProxyRenderer):
            # Of 25,000 samples one may be in the next block.
            np.testing.assert_allclose(picture(package, step_mm, kind, view), whole, rtol=0, atol=1e-5)
