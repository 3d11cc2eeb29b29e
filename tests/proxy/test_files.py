"""Meshes as files: other readers take them, compression changes no position, and what is broken is refused."""

import io
import json
import struct

import jsonschema
import numpy as np
import pytest
import trimesh

from volprep.parts.proxy.files import BYTES_PER_TRIANGLE, DECODER_BYTES, chosen_files, mesh_file
from volprep.parts.proxy.mesh import block_planes, proxy_mesh
from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import MOST_VERTICES, primitives_of, read_glb, write_glb

SCALE = (0.25, 0.5, 0.125)


def shell(blocks, seed=0):
    """A mesh around a sphere with specks, and what it encloses."""
    z, y, x = np.ogrid[-1 : 1 : blocks * 1j, -1 : 1 : blocks * 1j, -1 : 1 : blocks * 1j]
    radius = np.sqrt(z * z + y * y + x * x)
    occupied = (np.abs(radius - 0.7) < 2 / blocks) | (np.random.default_rng(seed).random(radius.shape) < 0.05)
    planes = block_planes((8 * blocks,) * 3, 8)
    return proxy_mesh(occupied, planes, "merged"), occupied, planes


def corners_of(primitives):
    """Corner positions of every triangle, each from its least corner on, in order: the mesh whatever its numbers."""
    corners = np.concatenate([each.positions_xyz[each.triangles] for each in primitives]).astype(np.int64)
    key = (corners * np.array([1 << 40, 1 << 20, 1])).sum(axis=2)
    turned = np.stack([np.roll(corner, -int(k), axis=0) for corner, k in zip(corners, key.argmin(axis=1), strict=True)])
    flat = turned.reshape(-1, 9)
    return flat[np.lexsort(flat.T)]


@pytest.mark.parametrize("draco", [False, True])
def test_a_file_holds_the_mesh_exactly(draco):
    mesh, _, _ = shell(12)
    parts = primitives_of(mesh.positions_xyz, mesh.triangles, 500)
    data = write_glb(parts, SCALE, {"units": "millimetres"}, draco=draco)
    found = read_glb(data, "mesh")
    assert (found.scale_mm_xyz, found.draco) == (SCALE, draco)
    assert len(found.primitives) == len(parts) > 3
    assert np.array_equal(corners_of(found.primitives), corners_of(parts))
    assert data == write_glb(parts, SCALE, {"units": "millimetres"}, draco=draco)


def test_trimesh_reads_a_closed_mesh_in_millimetres():
    mesh, occupied, planes = shell(10)
    data = mesh_file(mesh, SCALE).plain
    scene = trimesh.load(io.BytesIO(data), file_type="glb")
    whole = scene.to_geometry() if hasattr(scene, "to_geometry") else scene.dump(concatenate=True)
    assert whole.is_watertight
    assert whole.is_winding_consistent
    z, y, x = (np.diff(along).astype(float) for along in planes)
    sizes = z[:, None, None] * y[None, :, None] * x[None, None, :]
    assert whole.volume == pytest.approx(sizes[occupied].sum() * np.prod(SCALE), rel=1e-6)


def test_vtk_reads_the_same_mesh(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    mesh, _, _ = shell(10)
    path = tmp_path / "mesh.glb"
    path.write_bytes(mesh_file(mesh, SCALE).plain)
    (block,) = pyvista.read(path).recursive_iterator()
    surface = block.extract_surface(algorithm="dataset_surface") if not isinstance(block, pyvista.PolyData) else block
    assert surface.n_cells == len(mesh.triangles)
    assert surface.n_open_edges == 0
    ends = mesh.positions_xyz.max(axis=0) * SCALE
    assert np.allclose(np.array(surface.bounds)[1::2], ends, rtol=1e-6)


def test_parts_have_16_bit_indices_and_keep_every_triangle():
    mesh, _, _ = shell(60)
    assert len(mesh.positions_xyz) > MOST_VERTICES
    parts = primitives_of(mesh.positions_xyz, mesh.triangles)
    assert len(parts) > 1
    assert all(len(part.positions_xyz) <= MOST_VERTICES and part.triangles.dtype == np.uint16 for part in parts)
    assert sum(len(part.triangles) for part in parts) == len(mesh.triangles)
    together = np.concatenate([part.positions_xyz[part.triangles] for part in parts])
    assert np.array_equal(together, mesh.positions_xyz[mesh.triangles])


def test_draco_stands_where_all_files_together_save_more_than_the_decoder():
    small, middle, large = (mesh_file(shell(size)[0], SCALE) for size in (20, 30, 60))
    assert chosen_files([small], "auto") == [(small.plain, False)]
    assert 0 < small.saved_bytes(small.packed()) < DECODER_BYTES
    ((packed, draco),) = chosen_files([large], "auto")
    assert draco
    assert large.saved_bytes(packed) == len(large.plain) - len(packed) - BYTES_PER_TRIANGLE * len(large.mesh.triangles)
    assert sum(len(part.triangles) for part in read_glb(packed, "mesh").primitives) == len(large.mesh.triangles)
    # The decoder comes once: beside the large file the small ones only have to save something.
    assert [draco for _, draco in chosen_files([small, large, middle], "auto")] == [True, True, True]


def test_draco_is_there_always_or_never_on_request():
    small = mesh_file(shell(20)[0], SCALE)
    assert chosen_files([small], "always") == [(small.packed(), True)]
    assert chosen_files([small], "none") == [(small.plain, False)]


def test_a_file_keeps_the_rules_of_gltf():
    """What three.js and validators ask for, in the words of the specification's own schema."""
    mesh, _, _ = shell(10)
    data = mesh_file(mesh, SCALE).plain
    magic, version, length = struct.unpack_from("<III", data)
    assert (magic, version, length) == (0x46546C67, 2, len(data))
    size, kind = struct.unpack_from("<II", data, 12)
    assert kind == 0x4E4F534A
    assert size % 4 == 0
    gltf = json.loads(data[20 : 20 + size])
    assert struct.unpack_from("<II", data, 20 + size) == (gltf["buffers"][0]["byteLength"], 0x004E4942)
    index = {"type": "integer", "minimum": 0}
    schema = {
        "required": ["asset", "scene", "scenes", "nodes", "meshes", "accessors", "bufferViews", "buffers"],
        "properties": {
            "asset": {"required": ["version"], "properties": {"version": {"const": "2.0"}}},
            "nodes": {
                "items": {"properties": {"mesh": index, "scale": {"type": "array", "minItems": 3, "maxItems": 3}}}
            },
            "accessors": {"items": {"required": ["componentType", "count", "type"]}},
            "bufferViews": {"items": {"required": ["buffer", "byteLength"], "properties": {"byteOffset": index}}},
        },
    }
    jsonschema.validate(gltf, schema)
    for accessor in gltf["accessors"]:
        view = gltf["bufferViews"][accessor["bufferView"]]
        width = {5126: 4, 5123: 2}[accessor["componentType"]] * {"VEC3": 3, "SCALAR": 1}[accessor["type"]]
        assert view["byteLength"] == width * accessor["count"]
        assert view["byteOffset"] % 4 == 0
        if accessor["type"] == "VEC3":
            assert (view["target"], len(accessor["min"]), len(accessor["max"])) == (34962, 3, 3)
        else:
            assert view["target"] == 34963


@pytest.mark.parametrize("draco", [False, True])
def test_every_beginning_and_many_damages_are_refused_or_harmless(draco):
    mesh, _, _ = shell(4)
    data = write_glb(primitives_of(mesh.positions_xyz, mesh.triangles), SCALE, {}, draco=draco)
    for stop in range(0, len(data), 7):
        with pytest.raises(VolprepError, match="VP4039"):
            read_glb(data[:stop], "mesh")
    rng = np.random.default_rng(4)
    refused = 0
    # Of compressed files the header and the JSON: what Draco makes of its own bytes is Draco's.
    end = len(data) if not draco else 20 + struct.unpack_from("<I", data, 12)[0]
    for _ in range(600):
        damaged = bytearray(data)
        damaged[rng.integers(end)] = rng.integers(256)
        try:
            read_glb(bytes(damaged), "mesh")
        except VolprepError as error:
            refused += error.code == "VP4039"
    assert refused > 100


def test_declared_sizes_beyond_the_file_are_refused_before_anything_is_made():
    mesh, _, _ = shell(4)
    data = write_glb(primitives_of(mesh.positions_xyz, mesh.triangles), SCALE, {})
    size = struct.unpack_from("<I", data, 12)[0]
    for before, after in (
        (b'"count":', b'"count":1'),
        (b'"byteOffset":0', b'"byteOffset":9'),
        (b'"mode":4', b'"mode":5'),
        (b'"bufferView":1', b'"bufferView":7'),
    ):
        text = data[20 : 20 + size].rstrip()
        assert before in text
        text = text.replace(before, after)
        text += b" " * (-len(text) % 4)
        rest = data[20 + size :]
        damaged = struct.pack("<IIIII", 0x46546C67, 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest
        with pytest.raises(VolprepError, match="VP4039"):
            read_glb(damaged, "mesh")
