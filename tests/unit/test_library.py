"""volprep as a library: what it exports, that importing it costs nothing, and that each function does its work."""

import ast
import inspect
import re
import subprocess
import sys
import time
import typing
from pathlib import Path

import nibabel
import numpy as np
import pytest
from dicom_files import save_all, stack
from phantom_scene import SHAPE_ZYX, SPACING_MM_ZYX, phantom, seen_phantom, write_phantom_scene
from pydicom.uid import ExplicitVRLittleEndian

import volprep
from volprep_formats.progress import Silent

ROOT = Path(__file__).parents[2]
FUNCTIONS = {
    "build_package",
    "check_package",
    "list_channels",
    "list_presets",
    "list_series",
    "open_package",
    "plan_package",
    "read_level",
    "read_scan",
    "render_package",
    "validate_package",
}
IN_NOTEBOOKS = {"from_pyvista", "show"}
RAW = {"shape_zyx": SHAPE_ZYX, "dtype": "uint16", "spacing_mm_zyx": SPACING_MM_ZYX}


def fresh(code: str) -> str:
    """Run code in a Python of its own; gives what it prints."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout


def test_the_library_exports_these_names_and_type_checkers_see_the_same() -> None:
    tree = ast.parse((ROOT / "volprep" / "__init__.py").read_text(encoding="utf-8"))
    typed = {
        alias.asname: node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname is not None
    }
    assert typed == volprep._HOME
    assert set(typed) == FUNCTIONS | IN_NOTEBOOKS | {"VolprepError"}
    assert set(typed) <= set(dir(volprep))


@pytest.mark.parametrize("name", sorted(FUNCTIONS | IN_NOTEBOOKS))
def test_each_function_has_a_docstring_and_types(name) -> None:
    function = getattr(volprep, name)
    assert len(inspect.getdoc(function).splitlines()[0]) > 30
    hints = typing.get_type_hints(function)
    assert set(inspect.signature(function).parameters) <= set(hints)
    assert hints["return"] is not type(None)


def test_import_loads_nothing_and_takes_no_time() -> None:
    loaded = fresh(
        "import sys; before = set(sys.modules); import volprep\n"
        "print(*sorted({name.split('.')[0] for name in set(sys.modules) - before} - set(sys.stdlib_module_names)))"
    )
    assert loaded.split() == ["volprep"]
    took = fresh("import time; t = time.process_time(); import volprep; print(time.process_time() - t)")
    assert float(took) < 0.5  # its table of names alone; with what it names, a second and more


def test_help_shows_every_function_also_without_the_extra_for_notebooks() -> None:
    text = fresh(
        "import sys; sys.modules['anywidget'] = None\n"
        "import pydoc, volprep; print(pydoc.plain(pydoc.render_doc(volprep)))\n"
        "from volprep import *; print(read_scan.__name__, __version__)"
    )
    shown = {name for name in FUNCTIONS | IN_NOTEBOOKS if re.search(rf"^    {name}\(", text, re.MULTILINE)}
    assert shown == FUNCTIONS
    assert "import_module" not in text
    assert set(volprep.__all__) == FUNCTIONS | IN_NOTEBOOKS | {"VolprepError", "__version__"}


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'volprep' has no attribute 'biuld'"):
        volprep.biuld  # noqa: B018


def test_opengl_is_loaded_only_to_draw() -> None:
    code = "import sys, volprep; volprep.read_scan; volprep.list_series; print('OpenGL' in sys.modules)"
    assert fresh(code).strip() == "False"


def test_a_scan_is_read_with_its_grid_and_physical_values(tmp_path, monkeypatch) -> None:
    phantom().tofile(tmp_path / "phantom.raw")
    monkeypatch.chdir(tmp_path)
    scan = volprep.read_scan("phantom.raw", raw=RAW)
    np.testing.assert_array_equal(scan.stored, phantom())
    np.testing.assert_array_equal(scan.physical, phantom().astype(np.float32))
    assert scan.grid.spacing_mm_zyx == SPACING_MM_ZYX


def test_a_scan_shows_itself_in_one_line(tmp_path) -> None:
    nibabel.save(nibabel.Nifti1Image(np.zeros((4, 3, 2), np.int16), np.diag([0.5, 1, 2.5, 1])), tmp_path / "scan.nii")
    scan = volprep.read_scan(tmp_path / "scan.nii")
    assert repr(scan) == "<VoxelArray [z, y, x] of 2 × 3 × 4 voxels of 2.5 × 1 × 0.5 mm, int16>"


def test_masked_voxels_are_refused(tmp_path) -> None:
    masked = np.ma.masked_less(phantom().astype(np.float32), 100)
    assert masked.mask.any()
    for call in (lambda: volprep.plan_package(masked), lambda: volprep.build_package(masked, tmp_path / "a.volpkg")):
        with pytest.raises(volprep.VolprepError, match=r"VP1282 .*masked voxels"):
            call()
    assert not list(tmp_path.iterdir())


def test_physical_values_are_slope_times_stored_plus_intercept(tmp_path) -> None:
    image = nibabel.Nifti1Image(phantom().T.astype(np.int16), np.eye(4))
    image.header.set_slope_inter(0.5, -1024.0)
    nibabel.save(image, tmp_path / "scan.nii")
    scan = volprep.read_scan(tmp_path / "scan.nii")
    expected = phantom() * 0.5 - 1024.0
    assert (scan.info.slope, scan.info.intercept) == (0.5, -1024.0)
    assert (scan.physical.min(), scan.physical.max()) == (expected.min(), expected.max())
    assert scan.physical.dtype == np.float32


@pytest.mark.parametrize(
    ("choices", "said"),
    [({"serise": "1"}, "serise: unknown key"), ({"volume": 0}, "volume"), ({"repair": ["holes"]}, "repair")],
)
def test_a_choice_that_cannot_be_is_refused_by_its_name(tmp_path, choices, said) -> None:
    scene = write_phantom_scene(tmp_path)
    for call in (
        lambda: volprep.read_scan(tmp_path / "phantom.raw", **choices),
        lambda: volprep.plan_package(scene, **choices),
        lambda: volprep.build_package(scene, tmp_path / "a.volpkg", **choices),
    ):
        with pytest.raises(volprep.VolprepError, match=f"VP9010 .*{said}"):
            call()


def test_a_volume_beyond_memory_is_refused_with_its_size(tmp_path, monkeypatch) -> None:
    phantom().tofile(tmp_path / "phantom.raw")

    allocate = np.empty

    def full(shape: object, *rest: object, **named: object) -> np.ndarray:
        if shape == SHAPE_ZYX:
            raise MemoryError
        return allocate(shape, *rest, **named)

    monkeypatch.setattr("numpy.empty", full)
    with pytest.raises(volprep.VolprepError, match="VP9011 the volume needs 64260 bytes"):
        volprep.read_scan(tmp_path / "phantom.raw", raw=RAW)


def test_series_of_a_folder_are_listed(tmp_path) -> None:
    save_all(stack(5), tmp_path / "series", ExplicitVRLittleEndian)
    (series,) = volprep.list_series(tmp_path).series
    assert series.files == 5
    assert volprep.read_scan(tmp_path, series=series.ending).grid.shape_zyx == series.shape_zyx


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """A package that the library has built, with what it said."""
    folder = tmp_path_factory.mktemp("library")
    manifest = volprep.build_package(write_phantom_scene(folder), folder / "phantom.volpkg", progress=Silent())
    assert manifest.profile.name == "gles3"
    return folder / "phantom.volpkg"


def test_a_package_is_planned_as_it_is_built(package) -> None:
    plan = volprep.plan_package(package.with_name("phantom.toml"))
    manifest = volprep.open_package(package).manifest
    # The stages add what they find out, such as the filter of a level, between what was planned.
    assert len(plan.items) > 5
    built = iter([item.name for item in manifest.plan])
    assert all(item.name in built for item in plan.items)
    assert not package.with_name("phantom.report").exists()


def test_choices_of_the_library_replace_those_of_the_scene(package) -> None:
    scene = package.with_name("phantom.toml")
    plan = volprep.plan_package(scene, profile="gles2-2048", preset="mr-head")
    assert plan.shared.profile.name == "gles2-2048"
    assert [*plan.channels[0].transfers] != [*volprep.plan_package(scene).channels[0].transfers]
    with pytest.raises(volprep.VolprepError, match="VP1004"):
        volprep.plan_package(scene, series="1.2.3")


def test_a_package_is_checked_opened_and_read_back(package) -> None:
    assert volprep.check_package(package) == []
    assert volprep.list_channels(package) == ["scan"]
    opened = volprep.open_package(package)
    level = volprep.read_level(package)
    assert level.grid.shape_zyx == opened.manifest.levels[0].grid.shape_zyx
    codes = opened.manifest.quantization
    seen = seen_phantom(opened.manifest).clip(*codes.window)
    # Codes of 16 bits are half floats on this profile, which are off by 2^-12 of the window at most.
    low, high = codes.window
    half_float = (high - low) * 2.0**-12 if codes.bits == 16 else 0.0
    assert np.abs(level.physical - seen).max() <= codes.max_error + half_float + 1e-3
    assert volprep.read_level(package, 1).grid.shape_zyx == opened.manifest.levels[1].grid.shape_zyx


def test_a_package_is_drawn_as_an_array(package) -> None:
    picture = volprep.render_package(package, shape_hw=(48, 64))
    assert (picture.shape, picture.dtype) == ((48, 64, 3), np.uint8)
    assert picture.max() > 50
    assert volprep.render_package(package, shape_hw=(48, 64), background="transparent").shape == (48, 64, 4)
    assert np.abs(picture.astype(int) - volprep.render_package(package, view="left", shape_hw=(48, 64))).max() > 20


def test_an_open_package_stands_for_its_path(package) -> None:
    opened = volprep.open_package(package)
    assert repr(opened) == f"Package({str(package)!r})"
    assert volprep.check_package(opened) == []
    assert volprep.read_level(opened, 1).grid == opened.manifest.levels[1].grid
    with pytest.raises(volprep.VolprepError, match=r"VP5025 there is no background pink.* transparent"):
        volprep.render_package(opened, background="pink")


def test_presets_are_listed_with_what_they_show() -> None:
    presets = volprep.list_presets()
    assert "ct-bone" in presets
    assert all(len(shows) > 10 for shows in presets.values())


def test_what_the_guide_says_of_python_works(tmp_path, monkeypatch) -> None:
    text = (ROOT / "docs" / "GUIDE.md").read_text(encoding="utf-8")
    chapter = text[text.index("\n## From Python\n") :].split("\n## ")[1]
    code = "\n".join(re.findall(r"```python\n(.*?)```", chapter, re.DOTALL))
    assert {name for name in FUNCTIONS if f"volprep.{name}(" in code} == FUNCTIONS
    save_all(stack(5), tmp_path / "dicom", ExplicitVRLittleEndian)
    affine = np.diag([*SPACING_MM_ZYX[::-1], 1.0])
    nibabel.save(nibabel.Nifti1Image(phantom().T.astype(np.int16), affine), tmp_path / "head.nii.gz")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    begun = time.monotonic()
    exec(compile(code, "GUIDE.md", "exec"), names)  # noqa: S102 - our own guide
    assert (tmp_path / "head.volpkg" / "manifest.json").is_file()
    assert (tmp_path / "head.report" / "index.html").is_file()
    assert names["report"].verdict.views > 0
    assert names["picture"].shape == (256, 256, 3)
    assert time.monotonic() - begun < 60


def test_a_build_that_fails_leaves_the_older_array_or_none(tmp_path) -> None:
    array = phantom()[::4, ::4, ::4]
    source = tmp_path / "array.volpkg.source.npy"
    with pytest.raises(volprep.VolprepError):
        volprep.build_package(array, tmp_path / "array.volpkg", profile="no-such-profile")
    assert list(tmp_path.iterdir()) == []
    np.save(source, array)
    with pytest.raises(volprep.VolprepError):
        volprep.build_package(array + 1, tmp_path / "array.volpkg", profile="no-such-profile")
    np.testing.assert_array_equal(np.load(source), array)
    assert list(tmp_path.iterdir()) == [source]


def test_an_array_is_a_source_and_its_package_validates(tmp_path) -> None:
    array = phantom()[::2, ::2, ::2]
    package = tmp_path / "array.volpkg"
    manifest = volprep.build_package(array, package, spacing_mm_zyx=(5.0, 1.5, 2.0))
    assert manifest.source.info.grid.spacing_mm_zyx == (5.0, 1.5, 2.0)
    np.testing.assert_array_equal(np.load(tmp_path / "array.volpkg.source.npy"), array)
    assert volprep.validate_package(package, size=24).verdict.passed
    planned = volprep.plan_package(array, spacing_mm_zyx=(5.0, 1.5, 2.0))
    assert [item.reason for item in planned.items] == [item.reason for item in manifest.plan]
    with pytest.raises(volprep.VolprepError, match="spacing_mm_zyx is for arrays"):
        volprep.plan_package(package, spacing_mm_zyx=(1.0, 1.0, 1.0))


def test_the_library_says_its_version_and_results_print_in_a_line(tmp_path) -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+.*", volprep.__version__)
    plan = volprep.plan_package(phantom()[:4, :5, :6])
    assert len(repr(plan)) < 200
    assert "gles3" in repr(plan)
