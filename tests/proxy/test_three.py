"""three.js reads our meshes, plain and compressed with Draco, with the decoder that it ships."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import ended
from npm_package import npm_package

from volprep.parts.proxy.mesh import block_planes, proxy_mesh
from volprep_formats.meshes import primitives_of, write_glb

VERSION = "0.180.0"
READ = Path(__file__).with_name("read_glb.mjs")
SCALE = (0.25, 0.5, 0.125)


@pytest.fixture(scope="module")
def three() -> Path:
    """Folder with three.js."""
    return npm_package("three", VERSION)


def read(three: Path, files: list[Path]) -> list[dict]:
    done = ended(["node", str(READ), str(three), *map(str, files)])
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def in_order(corners: np.ndarray) -> np.ndarray:
    """Triangles [n, 3, xyz], each from its least corner on, in order: the mesh whatever its numbers."""
    first = [min(range(3), key=lambda k: tuple(corner[k])) for corner in corners]
    turned = np.stack([np.roll(corner, -k, axis=0) for corner, k in zip(corners, first, strict=True)])
    flat = turned.reshape(-1, 9)
    return flat[np.lexsort(flat.T)]


@pytest.mark.long
def test_three_js_finds_every_triangle_where_it_is_and_turned_as_it_is(three, tmp_path) -> None:
    rng = np.random.default_rng(4)
    occupied = rng.random((9, 10, 11)) < 0.4
    mesh = proxy_mesh(occupied, block_planes((70, 79, 86), 8), "blocks")
    files = []
    for draco in (False, True):
        files.append(tmp_path / f"{draco}.glb")
        # Several parts, so that indices stay small.
        parts = primitives_of(mesh.positions_xyz, mesh.triangles, 700)
        files[-1].write_bytes(write_glb(parts, SCALE, {"units": "millimetres"}, draco=draco))
    wanted = in_order((mesh.positions_xyz[mesh.triangles] * np.array(SCALE)).astype(np.float64))
    assert len(wanted) > 2000
    for found in read(three, files):
        corners = np.array(found["corners"]).reshape(-1, 3, 3)
        assert np.array_equal(in_order(corners), wanted)
        assert 0 < found["largestIndex"] < 2**16
        low, high = (np.array(end) for end in found["box"])
        ends = mesh.positions_xyz.min(axis=0), mesh.positions_xyz.max(axis=0)
        assert np.array_equal([low, high], np.array(ends) * SCALE)
