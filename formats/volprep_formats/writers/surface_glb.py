"""Surfaces as glTF 2.0 binary: a named node for each mesh, normals, linear vertex colours, the facts in `extras`.

Meshes keep millimetres and LPS; the root turns them into the metres and axes of glTF (y up, the face towards z).
Sources: glTF 2.0 specification; KHR_draco_mesh_compression.
"""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float32Array
from volprep_formats.package.look import extras_of
from volprep_formats.writers.surface_records import SurfaceMesh, Surfaces

_FLOAT, _SHORT, _INT = 5126, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
METRES_FROM_LPS = [0.001, 0, 0, 0, 0, 0, -0.001, 0, 0, 0.001, 0, 0, 0, 0, 0, 1]
"""Column by column: x to the left, y to the head, z to the front."""
_DRACO = "KHR_draco_mesh_compression"
_POSITION_BITS, _NORMAL_BITS = 16, 10
_COLOUR_ID = 7


def glb_of(surfaces: Surfaces, *, draco: bool) -> bytes:
    """Return the bytes of a file."""
    writer = _Writer()
    meshes = [writer.mesh(mesh, draco=draco) for mesh in surfaces.meshes]
    count = len(meshes)
    facts = {"volprep": surfaces.facts.model_dump(mode="json"), **extras_of(surfaces.looks)}
    nodes: list[dict[str, object]] = [{"name": mesh.name, "mesh": index} for index, mesh in enumerate(surfaces.meshes)]
    root = {"name": surfaces.facts.package, "matrix": METRES_FROM_LPS, "children": [*range(count)], "extras": facts}
    material = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}}
    gltf: dict[str, object] = {
        "asset": {"version": "2.0", "generator": surfaces.facts.generator},
        "scene": 0,
        "scenes": [{"nodes": [count]}],
        "nodes": [*nodes, root],
        "meshes": meshes,
        "materials": [material],
        "accessors": writer.accessors,
        "bufferViews": writer.views,
        "buffers": [{"byteLength": len(writer.binary)}],
    }
    if draco:
        gltf |= {"extensionsUsed": [_DRACO], "extensionsRequired": [_DRACO]}
    return glb_head(gltf, len(writer.binary)) + bytes(writer.binary)


def glb_head(gltf: dict[str, object], binary_bytes: int) -> bytes:
    """Return everything of a file before its binary data, whose size is a multiple of 4."""
    text = json.dumps(gltf, allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<III", 0x46546C67, 2, 12 + 8 + len(text) + 8 + binary_bytes)
    return head + struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", binary_bytes, 0x004E4942)


class _Writer:
    def __init__(self) -> None:
        self.binary = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, object]] = []

    def mesh(self, mesh: SurfaceMesh, *, draco: bool) -> dict[str, object]:
        """Add a mesh, and return its entry."""
        positions = mesh.positions_mm.astype(np.float32)
        normals = mesh.normals.astype(np.float32)
        colours = np.rint(65535 * mesh.colours).astype(np.uint16)
        triangles = mesh.triangles.astype(np.uint32)
        extension: dict[str, object] = {}
        if draco:
            packed, ids, (positions, triangles) = _packed(positions, normals, colours, triangles)
            extension = {"extensions": {_DRACO: {"bufferView": self._view(packed), "attributes": ids}}}
        place = None if draco else self._view
        bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
        # Components of a vertex begin at multiples of four bytes: a fourth one fills the last.
        opaque = np.concatenate([colours, np.full((len(colours), 1), 65535, np.uint16)], axis=1)
        attributes = {
            "POSITION": self._accessor(place, positions, "VEC3", _FLOAT, len(positions), **bounds),
            "NORMAL": self._accessor(place, normals, "VEC3", _FLOAT, len(positions)),
            "COLOR_0": self._accessor(place, opaque, "VEC4", _SHORT, len(positions), normalized=True),
        }
        corners = self._accessor(place, triangles, "SCALAR", _INT, triangles.size, target=_INDICES)
        primitive = {"attributes": attributes, "indices": corners, "material": 0, "mode": 4}
        return {"name": mesh.name, "primitives": [primitive | extension]}

    def _accessor(
        self,
        place: Any,
        data: NDArray[Any],
        kind: str,
        component: int,
        count: int,
        *,
        target: int = _VERTICES,
        **more: object,
    ) -> int:
        accessor: dict[str, object] = {"componentType": component, "count": count, "type": kind, **more}
        if place is not None:
            accessor["bufferView"] = place(np.ascontiguousarray(data).tobytes(), target)
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def _view(self, data: bytes, target: int | None = None) -> int:
        self.binary += bytes(-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.views.append(view if target is None else view | {"target": target})
        self.binary += data
        self.binary += bytes(-len(self.binary) % 4)
        return len(self.views) - 1


def _packed(
    positions: Float32Array, normals: Float32Array, colours: NDArray[np.uint16], triangles: NDArray[np.uint32]
) -> tuple[bytes, dict[str, int], tuple[Float32Array, NDArray[np.uint32]]]:
    """Return the bitstream, the identifier of each attribute in it, and positions and triangles as it decodes."""
    import DracoPy  # noqa: PLC0415 - loaded where it is used

    opaque = np.concatenate([colours, np.full((len(colours), 1), 65535, np.uint16)], axis=1)
    data: bytes = DracoPy.encode(
        positions,
        triangles,
        quantization_bits=_POSITION_BITS,
        compression_level=7,
        normals=normals.astype(np.float64),
        normal_quantization_bits=_NORMAL_BITS,
        generic_attributes={_COLOUR_ID: opaque},
    )
    mesh: Any = DracoPy.decode(data)
    ids = {
        attribute["attribute_type"]: attribute["unique_id"]
        for attribute in mesh.attributes
        if attribute["unique_id"] != _COLOUR_ID
    }
    return data, {"POSITION": ids[0], "NORMAL": ids[1], "COLOR_0": _COLOUR_ID}, (mesh.points, mesh.faces)
