"""Small sound files of the formats whose header is text: NRRD, MetaImage and VTK."""

import zlib
from collections.abc import Callable
from pathlib import Path

import nrrd
import numpy as np
from numpy.typing import NDArray

Make = Callable[[Path], bytes]


def nrrd_file(values_zyx: NDArray[np.int16], encoding: str) -> Make:
    """Oblique, in the space RAS."""

    def make(folder: Path) -> bytes:
        told = {
            "space": "right-anterior-superior",
            "space directions": [[0, -2.0, 0], [1.5, 0, 0], [0, 0, 3]],
            "space origin": [5, 6, 7],
            "kinds": ["domain"] * 3,
            "encoding": encoding,
        }
        file = folder / "sound.nrrd"
        nrrd.write(str(file), values_zyx, told, index_order="C")
        return file.read_bytes()

    return make


def metaimage_file(values_zyx: NDArray[np.int16], *, packed: bool) -> Make:
    """By hand, as ITK writes it."""

    def make(_folder: Path) -> bytes:
        data = zlib.compress(values_zyx.tobytes()) if packed else values_zyx.tobytes()
        size = f"CompressedDataSize = {len(data)}\n" if packed else ""
        nz, ny, nx = values_zyx.shape
        head = (
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
            f"CompressedData = {packed}\n{size}"
            "TransformMatrix = 0 -1 0 1 0 0 0 0 1\nOffset = 5 6 7\n"
            f"CenterOfRotation = 0 0 0\nElementSpacing = 2 1.5 3\nDimSize = {nx} {ny} {nz}\nElementType = MET_SHORT\n"
            "ElementDataFile = LOCAL\n"
        )
        return head.encode() + data

    return make


def vtk_file(values_zyx: NDArray[np.int16], suffix: str, form: str) -> Make:
    """By VTK: .vti as "text", "inline", "inline zlib", "appended zlib" or "base64", .vtk as "text" or "binary"."""

    def make(folder: Path) -> bytes:
        import pyvista
        from vtkmodules.vtkIOLegacy import vtkStructuredPointsWriter
        from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

        grid = pyvista.ImageData(dimensions=values_zyx.shape[::-1], spacing=(2, 1.5, 3), origin=(5, 6, 7))
        grid.point_data["v"] = values_zyx.ravel()
        grid.point_data.active_scalars_name = "v"
        writer = vtkXMLImageDataWriter() if suffix == ".vti" else vtkStructuredPointsWriter()
        if suffix == ".vtk":
            writer.SetFileType(1 if form == "text" else 2)
        else:
            modes = {"text": writer.Ascii, "appended": writer.Appended, "base64": writer.Appended}
            writer.SetDataMode(modes.get(form.split(maxsplit=1)[0], writer.Binary))
            writer.SetEncodeAppendedData(form == "base64")
            writer.SetCompressorType(writer.ZLIB if form.endswith("zlib") else writer.NONE)
        writer.SetInputData(grid)
        writer.SetFileName(str(folder / f"sound{suffix}"))
        assert writer.Write() == 1
        data = (folder / f"sound{suffix}").read_bytes()
        # What comes after the voxels is not read, so a file that is cut there is whole.
        place = data.find(b"\n  </AppendedData>" if suffix == ".vti" else b"METADATA")
        return data[:place] if place >= 0 else data

    return make
