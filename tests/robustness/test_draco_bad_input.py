"""Meshes by Draco whose bytes say what no primitive of ours has: each is refused at once, before Draco allocates.

The kinds are those of the holes that parsers of Draco's kind had: sizes beyond the data, point clouds and other methods
in place of the mesh that is expected, metadata within metadata, and parts of attributes that do not make vertices.
"""

import struct
import time
from pathlib import Path

import numpy as np
import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import Primitive, decode_draco, encode_draco, read_glb

from .mesh_subjects import glb_file
from .mutations import assert_survives

POINTS, MESH = 0, 1
SEQUENTIAL, EDGEBREAKER = 0, 1


def varint(number: int) -> bytes:
    low, rest = number & 127, number >> 7
    return bytes([low | 128]) + varint(rest) if rest else bytes([low])


def start(kind: int = MESH, method: int = EDGEBREAKER, flags: int = 0, version: tuple[int, int] = (2, 2)) -> bytes:
    return b"DRACO" + bytes([*version, kind, method]) + struct.pack("<H", flags)


def edgebreaker(vertices: int, triangles: int) -> bytes:
    return start() + b"\0" + varint(vertices) + varint(triangles) + b"\1" + varint(triangles) + varint(0) + bytes(64)


BAD = {
    "as many triangles as 28 bits hold": edgebreaker(2**28, 2**28),
    "as many triangles as 32 bits hold": edgebreaker(2**32 - 1, 2**32 - 1),
    "few vertices of many triangles": edgebreaker(8, 2**28),
    "a number that does not end": start() + b"\0" + b"\xff" * 40,
    "nothing but a beginning": start(),
    "triangles one after the other": start(method=SEQUENTIAL) + varint(2**30) + varint(100) + b"\1" + bytes(64),
    "a cloud of points": start(POINTS, SEQUENTIAL) + struct.pack("<i", 2**31 - 1) + b"\1" + bytes(64),
    "a cloud of a negative number of points": start(POINTS, SEQUENTIAL) + struct.pack("<i", -1) + bytes(64),
    "a tree of points": start(POINTS, EDGEBREAKER) + struct.pack("<i", 2**31 - 1) + b"\1" + bytes(64),
    "metadata within metadata": start(flags=0x8000) + varint(0) + (varint(0) + varint(1) + b"\1a") * 200_000,
    "metadata of many entries": start(flags=0x8000) + varint(0) + varint(2**32 - 1) + bytes(64),
    "an old version": start(version=(1, 1)) + bytes(64),
    "vertices of one number": start(method=SEQUENTIAL) + varint(1) + varint(2**32 - 1) + b"\1" + bytes(64),
}


@pytest.mark.parametrize("data", BAD.values(), ids=BAD)
def test_what_no_primitive_has_is_refused_at_once(data) -> None:
    began = time.process_time()
    with pytest.raises(VolprepError, match="VP4039"):
        decode_draco(data, "mesh.glb")
    assert time.process_time() - began < 10.0  # numbers that are believed take a minute


def test_a_mesh_of_as_many_vertices_as_indices_can_name_comes_back_whole() -> None:
    side = 255
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    positions = np.stack([x, y, x * y % 7], axis=-1).reshape(-1, 3).astype(np.float32)
    a = (y[:-1, :-1] * side + x[:-1, :-1]).ravel()
    triangles = np.concatenate([np.stack([a, a + 1, a + side], -1), np.stack([a + 1, a + side + 1, a + side], -1)])
    found = decode_draco(encode_draco(Primitive(positions, triangles.astype(np.uint16))), "mesh.glb")
    assert len(found.positions_xyz) == side**2
    assert len(found.triangles) == len(triangles)


def test_damaged_draco_is_read_or_refused_with_a_code(tmp_path) -> None:
    primitive = read_glb(glb_file(draco=True)(tmp_path), "mesh.glb").primitives[0]

    def read(path: Path) -> None:
        found = decode_draco(path.read_bytes(), path.name)
        assert found.triangles.shape[1:] == found.positions_xyz.shape[1:] == (3,)

    outcomes = assert_survives(encode_draco(primitive), ".drc", read, tmp_path, count=3000)
    assert outcomes.keys() == {"read", "VP4039"}
