"""Compare a mesh of proxy geometry with its record in the manifest."""

from collections.abc import Iterator

import numpy as np

from volprep_formats.meshes import GlbMesh
from volprep_formats.package.parts.proxy.record import UNITS, ProxyMeshFile


def mesh_problems(record: ProxyMeshFile, mesh: GlbMesh, shape_zyx: tuple[int, int, int]) -> Iterator[str]:
    """Return the differences between a file and its record in the manifest."""
    triangles = sum(len(part.triangles) for part in mesh.primitives)
    if (triangles, mesh.draco) != (record.triangles, record.draco):
        yield f"has {triangles} triangles or compression that the manifest does not name"
    if mesh.scale_mm_xyz != record.box_from_mesh_mm_xyz:
        yield "has another scale than the manifest says"
    ends = np.array(shape_zyx[::-1]) * UNITS
    for part in mesh.primitives:
        at = part.positions_xyz
        if (at < 0).any() or (at > ends).any() or (at != np.rint(at)).any():
            yield "has positions outside of its level, or that are no whole numbers"
            return
