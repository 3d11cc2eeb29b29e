"""Packages for OpenGL ES 1.1: from a scene to pictures, and what cannot be."""

import numpy as np
import pytest
from channel_scene import write_channel_scene
from judged import validate
from phantom_scene import write_phantom_scene
from scene_builds import built, planned
from slice_packages import missing_es11, slice_package, stack_of

from volprep.pipeline.build import plan_build
from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.prepare import prepare
from volprep.plan.item_kinds import BEYOND
from volprep.plan.products import SlicesPlan
from volprep.scene.profiles import load_profile
from volprep.scene.request import load_request
from volprep.scene.scene import SliceSettings
from volprep.transfer.preclassified import classified_texels
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.function_table import Table
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

needs_es11 = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")


def scene_with(folder, table="", profile="gles1"):
    return write_phantom_scene(folder, profile, more=table)


def plan_of(folder, table="", profile="gles1"):
    return planned(scene_with(folder, table, profile))


@needs_es11
def test_a_scene_becomes_a_package_of_slices_without_shaders(tmp_path):
    built(scene_with(tmp_path), tmp_path / "p.volpkg")
    assert check(tmp_path / "p.volpkg") == []
    manifest = Package.open(tmp_path / "p.volpkg").manifest
    assert manifest.programs == ()
    assert {(each.transfer, each.slices.axis) for each in manifest.textures} == {
        (transfer, axis) for transfer in ("shell", "core") for axis in "xyz"
    }
    assert {record.role for record in manifest.files} == {"texture", "preview"}
    assert "slices of shell across x" in {item.name for item in manifest.plan if item.kept}


@needs_es11
@pytest.mark.usefixtures("stages_run_again")
def test_the_same_scene_gives_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        built(scene_with(tmp_path, "\n[lab.slices]\npalette_entries = 30\n"), tmp_path / name)
    files = [{f.relative_to(tmp_path / n): f.read_bytes() for f in (tmp_path / n).rglob("*.*")} for n in ("a", "b")]
    assert files[0] == files[1]


@needs_es11
def test_each_stack_has_the_opacity_of_its_own_distance(tmp_path):
    codes = np.random.default_rng(5).integers(0, 256, (4, 5, 6))
    package = slice_package(tmp_path, codes, (3.0, 0.5, 1.25), slices='form = "rgba"')
    function = package.manifest.transfer_functions[0]
    for place, (axis, distance_mm) in enumerate((("z", 3.0), ("y", 0.5), ("x", 1.25))):
        values = np.moveaxis(codes, place, 0)
        expected = classified_texels(Table.exact(function), values.ravel().astype(float), distance_mm)
        np.testing.assert_array_equal(stack_of(package, axis), expected.reshape(*values.shape, 4))
        assert {each.reference_mm for each in package.manifest.textures if each.slices.axis == axis} == {distance_mm}


@needs_es11
def test_fewer_stacks_are_there_on_request(tmp_path):
    package = slice_package(tmp_path, np.full((4, 5, 6), 9), slices='stacks = ["z"]')
    assert {each.slices.axis for each in package.manifest.textures} == {"z"}
    left_out = {item.name: item for item in package.manifest.plan if not item.kept}
    assert "slices across x" in left_out


@needs_es11
def test_a_package_of_slices_is_validated(tmp_path):
    codes = np.zeros((12, 14, 16))
    z, y, x = np.meshgrid(*(np.arange(n) - n / 2 + 0.5 for n in codes.shape), indexing="ij")
    # Colours that the filter mixes are seen: FLIP is 0.050 to 0.060, the default tolerance 0.03.
    flip = "[tolerance]\nflip = 0.07\n"
    codes = 200 * np.exp(-(x**2 + y**2 + z**2) / 20)
    package = slice_package(tmp_path, codes, slices='form = "palette"', extra=flip)
    report = validate(package.path, tmp_path / "report", picture_size=32)
    (program,) = report.programs
    assert (program.technique, len(program.views), len(program.sweep.points)) == ("slices", 9, 1)
    assert report.verdict.passed
    assert 0 < report.verdict.worst_rmse < 0.02
    for program in report.programs:
        parts = program.sweep.breakdown
        shares = [parts.texels.rmse, parts.angle.rmse, parts.target.rmse]
        assert min(shares) > 0
        whole = next(view.total.rmse for view in program.views if view.view == program.sweep.view)
        # The triangle inequality: nothing is left over.
        assert whole <= sum(shares) + 1e-9
    assert "classification before the filter" in (tmp_path / "report" / "index.html").read_text(encoding="utf-8")


@needs_es11
def test_a_package_that_is_too_far_off_fails(tmp_path):
    scene = scene_with(tmp_path, "\n[tolerance]\nrmse = 0.001\nmaximum = 0.01\n")
    built(scene, tmp_path / "p.volpkg")
    report = validate(tmp_path / "p.volpkg", tmp_path / "report", picture_size=24)
    assert not report.verdict.passed


@needs_es11
def test_the_verb_changes_the_form_of_a_draft(tmp_path):
    request = load_request(scene_with(tmp_path))
    import_draft(prepare(request), tmp_path / "d", Silent())
    for name in ("quantize", "transfer", "slices"):
        draft = run_verb(tmp_path / "d", name, lambda scene: scene, Silent())
    assert {each.format for each in draft.manifest.textures} == {"palette8-rgba8unorm"}

    def rgba(scene):
        return scene.model_copy(update={"slices": SliceSettings(form="rgba", stacks=("z",))})

    draft = run_verb(tmp_path / "d", "slices", rgba, Silent())
    assert {(each.format, each.slices.axis) for each in draft.manifest.textures} == {("rgba8unorm", "z")}
    run_verb(tmp_path / "d", "seal", lambda scene: scene, Silent())
    assert check(tmp_path / "d") == []


def test_the_finest_level_that_fits_is_taken_and_says_why(tmp_path):
    device = load_profile("gles1", tmp_path).model_copy(update={"max_texture_bytes": 40_000})
    request = load_request(scene_with(tmp_path))
    plan = plan_build(type(request)(scene=request.scene, profile=device, scene_path=None), Silent())
    (channel,) = plan.channels
    (level,) = channel.levels
    assert level.index > 0
    size = sum(
        1024 + height * width
        for stack in channel.part(SlicesPlan).stacks
        if stack.transfer == "shell"
        for height, width in (texture.shape_yx for texture in stack.textures)
    )
    assert size <= 40_000
    reasons = {item.name: item.reason for item in plan.items}
    assert "more than the 40000 that profile gles1 has for textures" in reasons["level 0"]


def test_a_device_with_too_little_memory_holds_no_level(tmp_path):
    device = load_profile("gles1", tmp_path).model_copy(update={"max_texture_bytes": 2000})
    request = load_request(scene_with(tmp_path))
    with pytest.raises(VolprepError, match=r"VP3022 .*3 stacks of slices take"):
        plan_build(type(request)(scene=request.scene, profile=device, scene_path=None), Silent())


WIDE = "[tolerance]\nrmse = 0.2\nmaximum = 1.0\nflip = 0.5\n"


@pytest.mark.parametrize(
    ("table", "profile", "problem"),
    [
        ("\n[slices]\n", "gles2-2048", "has shaders, which draw a whole volume"),
        ('\n[render]\nlighting = "headlight"\n', "gles1", r"render\.lighting = .headlight. needs them"),
        ('\n[render]\ncompositing = "maximum"\n', "gles1", "compositing maximum needs them"),
        ("\n[normals]\n", "gles1", r"\[normals\] needs them"),
        ("\n[proxy]\n", "gles1", r"\[proxy\] needs them"),
        ("\n[grid]\n", "gles1", r"\[grid\] needs them"),
        ("\n[bricks]\n", "gles1", r"\[bricks\] needs them"),
        ("\n[textures]\nmipmaps = true\n", "gles1", r"textures\.mipmaps needs them"),
        ('\n[skip]\nkind = "blocks"\n', "gles1", r"skip\.kind blocks needs them"),
        ("\n[skip]\nranges = true\n", "gles1", r"skip\.ranges needs them"),
        ('\n[render]\nclassification = "palette"\n', "gles1", "classification palette needs them"),
        ('\n[lab.slices]\nstacks = ["x", "x"]\n', "gles1", "names an axis twice"),
    ],
)
def test_what_does_not_go_together_is_refused(tmp_path, table, profile, problem):
    with pytest.raises(VolprepError, match=rf"VP3060 .*{problem}"):
        plan_of(tmp_path, table, profile)


@pytest.mark.parametrize(("extinction", "tolerance", "warned"), [(0.6, "", 1), (0.6, WIDE, 0)])
def test_slices_beyond_the_tolerance_are_warned_of(tmp_path, extinction, tolerance, warned):
    scene = scene_with(tmp_path)
    text = scene.read_text().partition('[[transfer]]\nname = "core"')[0] + tolerance
    scene.write_text(text.replace("0.2 }", f"{extinction / 3} }}").replace("0.6 }", f"{extinction} }}"))
    package = built(scene, tmp_path / "slices.volpkg")
    said = [item.reason for item in package.manifest.plan if item.kind == BEYOND]
    assert len(said) == warned
    assert all("in an oblique view shell is off by RMSE" in each for each in said)


def test_a_profile_without_palettes_needs_the_other_form(tmp_path):
    device = load_profile("gles1", tmp_path).model_copy(update={"texture_formats": ("r8unorm", "rgba8unorm")})
    request = load_request(scene_with(tmp_path))
    with pytest.raises(VolprepError, match=r"VP3060 .*no textures of the format palette8-rgba8unorm"):
        plan_build(type(request)(scene=request.scene, profile=device, scene_path=None), Silent())


def test_several_channels_have_no_slices(tmp_path):
    with pytest.raises(VolprepError, match=r"VP1244 .*stacks of slices"):
        planned(write_channel_scene(tmp_path, "gles1"))
