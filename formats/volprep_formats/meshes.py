"""Triangle meshes as glTF 2.0 binary files (.glb): a deterministic writer and a reader that checks every number.

Positions are float32, indices 16 bits in each primitive, so that OpenGL ES 2.0 draws them without an extension; a mesh
with more vertices has several primitives. One node scales the positions to millimetres; glTF's own unit is the metre,
so `extras` of the file names the unit. Sources: glTF 2.0 specification, and its extension KHR_draco_mesh_compression.
"""

import json
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NoReturn

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, ValidationError
from pydantic.alias_generators import to_camel

from volprep_formats.arrays import Float32Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.record import Record, problems

MOST_VERTICES = 65535
"""Most vertices in a primitive: indices have 16 bits, and the highest one restarts strips in OpenGL ES 3.0."""
LARGEST_POSITION = 2**24
"""float32 holds every whole number up to here."""
_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942
_FLOAT, _SHORT = 5126, 5123
_VERTICES, _INDICES = 34962, 34963
_DRACO = "KHR_draco_mesh_compression"
_LARGEST_JSON = 2**20
_DRACO_BITS = 24
# Draco 2.2, a triangle mesh by edgebreaker, no metadata: what `encode_draco` writes.
_DRACO_START = b"DRACO\x02\x02\x01\x01\x00\x00"
# A closed surface has about two triangles per vertex; one full of holes has up to four.
_MOST_TRIANGLES = 8 * MOST_VERTICES


@dataclass(frozen=True)
class Primitive:
    """A primitive of a mesh, drawn by one call."""

    positions_xyz: Float32Array
    """Vertex positions [n, 3]: integers, in units of the mesh."""
    triangles: NDArray[np.uint16]
    """Vertices of each triangle, [m, 3]."""


@dataclass(frozen=True)
class GlbMesh:
    """The mesh of a file."""

    primitives: tuple[Primitive, ...]
    """Its primitives."""
    scale_mm_xyz: tuple[float, float, float]
    """Millimetres per unit of position along each axis."""
    draco: bool
    """Whether it is compressed."""


def primitives_of(
    positions_xyz: NDArray[np.int32], triangles: NDArray[np.int32], most_vertices: int = MOST_VERTICES
) -> tuple[Primitive, ...]:
    """Split a mesh into primitives of at most `most_vertices`, triangles in order. Raises VP9001 beyond 2^24."""
    if np.abs(positions_xyz, dtype=np.int64).max(initial=0) > LARGEST_POSITION:
        raise VolprepError("VP9001", error="positions of a mesh are larger than float32 holds exactly")
    return tuple(_split(positions_xyz, triangles, most_vertices))


def write_glb(
    primitives: tuple[Primitive, ...],
    scale_mm_xyz: tuple[float, float, float],
    extras: Mapping[str, str],
    *,
    draco: bool = False,
) -> bytes:
    """Return the bytes of a file; at least one primitive. `extras` are strings about the whole, such as its axes."""
    writer = _Writer(draco=draco)
    for primitive in primitives:
        writer.add(primitive)
    return writer.file(scale_mm_xyz, extras)


def read_glb(data: bytes, name: str) -> GlbMesh:
    """Read a file of the form that `write_glb` writes. Raises VP4039 for anything else, before it allocates."""
    text, binary = _chunks(data, name)
    try:
        gltf = _Gltf.model_validate_json(text)
    except ValidationError as error:
        _fail(name, problems(error))
    primitives = tuple(_read(gltf, primitive, binary, name) for primitive in gltf.meshes[0].primitives)
    return GlbMesh(primitives, gltf.nodes[0].scale, bool(gltf.extensions_required))


def _split(positions: NDArray[np.int32], triangles: NDArray[np.int32], most_vertices: int) -> Iterator[Primitive]:
    while len(triangles):
        # Indices address at most `most_vertices` vertices, so a primitive ends before the triangle that would need
        # one more.
        _, first = np.unique(triangles, return_index=True)
        first.sort()
        stop = len(triangles) if len(first) <= most_vertices else int(first[most_vertices]) // 3
        used, local = np.unique(triangles[:stop], return_inverse=True)
        yield Primitive(np.ascontiguousarray(positions[used], np.float32), local.reshape(-1, 3).astype(np.uint16))
        triangles = triangles[stop:]


class _Writer:
    def __init__(self, *, draco: bool) -> None:
        self._draco = draco
        self._binary = bytearray()
        self._views: list[dict[str, int]] = []
        self._accessors: list[dict[str, object]] = []
        self._primitives: list[dict[str, object]] = []

    def add(self, primitive: Primitive) -> None:
        """Add a primitive with its accessors and views."""
        packed = encode_draco(primitive) if self._draco else None
        # The decoder may return the vertices in another order.
        shown = primitive if packed is None else decode_draco(packed, "mesh")
        extension: dict[str, object] = {}
        if packed is not None:
            view = {"bufferView": self._view(packed), "attributes": {"POSITION": 0}}
            extension = {"extensions": {_DRACO: view}}
        self._primitives.append(
            {"attributes": {"POSITION": len(self._accessors)}, "indices": len(self._accessors) + 1, "mode": 4}
            | extension
        )
        positions, indices = shown.positions_xyz, shown.triangles
        bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
        vertices = {"componentType": _FLOAT, "count": len(positions), "type": "VEC3"} | bounds
        corners = {"componentType": _SHORT, "count": indices.size, "type": "SCALAR"}
        if packed is None:
            vertices["bufferView"] = self._view(positions.tobytes(), _VERTICES)
            corners["bufferView"] = self._view(indices.tobytes(), _INDICES)
        self._accessors += [vertices, corners]

    def file(self, scale_mm_xyz: tuple[float, float, float], extras: Mapping[str, str]) -> bytes:
        """Assemble header, JSON and binary."""
        used = {"extensionsUsed": [_DRACO], "extensionsRequired": [_DRACO]} if self._draco else {}
        gltf = {
            "asset": {"version": "2.0", "generator": "volprep", "extras": dict(extras)},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "scale": list(scale_mm_xyz)}],
            "meshes": [{"primitives": self._primitives}],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._binary)}],
        } | used
        text = json.dumps(gltf, allow_nan=False, separators=(",", ":"), sort_keys=True).encode("ascii")
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), _JSON) + text
        chunks += struct.pack("<II", len(self._binary), _BIN) + bytes(self._binary)
        return struct.pack("<III", _MAGIC, 2, 12 + len(chunks)) + chunks

    def _view(self, data: bytes, target: int | None = None) -> int:
        view = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(data)}
        self._views.append(view if target is None else view | {"target": target})
        self._binary += data + bytes(-len(data) % 4)
        return len(self._views) - 1


def encode_draco(primitive: Primitive) -> bytes:
    """Compress a primitive; its integers are preserved exactly."""
    import DracoPy  # noqa: PLC0415 - few need it

    # A range of 2^bits - 1 makes each whole number a step of its own.
    return bytes(
        DracoPy.encode(
            primitive.positions_xyz,
            primitive.triangles.astype(np.uint32),
            quantization_bits=_DRACO_BITS,
            compression_level=7,
            quantization_range=2**_DRACO_BITS - 1,
            quantization_origin=[0.0, 0.0, 0.0],
        )
    )


def decode_draco(data: bytes, name: str) -> Primitive:
    """Decompress a primitive. Raises VP4039 for invalid data."""
    import DracoPy  # noqa: PLC0415 - few need it

    _check_draco_start(data, name)
    try:
        mesh = DracoPy.decode(data)
        faces = np.asarray(mesh.faces).reshape(-1, 3)
        positions = np.asarray(mesh.points, np.float32).reshape(-1, 3)
    except (AttributeError, TypeError, ValueError, RuntimeError, DracoPy.FileTypeException) as error:
        _fail(name, f"Draco: {error}")
    if faces.max(initial=0) >= MOST_VERTICES or not faces.size:
        _fail(name, "Draco: indices are missing or need more than 16 bits")
    return Primitive(np.rint(positions), faces.astype(np.uint16))


def _check_draco_start(data: bytes, name: str) -> None:
    """Check kind and sizes before Draco does: a few bytes that declare 2^28 triangles keep it busy for minutes."""
    if not data.startswith(_DRACO_START):
        _fail(name, "Draco: it is not a triangle mesh of version 2.2 by edgebreaker")
    at = len(_DRACO_START) + 1  # how triangles follow each other
    vertices, at = _varint(data, at)
    triangles, _ = _varint(data, at)
    if vertices > MOST_VERTICES or triangles > _MOST_TRIANGLES:
        _fail(name, f"Draco: it says {vertices} vertices and {triangles} triangles, more than a primitive has")


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Return the number at `at`, seven bits per byte, and the position after it."""
    number = 0
    for shift, byte in enumerate(data[at : at + 5]):
        number |= (byte & 127) << 7 * shift
        if byte < 128:
            return number, at + shift + 1
    return 2**32, at  # it does not end


Index = Annotated[int, Field(ge=0, lt=2**16)]
Size = Annotated[int, Field(ge=0, lt=2**31)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class _Part(Record):
    """A chunk of the file. Only chunks that `write_glb` writes are accepted."""

    model_config = ConfigDict(alias_generator=to_camel)


class _Asset(_Part):
    version: Literal["2.0"]
    generator: str
    extras: dict[str, str]


class _Scene(_Part):
    nodes: tuple[Literal[0]]


class _Node(_Part):
    mesh: Literal[0]
    scale: tuple[Number, Number, Number]


class _Attributes(_Part):
    position: Annotated[Index, Field(alias="POSITION")]


class _Compressed(_Part):
    buffer_view: Index
    attributes: _Attributes


class _Extensions(_Part):
    draco: Annotated[_Compressed, Field(alias=_DRACO)]


class _Primitive(_Part):
    attributes: _Attributes
    indices: Index
    mode: Literal[4]
    extensions: _Extensions | None = None


class _Mesh(_Part):
    primitives: Annotated[tuple[_Primitive, ...], Field(min_length=1)]


class _Accessor(_Part):
    component_type: Literal[5126, 5123]
    count: Annotated[int, Field(ge=1, lt=2**31)]
    type: Literal["VEC3", "SCALAR"]
    buffer_view: Index | None = None
    min: tuple[Number, Number, Number] | None = None
    max: tuple[Number, Number, Number] | None = None


class _View(_Part):
    buffer: Literal[0]
    byte_offset: Size
    byte_length: Size
    target: Literal[34962, 34963] | None = None


class _Buffer(_Part):
    byte_length: Size


class _Gltf(_Part):
    asset: _Asset
    scene: Literal[0]
    scenes: tuple[_Scene]
    nodes: tuple[_Node]
    meshes: tuple[_Mesh]
    accessors: tuple[_Accessor, ...]
    buffer_views: tuple[_View, ...]
    buffers: tuple[_Buffer]
    extensions_used: tuple[Literal["KHR_draco_mesh_compression"], ...] = ()
    extensions_required: tuple[Literal["KHR_draco_mesh_compression"], ...] = ()


def _chunks(data: bytes, name: str) -> tuple[bytes, memoryview]:
    if len(data) < 28 or struct.unpack_from("<III", data) != (_MAGIC, 2, len(data)):
        _fail(name, "it does not begin as a glTF 2.0 binary of its size")
    length, kind = struct.unpack_from("<II", data, 12)
    if kind != _JSON or length % 4 or length > min(len(data) - 28, _LARGEST_JSON):
        _fail(name, "its JSON is missing, too long or out of place")
    size, second = struct.unpack_from("<II", data, 20 + length)
    if second != _BIN or size != len(data) - 28 - length:
        _fail(name, "its binary part has another size")
    return data[20 : 20 + length], memoryview(data)[28 + length :]


def _read(gltf: _Gltf, primitive: _Primitive, binary: memoryview, name: str) -> Primitive:
    if gltf.buffers[0].byte_length != len(binary):
        _fail(name, "its buffer has another size")
    vertices = _at(gltf.accessors, primitive.attributes.position, name)
    corners = _at(gltf.accessors, primitive.indices, name)
    kinds = (vertices.component_type, vertices.type, corners.component_type, corners.type)
    if kinds != (_FLOAT, "VEC3", _SHORT, "SCALAR") or corners.count % 3 or vertices.count > MOST_VERTICES:
        _fail(name, "positions are not float32, or indices not three of 16 bits for each triangle")
    if primitive.extensions is None:
        positions = np.frombuffer(_bytes(gltf, vertices.buffer_view, binary, 12 * vertices.count, name), "<f4")
        indices = np.frombuffer(_bytes(gltf, corners.buffer_view, binary, 2 * corners.count, name), "<u2")
        found = Primitive(positions.reshape(-1, 3), indices.reshape(-1, 3))
    else:
        packed = _bytes(gltf, primitive.extensions.draco.buffer_view, binary, None, name)
        found = decode_draco(bytes(packed), name)
    if (len(found.positions_xyz), found.triangles.size) != (vertices.count, corners.count):
        _fail(name, "the decompressed data have another size")
    if found.triangles.max() >= vertices.count or not np.isfinite(found.positions_xyz).all():
        _fail(name, "a triangle has no vertex, or a vertex no position")
    bounds = (tuple(found.positions_xyz.min(axis=0).tolist()), tuple(found.positions_xyz.max(axis=0).tolist()))
    if bounds != (vertices.min, vertices.max):
        _fail(name, "positions are not within their bounds")
    return found


def _bytes(gltf: _Gltf, view: int | None, binary: memoryview, size: int | None, name: str) -> memoryview:
    record = _at(gltf.buffer_views, -1 if view is None else view, name)
    begin, length = record.byte_offset, record.byte_length
    if begin % 4 or begin + length > len(binary) or size not in {None, length}:
        _fail(name, "a part of its buffer lies outside, or has another size")
    return binary[begin : begin + length]


def _at(parts: tuple[Any, ...], index: int, name: str) -> Any:
    if not 0 <= index < len(parts):
        _fail(name, f"it has no part {index}")
    return parts[index]


def _fail(name: str, problem: object) -> NoReturn:
    raise VolprepError("VP4039", name=name, problem=problem)
