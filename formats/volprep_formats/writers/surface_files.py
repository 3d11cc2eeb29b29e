"""Surfaces as files: glTF binary, USDZ, PLY and STL, each with the error against the volume inside.

STL has no room for facts but the 80 bytes of its header; PLY has comments. Both hold all meshes as one, in millimetres
and LPS, as 3D Slicer writes them. Sources: the PLY polygon file format (Turk 1994); STL, 3D Systems 1989.
"""

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from volprep_formats.output import new_file
from volprep_formats.srgb import srgb_of_linear
from volprep_formats.writers.surface_glb import glb_of
from volprep_formats.writers.surface_records import SurfaceFacts, SurfaceMesh, Surfaces


def write_surfaces(surfaces: Surfaces, path: Path, *, draco: bool = False) -> None:
    """Write surfaces in the format that the ending names. Raises VP4020."""
    ending = path.suffix.lower()
    makers = {".glb": lambda: glb_of(surfaces, draco=draco), ".usdz": lambda: _usdz(surfaces)}
    makers |= {".ply": lambda: _ply(surfaces), ".stl": lambda: _stl(surfaces)}
    data = makers[ending]()
    with new_file(path) as file:
        file.write(data)


def _joined(surfaces: Surfaces) -> SurfaceMesh:
    starts = np.cumsum([0, *(len(mesh.positions_mm) for mesh in surfaces.meshes)])
    parts = zip(surfaces.meshes, starts, strict=False)
    return SurfaceMesh(
        surfaces.facts.function,
        np.concatenate([mesh.positions_mm for mesh in surfaces.meshes]),
        np.concatenate([mesh.normals for mesh in surfaces.meshes]),
        np.concatenate([mesh.colours for mesh in surfaces.meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in parts]),
    )


def _ply(surfaces: Surfaces) -> bytes:
    mesh = _joined(surfaces)
    vertices = np.empty(len(mesh.positions_mm), [("place", "<f4", 3), ("normal", "<f4", 3), ("colour", "u1", 3)])
    vertices["place"], vertices["normal"] = mesh.positions_mm, mesh.normals
    vertices["colour"] = np.rint(255 * srgb_of_linear(mesh.colours))
    faces = np.empty(len(mesh.triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.triangles
    places = [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    colours = [f"property uchar {name}" for name in ("red", "green", "blue")]
    lines = ["ply", "format binary_little_endian 1.0", "comment SPACE=LPS, millimetres"]
    lines += [f"comment volprep {json.dumps(surfaces.facts.model_dump(mode='json'))}"]
    lines += [f"element vertex {len(vertices)}", *places, *colours]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return "\n".join(lines).encode() + b"\n" + vertices.tobytes() + faces.tobytes()


def _stl(surfaces: Surfaces) -> bytes:
    mesh = _joined(surfaces)
    corners = mesh.positions_mm.astype(np.float32)[mesh.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).astype(np.float64)
    facets = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    facets["normal"] = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    facets["corners"] = corners
    return _stl_header(surfaces.facts) + np.uint32(len(facets)).tobytes() + facets.tobytes()


def _stl_header(facts: SurfaceFacts) -> bytes:
    """Return 80 bytes that do not begin with "solid", which means text."""
    worst = max((node.error.p95_mm for node in facts.nodes if node.error.p95_mm is not None), default=None)
    told = "" if worst is None else f" 95% within {worst:.3g} mm of the volume's first hits"
    return f"volprep SPACE=LPS UNIT=mm{told}".encode()[:80].ljust(80)


def _usdz(surfaces: Surfaces) -> bytes:
    """Return an archive of one stage: y up, a metre is 1000 units."""
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdUtils, Vt  # noqa: PLC0415 - in an extra

    with TemporaryDirectory() as folder:
        file = Path(folder) / "surface.usdc"
        stage = Usd.Stage.CreateNew(str(file))
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
        UsdGeom.SetStageMetersPerUnit(stage, 0.001)
        root = UsdGeom.Xform.Define(stage, "/Volume")
        stage.SetDefaultPrim(root.GetPrim())
        root.AddRotateXOp().Set(-90.0)
        stage.SetMetadata("customLayerData", {"volprep": json.dumps(surfaces.facts.model_dump(mode="json"))})
        material = UsdShade.Material.Define(stage, "/Volume/Material")
        surface = UsdShade.Shader.Define(stage, "/Volume/Material/Surface")
        surface.CreateIdAttr("UsdPreviewSurface")
        surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(1.0)
        colour = UsdShade.Shader.Define(stage, "/Volume/Material/Colour")
        colour.CreateIdAttr("UsdPrimvarReader_float3")
        colour.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
        output = colour.CreateOutput("result", Sdf.ValueTypeNames.Float3)
        surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(output)
        material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", Sdf.ValueTypeNames.Token))
        for index, mesh in enumerate(surfaces.meshes):
            made = UsdGeom.Mesh.Define(stage, f"/Volume/{_identifier(mesh.name)}_{index}")
            made.GetPrim().SetDisplayName(mesh.name)
            positions = mesh.positions_mm.astype(np.float32)
            made.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(positions))
            made.CreateExtentAttr(
                [Gf.Vec3f(*map(float, edge)) for edge in (positions.min(axis=0), positions.max(axis=0))]
            )
            made.CreateFaceVertexCountsAttr(Vt.IntArray(len(mesh.triangles), 3))
            made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.triangles.reshape(-1).astype(np.int32)))
            made.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(mesh.normals.astype(np.float32)))
            made.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
            made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
            shown = made.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex)
            shown.Set(Vt.Vec3fArray.FromNumpy(mesh.colours.astype(np.float32)))
            UsdShade.MaterialBindingAPI.Apply(made.GetPrim()).Bind(material)
        stage.GetRootLayer().Save()
        archive = Path(folder) / "surface.usdz"
        UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(file)), str(archive))
        return archive.read_bytes()


def _identifier(name: str) -> str:
    """Return a name of a prim: letters, digits and underscores."""
    plain = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in name)
    return plain if plain[:1].isalpha() else f"segment_{plain}"
