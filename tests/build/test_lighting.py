"""Gradients that shaders take, and lights with a place: from the scene to the picture and the verdict."""

import numpy as np
import pytest
import scene_builds
from judged import validate
from scene_builds import built, view_of, write_raw_scene

from volprep.compositing import COMPOSITINGS
from volprep.render.renderer import Renderer
from volprep.truth.decoded import level_volume, table_function
from volprep.truth.volume import Medium
from volprep.validation.timing.full_rays import unskipped
from volprep_formats.diagnostics import VolprepError

SHAPE_ZYX = (26, 34, 36)
SPACING = (1.2, 0.9, 0.8)
FORWARD = '[lighting]\nnormals = "forward"\n'
PHONG = '[lighting]\nlight_mm = [-30.0, -40.0, 60.0]\nnormals = "{}"\n'


def package_of(folder, lighting, table="", profile="gles3", compositing="emission-absorption"):
    """A ball of tissue in air, with a hollow."""
    z, y, x = np.meshgrid(*((np.arange(n) + 0.5) * h for n, h in zip(SHAPE_ZYX, SPACING, strict=True)), indexing="ij")
    far = np.sqrt((x - 14.4) ** 2 + (y - 15.3) ** 2 + (z - 15.6) ** 2)
    voxels = 1000 * np.clip((12 - far) / 6, 0, 1) - 500 * np.clip(5 - np.abs(x - 20), 0, 1)
    tables = f"""[pyramid]
coarsest_longest_axis = 18
[skip]
kind = "distance"
block = 4
[tolerance]
maximum = 1.0
{table}
[render]
lighting = "{lighting}"
compositing = "{compositing}"
picture_size = 40
[[transfer]]
name = "tissue"
reference_mm = 3.0
isovalue = 400.0
points = [
    {{ value = 200.0, colour = "#ff8040", opacity = 0.0 }},
    {{ value = 600.0, colour = "#ffc0a0", opacity = 0.95 }},
]
"""
    scan = np.rint(voxels).astype("<i2")
    return built(write_raw_scene(folder, scan, tables, profile=profile, spacing_mm_zyx=SPACING))


def drawn(package, view="anterior-left", size=64):
    return scene_builds.drawn(package, view, (size, size))


CASES = {
    "central": ("headlight", '[lighting]\nnormals = "central"\n', "gles3", "emission-absorption"),
    "forward-mosaic": ("headlight", '[lighting]\nnormals = "forward"\n', "gles2-2048", "emission-absorption"),
    "phong": ("phong", PHONG.format("volume"), "gles3", "emission-absorption"),
    "phong-central": ("phong", PHONG.format("central"), "gles3", "back-to-front"),
    "blinn-mosaic": ("blinn-phong", PHONG.format("central"), "gles2-2048", "emission-absorption"),
    "phong-surface": ("phong", PHONG.format("central"), "gles3", "isosurface"),
    "phong-bricks": (
        "phong",
        PHONG.format("central") + "[bricks]\nsize = 8\n[lab.bricks]\nreach = 2\n",
        "gles3",
        "emission-absorption",
    ),
    "head-bricks": ("headlight", FORWARD + "[bricks]\nsize = 5\n[lab.bricks]\nreach = 2\n", "gles3", "isosurface"),
    "phong-mipmaps": (
        "phong",
        PHONG.format("central") + "[textures]\nmipmaps = true\n",
        "gles3",
        "emission-absorption",
    ),
    "head-mipmaps": ("headlight", FORWARD + "[textures]\nmipmaps = true\n", "gles3", "isosurface"),
    "blinn-hit": ("blinn-phong", PHONG.format("volume"), "gles2-2048", "first-hit"),
}


@pytest.fixture(scope="module", params=CASES)
def package(request, tmp_path_factory):
    return package_of(tmp_path_factory.mktemp(request.param), *CASES[request.param])


@pytest.mark.long(keep=1)
def test_it_is_what_the_oracle_draws_and_skipping_changes_no_pixel(package) -> None:
    (program, *_) = package.manifest.level_programs
    volume = level_volume(package, package.manifest.levels[0].index)
    medium = Medium(volume, package.manifest.transfer_functions[0])
    plain = unskipped(package, program)
    for view in ("anterior-left", "superior"):
        matrix = view_of(volume.grid, view)
        oracle = COMPOSITINGS[program.compositing].oracle
        truth = oracle([medium], matrix, (40, 40)).rgba
        picture = drawn(package, view, 40)
        assert truth[..., 0].max() > 0.3
        # Steps miss a surface that a ray only just touches; nothing else differs by more than rounding to 8 bits.
        missed = np.abs(picture[..., 3] - truth[..., 3]) > 0.5
        assert missed.sum() <= 3
        assert np.sqrt(np.mean((picture - truth)[~missed] ** 2)) < 1 / 255
        assert np.array_equal(picture, drawn(plain, view, 40))


@pytest.mark.long
def test_the_light_of_a_package_is_that_of_its_scan(tmp_path) -> None:
    package = package_of(tmp_path, "phong", PHONG.format("central"))
    report = validate(package.path, tmp_path / "report", picture_size=16)
    assert report.verdict.failed == 0
    assert report.verdict.differing == ()


def test_a_shader_that_takes_gradients_needs_no_normals(tmp_path) -> None:
    package = package_of(tmp_path, "headlight", '[lighting]\nnormals = "central"\n')
    assert not any(texture.role == "normals" for texture in package.manifest.textures)
    (program,) = package.manifest.level_programs
    assert program.normals_from == "central"
    item = next(item for item in package.manifest.plan if item.name == "normals")
    assert not item.kept
    assert "central differences" in item.reason


def test_light_is_taken_only_where_something_is_seen(tmp_path) -> None:
    package = package_of(tmp_path, "phong", PHONG.format("central"))
    text = package.read_text(package.manifest.level_programs[0].fragment)
    before, behind = text.split("vec3 normal = normal_at(")
    assert "if (medium.a > 0.0) {" in before[before.rindex("classify(") :]
    assert "u_light_mm - place" in behind


def test_a_light_shines_from_its_place(tmp_path) -> None:
    """Lit from the patient's left, what one sees from in front is brighter on the left: on the right of the picture."""
    left = package_of(tmp_path, "phong", PHONG.format("volume").replace("-30.0, -40.0, 60.0", "200.0, 10.0, 10.0"))
    picture = drawn(left, "anterior")
    half = picture.shape[1] // 2
    assert picture[:, half:, 1].sum() > 1.5 * picture[:, :half, 1].sum()


def test_a_light_inside_the_volume_lights(tmp_path) -> None:
    package = package_of(tmp_path, "blinn-phong", '[lighting]\nlight_mm = [14.4, 15.3, 15.6]\nnormals = "central"\n')
    picture = drawn(package)
    assert np.isfinite(picture).all()
    assert picture[..., 0].max() > 0.1
    assert (picture[..., :3] <= picture[..., 3:] + 1 / 255).all()


def test_a_light_without_a_place_is_refused(tmp_path) -> None:
    for lighting in ("phong", "blinn-phong"):
        with pytest.raises(VolprepError, match="light_mm") as found:
            package_of(tmp_path, lighting)
        assert found.value.code == "VP3119"


def test_classified_voxels_have_no_differences_of_values(tmp_path) -> None:
    with pytest.raises(VolprepError, match="preclassified") as found:
        package_of(tmp_path, 'headlight"\nclassification = "preclassified', '[lighting]\nnormals = "central"\n')
    assert found.value.code == "VP3120"


@pytest.mark.parametrize("table", ["[bricks]\nsize = 8\n[lab.bricks]\nreach = 2\n", "[textures]\nmipmaps = true\n"])
def test_normals_of_a_volume_are_neither_in_bricks_nor_in_mipmaps(tmp_path, table) -> None:
    with pytest.raises(VolprepError, match=r"VP3003 .*normals"):
        package_of(tmp_path, "headlight", table)


def test_light_on_bricks_without_ghost_voxels_is_refused(tmp_path) -> None:
    with pytest.raises(VolprepError, match=r"VP3165 .*reach is 1"):
        package_of(tmp_path, "headlight", FORWARD + "[bricks]\nsize = 8\n")


@pytest.mark.parametrize(
    ("level", "profile", "more"),
    [
        (0, "gles3", "[textures]\nmipmaps = true\n"),
        (1, "gles3", "[textures]\nmipmaps = true\n"),
        (3, "gles2-2048", ""),
        (1, "gles3", "[bricks]\nsize = 8\n[lab.bricks]\nreach = 2\n"),
    ],
    ids=["mipmap 0", "mipmap 1", "mosaic", "bricks"],
)
def test_each_level_is_lit_by_differences_of_its_own_voxels(tmp_path, level, profile, more) -> None:
    package = package_of(tmp_path, "headlight", f'[lighting]\nnormals = "central"\n{more}', profile)
    volume = level_volume(package, level)
    medium = Medium(volume, table_function(package, "tissue", level))
    matrix = view_of(volume.grid, "superior")
    oracle = COMPOSITINGS["emission-absorption"].oracle
    truth = oracle([medium], matrix, (40, 40)).rgba
    with Renderer(package, level=level, target="rgba32f") as renderer:
        picture = renderer.render(matrix, (40, 40), 0.1)
    assert np.sqrt(np.mean((picture - truth) ** 2)) < 1e-3
