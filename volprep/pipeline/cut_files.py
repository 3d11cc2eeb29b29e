"""The files of a cut: the box as a texture, where it lies, and a picture of the coarsest level with its mark."""

import json
from pathlib import Path

import numpy as np

from volprep.render.cut import Cut, CutRecord, cut
from volprep.truth.decoded import level_volume
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.output import output_errors, require_place, taken, write_file
from volprep_formats.package.reader import Package
from volprep_formats.png import png_bytes
from volprep_formats.textures import ktx2

_FORMATS: dict[str, ktx2.Ktx2Format] = {"uint8": "r8unorm", "uint16": "r16unorm", "float16": "r16float"}
_MARK = (255, 96, 32)
_GAP = 2
"""Pixels between the three sections."""
_LONGEST = 384
"""Pixels of the longest side of a section, at least half of it."""


def write_cut(
    package: Package,
    center_xyz: tuple[float, float, float],
    size: int,
    folder: Path,
    *,
    world: bool = False,
    force: bool = False,
) -> CutRecord:
    """Cut a box and write cut.ktx2, cut.png and cut.json, in this order, into `folder`.

    `center_xyz` is a voxel of level 0, or with `world` a place in the patient in millimetres. Raises the errors of
    `cut`, VP1251 or VP1254 where a name is taken and `force` is not given, VP4020 where nothing can be written.
    """
    names = [folder / name for name in ("cut.ktx2", "cut.png", "cut.json")]
    for path in names:
        if path.exists() and not force:
            raise taken(path)
    with output_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for path in names:
        require_place(path)
    grid = package.manifest.grid
    if world and grid is not None:
        x, y, z, _ = np.linalg.inv(grid.world_from_index) @ [*center_xyz, 1.0]
        center_xyz = x, y, z
    found = cut(package, center_xyz, size)
    image = ktx2.Ktx2Image(_FORMATS[found.texels.dtype.name], found.record.grid.shape_zyx, found.texels, 3)
    text = json.dumps(found.record.model_dump(mode="json"), indent=2, sort_keys=True)
    texture, picture, record = names
    write_file(texture, b"".join(ktx2.encode(image)))
    write_file(picture, png_bytes(marked_sections(package, found)))
    write_file(record, (text + "\n").encode())
    return found.record


def marked_sections(package: Package, found: Cut) -> UInt8Array:
    """Sections through the middle of the box, in the coarsest level, with the box drawn in: across z, y and x."""
    coarsest = max(package.manifest.levels, key=lambda level: level.index)
    mark = max(found.record.marks, key=lambda mark: mark.level)
    codes = level_volume(package, coarsest.index).stored
    grey_per_code = 255 / max(float(codes.max()), 1e-9)
    low, high = (np.array(corner[::-1]) * codes.shape for corner in (mark.low_str, mark.high_str))
    middle = np.clip((low + high) / 2, 0, np.array(codes.shape) - 1).astype(int)
    sections = []
    for axis in range(3):
        rows, columns = (value for value in range(3) if value != axis)
        # Only the sections become grey: the level may be as large as a device can hold.
        section = np.rint(np.take(codes, middle[axis], axis).astype(np.float64) * grey_per_code).astype(np.uint8)
        spacing = np.array(coarsest.grid.spacing_mm_zyx)[[rows, columns]]
        picture = _framed(section, spacing, low[[rows, columns]], high[[rows, columns]])
        # People expect the head above: rows along an axis that leads there run from the bottom up.
        sections.append(picture[::-1] if rows == 0 and coarsest.grid.direction[2][2] > 0.0 else picture)
    height = max(len(section) for section in sections)
    padded = [np.pad(section, ((0, height - len(section)), (0, _GAP), (0, 0))) for section in sections]
    return np.concatenate(padded, axis=1)[:, :-_GAP]


def _framed(section: UInt8Array, spacing_mm: Float64Array, low: Float64Array, high: Float64Array) -> UInt8Array:
    """Draw a section with square pixels, and the frame from `low` to `high`, in voxels."""
    size_mm = np.array(section.shape) * spacing_mm
    pixels_per_voxel = np.maximum(np.rint(spacing_mm * (_LONGEST / size_mm.max())), 1).astype(int)
    large = np.repeat(np.repeat(section, pixels_per_voxel[0], axis=0), pixels_per_voxel[1], axis=1)
    picture = np.repeat(large[..., None], 3, axis=2)
    top, left = np.clip(np.rint(low * pixels_per_voxel).astype(int), 0, np.array(large.shape) - 1)
    bottom, right = np.clip(np.rint(high * pixels_per_voxel).astype(int) - 1, 0, np.array(large.shape) - 1)
    picture[[top, bottom], left : right + 1] = _MARK
    picture[top : bottom + 1, [left, right]] = _MARK
    return picture
