"""The second reading: it agrees with what is right, does not agree with what is wrong, and shares no code."""

import ast
import importlib.util
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pydicom
import pytest
import SimpleITK
import tifffile
from foreign_scans import SCENES, blobs
from oracle_views import HILLS, LIGHT, MIDDLE, views
from sample_report import report_of

from volprep.parts.gradient import gradients
from volprep.scan.repair import open_scan
from volprep.scene.request import load_request
from volprep.truth.camera import standard_views
from volprep.truth.lit import Lit, ShaderSlopes
from volprep.truth.volume import Volume
from volprep.validation.witness import data_checks, independent
from volprep.validation.witness.drawn_checks import _brightness, compared
from volprep.validation.witness.independent.normals import WitnessedLight, normals, slopes
from volprep.validation.witness.independent.rays import WitnessedMedium, picture
from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan
from volprep.validation.witness.independent.scene import WitnessedScene, read_scene
from volprep.validation.witness.independent.sources import read_scan
from volprep.validation.witness.read_checks import box_of, check_cameras, check_function, check_voxels
from volprep.validation.witness.step_checks import check_steps
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import Tolerance
from volprep_formats.progress import Silent
from volprep_formats.source import SourceSpec


def test_the_independent_reading_imports_nothing_of_the_product() -> None:
    own = independent.__name__
    for path in Path(independent.__path__[0]).glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [each.name for each in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert [name for name in names if name.startswith("volprep") and not name.startswith(own)] == [], path


def product_reads(spec: SourceSpec) -> tuple[Volume, dict]:
    with open_scan(spec, Path(), Silent()) as source:
        info = source.info
        stored = source.read_slab(0, info.grid.shape_zyx[0])
    return Volume(stored, info.grid, info.slope, info.intercept), json.loads(info.grid.model_dump_json())


def ome_tiff(folder: Path) -> SourceSpec:
    sizes = {f"PhysicalSize{axis}": size for axis, size in zip("XYZ", (0.3, 0.4, 0.9), strict=True)}
    units = {f"PhysicalSize{axis}Unit": "µm" for axis in "XYZ"}
    stored = np.rint(blobs() * 200).astype(np.uint8)
    tifffile.imwrite(folder / "scan.ome.tif", stored, metadata={"axes": "ZYX", **sizes, **units})
    return SourceSpec(path=str(folder / "scan.ome.tif"))


def metaimage(folder: Path) -> SourceSpec:
    image = SimpleITK.GetImageFromArray((blobs() * 500).astype(np.float32))
    image.SetSpacing((0.7, 1.1, 1.9))
    image.SetOrigin((4.0, -8.0, 2.0))
    image.SetDirection((0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0))
    SimpleITK.WriteImage(image, str(folder / "scan.mha"))
    return SourceSpec(path=str(folder / "scan.mha"))


def of_scene(name: str):
    return lambda folder: load_request(SCENES[name](folder)).scene.source


OF_ONE_FILE = ("nifti", "dicom", "maximum", "surface", "opaque")
SOURCES = {"ome-tiff": ome_tiff, "metaimage": metaimage, **{name: of_scene(name) for name in OF_ONE_FILE}}


@pytest.fixture(scope="module")
def readings(tmp_path_factory):
    """Each source as the product reads it, and as the witness does."""
    found = {}
    for name, make in SOURCES.items():
        spec = make(tmp_path_factory.mktemp(name))
        found[name] = (*product_reads(spec), read_scan(spec.model_dump(mode="json")))
    return found


def failed(checks) -> list[str]:
    return [check.item for check in checks if not check.passed]


@pytest.mark.parametrize("name", SOURCES)
def test_both_readings_of_a_source_agree_in_places_and_values(readings, name) -> None:
    ours, grid, theirs = readings[name]
    checks = list(check_voxels("scan", ours, grid, theirs))
    assert len(checks) == 2
    assert failed(checks) == []


def mirrored(volume: Volume) -> Volume:
    return replace(volume, stored=np.ascontiguousarray(volume.stored[..., ::-1]))


def moved(grid: dict, by_mm: float) -> dict:
    return {**grid, "origin_mm_xyz": [grid["origin_mm_xyz"][0] + by_mm, *grid["origin_mm_xyz"][1:]]}


WRONG = {
    "mirrored": lambda ours, grid: (mirrored(ours), grid),
    "without its intercept": lambda ours, grid: (replace(ours, intercept=0.0), grid),
    "half a voxel beside": lambda ours, grid: (ours, moved(grid, 0.4)),
    "with spacings exchanged": lambda ours, grid: (ours, {**grid, "spacing_mm_zyx": grid["spacing_mm_zyx"][::-1]}),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_readings_do_not_agree_about_a_scan_that_is(readings, wrong) -> None:
    ours, grid, theirs = readings["nifti"]
    assert failed(check_voxels("scan", *WRONG[wrong](ours, grid), theirs)) != []


def test_a_library_that_is_not_installed_is_named(monkeypatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(CannotWitnessError, match="nibabel or SimpleITK is not installed"):
        read_scan({"path": "scan.nii"})


@pytest.mark.parametrize(("name", "library"), [("nifti", "nibabel"), ("dicom", "pydicom")])
def test_without_its_library_another_one_reads_the_same_volume(monkeypatch, readings, tmp_path, name, library) -> None:
    spec = of_scene(name)(tmp_path)
    there = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda module: None if module == library else there(module))
    other = read_scan(spec.model_dump(mode="json"))
    assert other.library.startswith("SimpleITK")
    assert failed(check_voxels("scan", *readings[name][:2], other)) == []


def test_copies_of_dicom_images_are_left_out_and_other_images_at_one_place_are_not(tmp_path) -> None:
    spec = of_scene("dicom")(tmp_path)
    once = read_scan(spec.model_dump(mode="json"))
    first = min(each for each in Path(spec.path).rglob("*") if each.is_file())
    header = pydicom.dcmread(first)
    header.SOPInstanceUID = header.file_meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
    header.save_as(first.with_name("copy.dcm"))

    again = read_scan(spec.model_dump(mode="json"))
    header.PixelData = bytes(len(header.PixelData))
    header.save_as(first.with_name("copy.dcm"))

    assert again.stored.shape == once.stored.shape
    assert (again.stored == once.stored).all()
    with pytest.raises(CannotWitnessError, match="several slices lie at one place"):
        read_scan(spec.model_dump(mode="json"))


@pytest.mark.parametrize("key", ["mask", "repair", "rgb"])
def test_a_source_whose_voxels_are_changed_is_not_witnessed(key) -> None:
    with pytest.raises(CannotWitnessError, match=key):
        read_scan({"path": "scan.nii", key: "luminance"})


def decoded(tmp_path: Path):
    path = SCENES["nifti"](tmp_path)
    presets = Path(load_request.__globals__["__file__"]).parent / "presets"
    ours = load_request(path).scene.transfer[0].resolved()
    return SimpleNamespace(function=lambda name: ours), read_scene(path, path, presets), ours


def test_both_decodings_of_a_scene_agree(tmp_path) -> None:
    subject, scene, _ = decoded(tmp_path)
    (wanted,) = scene.functions
    assert failed(check_function(subject, wanted, 1.0)) == []


def test_decodings_do_not_agree_about_colours_taken_for_linear_or_opacity_over_length(tmp_path) -> None:
    _, scene, ours = decoded(tmp_path)
    points = ours.points
    linear = [point.model_copy(update={"colour": tuple(c**0.45 for c in point.colour)}) for point in points]
    divided = [point.model_copy(update={"extinction_per_mm": point.extinction_per_mm * 0.9}) for point in points]
    for wrong in (linear, divided):
        other = SimpleNamespace(function=lambda name, p=wrong: ours.model_copy(update={"points": tuple(p)}))
        assert failed(check_function(other, scene.functions[0], 1.0)) != []


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_cameras_agree_and_mirrored_ones_do_not(readings, projection) -> None:
    ours, grid, _ = readings["dicom"]
    matrices = {name: c.box_from_clip(ours.grid, 1.0) for name, c in standard_views(ours.grid, projection).items()}
    right = SimpleNamespace(views=matrices, shape_hw=(40, 40))
    assert failed(check_cameras(right, grid, projection)) == []
    left = {name: matrix @ np.diag([-1.0, 1.0, 1.0, 1.0]) for name, matrix in matrices.items()}
    assert failed(check_cameras(SimpleNamespace(views=left, shape_hw=(40, 40)), grid, projection)) == ["cameras"]


def integrated(view, step_mm: float):
    """Draw a view of the laws with the integrator, [ray, 4]."""
    grid, camera = json.loads(view.grid.model_dump_json()), view.camera
    index = data_checks.world_from_index(grid)
    points = HILLS.points
    shown = [
        WitnessedMedium(
            WitnessedScan(medium.volume.stored, medium.volume.slope, medium.volume.intercept, index, "test"),
            np.array([point.value for point in points]),
            np.array([point.colour for point in points]),
            np.array([point.extinction_per_mm for point in points]),
            HILLS.reference_mm,
            HILLS.isovalue,
            HILLS.intensities,
            view.nearest,
        )
        for medium in view.media
    ]
    shape = (7, 9)
    rows, columns = (each.ravel() for each in np.indices(shape))
    world = camera.world_from_clip(shape[1] / shape[0])
    ends = []
    for depth in (-1.0, 1.0):
        across, above = (2 * columns + 1) / shape[1] - 1, 1 - (2 * rows + 1) / shape[0]
        at = np.stack([across, above, np.full(63, depth), np.ones(63)], axis=-1) @ world.T
        ends.append(at[:, :3] / at[:, 3:])
    directions = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0], axis=1, keepdims=True)
    return picture(
        shown, (ends[0], directions), view.compositing.name, step_mm, [light_of(view, shown[0].scan)] * len(shown)
    )


def light_of(view, scan) -> WitnessedLight | None:
    if view.normals is None:
        return None
    source = view.normals.normals if isinstance(view.normals, Lit) else view.normals
    if isinstance(source, ShaderSlopes):
        window = (-1e4, 1e4)
        return WitnessedLight(slopes(scan, source.kernel, window), None, soft=source.soft_per_mm / 2e4)
    vectors = view.vectors if view.vectors is not None else normals(scan, view.normals)
    if not isinstance(view.normals, Lit):
        return WitnessedLight(vectors, None)
    keys = {key: getattr(LIGHT, key) for key in ("ambient", "diffuse", "specular", "shininess")}
    return WitnessedLight(vectors, np.array(LIGHT.place_mm_xyz), halfway=view.normals.halfway, **keys)


DRAWN = {name: view for name, view in views(HILLS) if "shadows" not in name}


@pytest.mark.parametrize("name", DRAWN)
def test_the_integrator_agrees_with_every_oracle_and_not_with_a_fainter_picture(name) -> None:
    view = DRAWN[name]
    truth = view.draw().rgba.reshape(-1, 4)
    coarse, fine = integrated(view, 0.02), integrated(view, 0.01)
    scene = WitnessedScene({}, (), compositing=view.compositing.name)
    changes = np.abs(fine - coarse)
    assert failed(compared("it", (fine, changes), truth=truth, drawn=truth, scene=scene)) == []
    fainter = 0.95 * truth
    assert failed(compared("it", (fine, changes), truth=fainter, drawn=truth, scene=scene))[0] == "truth of it"


@pytest.mark.parametrize("name", [name for name, view in DRAWN.items() if view.nearest])
def test_the_integrator_is_exact_through_labels(name) -> None:
    view = DRAWN[name]
    np.testing.assert_allclose(integrated(view, 5.0), view.draw().rgba.reshape(-1, 4), atol=1e-5)


def test_the_middle_of_the_views_is_that_of_the_box() -> None:
    view = next(iter(DRAWN.values()))
    assert np.allclose(box_of(json.loads(view.grid.model_dump_json()), "orthographic").middle_mm, MIDDLE)


def test_a_level_that_is_shifted_by_half_a_voxel_is_seen() -> None:
    fine = np.pad(blobs(), 1, mode="edge")[:22, :26, :30] * 1000
    means = data_checks._blocks(fine, (2, 2, 2)).mean(axis=(1, 3, 5))
    shifted = data_checks._blocks(np.roll(fine, 1, axis=2), (2, 2, 2)).mean(axis=(1, 3, 5))
    everywhere = np.ones(means.shape, bool)
    assert data_checks._shift(means, means, everywhere) < 1e-9
    assert data_checks._shift(shifted, means, everywhere) > 2 * data_checks._SHIFT_VOXELS


def test_codes_of_16_bits_in_half_floats_agree_with_their_values() -> None:
    window, step = (-100.0, 789.0), 889.0 / 65535
    values = np.random.default_rng(4).uniform(*window, (20, 20, 20))
    held = np.rint((values - window[0]) / step).astype(np.float64) / 65535
    held = window[0] + 889.0 * held.astype(np.float16).astype(np.float64)
    everywhere = np.ones(values.shape, bool)
    apart = step + data_checks._half_float_steps(held, window)
    assert data_checks._close("it", "codes", held - values, apart, everywhere).passed
    assert not data_checks._close("it", "codes", held - values, step, everywhere).passed
    assert not data_checks._close("it", "codes", held - values + 2 * step, step, everywhere).passed


@pytest.mark.parametrize(
    ("errors", "agrees"),
    [
        ((8e-3, 2e-3, 5e-4), True),
        ((8e-3, 4e-3, 2e-3), True),
        ((4e-3, 3.2e-3, 3.1e-3), False),
        ((3e-6, 2e-6, 3e-6), True),
    ],
)
def test_finer_steps_must_reach_the_truth_of_the_table(errors, agrees) -> None:
    (program,) = report_of((0.002, 0.002, 0.002), Tolerance()).programs
    finest = [point for point in program.sweep.points if point.level == program.level][:3]
    points = [
        point.model_copy(update={"quadrature": numbers.model_copy(update={"seen_rmse": error})})
        for point, error in zip(finest, errors, strict=True)
        if (numbers := point.quadrature) is not None
    ]
    sweep = program.sweep.model_copy(update={"points": tuple(points), "float_target": "rgba32f"})
    swept = [program.model_copy(update={"sweep": sweep})]
    (check,) = check_steps(swept, {"raycast": "lookup"})
    assert not list(check_steps(swept, {"raycast": "preclassified"}))
    assert (check.item, check.passed) == ("steps of raycast", agrees)


POINTS = (
    np.array([0.0, 40.0, 100.0]),
    np.array([[0.1, 0.9, 0.2], [0.8, 0.3, 0.5], [0.4, 0.6, 0.7]]),
    np.array([0, 2, 1.0]),
)


def table_texels(beside: float) -> np.ndarray:
    """A table of half floats over 0 to 100 whose entries are `beside` entries away from their values."""
    at = np.linspace(0.0, 100.0, 64) + beside * 100.0 / 63
    return np.column_stack([np.interp(at, POINTS[0], each) for each in (*POINTS[1].T, POINTS[2])]).astype(np.float16)


@pytest.mark.parametrize(("beside", "agrees"), [(0.0, True), (0.5, False)])
def test_a_table_that_is_half_an_entry_beside_is_seen(monkeypatch, beside, agrees) -> None:
    monkeypatch.setattr(data_checks, "read_texture", lambda path, name: table_texels(beside)[None, None])
    check = data_checks.check_table(Path(), {"name": "table", "file": "table"}, (0.0, 100.0), POINTS)
    assert check.passed == agrees


@pytest.mark.parametrize(("spacing", "agrees"), [((1.0, 1.4, 3.0), True), ((1.0, 1.0, 1.0), False)])
def test_normals_that_ignore_the_spacing_are_seen(monkeypatch, spacing, agrees) -> None:
    scan = WitnessedScan(blobs() * 1000, 1.0, 0.0, np.diag([1.0, 1.4, 3.0, 1.0]), "test")
    other = replace(scan, world_from_index=np.diag([*spacing, 1.0]))
    texels = np.rint(normals(other, "sobel") * 127 + 128).astype(np.uint8)
    monkeypatch.setattr(data_checks, "read_texture", lambda path, name: texels)
    texture = {"name": "normals", "file": "normals", "normals": {"code": "biased8", "kernel": "sobel"}}
    assert data_checks.check_normals(Path(), texture, scan, 4.0).passed == agrees


@pytest.mark.parametrize("kernel", ["forward", "central", "thesis", "sobel", "isotropic"])
def test_normals_of_the_border_are_those_of_the_package(kernel) -> None:
    """Where a box cuts matter, a difference has one side: a slope across the border must not count half."""
    stored = np.random.default_rng(5).integers(0, 4000, (5, 6, 7)).astype(np.uint16)
    scan = WitnessedScan(stored, 1.0, 0.0, np.diag([1.0, 1.4, 3.0, 1.0]), "test")
    grid = Grid.of(stored.shape, (3.0, 1.4, 1.0))
    expected = gradients(stored, grid, kernel)
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    np.testing.assert_allclose(normals(scan, kernel), expected, atol=1e-5)


def test_normals_of_one_slice_lie_in_it() -> None:
    scan = WitnessedScan(np.random.default_rng(6).random((1, 6, 7)), 1.0, 0.0, np.eye(4), "test")
    assert not normals(scan, "forward")[..., 2].any()


@pytest.mark.parametrize(("offset", "agrees"), [(0.0, True), (0.02, False)])
def test_pictures_that_are_all_too_bright_are_seen_where_their_noise_is_allowed(offset, agrees) -> None:
    difference = np.random.default_rng(1).normal(offset, 0.015, (500, 4))
    assert _brightness("it", difference, 0.02).passed == agrees


def test_an_early_end_is_seen() -> None:
    fine = np.column_stack([np.full((40, 3), 0.5), np.linspace(0.9, 0.99, 40)])
    ended = np.where(fine >= 0.9, 1.0, fine)
    scene = WitnessedScene({}, (), rmse=0.1)
    assert failed(compared("it", (fine, 0 * fine), truth=fine, drawn=fine, scene=scene)) == []
    assert failed(compared("it", (fine, 0 * fine), truth=fine, drawn=ended, scene=scene)) == ["opacity of it"]
