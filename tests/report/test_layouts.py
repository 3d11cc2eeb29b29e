"""Figures of how a package lays out its volume: what is drawn lies where the package says, and something is seen."""

import json

import numpy as np
import pytest
from command_line import volprep
from tamper_scenes import write_kind
from tampering import built

from volprep.vtk.layouts import panels_of, write_figure
from volprep.vtk.shapes import Points, Slice, Strokes, Surface, load_panels, save_panels
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package


@pytest.fixture(scope="module")
def packages(tmp_path_factory) -> dict[str, Package]:
    made = {}
    for kind in ("house", "bricks", "slices", "mipmaps"):
        folder = tmp_path_factory.mktemp(kind)
        made[kind] = Package.open(built(folder, write_kind(folder, kind)))
    return made


def shapes(package: Package, kind: type) -> list:
    return [shape for panel in panels_of(package) for shape in panel.shapes if isinstance(shape, kind)]


def test_a_house_shows_its_mesh_and_its_sub_volumes_with_a_walk(packages) -> None:
    mesh, pieces = panels_of(packages["house"])
    assert mesh.title.startswith("proxy mesh of shell, level 0\n")
    assert pieces.title.startswith("24 of 24 sub-volumes")
    assert "a walk of 3 moves" in pieces.title
    points, end = (shape for shape in pieces.shapes if isinstance(shape, Points))
    assert len(points.points_mm_xyz) == 3 * 4 * 5
    # The walk ends where pieces share a voxel: the point lies on its centre.
    np.testing.assert_allclose(end.points_mm_xyz, [[15.5 * 0.75, 10.5, 5.5 * 1.5]])


def test_everything_lies_in_the_box(packages) -> None:
    for package in packages.values():
        for panel in panels_of(package):
            for shape in panel.shapes:
                points = next(value for value in vars(shape).values() if isinstance(value, np.ndarray))
                corners = points.reshape(-1, 3)
                assert corners.min() >= -1e-9
                assert (corners <= np.array(panel.extent_mm_xyz) + 1e-9).all()


def test_pieces_fill_the_box_where_no_level_holds_them_whole(tmp_path) -> None:
    path = write_kind(tmp_path, "plain")
    limits = "[textures]\nmemory_bytes = 2600\n[grid]\nsize = 4\n"
    path.write_text(path.read_text().replace("[[transfer]]", f"{limits}[[transfer]]"))
    package = Package.open(built(tmp_path, path))
    assert package.manifest.levels[0].index == 1
    (panel,) = panels_of(package)
    extent = package.manifest.grid.extent_mm_zyx[::-1]
    np.testing.assert_allclose(panel.extent_mm_xyz, extent)
    for shape in panel.shapes:
        points = next(value for value in vars(shape).values() if isinstance(value, np.ndarray)).reshape(-1, 3)
        assert (points <= np.array(extent) + 1e-9).all()


def test_bricks_that_are_stored_are_shown(packages) -> None:
    (panel,) = panels_of(packages["bricks"])
    layout = next(each.bricks for each in packages["bricks"].manifest.textures if each.bricks is not None)
    (surface,) = shapes(packages["bricks"], Surface)
    assert len(surface.faces) == 6 * layout.stored
    assert f"{layout.stored} of {np.prod(layout.bricks_zyx)} are stored" in panel.title


def test_slices_lie_at_the_centres_of_their_voxels(packages) -> None:
    along_z = [panel for panel in panels_of(packages["slices"]) if panel.title.startswith("slices along z")]
    found = [shape for shape in along_z[0].shapes if isinstance(shape, Slice)]
    # Ten slices, of which every second is shown, 1.5 mm apart.
    assert [shape.corners_mm_xyz[0, 2] for shape in found] == [2.25, 5.25, 8.25, 11.25, 14.25]
    assert {shape.texels.shape[:2] for shape in found} == {found[0].texels.shape[:2]}


def test_panels_travel_unchanged(packages, tmp_path) -> None:
    panels = [*panels_of(packages["house"])]
    save_panels(panels, tmp_path / "panels.npz")
    for ours, theirs in zip(panels, load_panels(tmp_path / "panels.npz"), strict=True):
        assert (ours.title, ours.extent_mm_xyz) == (theirs.title, theirs.extent_mm_xyz)
        for one, other in zip(ours.shapes, theirs.shapes, strict=True):
            assert type(one) is type(other)
            for name, value in vars(one).items():
                np.testing.assert_array_equal(value, getattr(other, name))


@pytest.mark.long
def test_inspect_writes_the_figure(packages, tmp_path) -> None:
    result = volprep("inspect", packages["house"].path, "--figure", tmp_path / "figure.png", "--json")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["width"] == 2 * json.loads(result.stdout)["height"]
    from skimage.io import imread

    picture = imread(tmp_path / "figure.png").astype(int)
    left, right = np.split(picture, 2, axis=1)
    teal, orange = left[..., 1] - left[..., 0] > 40, right[..., 0] - right[..., 2] > 40
    assert teal.mean() > 0.1, "no mesh is seen"
    assert orange.mean() > 0.05, "no sub-volumes are seen"


def test_a_package_without_a_layout_is_told_so(packages, tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP6043"):
        write_figure(packages["mipmaps"], tmp_path / "figure.png")
    assert not (tmp_path / "figure.png").exists()


def test_the_outline_is_drawn_once(packages) -> None:
    for panel in panels_of(packages["bricks"]):
        assert sum(isinstance(shape, Strokes) for shape in panel.shapes) == 1
