"""Channels on grids of their own in one picture: what the package holds, what it draws, and what is refused."""

import nibabel
import numpy as np
import pytest
from judged import validate
from scene_builds import built, planned, view_of
from scipy.spatial.transform import Rotation
from two_grids import ball, ct_affine, write_two_grids

from volprep.pipeline.costs import planned_costs
from volprep.render.renderer import Renderer
from volprep.validation.timing.empty_space import samples_of_views
from volprep.validation.timing.full_rays import unskipped
from volprep_formats import grid as grids
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import box_from_box
from volprep_formats.package.channel_packages import channel_packages, package_of_transfer
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package

MADE = "volprep_formats.package.pictures.box_from_box"
"""What drawings are made with; the truth does not use it."""
MOVED = np.array([[1.0, 0.0, 0.0, 7.0], [0.0, 0.9, -0.1, -4.0], [0.0, 0.1, 1.05, 3.0], [0.0, 0.0, 0.0, 1.0]])
"""A registration with a shear."""


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    folder = tmp_path_factory.mktemp("grids")
    return built(write_two_grids(folder), folder / "fused.volpkg")


def picture(package: Package, name: str | None, view: str = "anterior-left", size: int = 48) -> np.ndarray:
    seen = package_of_transfer(package, name)
    with Renderer(package, transfer=name, target="rgba32f") as renderer:
        return renderer.render(view_of(seen.manifest.box, view), (size, size))


def corners_in(box: grids.Grid, grid: grids.Grid) -> np.ndarray:
    ends = np.array(np.meshgrid(*[(0.0, length) for length in grid.extent_mm_zyx[::-1]])).reshape(3, -1)
    matrix = np.array(box_from_box(box, None, grid))
    return matrix[:, :3] @ ends + matrix[:, 3:]


def test_each_channel_keeps_its_own_voxels(package) -> None:
    seen = channel_packages(package)
    spacings = {name: part.manifest.grid.spacing_mm_zyx for name, part in seen.items()}
    assert spacings["ct"] == (2.5, 2.0, 2.0)
    assert spacings["pet"] == pytest.approx((5.0, 3.5, 4.0))
    for part in seen.values():
        assert part.manifest.levels[0].grid == part.manifest.grid
    assert check(package.path) == []


def test_the_box_holds_what_all_channels_show_in_voxels_of_the_first(package) -> None:
    both, *alone = package.manifest.pictures
    assert both.grid.spacing_mm_zyx == (2.5, 2.0, 2.0)
    for each in alone:
        corners = corners_in(both.grid, each.grid or package.manifest.grid)
        assert corners.min() > -1e-4
        assert (corners.max(axis=1) < np.array(both.grid.extent_mm_zyx[::-1]) + 1e-4).all()


def test_a_scene_may_draw_only_the_box_of_the_first_channel(tmp_path) -> None:
    plan = planned(write_two_grids(tmp_path, more='box = "first"'))
    assert plan.together.grid == plan.shared.grid


def test_a_matrix_from_box_to_box_leads_by_way_of_the_world() -> None:
    turn = Rotation.from_euler("xyz", (10, 50, -70), degrees=True).as_matrix()
    one = grids.Grid.of((4, 5, 6), (1.0, 2.0, 3.0), (5.0, -3.0, 2.0), turn)
    other = grids.Grid.of((7, 3, 2), (0.5, 1.0, 0.7), (-1.0, 4.0, 9.0), turn.T)
    rows = tuple(tuple(row) for row in MOVED[:3].tolist())
    expected = np.linalg.inv(MOVED @ one.world_from_box) @ other.world_from_box
    np.testing.assert_allclose(box_from_box(one, rows, other), expected[:3], atol=1e-12)


def test_it_is_within_the_tolerance_and_so_is_each_channel_alone(package, tmp_path) -> None:
    report = validate(package, tmp_path / "report")
    assert report.verdict.passed
    assert {program.transfer for program in report.programs} == {"both", "body", "hot"}


def test_the_first_channel_ends_at_its_own_faces_though_it_is_dense_there(tmp_path) -> None:
    scene = write_two_grids(tmp_path)
    body = nibabel.load(tmp_path / "ct.nii")
    cut = body.slicer[12:28, 12:28, 10:22]
    nibabel.save(nibabel.Nifti1Image(np.asarray(cut.dataobj).clip(100, None), cut.affine), tmp_path / "ct.nii")
    package = built(scene, tmp_path / "fused.volpkg")
    both = package.manifest.pictures[0].grid
    assert all(both.extent_mm_zyx[axis] > 1.5 * package.manifest.grid.extent_mm_zyx[axis] for axis in range(3))
    assert validate(package).verdict.passed


def test_a_registration_with_a_shear_is_within_the_tolerance(tmp_path) -> None:
    found = built(write_two_grids(tmp_path, pet=f"transform = {MOVED.tolist()}"))
    assert found.manifest.pictures[0].media[1].placed is not None
    assert validate(found).verdict.passed


def test_a_registration_puts_a_file_that_says_another_place_where_it_belongs(package, tmp_path) -> None:
    lps = np.diag([-1.0, -1.0, 1.0, 1.0])
    rigid = np.eye(4)
    rigid[:3, :3] = Rotation.from_euler("xyz", (5, 8, -12), degrees=True).as_matrix()
    rigid[:3, 3] = (11.0, -6.0, 4.0)
    scene = write_two_grids(tmp_path, pet=f"transform = {(lps @ rigid @ lps).tolist()}", placed=np.linalg.inv(rigid))
    np.testing.assert_allclose(picture(built(scene), None), picture(package, None), atol=2e-4)


def shifted(grid, placed, other):
    """Off by a quarter of a voxel along x."""
    rows = box_from_box(grid, placed, other)
    return ((*rows[0][:3], rows[0][3] + 0.25 * grid.spacing_mm_zyx[2]), *rows[1:])


def transposed(grid, placed, other):
    rows = np.array(box_from_box(grid, placed, other))
    rows[:, :3] = rows[:, :3].T
    return tuple(tuple(row) for row in rows.tolist())


def ignored(grid, _placed, other):
    return box_from_box(grid, None, other)


@pytest.mark.parametrize("fault", [shifted, transposed, ignored])
def test_pictures_find_a_grid_in_the_wrong_place(tmp_path, monkeypatch, fault) -> None:
    # The same fault in the build and in the package that validation derives: only the truth knows better.
    monkeypatch.setattr(MADE, fault)
    moved = "transform = [[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"
    report = validate(built(write_two_grids(tmp_path, pet=moved if fault is ignored else "")))
    assert not report.verdict.passed
    assert not report.derivation.findings
    beyond = {program.transfer: sum(not view.passed for view in program.views) for program in report.programs}
    # A shift is invisible along its axis.
    assert beyond.pop("both") >= 7
    assert beyond == {"body": 0, "hot": 0}


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ('[render]\ntechnique = "slabs"', "technique slabs"),
        ("editable = true", "editable"),
        ("[textures]\nmipmaps = true", "textures.mipmaps"),
        ('[lab.textures]\nchannels = "packed"', "packed"),
    ],
)
def test_what_does_not_go_with_several_grids_is_refused(tmp_path, more, says) -> None:
    scene = write_two_grids(tmp_path)
    text = scene.read_text().replace("[render]\npicture_size = 48\n", "")
    scene.write_text(f"{text}{more}" if more.startswith("[") else f"{more}\n{text}")
    with pytest.raises(VolprepError, match=says) as error:
        planned(scene)
    assert error.value.code == "VP1246"


def test_a_device_without_3d_textures_is_refused(tmp_path) -> None:
    with pytest.raises(VolprepError, match="3D textures") as error:
        planned(write_two_grids(tmp_path, profile="gles2-4096"))
    assert error.value.code == "VP1246"


def test_channels_on_several_grids_need_no_common_picture(tmp_path) -> None:
    scene = write_two_grids(tmp_path)
    scene.write_text(scene.read_text().partition("[together]")[0])
    found = built(scene)
    assert [each.name for each in found.manifest.pictures] == ["body", "hot"]
    assert validate(found).verdict.passed


@pytest.mark.parametrize("grids", ["one grid", "two grids"])
def test_planned_costs_count_the_tables_that_the_picture_of_both_reads(tmp_path, grids) -> None:
    scene = write_two_grids(tmp_path)
    if grids == "one grid":
        spot = (8 * ball(ct_affine(), (40, 40, 32), (10, 0, 0), 8)).astype(np.float32)
        nibabel.save(nibabel.Nifti1Image(spot, ct_affine()), tmp_path / "pet.nii")
    costs = {(cost.picture, cost.level): cost.gpu_bytes for cost in planned_costs(planned(scene))}
    both = built(scene).manifest.pictures[0]
    assert {(both.name, each.level): each.cost.gpu_bytes for each in both.drawings}.items() <= costs.items()


def test_rays_skip_what_each_channel_leaves_empty_and_draw_the_same(package) -> None:
    program = package.manifest.picture_program("raycast-both", package.manifest.pictures[0])
    assert "u_skip_0" in program.samplers
    plain = unskipped(package, program)
    for view in ("anterior", "left", "superior", "anterior-left"):
        np.testing.assert_array_equal(picture(plain, None, view), picture(package, None, view))
    views = [(view_of(package.manifest.box, "anterior"), (48, 48))]
    (all_taken, _), (taken, looked) = (
        samples_of_views(each, program, 0, views, kind=Renderer)[0] for each in (plain, package)
    )
    assert (taken <= all_taken).all()
    assert taken.sum() < 0.8 * all_taken.sum()
    assert looked.max() > 0


def test_an_orbit_around_one_picture_draws_the_other_in_its_own_box(package) -> None:
    # The hot spots are where they are in the picture of both, seen by one camera of the world.
    seen = package_of_transfer(package, "hot").manifest.box
    camera = np.linalg.inv(seen.world_from_box) @ package.manifest.box.world_from_box
    matrix = camera @ view_of(package.manifest.box, "anterior")
    with Renderer(package, transfer="hot") as renderer:
        alone = renderer.render(matrix, (48, 48))[..., 3]
    both = picture(package, None, "anterior")
    redder = both[..., 0] - both[..., 2]
    assert alone.max() > 0.5
    assert redder[alone > 0.5].mean() > 2 * redder[(alone == 0.0) & (both[..., 3] > 0.1)].mean()


@pytest.mark.parametrize("offset", [0.0, 0.25, 0.4])
def test_a_dose_off_by_a_part_of_a_voxel_is_drawn_there_to_a_hundredth_of_a_voxel(tmp_path, offset) -> None:
    # A dose that rises along x, seen along y: the opacity of a pixel says which value its ray met.
    spacing, count = 4.0, 21
    scene = write_two_grids(tmp_path, more="[quantize]\nwindow = [0.0, 255.0]")
    rising = np.broadcast_to(12.0 * np.arange(count)[:, None, None], (count, 11, 9)).astype(np.float32)
    corner = np.array([-40.0, -20.0, -16.0]) + offset * spacing
    nibabel.save(
        nibabel.Nifti1Image(rising, nibabel.affines.from_matvec(spacing * np.eye(3), corner)), tmp_path / "pet.nii"
    )
    text = scene.read_text()
    body, hot = text.index('name = "body"'), text.index('name = "hot"')
    dose = 'name = "hot"\nchannel = "pet"\npoints = [{ value = 0.0, colour = "#ffffff", extinction_per_mm = 0.0 }, '
    dose += '{ value = 255.0, colour = "#ffffff", extinction_per_mm = 0.05 }]\n'
    faint = 'name = "body"\npoints = [{ value = 0.0, colour = "#ffffff", extinction_per_mm = 0.0 }, '
    faint += '{ value = 1.0, colour = "#ffffff", extinction_per_mm = 1e-12 }]\n\n[[transfer]]\n'
    scene.write_text(text[:body] + faint + dose + text[text.index("[together]", hot) :])
    package = built(scene)
    box = package.manifest.box
    with Renderer(package, target="rgba32f") as renderer:
        alpha = renderer.render(view_of(box, "anterior"), (128, 128))[64, :, 3].astype(float)
    clip = np.array([[(2 * column + 1) / 128 - 1, 1 / 128, 0.0, 1.0] for column in range(128)])
    # NIfTI's x points to the right, the world's to the left.
    right_mm = -(box.world_from_box @ view_of(box, "anterior") @ clip.T)[0]
    found_voxel = -np.log1p(-alpha) / (11 * spacing * 0.05) * 255 / 12
    true_voxel = (right_mm - corner[0]) / spacing
    met = (true_voxel > 0.5) & (true_voxel < count - 1.5)
    assert met.sum() > 50
    assert np.abs(found_voxel - true_voxel)[met].max() < 0.01


def test_light_falls_on_each_channel_along_its_own_gradient(package, tmp_path) -> None:
    more = '[render]\npicture_size = 48\nlighting = "headlight"'
    scene = write_two_grids(tmp_path, pet=f"transform = {MOVED.tolist()}", more=more)
    scene.write_text(scene.read_text().replace("[render]\npicture_size = 48\n\n[[transfer]]", "[[transfer]]"))
    found = built(scene)
    asked = validate(found, tmp_path / "report", witness=True)
    assert asked.verdict.passed
    assert not asked.witness.disagreeing
    assert any(check.item == "pictures of raycast-both" and check.passed for check in asked.witness.checks)


@pytest.mark.long
def test_the_witness_agrees_with_each_channel_and_with_both(package, tmp_path) -> None:
    asked = validate(package, tmp_path / "report", witness=True).witness
    assert not asked.disagreeing
    assert not asked.contradicted
    # VTK composites several volumes otherwise; NumPy integrates them.
    assert {each.item for each in asked.missing} == {"raycast-both"}
    assert any(check.item == "pictures of raycast-both" and check.passed for check in asked.checks)
