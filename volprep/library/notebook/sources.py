"""Objects of other libraries as files that volprep reads."""

import sys
from os import PathLike
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST


class VtkImage(Protocol):
    """A `pyvista.ImageData`."""

    dimensions: tuple[int, int, int]
    spacing: tuple[float, float, float]
    origin: tuple[float, float, float]

    def save(self, filename: str) -> None:
        """Write it to a file."""


class ItkImage(Protocol):
    """A `SimpleITK.Image`."""

    def GetSpacing(self) -> tuple[float, ...]:  # noqa: N802 - the library's name
        """Return the spacing, x first."""

    def GetDirection(self) -> tuple[float, ...]:  # noqa: N802 - the library's name
        """Return the matrix of directions by rows."""


Volume = str | PathLike[str] | NDArray[np.generic] | Package | VtkImage | ItkImage
"""Types that `show` takes."""


def package_path(volume: object) -> Path | None:
    """Return the path of an existing package; None for anything else."""
    if isinstance(volume, Package):
        return volume.path
    if not isinstance(volume, str | PathLike):
        return None
    path = Path(volume)
    return path if path.name.endswith(".volpkg.zip") or (path / MANIFEST).is_file() else None


def scan_file(volume: object, folder: Path) -> str | PathLike[str] | NDArray[np.generic]:
    """Return a path or an array as it is; write an image of pyvista or SimpleITK to a file in `folder`.

    The file keeps spacing, origin and direction. Raises VP7092 for any other object.
    """
    if isinstance(volume, str | PathLike | np.ndarray):
        return volume
    # An object of an optional library proves that the library is loaded.
    pyvista, itk = sys.modules.get("pyvista"), sys.modules.get("SimpleITK")
    if pyvista is not None and isinstance(volume, pyvista.ImageData):
        return _vtk_file(pyvista, volume, folder / "volume.vti")
    if itk is not None and isinstance(volume, itk.Image):
        path = folder / "volume.mha"
        itk.WriteImage(volume, str(path))
        return path
    raise VolprepError("VP7092", what=type(volume).__name__, reason="this type is unknown")


def _vtk_file(pyvista: Any, image: Any, path: Path) -> Path:
    """Write the active scalars of an image alone: files with several arrays are ambiguous."""
    values = image.active_scalars
    if values is None or values.size != len(values):
        reason = "it has no active scalars" if values is None else "its scalars have several components"
        raise VolprepError("VP7092", what="the ImageData", reason=reason)
    shape, origin = np.array(image.dimensions), np.array(image.origin)
    direction = np.array(image.direction_matrix)
    if len(values) != image.n_points:
        # Values of cells belong to their middles.
        shape = shape - 1
        origin = origin + direction @ (np.array(image.spacing) / 2)
    plain = pyvista.ImageData(dimensions=shape, spacing=image.spacing, origin=origin, direction_matrix=direction)
    plain.point_data["values"] = np.asarray(values).astype(np.uint8) if values.dtype == bool else values
    plain.save(path)
    return path
