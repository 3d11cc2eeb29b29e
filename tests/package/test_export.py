import json
import os
import tomllib
import tracemalloc

import numpy as np
import pytest
from command_line import volprep
from tiny_packages import ES2, ES3, function, lossless, tiny_package

from volprep.parts.mosaic.packing import Packing, Room
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.prepare import prepare
from volprep.scene.request import load_request
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.volpkg import open_level
from volprep_formats.source import RawLayout, SourceSpec
from volprep_formats.writers import dicom, nifti, nrrd, raw
from volprep_formats.writers.values import PhysicalValues, StoredValues

DIRECTION = ((0.0, 0.6, -0.8), (1.0, 0.0, 0.0), (0.0, -0.8, -0.6))  # right-handed: DICOM keeps the order of slices
CODES = np.random.default_rng(7).integers(0, 256, (5, 4, 7)).astype(np.uint8)
WHOLE = Grid.of((9, 8, 9), (2.5, 0.7, 0.3), (-101.123456789, 33.3, 7.1), DIRECTION)
GRID = WHOLE.part((2, 3, 1), (7, 7, 8))  # what is left of a scan after its border
KINDS = {
    "3d": (ES3, Packing(), 64),
    "mosaic": (ES2, Packing(), 64),
    "mosaic of 4 channels": (ES2, Packing(4), 64),
    "mosaic in two textures": (ES2, Packing(4, "planar", 1), 9),
    "overlapping mosaic in two textures": (ES2, Packing(4, "overlapping"), 7),
}


@pytest.fixture(params=KINDS)
def package(request, tmp_path):
    profile, packing, size = KINDS[request.param]
    ramp = function((0.0, (1.0, 1.0, 1.0), 0.0), (255.0, (1.0, 1.0, 1.0), 0.1))
    quantized = lossless(0.5, -100.0)
    folder = tmp_path / "tiny.volpkg"
    tiny_package(
        folder,
        [CODES, CODES[::2, ::2, ::2]] if profile is ES3 else CODES,
        ramp,
        profile,
        packing=packing,
        room=Room(size, textures=7),
        grid=GRID,
        quantization=quantized,
    )
    return folder


SCENE = """name = "scan"
[[transfer]]
name = "ramp"
points = [
    { value = -1000.0, colour = [1.0, 1.0, 1.0], extinction_per_mm = 0.0 },
    { value = 3000.0, colour = [1.0, 1.0, 1.0], extinction_per_mm = 0.1 },
]
"""


class InterruptedRead(Exception):
    pass


def fail(_z0, _z1):
    raise InterruptedRead


def read_back(path, layout=None):
    with open_source(SourceSpec(path=str(path), raw=layout), path.parent, Silent()) as source:
        return source.info, source.read_slab(0, source.info.grid.shape_zyx[0])


def written(package, write, path, values=lambda source: source):
    with open_level(package) as source:
        write(values(source), path, Silent())
    return path


@pytest.mark.parametrize(("write", "name"), [(nifti.write, "a.nii"), (nifti.write, "a.nii.gz"), (nrrd.write, "a.nrrd")])
def test_stored_values_come_back_at_the_same_places(package, tmp_path, write, name) -> None:
    info, codes = read_back(written(package, write, tmp_path / name, StoredValues))
    np.testing.assert_array_equal(codes, CODES)
    assert (info.slope, info.intercept) == (1.0, 0.0)
    np.testing.assert_allclose(info.grid.world_from_index, GRID.world_from_index, rtol=0, atol=1e-7)


def test_nifti_keeps_codes_with_slope_and_nrrd_has_physical_values(package, tmp_path) -> None:
    info, codes = read_back(written(package, nifti.write, tmp_path / "a.nii.gz"))
    np.testing.assert_array_equal(codes, CODES)
    assert (info.slope, info.intercept) == (0.5, -100.0)
    _, physical = read_back(written(package, nrrd.write, tmp_path / "a.nrrd", PhysicalValues))
    np.testing.assert_array_equal(physical, CODES * np.float32(0.5) - 100)


def test_the_sidecar_of_a_raw_file_is_a_table_of_a_scene(package, tmp_path) -> None:
    path = written(package, raw.write, tmp_path / "a.raw", StoredValues)
    table = tomllib.loads((tmp_path / "a.raw.toml").read_text())["source"]["raw"]
    info, codes = read_back(path, RawLayout.model_validate_json(json.dumps(table)))
    np.testing.assert_array_equal(codes, CODES)
    np.testing.assert_allclose(info.grid.spacing_mm_zyx, GRID.spacing_mm_zyx, rtol=0)


@pytest.mark.parametrize("in_one_file", [False, True])
def test_a_texture_is_read_slice_by_slice(tmp_path, in_one_file) -> None:
    voxels = np.random.default_rng(8).integers(0, 256, (64, 150, 130)).astype(np.uint8)
    folder = tmp_path / "deep.volpkg"
    ramp = function((0.0, (1.0, 1.0, 1.0), 0.0), (255.0, (1.0, 1.0, 1.0), 0.1))
    tiny_package(folder, voxels, ramp, ES3)
    if in_one_file:
        names = [path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*")) if path.is_file()]
        with (tmp_path / "deep.volpkg.zip").open("wb") as file:
            write_single_file(folder, names, file, Silent())
        folder = tmp_path / "deep.volpkg.zip"
    tracemalloc.start()
    with open_level(folder) as source:
        tracemalloc.reset_peak()
        for z in range(0, 64, 2):
            assert np.array_equal(source.read_slab(z, z + 2), voxels[z : z + 2])
        peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < voxels.nbytes / 4


def test_a_package_is_a_source_of_another_import(package) -> None:
    info, codes = read_back(package)
    np.testing.assert_array_equal(codes, CODES)
    assert (info.format, info.grid, info.slope, info.intercept) == ("volpkg", GRID, 0.5, -100.0)


def test_a_dicom_series_comes_back_at_the_same_places(package, tmp_path) -> None:
    with open_level(package) as source:
        dicom.write(source, tmp_path / "series", Silent())
    info, codes = read_back(tmp_path / "series")
    np.testing.assert_array_equal(codes, CODES)
    # A DS has 16 characters: at least 1e-9 of a direction, and of a position here.
    np.testing.assert_allclose(info.grid.world_from_index, GRID.world_from_index, rtol=0, atol=1e-6)


def test_the_same_volume_gives_the_same_bytes(package, tmp_path) -> None:
    for write, ending in ((nifti.write, ".nii.gz"), (nrrd.write, ".nrrd")):
        first, second = (written(package, write, tmp_path / f"{name}{ending}").read_bytes() for name in "ab")
        assert first == second


@pytest.mark.parametrize("package", ["3d"], indirect=True)
def test_a_coarser_level_is_another_volume_and_a_missing_one_is_told(package) -> None:
    with open_level(package, 1) as source:
        np.testing.assert_array_equal(source.read_slab(0, 3), CODES[::2, ::2, ::2])
        assert source.info.grid == GRID.coarser((2, 2, 2))
    with pytest.raises(VolprepError, match=r"VP1250.*no level 2, only: 0, 1"):
        open_level(package, 2)


def test_a_draft_gives_the_scan_at_full_precision(tmp_path) -> None:
    scan = np.random.default_rng(8).integers(-1000, 3000, (3, 5, 4)).astype("<i2")
    scan[0, 0, 0] = -29921  # these two bytes begin a gzip file, too
    (tmp_path / "scan.raw").write_bytes(bytes(4) + scan.tobytes())
    scene = '[source]\npath = "scan.raw"\n[source.raw]\nshape_zyx = [3, 5, 4]\ndtype = "int16"\nheader_bytes = 4\n'
    (tmp_path / "scan.toml").write_text(SCENE + scene)
    done = volprep("import", tmp_path / "scan.toml", "-o", tmp_path / "scan.volpkg")
    assert done.returncode == 0, done.stderr
    _, codes = read_back(written(tmp_path / "scan.volpkg", nifti.write, tmp_path / "scan.nii"))
    np.testing.assert_array_equal(codes, scan)


def replace_by(trick, file, outside):
    """Put something else in place of a file of a package, and what it was outside."""
    if trick == "a pipe":
        file.unlink()
        os.mkfifo(file)
        return
    if trick == "a link to the folder around it":
        file = file.parent
    file.rename(outside)
    file.symlink_to(outside)


@pytest.mark.timeout(20)
@pytest.mark.parametrize("trick", ["a link", "a link to the folder around it", "a pipe"])
def test_a_draft_as_a_source_is_never_left(tmp_path, trick) -> None:
    (tmp_path / "scan.raw").write_bytes(CODES.tobytes())
    scene = f'[source]\npath = "scan.raw"\n[source.raw]\nshape_zyx = {list(CODES.shape)}\ndtype = "uint8"\n'
    (tmp_path / "scan.toml").write_text(SCENE + scene)
    draft = import_draft(prepare(load_request(tmp_path / "scan.toml")), tmp_path / "scan.volpkg", Silent()).draft
    open_level(draft.folder).__exit__()
    replace_by(trick, draft.folder / "work" / "level0-scan.raw", tmp_path / "outside")
    with pytest.raises(VolprepError, match="VP4007"):
        open_level(draft.folder)


@pytest.mark.timeout(20)
@pytest.mark.parametrize("package", ["3d"], indirect=True)
@pytest.mark.parametrize("trick", ["a link", "a pipe"])
def test_a_package_as_a_source_is_never_left(package, tmp_path, trick) -> None:
    replace_by(trick, package / "volume-scan-0.ktx2", tmp_path / "outside")
    with pytest.raises(VolprepError, match="VP4007"):
        open_level(package)


def test_a_file_that_fails_leaves_nothing(package, tmp_path) -> None:
    before = sorted(tmp_path.iterdir())
    with open_level(package) as source:
        source.read_slab = fail
        with pytest.raises(InterruptedRead):
            nifti.write(source, tmp_path / "a.nii", Silent())
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("package", ["3d"], indirect=True)
def test_a_scene_and_the_verb_choose_a_level_of_a_package(package, tmp_path) -> None:
    with open_source(SourceSpec(path=str(package), level=1), tmp_path, Silent()) as source:
        np.testing.assert_array_equal(source.read_slab(0, 3), CODES[::2, ::2, ::2])
    done = volprep("import", package, "-o", tmp_path / "coarse.volpkg", "--level", "1")
    assert done.returncode == 0, done.stderr
    info, codes = read_back(tmp_path / "coarse.volpkg")
    np.testing.assert_array_equal(codes, CODES[::2, ::2, ::2])
    assert info.grid == GRID.coarser((2, 2, 2))
    refused = volprep("import", package, "-o", tmp_path / "none.volpkg", "--level", "2")
    assert (refused.returncode, "VP1250" in refused.stderr) == (ExitStatus.PACKAGE, True)


@pytest.mark.long(keep=1)
def test_the_verb_writes_physical_and_stored_values_of_openvdb(package, tmp_path) -> None:
    pytest.importorskip("volprep_formats._vdb", reason="this build has no OpenVDB")
    for values, slope, intercept in (("physical", 0.5, -100.0), ("stored", 1.0, 0.0)):
        done = volprep("export", package, tmp_path / f"{values}.vdb", "--values", values)
        assert done.returncode == 0, done.stderr
        info, found = read_back(tmp_path / f"{values}.vdb")
        np.testing.assert_array_equal(found, CODES * slope + intercept)
        np.testing.assert_allclose(info.grid.world_from_index, GRID.world_from_index, rtol=0, atol=1e-9)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("package", ["3d"], indirect=True)
@pytest.mark.parametrize("name", ["a.nii.gz", "a.nrrd", "a.vdb", "a"])
def test_the_verb_writes_the_level_that_it_is_told(package, tmp_path, name) -> None:
    if name.endswith(".vdb"):
        pytest.importorskip("volprep_formats._vdb", reason="this build has no OpenVDB")
    done = volprep("export", package, tmp_path / name, "--level", "1", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["shape_zyx"] == [3, 2, 4]
    info, found = read_back(tmp_path / name)
    np.testing.assert_array_equal(info.slope * found.astype(float) + info.intercept, CODES[::2, ::2, ::2] * 0.5 - 100)
    refused = volprep("export", package, tmp_path / f"b{name}", "--level", "7")
    assert (refused.returncode, "VP1250" in refused.stderr) == (ExitStatus.PACKAGE, True)
    assert not (tmp_path / f"b{name}").exists()


@pytest.mark.parametrize("ending", [".nii.gz", ".nrrd", ".raw"])
def test_sixteen_bits_come_back_as_half_floats_hold_them(tmp_path, ending) -> None:
    codes = np.random.default_rng(9).integers(0, 65536, CODES.shape).astype(np.uint16)
    folder = tmp_path / "deep.volpkg"
    ramp = function((0.0, (1.0, 1.0, 1.0), 0.0), (65535.0, (1.0, 1.0, 1.0), 0.1))
    told = lossless(0.125, -1000.0, bits=16)
    tiny_package(folder, codes, ramp, ES3, grid=GRID, window=(0.0, 65535.0), quantization=told)
    halves = (codes / 65535).astype(np.float16).astype(np.float64)
    for values, expected in (("stored", halves), ("physical", halves * (65535 * 0.125) - 1000)):
        file = tmp_path / f"{values}{ending}"
        done = volprep("export", folder, file, "--values", values)
        assert done.returncode == 0, done.stderr
        table = tomllib.loads(file.with_name(f"{file.name}.toml").read_text()) if ending == ".raw" else None
        layout = table and RawLayout.model_validate_json(json.dumps(table["source"]["raw"]))
        info, found = read_back(file, layout)
        physical = info.slope * found.astype(np.float64) + info.intercept
        # A result of 24 bits, of numbers of up to 7200.
        np.testing.assert_allclose(physical, expected, rtol=0, atol=8192 * 2**-24 if values == "physical" else 0)


@pytest.mark.long(keep=1)
def test_the_verb_writes_and_replaces_only_by_force(package, tmp_path) -> None:
    assert volprep("export", package, tmp_path / "a.nii.gz").returncode == 0
    again = volprep("export", package, tmp_path / "a.nii.gz")
    assert (again.returncode, again.stderr.split()[1]) == (6, "VP1251")
    assert volprep("export", package, tmp_path / "a.nii.gz", "--force").returncode == 0
    assert "VP1252" in volprep("export", package, tmp_path / "a.jpg").stderr
