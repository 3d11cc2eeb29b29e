"""Small sound files whose voxels have colours, and how they are read."""

import io
from collections.abc import Callable
from pathlib import Path

import imagecodecs
import nrrd
import numpy as np
from dicom_files import compressed, image, save
from numpy.typing import NDArray
from pydicom.uid import ExplicitVRLittleEndian, JPEGBaseline8Bit

from volprep_formats.source import ColourChannel

Make = Callable[[Path], bytes]
WANTED = ColourChannel(part="green", opacity_of="luminance", shares=((0.0, 0.0), (1.0, 1.0)))
"""The channel that is read."""


def colours(shape: tuple[int, ...] = (3, 5, 4)) -> NDArray[np.uint8]:
    """Voxels [z, y, x, RGB]."""
    return np.random.default_rng(5).integers(0, 256, (*shape, 3)).astype(np.uint8)


def npy_in_colour(_folder: Path) -> bytes:
    """An array of four axes."""
    file = io.BytesIO()
    np.save(file, colours())
    return file.getvalue()


def nrrd_in_colour(folder: Path) -> bytes:
    """With RGB as the fastest axis."""
    kinds = ["RGB-color", "domain", "domain", "domain"]
    nrrd.write(str(folder / "sound.nrrd"), colours(), {"kinds": kinds, "encoding": "raw"}, index_order="C")
    return (folder / "sound.nrrd").read_bytes()


def vti_in_colour(folder: Path) -> bytes:
    """By VTK, with facts about the array after its numbers."""
    import pyvista

    grid = pyvista.ImageData(dimensions=(4, 5, 3))
    grid.point_data["v"] = colours().reshape(-1, 3)
    grid.point_data.active_scalars_name = "v"
    grid.save(folder / "sound.vti", binary=False)
    return (folder / "sound.vti").read_bytes()


def dicom_in_colour(syntax: str) -> Make:
    """One slice: RGB as it is, or YBR_FULL_422 as JPEG."""

    def make(folder: Path) -> bytes:
        picture = colours((40, 36))
        told = {"SamplesPerPixel": 3, "PlanarConfiguration": 0, "SliceThickness": "1"}
        is_ybr = syntax == JPEGBaseline8Bit
        told["PhotometricInterpretation"] = "YBR_FULL_422" if is_ybr else "RGB"
        data = image(picture[..., 0], **told)
        data.PixelData = picture.tobytes()
        if is_ybr:
            data = compressed(data, syntax, bytes(imagecodecs.jpeg8_encode(picture, level=90, subsampling="422")))
        return save(data, folder / "sound", syntax).read_bytes()

    return make


DICOM = {"plain": ExplicitVRLittleEndian, "JPEG": JPEGBaseline8Bit}
"""Transfer syntaxes of the DICOM subjects."""
