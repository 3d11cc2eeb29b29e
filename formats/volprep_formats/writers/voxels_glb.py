"""Voxels as glTF 2.1 binary with the draft extension EXT_voxels: one node, an attribute for each channel.

Sources: glTF 2.1 draft (shapes, boundingVolume); EXT_voxels (CesiumGS/glTF pull request 123, README of the draft): the
columns of a box run from +x to -x, its rows from -z to +z, its slices from -y to +y. Both may still change. A reader of
glTF 2.0 shows an empty node.
"""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import generator
from volprep_formats.output import new_file
from volprep_formats.package.look import VolumeLooks, extras_of
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource
from volprep_formats.writers.surface_glb import METRES_FROM_LPS, glb_head
from volprep_formats.writers.values import PhysicalValues

EXTENSION = "EXT_voxels"
_FLOAT = 5126
_MOST_BYTES = 2**32 - 2**20
_BOX_FROM_NODE = np.array([[-1, 0, 0], [0, 0, 1], [0, 1, 0]])
"""Axes x, y, z of our box as axes of the node: right, forward and up of the draft."""
_DRAFT = "glTF 2.1 and EXT_voxels as drafted in August 2026; both may change"


def write(
    sources: Sequence[VolumeSource], names: Sequence[str], looks: VolumeLooks, path: Path, progress: Progress
) -> None:
    """Write the physical values of channels on one grid as float32. Raises VP1255 (too large) and VP4020."""
    channels = [PhysicalValues(source) for source in sources]
    size = 4 * int(np.prod(channels[0].info.grid.shape_zyx))
    if len(channels) * size > _MOST_BYTES:
        raise VolprepError("VP1255", path=path, needed=len(channels) * size, most=_MOST_BYTES)
    depth = channels[0].info.grid.shape_zyx[0]
    progress.start("writing voxels", depth * len(channels))
    with new_file(path) as file:
        file.write(glb_head(_gltf([channel.info for channel in channels], names, size, looks), size * len(channels)))
        for channel in channels:
            for z in range(depth):
                file.write(np.ascontiguousarray(channel.read_slab(z, z + 1), dtype="<f4").tobytes())
                progress.advance()


def _gltf(infos: Sequence[SourceInfo], names: Sequence[str], size: int, looks: VolumeLooks) -> dict[str, object]:
    grid = infos[0].grid
    attributes = {f"_{re.sub('[^A-Z0-9]', '_', name.upper())}": index for index, name in enumerate(names)}
    # A box of glTF has its middle at 0.
    extent_xyz = np.array(grid.spacing_mm_zyx[::-1]) * grid.shape_zyx[::-1]
    placed = grid.world_from_box @ np.block([[_BOX_FROM_NODE, extent_xyz[:, None] / 2], [np.zeros((1, 3)), 1.0]])
    told = {"draft": _DRAFT, "units": [info.unit for info in infos], "channels": [*names]}
    voxels = {
        "name": "voxels",
        "matrix": placed.T.ravel().tolist(),
        "boundingVolume": {"shape": 0},
        "extensions": {EXTENSION: {"dimensions": [*grid.shape_zyx[::-1]], "attributes": attributes}},
        "extras": {"volprep": told, **extras_of(looks)},
    }
    views = [{"buffer": 0, "byteOffset": size * index, "byteLength": size} for index in range(len(names))]
    count = int(np.prod(grid.shape_zyx))
    accessor = {"componentType": _FLOAT, "count": count, "type": "SCALAR"}
    return {
        "asset": {"version": "2.1", "generator": generator()},
        "extensionsUsed": [EXTENSION],
        "extensionsRequired": [EXTENSION],
        "scene": 0,
        "scenes": [{"nodes": [1]}],
        "nodes": [voxels, {"name": "patient", "matrix": METRES_FROM_LPS, "children": [0]}],
        "shapes": [{"type": "box", "box": {"size": extent_xyz[[0, 2, 1]].tolist()}}],
        "accessors": [{"bufferView": index, **accessor} for index in range(len(names))],
        "bufferViews": views,
        "buffers": [{"byteLength": size * len(names)}],
    }
