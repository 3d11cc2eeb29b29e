"""A package as a stranger reads it: its manifest, and plain textures, without any of the product's readers."""

import json
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, affine

Json = Mapping[str, Any]

_TEXELS = {9: ("u1", 1), 16: ("u1", 2), 23: ("u1", 3), 37: ("u1", 4), 70: ("u2", 1), 76: ("f2", 1), 97: ("f2", 4)}
"""Type and number of the components of a texel by the number of its Vulkan format."""
_IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"


def read_file(package: Path, name: str) -> bytes:
    """Return a file of a package, which is a folder or a zip."""
    if package.is_dir():
        return (package / name).read_bytes()
    with zipfile.ZipFile(package) as archive:
        inside = next(word for word in archive.namelist() if word == name or word.endswith(f"/{name}"))
        return archive.read(inside)


def read_manifest(package: Path) -> Json:
    """Return the manifest."""
    found: Json = json.loads(read_file(package, "manifest.json"))
    return found


def read_texture(package: Path, name: str) -> NDArray[Any]:
    """Return the texels [z, y, x, component] of the finest level of a KTX 2 file that is not compressed."""
    data = read_file(package, name)
    kind, _, width, height, depth, _, _, _, scheme = struct.unpack_from("<9I", data, 12)
    if data[:12] != _IDENTIFIER or kind not in _TEXELS or scheme != 0:
        raise CannotWitnessError(f"{name} is compressed, or of another format")
    (at,) = struct.unpack_from("<Q", data, 80)
    dtype, components = _TEXELS[kind]
    shape = (max(depth, 1), max(height, 1), width, components)
    return np.frombuffer(data, dtype, count=int(np.prod(shape)), offset=at).reshape(shape)


def world_from_index(grid: Json) -> Floats:
    """Return the 4×4 matrix of a grid record: (x, y, z, 1) in voxels to millimetres in the patient's space."""
    steps = np.array(grid["direction"], dtype=np.float64) * np.array(grid["spacing_mm_zyx"][::-1])
    return affine(steps, np.array(grid["origin_mm_xyz"], dtype=np.float64))


def corner_and_size(grid: Json) -> tuple[Floats, Floats]:
    """Return the corner of the box of a grid record, half a voxel before the first centre, and its extent (x, y, z)."""
    matrix = world_from_index(grid)
    return matrix[:3, 3] - matrix[:3, :3] @ np.full(3, 0.5), np.array(grid["extent_mm_zyx"][::-1], dtype=np.float64)
