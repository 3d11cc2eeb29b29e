"""Techniques: a scene asks for one, the package has what it needs and nothing else, and validation judges it."""

from unittest.mock import patch

import numpy as np
import pytest
import scene_builds
from ball_scan import write_ball_scene
from scene_builds import planned, view_of

from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.techniques import TECHNIQUES
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep.validation.folder import ReportFolder
from volprep.validation.run import measure_package
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.progress import Silent

CONVERGENT = [name for name, technique in TECHNIQUES.items() if technique.order is None and name != "ray-casting"]
DIVERGENT = [name for name, technique in TECHNIQUES.items() if technique.order is not None]


PROFILE = """
name = "eight"
api = "es2.0"
max_texture_size = 64
max_3d_texture_size = 0
texture_units = 8
texture_formats = ["r8unorm", "rgba8unorm"]
index_bits = 16
max_texture_bytes = 67108864
"""

EIGHT = PROFILE.replace("units = 8", "units = {}")

EMPTY = """crop = "none"

[source]"""


def built(folder, render, profile="gles3", tables=""):
    return scene_builds.built(write_ball_scene(folder, render, profile, tables), folder / "p.volpkg")


def measured(package, folder):
    """What validation finds, without its page."""
    for name in ("report/pictures", "scratch"):
        (folder / name).mkdir(parents=True)
    with patch("volprep.validation.timing.sweep._RATIOS", (4.0, 2.0, 1.0)):
        return measure_package(package.path, ReportFolder(folder / "report"), folder / "scratch", Silent())


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("technique", "profile"),
    [
        *((name, "gles3") for name in CONVERGENT),
        *((name, "gles2-2048") for name in CONVERGENT if "mosaic" in TECHNIQUES[name].samplings),
    ],
)
def test_a_package_of_every_technique_is_validated(tmp_path, technique, profile):
    # On OpenGL ES 2.0 layers are rounded to 8 bits, one by one: RMSE 0.0048, FLIP 0.032.
    rounded = technique == "axis-slices" and profile == "gles2-2048"
    tables = "[tolerance]\nflip = 0.04\n" if rounded else ""
    package = built(tmp_path, f'technique = "{technique}"', profile, tables)
    assert check(package.path) == []
    assert {program.technique for program in package.manifest.programs} == {technique}
    report = measured(package, tmp_path)
    assert report.verdict.passed, report.verdict
    assert {program.technique for program in report.programs} == {technique}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
@pytest.mark.parametrize("classification", ["control-points", "palette", "preclassified"])
def test_a_package_without_a_table_is_validated_with_and_without_3d_textures(tmp_path, classification, profile):
    # Classified voxels are rounded to 8 bits, and their light is not that of the values between them: at every step
    # FLIP is 0.08 to 0.09, and thin things keep 0.717 of their light.
    tables = "[tolerance]\nflip = 0.1\nkept_light = 0.7\n" if classification == "preclassified" else ""
    package = built(
        tmp_path, f'classification = "{classification}"', profile, f"{tables}[lab.render]\npalette_entries = 200\n"
    )
    assert check(package.path) == []
    assert {texture.role for texture in package.manifest.textures} <= {"volume", "skip"}
    report = measured(package, tmp_path)
    assert report.verdict.passed, report.verdict


def test_control_points_leave_the_eighth_unit_to_the_volume(tmp_path):
    (tmp_path / "eight.toml").write_text(PROFILE, encoding="utf-8")
    render = 'classification = "{}"\nopacity_cutoff = 1.0'
    packages = {}
    for name in ("control-points", "lookup"):
        (tmp_path / name).mkdir()
        scene = write_ball_scene(tmp_path / name, render.format(name), "../eight.toml", '[skip]\nkind = "none"')
        text = (
            scene.read_text(encoding="utf-8")
            .replace("[12, 15, 17]", "[370, 15, 17]")
            .replace("1.5,", "0.05,")
            .replace("[source]", 'crop = "none"\n[source]', 1)
        )
        scene.write_text(text, encoding="utf-8")
        ball = np.fromfile(tmp_path / name / "ball.raw", np.uint8).reshape(12, 15, 17)
        np.repeat(ball, 31, axis=0)[:370].tofile(tmp_path / name / "ball.raw")
        packages[name] = planned(scene).channels[0]
    assert len(packages["control-points"].volumes[0].names) == 8
    assert packages["control-points"].levels[0].index == 0
    assert packages["lookup"].levels[0].index > 0


@pytest.mark.long
def test_a_volume_that_needs_all_eight_units_is_drawn_by_control_points_as_well_as_with_a_table(tmp_path):
    """As 512³ voxels in eight textures of 2048² texels of four channels (thesis, 6.7): no texel is left."""
    z, y, x = np.meshgrid(*(np.linspace(-1.6, 1.6, n) for n in (128, 32, 32)), indexing="ij")
    values = (230 * np.exp(-(x**2) - y**2 - z**2) + 20 * (np.sin(9 * x) > 0)).astype(np.uint8)
    rmse = {}
    for name, units in (("control-points", 8), ("lookup", 9)):
        folder = tmp_path / name
        folder.mkdir()
        (tmp_path / f"{name}.toml").write_text(EIGHT.format(units), encoding="utf-8")
        render = f'classification = "{name}"\nopacity_cutoff = 1.0\nstep_voxels = 0.25'
        scene = write_ball_scene(
            folder, render, f"../{name}.toml", '[skip]\nkind = "none"\n[lab.mosaic]\norder = "interleaved"'
        )
        text = scene.read_text(encoding="utf-8").replace("[12, 15, 17]", "[128, 32, 32]").replace("[1.5,", "[0.25,")
        text = text.replace("[source]", EMPTY, 1)
        scene.write_text(text, encoding="utf-8")
        values.tofile(folder / "ball.raw")
        package = scene_builds.built(scene, folder / "p.volpkg")
        volumes = [texture for texture in package.manifest.textures if texture.role == "volume"]
        assert [texture.shape_zyx for texture in volumes] == [(1, 64, 64)] * 8
        assert {texture.level for texture in volumes} == {0}
        assert len(package.manifest.level_programs[0].samplers) == units
        grid = package.manifest.grid
        function = package.manifest.transfer_functions[0]
        view = view_of(grid, "anterior-left")
        truth = oracle_picture(Volume(values, grid), function, view, (48, 48)).rgba
        with Renderer(package) as renderer:
            drawn = renderer.render(view, (48, 48))
        rmse[name] = float(np.sqrt(np.mean((drawn - truth) ** 2)))
        assert truth[..., 3].max() > 0.9
    assert rmse["control-points"] < 0.003
    assert rmse["control-points"] < 1.1 * rmse["lookup"] + 1e-4


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("technique", DIVERGENT)
def test_a_package_of_what_is_published_with_an_error_is_drawn_and_judged(tmp_path, technique):
    package = built(tmp_path, f'technique = "{technique}"')
    report = measured(package, tmp_path)
    # Positions of 8 bits are off by less than a voxel of a volume as small as this one.
    assert report.verdict.passed == (technique == "two-pass-as-published")
    for program in report.programs:
        assert any(limit.startswith("As published") for limit in program.sweep.convergence.limits)
    assert all(program.sweep.convergence.expected == TECHNIQUES[technique].order for program in report.programs)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("technique", TECHNIQUES)
def test_only_what_takes_several_samples_in_a_fragment_has_a_skip_table_and_an_early_end(tmp_path, technique):
    scene = write_ball_scene(tmp_path, f'technique = "{technique}"\nopacity_cutoff = 0.998')
    text = scene.read_text(encoding="utf-8").replace("[12, 15, 17]", "[64, 64, 64]").replace("[source]", EMPTY, 1)
    scene.write_text(text, encoding="utf-8")
    codes = np.zeros((64, 64, 64), np.uint8)
    codes[:12, :12, :12] = 200
    codes.tofile(tmp_path / "ball.raw")
    plan = planned(scene)
    loops = TECHNIQUES[technique].loops
    assert ("skip" in plan.stages) == loops
    assert (plan.shared.rays.opacity_cutoff is not None) == loops
    left_out = {item.name: item.reason for item in plan.items if not item.kept}
    assert ("a fragment takes one sample" in left_out.get("early ray termination", "")) != loops


@pytest.mark.parametrize(
    ("render", "tables", "what"),
    [
        ('technique = "view-slices"\ncompositing = "maximum"', "", "compositing maximum"),
        ('technique = "view-slices-as-published"\nclassification = "preintegrated"', "", "classification preintegr"),
        ('technique = "view-slices"', "[proxy]", r"\[proxy\]"),
        ('technique = "view-slices"', "[grid]\nsize = 16", r"\[grid\]"),
        ('technique = "view-slices"', '[skip]\nkind = "blocks"', r"skip\.kind blocks"),
    ],
)
def test_a_technique_with_what_it_cannot_do_is_refused(tmp_path, render, tables, what):
    with pytest.raises(VolprepError, match=f"VP3130 .*{what}"):
        planned(write_ball_scene(tmp_path, render, tables=tables))


@pytest.mark.parametrize("technique", [name for name in TECHNIQUES if "mosaic" not in TECHNIQUES[name].samplings])
def test_a_technique_that_the_device_class_cannot_do_is_refused(tmp_path, technique):
    with pytest.raises(VolprepError, match=r"VP3164 .*gles2-2048"):
        planned(write_ball_scene(tmp_path, f'technique = "{technique}"', "gles2-2048"))
    compressed = '[textures]\ncompression = "eac"'
    with pytest.raises(VolprepError, match=r"VP3130 .*compression eac"):
        planned(write_ball_scene(tmp_path, f'technique = "{technique}"', "gles3", compressed))


def test_an_unknown_technique_is_refused(tmp_path):
    with pytest.raises(VolprepError, match=r"VP3003 .*technique"):
        load_request(write_ball_scene(tmp_path, 'technique = "splatting"'))


def test_a_device_without_shaders_has_no_technique_to_choose(tmp_path):
    with pytest.raises(VolprepError, match=r"VP3060 .*technique view-slices"):
        planned(write_ball_scene(tmp_path, 'technique = "view-slices"', "gles1"))
