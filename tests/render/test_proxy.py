"""Pictures with and without proxy geometry are the same: rays begin and end at the mesh, samples stay in place."""

import re

import numpy as np
import pytest
from blobs import DIRECTIONS, SHELLS, blobs, check_same
from sample_counts import samples_per_pixel
from scene_builds import view_of
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.render.proxy_renderer import ProxyRenderer
from volprep.render.renderer import Renderer
from volprep.scene.scene import NormalSettings, ProxySettings
from volprep.truth.camera import Camera, standard_views
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid

FORMS = ["blocks", "merged", "convex", "box"]
MERGED = ProxySettings(block=4)
profiles = pytest.mark.parametrize("profile", [ES3, ES2], ids=["texture3d", "mosaic"])


def at_mesh(package):
    """Return the program whose rays begin at a mesh."""
    (program,) = (each for each in package.manifest.programs if each.rays == "mesh")
    return package.manifest.picture_program(program.name, package.manifest.pictures[0])


def pictures(package, views, projection="orthographic", *, level=0, shape=(60, 75)):
    """The same views without the mesh and with it."""
    grid = package.manifest.levels[0].grid
    cameras = standard_views(grid, projection)
    found = []
    for kind in (Renderer, ProxyRenderer):
        with kind(package, level=level, target="rgba32f") as renderer:
            found.append(
                np.stack(
                    [renderer.render(cameras[view].box_from_clip(grid, shape[1] / shape[0]), shape) for view in views]
                )
            )
    return found


@pytest.mark.long(keep=3)
@profiles
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_beginning_at_the_mesh_changes_no_pixel(tmp_path, profile, form, projection):
    seed = FORMS.index(form)
    direction = list(DIRECTIONS.values())[seed % 3]
    shape, spacing = ((37, 41, 53), (2.0, 0.7, 1.1)) if projection == "perspective" else ((45, 33, 29), (0.8, 1.3, 0.9))
    grid = Grid.of(shape, spacing, (4.0, -9.0, 2.0), direction)
    proxy = ProxySettings(form=form, block=(4, 3, 5, 8)[seed])
    step_mm = 0.5 if projection == "orthographic" else 0.23
    codes = blobs(seed + 30, shape)
    package = tiny_package(tmp_path / "p", codes, SHELLS, profile, grid=grid, step_mm=step_mm, proxy=proxy)
    plain, begun = pictures(package, ("anterior", "superior", "left", "anterior-right", "posterior-left"), projection)
    assert plain[..., 3].max() > 0.5
    # Rays are those of the box, and what the mesh leaves out adds nothing.
    assert np.array_equal(begun, plain)


TECHNIQUES = [("slabs", ES3), ("slabs", ES2), ("tiles", ES3), ("two-pass", ES3), ("two-pass", ES2)]


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(("technique", "profile"), TECHNIQUES)
@pytest.mark.parametrize("wishes", [{}, {"skip": ("distance", 4), "cutoff": 0.99}], ids=["plain", "skipping"])
def test_every_technique_with_rays_begins_and_ends_at_the_mesh(tmp_path, technique, profile, wishes):
    if technique == "slabs":
        wishes = {name: each for name, each in wishes.items() if name != "skip"}
    codes = blobs(36, (37, 41, 33))
    package = tiny_package(tmp_path / "p", codes, SHELLS, profile, technique=technique, proxy=MERGED, **wishes)
    assert [each.geometry for each in at_mesh(package).before] == ["mesh"]
    if technique == "two-pass":
        # At a mesh the first pass draws the mesh in place of the box, and rays are those of one pass.
        alike = tiny_package(tmp_path / "one", codes, SHELLS, profile, proxy=MERGED, **wishes)
    views = ("anterior", "anterior-right", "posterior-left")
    plain, _ = pictures(package if technique != "two-pass" else alike, views, "perspective")
    _, begun = pictures(package, views, "perspective")
    assert plain[..., 3].max() > 0.5
    assert np.array_equal(begun, plain)


@profiles
def test_rays_end_behind_the_mesh(tmp_path, profile):
    codes = np.zeros((40, 40, 40), np.uint8)
    codes[18:22, 2:6, 18:22] = 255
    package = tiny_package(tmp_path / "p", codes, SHELLS, profile, proxy=MERGED)
    grid = package.manifest.grid
    program = at_mesh(package)
    for view in ("anterior", "posterior"):
        camera = view_of(grid, view)
        taken, _ = samples_per_pixel(package, program, 0, camera, (48, 48), kind=ProxyRenderer)
        # 4 voxels between two blocks of 4 and their margins, in steps of half a voxel; the box is 80 steps deep.
        assert 0 < taken.max() <= 30


def test_a_far_plane_in_the_volume_draws_without_the_mesh(tmp_path):
    package = tiny_package(tmp_path / "p", blobs(16, (40, 40, 40)), SHELLS, proxy=MERGED)
    grid = package.manifest.grid
    whole = view_of(grid, "anterior")
    near_half = whole @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0.5, -0.5], [0, 0, 0, 1]])
    drawn = []
    for kind in (Renderer, ProxyRenderer):
        with kind(package, target="rgba32f") as renderer:
            drawn.append(renderer.render(near_half, (40, 40)))
    assert drawn[0][..., 3].max() > 0.5
    assert np.array_equal(*drawn)


def test_what_reaches_the_border_of_the_volume_is_drawn_up_to_it(tmp_path):
    # Every pixel of a picture that just holds the volume, and rays along its faces.
    everything = function((0.0, (0.9, 0.5, 0.1), 0.05), (255.0, (1.0, 1.0, 1.0), 0.4))
    codes = np.random.default_rng(5).integers(0, 256, (20, 24, 28)).astype(np.uint8)
    package = tiny_package(tmp_path / "p", codes, everything, proxy=MERGED)
    grid = package.manifest.grid
    camera = Camera((14.0, -60.0, 10.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), 28.0, 100.0, "orthographic")
    both = []
    for kind in (Renderer, ProxyRenderer):
        with kind(package, target="rgba32f") as renderer:
            both.append(renderer.render(camera.box_from_clip(grid, 1.0), (56, 56)))
    assert (both[0][..., 3] > 0).mean() > 0.5
    check_same(both[1], both[0])


@profiles
def test_rays_take_fewer_samples_and_with_a_skip_table_as_few_as_that_alone_leaves(tmp_path, profile):
    codes = blobs(31, (48, 45, 50))
    taken = {}
    for name, skip in (("plain", None), ("skipping", ("distance", 4))):
        package = tiny_package(tmp_path / name, codes, SHELLS, profile, skip=skip, proxy=MERGED)
        grid = package.manifest.grid
        camera = view_of(grid, "anterior-left")
        for program, kind in ((package.manifest.level_programs[0], Renderer), (at_mesh(package), ProxyRenderer)):
            taken[name, kind] = samples_per_pixel(package, program, 0, camera, (48, 48), kind=kind)[0].sum()
        check_same(*pictures(package, ("anterior-left", "superior")))
    assert taken["plain", ProxyRenderer] < 0.8 * taken["plain", Renderer]
    # A table saves what is in front as well; its runs of eight samples begin elsewhere, which is not always better.
    assert taken["skipping", ProxyRenderer] < 1.05 * taken["skipping", Renderer] < taken["plain", ProxyRenderer]


@profiles
def test_pre_integrated_segments_begin_at_the_mesh_too(tmp_path, profile):
    wishes = {"classification": "preintegrated", "step_mm": 1.3, "entries": 64}
    for name, skip in (("plain", None), ("skipping", ("distance", 4))):
        package = tiny_package(
            tmp_path / name, blobs(32, (37, 41, 33)), SHELLS, profile, skip=skip, proxy=MERGED, **wishes
        )
        check_same(*pictures(package, ("anterior", "anterior-right", "posterior-left")))


def test_what_is_lit_begins_at_the_mesh_too(tmp_path):
    package = tiny_package(
        tmp_path / "p", blobs(33, (30, 31, 32)), SHELLS, normals=NormalSettings(), lighting="headlight", proxy=MERGED
    )
    check_same(*pictures(package, ("anterior-left", "superior")))


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 40, 30), (50, 1, 2), (3, 2, 45)])
@pytest.mark.parametrize("block", [1, 8, 64])
def test_thin_volumes_and_blocks_larger_than_them_have_meshes(tmp_path, shape, block):
    codes = blobs(34, shape)
    codes[0, 0, 0] = 255
    package = tiny_package(tmp_path / "p", codes, SHELLS, proxy=ProxySettings(block=block))
    check_same(*pictures(package, ("anterior-left",)))


def test_every_level_has_a_mesh_of_its_own(tmp_path):
    finest = blobs(35, (40, 48, 32))
    coarse = np.ascontiguousarray(finest.reshape(20, 2, 24, 2, 16, 2).mean(axis=(1, 3, 5)).round().astype(np.uint8))
    package = tiny_package(tmp_path / "p", [finest, coarse], SHELLS, proxy=MERGED)
    assert [mesh.level for mesh in package.manifest.proxy.meshes] == [0, 1]
    for level in (0, 1):
        check_same(*pictures(package, ("anterior-left", "left"), level=level))


@profiles
def test_an_eye_inside_the_volume_draws_without_the_mesh(tmp_path, profile):
    shape = (40, 40, 40)
    grid = Grid.of(shape, (1.0, 1.0, 1.0))
    camera = Camera((17.3, 20.1, 18.2), (1.0, 0.3, -0.2), (0.0, 0.0, 1.0), 30.0, 40.0, "perspective")
    package = tiny_package(tmp_path / "p", blobs(16, shape), SHELLS, profile, cutoff=0.99, proxy=MERGED)
    both = []
    for kind in (Renderer, ProxyRenderer):
        with kind(package, target="rgba32f") as renderer:
            both.append(renderer.render(camera.box_from_clip(grid, 1.0), (64, 64)))
    assert both[0][..., 3].max() > 0.5
    assert np.array_equal(*both)


@profiles
def test_a_transfer_function_that_shows_nothing_has_no_mesh_and_an_empty_picture(tmp_path, profile):
    nothing = function((0.0, (1.0, 1.0, 1.0), 0.0))
    package = tiny_package(tmp_path / "p", blobs(17, (20, 21, 22)), nothing, profile, proxy=MERGED)
    (mesh,) = package.manifest.proxy.meshes
    assert (mesh.file, mesh.triangles, mesh.occupied_share) == (None, 0, 0.0)
    plain, begun = pictures(package, ("left",))
    assert not plain.any()
    assert not begun.any()


def test_a_level_without_a_mesh_is_told(tmp_path):
    package = tiny_package(tmp_path / "p", blobs(17, (9, 10, 11)), SHELLS)
    with pytest.raises(VolprepError, match="VP5018"):
        ProxyRenderer(package)


def test_without_proxy_geometry_no_shader_knows_of_it(tmp_path):
    package = tiny_package(tmp_path / "p", blobs(20, (9, 10, 11)), SHELLS)
    program = package.manifest.level_programs[0]
    for path in (program.vertex, program.fragment):
        assert not re.search("entry|entered|v_clip", package.read_text(path))
