"""Surfaces that leave a package: where they are, what their files say, and foreign readers of these files."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command_line import ended, volprep
from every_kind import write_segments
from npm_package import npm_package
from scene_builds import built
from tiny_packages import ES3, function, lossless, tiny_package

from volprep.surface.surfaces import surfaces_of
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Silent
from volprep_formats.writers.surface_files import write_surfaces
from volprep_formats.writers.surface_records import Surfaces

SPACING_ZYX = (1.5, 1.0, 0.75)
RADIUS_MM = 9.0
CENTRE_ZYX = np.array([10.0, 14.0, 18.0])
STRAIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MIRRORED = ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
ORANGE = (1.0, 0.25, 0.04)


def ball(path: Path, direction=STRAIGHT, opaque: float = 50.0) -> Path:
    """Write a package of a ball whose values fall by 10 per millimetre and are 100 at its surface."""
    z, y, x = np.indices((21, 29, 37))
    places = (np.stack([z, y, x], axis=-1) - CENTRE_ZYX) * SPACING_ZYX
    values = np.clip(100 + 10 * (RADIUS_MM - np.linalg.norm(places, axis=-1)), 0, 200).round().astype(np.uint8)
    edge = function((0.0, ORANGE, 0.0), (99.0, ORANGE, 0.0), (101.0, ORANGE, opaque), (255.0, ORANGE, opaque))
    grid = Grid.of(values.shape, SPACING_ZYX, (-5.0, 7.0, 11.0), direction)
    tiny_package(path, values, edge, ES3, grid=grid, quantization=lossless(1.0, 0.0))
    return path


@pytest.fixture(scope="module")
def surfaces(tmp_path_factory) -> Surfaces:
    return surfaces_of(ball(tmp_path_factory.mktemp("ball") / "b.volpkg"), Silent(), within_mm=0.2)


@pytest.fixture(scope="module")
def segmented(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("segmented")
    return built(write_segments(folder), folder / "p.volpkg").path


def centre(direction=STRAIGHT) -> np.ndarray:
    return np.array([-5.0, 7.0, 11.0]) + np.array(direction) @ (CENTRE_ZYX * SPACING_ZYX)[::-1]


@pytest.mark.parametrize("direction", [STRAIGHT, MIRRORED])
def test_the_surface_lies_where_rays_are_half_opaque(tmp_path: Path, direction) -> None:
    made = surfaces_of(ball(tmp_path / "b.volpkg", direction), Silent(), within_mm=0.0)
    (mesh,) = made.meshes
    apart = np.linalg.norm(mesh.positions_mm - centre(direction), axis=1) - RADIUS_MM
    assert np.abs(apart).max() < 0.2
    assert abs(np.median(apart)) < 0.05
    outwards = ((mesh.positions_mm - centre(direction)) / RADIUS_MM * mesh.normals).sum(axis=1)
    assert outwards.min() > 0.8
    enclosed = trimesh.Trimesh(mesh.positions_mm, mesh.triangles, process=False).volume
    assert enclosed == pytest.approx(4 / 3 * np.pi * RADIUS_MM**3, rel=0.03)


def test_the_stated_error_is_that_of_the_mesh(surfaces: Surfaces) -> None:
    (node,) = surfaces.facts.nodes
    assert node.watertight
    assert node.error.rays > 500
    assert 0 < node.error.median_mm < 0.1
    assert node.error.p95_mm < 0.4
    assert node.error.missed < 0.05
    assert node.error.colour_rmse < 0.01
    assert np.abs(surfaces.meshes[0].colours - ORANGE).max() < 0.01


def test_fewer_triangles_stay_within_the_distance_that_is_asked_for(tmp_path: Path, surfaces: Surfaces) -> None:
    package = ball(tmp_path / "b.volpkg")
    whole = surfaces_of(package, Silent(), within_mm=0.0)
    assert surfaces.facts.nodes[0].triangles < whole.facts.nodes[0].triangles / 3
    apart = np.abs(np.linalg.norm(surfaces.meshes[0].positions_mm - centre(), axis=1) - RADIUS_MM)
    assert np.percentile(apart, 95) <= surfaces.facts.decimated_within_mm + 0.05 <= 0.25
    assert whole.facts.nodes[0].error.p95_mm <= surfaces.facts.nodes[0].error.p95_mm + 0.02


@pytest.mark.parametrize("ending", ["glb", "ply", "stl", "usdz"])
def test_files_hold_the_mesh_and_its_error(surfaces: Surfaces, tmp_path: Path, ending: str) -> None:
    for name in "ab":
        write_surfaces(surfaces, tmp_path / f"{name}.{ending}")
    data = (tmp_path / f"a.{ending}").read_bytes()
    assert data == (tmp_path / f"b.{ending}").read_bytes()
    p95 = surfaces.facts.nodes[0].error.p95_mm
    count = surfaces.facts.nodes[0].triangles
    if ending == "usdz":
        usd = pytest.importorskip("pxr.Usd", reason="usd-core is not installed")
        from pxr import UsdGeom

        stage = usd.Stage.Open(str(tmp_path / "a.usdz"))
        facts = json.loads(stage.GetRootLayer().customLayerData["volprep"])
        meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
        assert [len(mesh.GetFaceVertexCountsAttr().Get()) for mesh in meshes] == [count]
        assert UsdGeom.GetStageMetersPerUnit(stage) == 0.001
        assert facts["nodes"][0]["error"]["p95_mm"] == p95
        return
    loaded = trimesh.load(tmp_path / f"a.{ending}", process=ending == "stl")
    if ending == "glb":
        length = struct.unpack("<I", data[12:16])[0]
        gltf = json.loads(data[20 : 20 + length])
        assert gltf["nodes"][-1]["extras"]["volprep"]["nodes"][0]["error"]["p95_mm"] == p95
        # Metres, y up, the face towards z.
        x, y, z = centre() / 1000
        np.testing.assert_allclose(loaded.bounds.mean(axis=0), [x, z, -y], atol=2e-4)
        (loaded,) = loaded.geometry.values()
    else:
        np.testing.assert_allclose(loaded.bounds.mean(axis=0), centre(), atol=0.2)
        assert (f"{p95}" if ending == "ply" else f"{p95:.3g} mm").encode() in data[:2000]
    assert loaded.is_watertight
    assert len(loaded.faces) == count


def test_segments_are_nodes_with_their_names_and_colours(segmented: Path, tmp_path: Path) -> None:
    done = volprep("export", segmented, tmp_path / "a.glb", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    scene = trimesh.load(tmp_path / "a.glb")
    assert [node["name"] for node in told["nodes"]] == [*scene.geometry] == ["segment-1", "segment-2"]
    for node, name, colour in zip(told["nodes"], scene.geometry, [(250, 62, 31), (31, 188, 250)], strict=True):
        assert node["error"]["p95_mm"] < 0.8
        linear = (np.array(colour) / 255) ** 2.2
        np.testing.assert_allclose(
            scene.geometry[name].visual.vertex_attributes["color"][0, :3] / 65535, linear, atol=0.02
        )
    one = volprep("export", segmented, tmp_path / "b.stl", "--transfer", json.loads(done.stdout)["function"])
    assert one.returncode == 0, one.stderr


def test_pictures_without_a_surface_are_refused(tmp_path: Path) -> None:
    with pytest.raises(VolprepError) as error:
        surfaces_of(ball(tmp_path / "b.volpkg", opaque=0.001), Silent())
    assert error.value.code == "VP1333"


@pytest.mark.long
@pytest.mark.parametrize("options", [[], ["--draco"]])
def test_the_validator_of_khronos_finds_nothing(segmented: Path, tmp_path: Path, options: list[str]) -> None:
    folder = npm_package("gltf-validator", "2.0.0-dev.3.10")
    done = volprep("export", segmented, tmp_path / "a.glb", *options)
    assert done.returncode == 0, done.stderr
    script = "const v = require('gltf-validator'); const fs = require('fs');"
    script += f"v.validateBytes(new Uint8Array(fs.readFileSync('{tmp_path}/a.glb')))"
    script += ".then((r) => console.log(JSON.stringify(r.issues)));"
    found = ended(["node", "-e", script], cwd=folder)
    issues = json.loads(found.stdout)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]


@pytest.mark.long
def test_the_validators_of_usd_find_nothing(surfaces: Surfaces, tmp_path: Path) -> None:
    pytest.importorskip("pxr.UsdValidation", reason="usd-core is not installed")
    from pxr import Usd, UsdValidation

    write_surfaces(surfaces, tmp_path / "a.usdz")
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    found = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(tmp_path / "a.usdz")))
    assert [f"{each.GetName()}: {each.GetMessage()}" for each in found] == []


def test_voxels_with_just_the_threshold_leave_no_triangle_without_area(tmp_path: Path) -> None:
    sample = Path(__file__).parents[2] / "formats" / "samples" / "scan.volpkg.zip"
    done = volprep("export", sample, tmp_path / "scan.stl")
    assert done.returncode == 0, done.stderr
    loaded = trimesh.load(tmp_path / "scan.stl")
    assert loaded.area_faces.min() > 1e-6
    assert loaded.is_watertight
