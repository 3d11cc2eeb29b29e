"""What `show` and `from_pyvista` take: objects of other libraries keep their place, values and functions."""

import io
import json
import sys
import zipfile

import numpy as np
import pytest
import pyvista
import SimpleITK

import volprep
from volprep.library.notebook.from_pyvista import _function, _placed
from volprep.library.notebook.sources import scan_file

VALUES = np.arange(4 * 5 * 6, dtype=np.int16).reshape(4, 5, 6)


def image(**placed: object) -> pyvista.ImageData:
    made = pyvista.ImageData(dimensions=(6, 5, 4), spacing=(1.0, 2.0, 3.0), origin=(7.0, 8.0, 9.0), **placed)
    made.point_data["other"] = np.zeros(VALUES.size)
    made.point_data["values"] = VALUES.ravel()
    made.set_active_scalars("values")
    return made


def test_an_image_of_pyvista_keeps_values_and_place(tmp_path) -> None:
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    scan = volprep.read_scan(scan_file(image(direction_matrix=turned), tmp_path))
    np.testing.assert_array_equal(scan.stored, VALUES)
    assert scan.grid.spacing_mm_zyx == (3.0, 2.0, 1.0)
    np.testing.assert_allclose(scan.grid.direction, turned)


def test_values_of_cells_lie_in_the_middle_of_their_cells(tmp_path) -> None:
    cells = pyvista.ImageData(dimensions=(7, 6, 5), spacing=(1.0, 2.0, 3.0))
    cells.cell_data["values"] = VALUES.ravel()
    scan = volprep.read_scan(scan_file(cells, tmp_path))
    np.testing.assert_array_equal(scan.stored, VALUES)
    # The corner of the box is the corner of the first cell.
    np.testing.assert_allclose(scan.grid.corner_mm_xyz, (0.0, 0.0, 0.0), atol=1e-9)


def test_an_image_of_simpleitk_keeps_values_and_place(tmp_path) -> None:
    given = SimpleITK.GetImageFromArray(VALUES)
    given.SetSpacing((1.0, 2.0, 3.0))
    scan = volprep.read_scan(scan_file(given, tmp_path))
    np.testing.assert_array_equal(scan.stored, VALUES)
    assert scan.grid.spacing_mm_zyx == (3.0, 2.0, 1.0)


def test_what_is_no_volume_is_refused() -> None:
    with pytest.raises(volprep.VolprepError, match="VP7092 dict cannot be shown"):
        volprep.show({})
    with pytest.raises(volprep.VolprepError, match="VP7092 the ImageData cannot be shown: it has no active scalars"):
        volprep.show(pyvista.ImageData(dimensions=(3, 3, 3)))


@pytest.fixture
def plotter():
    made = pyvista.Plotter(off_screen=True)
    yield made
    made.close()


def test_a_volume_of_a_plotter_that_looks_like_labels_is_drawn_as_values(plotter) -> None:
    layers = np.repeat(np.array([0, 40, 250], np.uint8), 8)[:, None, None] * np.ones((1, 24, 24), np.uint8)
    flat = pyvista.ImageData(dimensions=(24, 24, 24))
    flat.point_data["values"] = layers.ravel()
    plotter.add_volume(flat, cmap="bone", opacity="linear")
    with zipfile.ZipFile(io.BytesIO(volprep.from_pyvista(plotter).package)) as package:
        manifest = json.loads(package.read("manifest.json"))
    assert {each["filter"] for each in manifest["textures"] if each["role"] == "volume"} == {"linear"}


def test_a_volume_of_a_plotter_has_its_colours_and_opacities(plotter) -> None:
    actor = plotter.add_volume(image(), cmap="bone", opacity=[0.0, 0.5, 0.25], opacity_unit_distance=2.0)
    actor.SetPosition(100.0, 0.0, 0.0)
    assert _placed(actor).origin == (107.0, 8.0, 9.0)
    widget = volprep.from_pyvista(plotter)
    assert list(widget.functions) == ["pyvista"]
    points = widget.functions["pyvista"]
    vtk = actor.GetProperty()
    for point in points[:: len(points) // 7]:
        opacity = vtk.GetScalarOpacity().GetValue(point["value"])
        assert 1.0 - np.exp(-2.0 * point["extinction_per_mm"]) == pytest.approx(opacity, abs=1e-6)
        colour = np.array(vtk.GetRGBTransferFunction().GetColor(point["value"]))
        linear = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
        np.testing.assert_allclose(point["colour"], linear, atol=1e-6)
    assert _function(vtk).reference_mm == 2.0


def test_plotters_without_one_plain_volume_are_refused(plotter) -> None:
    with pytest.raises(volprep.VolprepError, match=r"VP7093 .* the plotter has 0 volumes"):
        volprep.from_pyvista(plotter)
    plotter.add_volume(image(), name="one")
    plotter.add_volume(image(), name="two", blending="maximum")
    with pytest.raises(volprep.VolprepError, match=r"VP7093 .* the plotter has 2 volumes"):
        volprep.from_pyvista(plotter)
    with pytest.raises(volprep.VolprepError, match=r"VP7093 .* blending is not composite"):
        volprep.from_pyvista(plotter, volume=1)


def test_without_the_extra_the_error_names_it(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "anywidget", None)
    for name in ("show", "widget"):
        monkeypatch.delitem(sys.modules, f"volprep.library.notebook.{name}", raising=False)
    monkeypatch.delattr(volprep, "show", raising=False)
    with pytest.raises(volprep.VolprepError, match=r"VP7090 .* module anywidget, .*\[notebook\]"):
        volprep.show(VALUES)
