"""Check the proxy geometry of a manifest against its levels, transfer functions and programs."""

from collections import Counter
from collections.abc import Iterator

import numpy as np

from volprep_formats.meshes import GlbMesh
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.proxy.record import UNITS, ProxyMeshFile

_RELATIVE_TOLERANCE = 1e-9


def proxy_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of meshes and of the programs that begin at them."""
    proxy = manifest.proxy
    yield from (
        f"program {program.name} begins at the box, but has a pass over a mesh"
        for program in manifest.programs
        if program.rays == "box" and any(each.geometry == "mesh" for each in program.passes)
    )
    if proxy is None:
        return
    grids = {level.index: level.grid for level in manifest.levels}
    functions = {function.name for function in manifest.transfer_functions}
    counts = Counter((mesh.transfer, mesh.level) for mesh in proxy.meshes)
    yield from (f"{n} meshes are for {of} on level {level}" for (of, level), n in counts.items() if n > 1)
    for mesh in proxy.meshes:
        name = f"the mesh for {mesh.transfer} on level {mesh.level}"
        if mesh.transfer not in functions:
            yield f"{name} is for no transfer function"
        if mesh.level not in grids:
            yield f"{name} is for no level"
            continue
        expected = [spacing / UNITS for spacing in grids[mesh.level].spacing_mm_zyx[::-1]]
        if not np.allclose(mesh.box_from_mesh_mm_xyz, expected, rtol=_RELATIVE_TOLERANCE, atol=0.0):
            yield f"{name} has box_from_mesh_mm_xyz that is not a quarter of its level's spacing"
        shown = mesh.file is not None
        if shown != (mesh.triangles > 0) or shown != (mesh.vertices > 0) or shown != (mesh.occupied_share > 0):
            yield f"{name} has a file without triangles, or triangles without a file"
    by_name = {mesh.name: mesh for mesh in proxy.meshes}
    if len(by_name) < len(proxy.meshes):
        yield "two meshes have one name"
    for picture, drawing in manifest.drawings:
        begun = by_name.get(drawing.at_mesh.mesh) if drawing.at_mesh is not None else None
        if drawing.at_mesh is not None and (
            begun is None or (begun.transfer, begun.level) != (picture.name, drawing.level)
        ):
            yield f"picture {picture.name} at level {drawing.level} begins at a mesh that is not its own"
    for program in (program for program in manifest.programs if program.rays == "mesh"):
        if [each.geometry for each in program.passes] != ["mesh"]:
            yield f"program {program.name} begins at meshes, but does not have one pass, which draws them"


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
