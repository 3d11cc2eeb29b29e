"""Small sound meshes, plain and compressed."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from volprep_formats.meshes import GlbMesh, primitives_of, read_glb, write_glb


def glb_file(*, draco: bool) -> Callable[[Path], bytes]:
    """A cube in two primitives."""

    def make(_folder: Path) -> bytes:
        corners = np.array([[x, y, z] for x in (0, 7) for y in (-3, 4) for z in (1, 9)], np.int32)
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))], np.int32)
        parts = primitives_of(corners, triangles, most_vertices=7)
        assert len(parts) > 1
        return write_glb(parts, (0.5, 1.0, 2.0), {"unit": "millimetre"}, draco=draco)

    return make


def read_mesh(path: Path) -> None:
    """Read a mesh; its triangles have vertices, and its vertices finite positions."""
    mesh: GlbMesh = read_glb(path.read_bytes(), path.name)
    assert mesh.primitives
    for part in mesh.primitives:
        assert part.triangles.max() < len(part.positions_xyz)
        assert np.isfinite(part.positions_xyz).all()
