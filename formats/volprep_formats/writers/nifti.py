"""NIfTI (.nii, .nii.gz), from LPS to RAS. Source: nifti1.h and nifti2.h, "3D image orientation and location".

NIfTI-1 keeps positions and the slope in 32 bits. Where that moves a voxel by more than a millionth of a millimetre,
or changes the slope, the file is NIfTI-2, which keeps 64.
"""

import struct
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any, BinaryIO
from xml.sax.saxutils import escape

import nibabel
import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.output import new_file
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource
from volprep_formats.writers.colours import StraightColours
from volprep_formats.writers.label_image import LabelImage, WrittenLabel
from volprep_formats.writers.voxels import write_voxels, zipped

_RAS_FROM_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
_LONGEST_AXIS_OF_VERSION_1 = 32767
_MOST_MOVED_MM = 1e-6
_SCANNER = 1
_INTENT_LABEL = 1002
_CARET = 0
"""Code of the extension, as TotalSegmentator writes it: nibabel gives the bytes of no other code that fits."""
_RGB = np.dtype([("R", "u1"), ("G", "u1"), ("B", "u1")])


def write(source: VolumeSource, path: Path, progress: Progress) -> None:
    """Write the stored values of `source`, with its slope and intercept. Raises VP4020."""
    _write(_header(source.info), b"", lambda file: write_voxels(source, file, progress), path)


def write_colours(colours: StraightColours, path: Path, progress: Progress) -> None:
    """Write the sRGB colours of a volume as RGB24, without their opacity. Raises VP4020."""
    depth = colours.info.grid.shape_zyx[0]
    progress.start("writing colours", depth)

    def voxels(file: BinaryIO) -> None:
        for z in range(depth):
            file.write(np.ascontiguousarray(colours.read_slab(z, z + 1)[..., :3]).tobytes())
            progress.advance()

    _write(_header(colours.info, _RGB), b"", voxels, path)


def write_labels(image: LabelImage, source: VolumeSource, path: Path, progress: Progress) -> None:
    """Write labels with the intent "label", and the table of names and colours of Caret. Raises VP4020."""
    header = _header(source.info)
    header["intent_code"] = _INTENT_LABEL
    _write(header, caret_table(image.entries), lambda file: write_voxels(source, file, progress), path)


def caret_table(entries: Sequence[WrittenLabel]) -> bytes:
    """Return the XML of Caret that names labels and gives their colours (GIFTI 1.0, LabelTable)."""
    labels = []
    for entry in entries:
        parts = zip(("Red", "Green", "Blue", "Alpha"), entry.rgba, strict=True)
        colour = " ".join(f'{name}="{part / 255:.6g}"' for name, part in parts)
        labels.append(f'<Label Key="{entry.value}" {colour}>{escape(entry.name or str(entry.value))}</Label>')
    table = "\n".join(["<LabelTable>", *labels, "</LabelTable>"])
    text = f'<CaretExtension><VolumeInformation Index="0">{table}</VolumeInformation></CaretExtension>'
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _write(header: Any, extension: bytes, write_all: Callable[[BinaryIO], None], path: Path) -> None:
    """Write a header, an extension of Caret unless it is empty, and what `write_all` writes."""
    block = bytes(4)
    if extension:
        length = -(-(8 + len(extension)) // 16) * 16
        block = b"\1\0\0\0" + struct.pack("<ii", length, _CARET) + extension.ljust(length - 8, b"\0")
    header["vox_offset"] = header.sizeof_hdr + len(block)
    with new_file(path) as file, zipped(file) if path.suffix == ".gz" else nullcontext(file) as stream:
        stream.write(header.binaryblock + block)
        write_all(stream)


def _header(info: SourceInfo, stored: np.dtype[Any] | None = None) -> Any:
    affine = _RAS_FROM_LPS @ info.grid.world_from_index
    kind: Any = nibabel.Nifti1Header if _fits_version_1(info, affine) else nibabel.Nifti2Header
    header = kind(endianness="<")
    header.set_data_dtype(stored or np.dtype(info.stored_type))
    header.set_data_shape(info.grid.shape_zyx[::-1])
    header["pixdim"][1:4] = info.grid.spacing_mm_zyx[::-1]
    header.set_qform(affine, code=_SCANNER)
    header.set_sform(affine, code=_SCANNER)
    header.set_xyzt_units("mm")
    header["scl_slope"], header["scl_inter"] = info.slope, info.intercept
    return header


def _fits_version_1(info: SourceInfo, affine: Float64Array) -> bool:
    sizes = np.array(info.grid.shape_zyx[::-1])
    numbers = np.array([info.slope, info.intercept])
    if sizes.max() > _LONGEST_AXIS_OF_VERSION_1 or not np.array_equal(numbers.astype(np.float32), numbers):
        return False
    moved = np.abs(affine.astype(np.float32) - affine)[:3] @ [*(sizes - 1), 1]
    return bool(moved.max() <= _MOST_MOVED_MM)
