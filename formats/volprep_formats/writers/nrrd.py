"""NRRD (.nrrd): attached header, gzip, space left-posterior-superior.

Source: "Definition of NRRD File Format" (http://teem.sourceforge.net/nrrd/format.html). Floats are written with all
their digits, so that positions come back bit by bit.
"""

from pathlib import Path

import numpy as np

from volprep_formats.grid import Grid
from volprep_formats.output import new_file
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource
from volprep_formats.writers.values import PhysicalValues
from volprep_formats.writers.voxels import write_voxels, zipped

_TYPES = {"uint8": "uint8", "int16": "int16", "uint16": "uint16", "float32": "float"}


def write(source: VolumeSource, path: Path, progress: Progress) -> None:
    """Write the physical values of `source`: the format has no slope. Raises VP4020."""
    values = PhysicalValues(source)
    with new_file(path) as file:
        file.write(_header(values.info))
        with zipped(file) as stream:
            write_voxels(values, stream, progress)


def _header(info: SourceInfo) -> bytes:
    nz, ny, nx = info.grid.shape_zyx
    lines = [
        "NRRD0004",
        f"type: {_TYPES[info.stored_type]}",
        "dimension: 3",
        "space: left-posterior-superior",
        f"sizes: {nx} {ny} {nz}",
        *space_lines(info.grid),
        "kinds: domain domain domain",
        "endian: little",
        "encoding: gzip",
    ]
    return ("\n".join(lines) + "\n\n").encode("ascii")


def space_lines(grid: Grid, before: str = "") -> list[str]:
    """Return the fields that place the voxels; `before` has the axes before x."""
    matrix = grid.world_from_index
    directions = " ".join(_vector(matrix[:3, axis]) for axis in range(3))
    return [f"space directions: {before}{directions}", f"space origin: {_vector(matrix[:3, 3])}"]


def _vector(numbers: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return "(" + ",".join(repr(float(number)) for number in numbers) + ")"
