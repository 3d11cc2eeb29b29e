"""Looks as a record: the same JSON in every file that has it, and what reads it. Voxels as glTF with EXT_voxels."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from command_line import volprep
from phantom_scene import write_phantom_scene
from scene_builds import built

from volprep.judge.measure import judge
from volprep.scene.request import load_request
from volprep_formats.diagnostics import VolprepError
from volprep_formats.look_files import read_looks
from volprep_formats.package.look import VolumeLooks
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.readers.volpkg import open_level

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "formats" / "samples"
SCAN = SAMPLES / "scan.volpkg.zip"
SCHEMA = json.loads((Path(__file__).parent / "ext_voxels.schema.json").read_text())


def exported(folder: Path, name: str, *options: str, package: Path = SCAN) -> Path:
    done = volprep("export", package, folder / name, *options)
    assert done.returncode == 0, done.stderr
    return folder / name


def glb(path: Path) -> tuple[dict, bytes]:
    data = path.read_bytes()
    assert int.from_bytes(data[8:12], "little") == len(data)
    size = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + size]), data[28 + size :]


@pytest.mark.parametrize("sample", ["scan", "baked-light", "two-channels", "segments", "colour", "slices"])
def test_looks_of_a_package_come_back_from_json(tmp_path: Path, sample: str) -> None:
    package = SAMPLES / f"{sample}.volpkg.zip"
    path = exported(tmp_path, "looks.json", package=package)
    manifest = Package.open(package).manifest
    looks = read_looks(path)
    assert looks == read_looks(package)
    assert [each.name for each in looks.looks] == [each.name for each in manifest.pictures]
    assert looks.looks[0].media[0].function == manifest.function(manifest.pictures[0].media[0].transfer)
    schema = json.loads((ROOT / "formats/schemas/looks.schema.json").read_text())
    jsonschema.validate(json.loads(path.read_text()), schema)
    assert (looks.looks[0].computed_light is not None) == (sample == "baked-light")
    assert (looks.looks[0].lighting == "headlight") == (sample == "segments")


def test_the_page_is_short() -> None:
    assert (ROOT / "formats/spec/looks.md").stat().st_size <= 8000


@pytest.mark.parametrize(("name", "options"), [("v.ome.zarr", ()), ("v.glb", ("--volume",))])
def test_other_files_hold_the_same_looks(tmp_path: Path, name: str, options: tuple[str, ...]) -> None:
    assert read_looks(exported(tmp_path, name, *options)) == read_looks(SCAN)


def test_looks_are_left_out_where_the_values_are_others(tmp_path: Path) -> None:
    done = volprep("export", SCAN, tmp_path / "v.ome.zarr", "--values", "stored")
    assert "export FILE.json writes the looks" in done.stderr
    with pytest.raises(VolprepError, match="volume_looks"):
        read_looks(tmp_path / "v.ome.zarr")


def test_an_export_of_one_channel_has_the_looks_of_that_channel_only(tmp_path: Path) -> None:
    path = exported(tmp_path, "v.glb", "--volume", "--channel", "activity", package=SAMPLES / "two-channels.volpkg.zip")
    assert [each.name for each in read_looks(path).looks] == ["hot"]


def test_a_scene_and_its_looks_judge_alike(tmp_path: Path) -> None:
    scene = write_phantom_scene(tmp_path)
    store = exported(tmp_path, "v.ome.zarr", package=built(scene, tmp_path / "p.volpkg").path)
    by_scene, by_looks = (judge(store, path, Silent()) for path in (scene, store))
    assert by_scene.measured
    assert [each.rmse for each in by_scene.measured] == pytest.approx([each.rmse for each in by_looks.measured])
    assert (by_scene.tolerance_rmse, by_scene.least_kept_contrast) == (
        by_looks.tolerance_rmse,
        by_looks.least_kept_contrast,
    )


def test_a_scene_takes_a_function_out_of_looks(tmp_path: Path) -> None:
    exported(tmp_path, "looks.json")
    scene = tmp_path / "scene.toml"
    scene.write_text('name = "a"\n[source]\npath = "x.nii"\n[[transfer]]\nname = "bone"\nfile = "looks.json"\n')
    (transfer,) = load_request(scene).scene.transfer
    wanted = next(each for each in read_looks(SCAN).looks if each.name == "bone").media[0].function
    assert transfer.resolved() == wanted
    scene.write_text(scene.read_text().replace('"bone"', '"veil"'))
    with pytest.raises(VolprepError, match="skin, bone"):
        load_request(scene)


def test_voxels_as_gltf_are_where_the_scan_has_them(tmp_path: Path) -> None:
    package = SAMPLES / "oblique.volpkg.zip"
    gltf, binary = glb(exported(tmp_path, "v.glb", "--volume", package=package))
    node = gltf["nodes"][0]
    told = node["extensions"]["EXT_voxels"]
    jsonschema.validate(told, SCHEMA)
    assert "draft" in node["extras"]["volprep"]
    with open_level(package, None) as source:
        info = source.info
        values = source.read_slab(0, info.grid.shape_zyx[0]) * info.slope + info.intercept
    x, y, z = told["dimensions"]
    (accessor,) = gltf["accessors"]
    assert accessor["count"] == x * y * z
    found = np.frombuffer(binary, "<f4").reshape(z, y, x)
    np.testing.assert_allclose(found, values, rtol=1e-6)
    # Voxels fill a box whose middle is at 0: by the draft from +x to -x, then from -z to +z, then from -y to +y.
    size = np.array(gltf["shapes"][node["boundingVolume"]["shape"]]["box"]["size"])
    matrix = np.array(node["matrix"]).reshape(4, 4).T
    for voxel in ((0, 0, 0), (x - 1, 0, 3), (2, y - 1, z - 1)):
        right, forward, up = (np.array(voxel) + 0.5) / (x, y, z) - 0.5
        local = np.array([-right, up, forward]) * size
        np.testing.assert_allclose(matrix @ [*local, 1], info.grid.world_from_index @ [*voxel, 1], atol=1e-9)


def test_voxels_that_no_file_can_hold_are_refused_before_anything_is_written(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("volprep_formats.writers.voxels_glb._MOST_BYTES", 1000)
    from volprep_formats.writers.voxels_glb import write

    with open_level(SCAN, None) as source, pytest.raises(VolprepError, match="VP1255"):
        write([source], ["scan"], VolumeLooks(looks=()), tmp_path / "v.glb", Silent())
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"{}",
        b"[]",
        b"\xff\xfe",
        b'{"format": "volume-looks", "version": 1}',
        b'{"format": "volume-looks", "version": 2, "looks": []}',
        b'{"nodes": 3, "attributes": [], "extras": 1}',
        b'{"attributes": {"volume_looks": 3}}',
        b"glTF\2\0\0\0",
        b"glTF\2\0\0\0" + b"\xff" * 12,
        b"[" * 5000,
        b" " * (2**20 + 1),
    ],
)
def test_files_without_looks_are_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(data)
    with pytest.raises(VolprepError, match="VP3042"):
        read_looks(path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(VolprepError, match="VP3042"):
        read_looks(tmp_path / "none.json")
