"""MINC files: NetCDF for version 1, HDF5 for version 2."""

from pathlib import Path

import h5py
import numpy as np
from scipy.io import netcdf_file

STEPS_ZYX = (3.0, -1.5, 2.0)
STARTS_ZYX = (7.0, 6.0, 5.0)
NAMES = ("zspace", "yspace", "xspace")


def _axis(name: str, odd: dict[str, object]) -> dict[str, object]:
    at = NAMES.index(name) if name in NAMES else 0
    told = {"step": STEPS_ZYX[at], "start": STARTS_ZYX[at], "spacing": b"regular__", "units": b"mm"}
    told |= {key.partition("__")[2]: value for key, value in odd.items() if key.partition("__")[0] == name}
    return {key: value for key, value in told.items() if value is not None}


def minc1(
    path: Path,
    voxels: np.ndarray,
    low: np.ndarray | float = 0.0,
    high: np.ndarray | float = 1.0,
    names: tuple[str, ...] = NAMES,
    **odd: object,
) -> Path:
    """Write MINC 1; `low` and `high` are image-min and image-max, one for all or one for each slice.

    `odd` replaces attributes: `xspace__units=b"furlong"`, `image__valid_range=(0.0, 9.0)`; None leaves one out.
    """
    with netcdf_file(path, "w") as file:
        for name, size in zip(names, voxels.shape, strict=True):
            file.createDimension(name, size)
            variable = file.createVariable(name, "i", ())
            for key, value in _axis(name, odd).items():
                setattr(variable, key, value)
        code = voxels.dtype.char.lower() if voxels.dtype.kind == "u" else voxels.dtype.char
        image = file.createVariable("image", code, names)
        image[:] = voxels.view(voxels.dtype.name.removeprefix("u"))
        image.signtype = b"unsigned" if voxels.dtype.kind == "u" else b"signed__"
        if "image__valid_range" in odd:
            image.valid_range = np.array(odd["image__valid_range"], ">f8")
        for name, ends in (("image-min", low), ("image-max", high)):
            variable = file.createVariable(name, "d", names[: np.ndim(ends)])
            variable.data[...] = ends
    return path


def minc2(
    path: Path,
    voxels: np.ndarray,
    low: np.ndarray | float = 0.0,
    high: np.ndarray | float = 1.0,
    names: tuple[str, ...] = NAMES,
    **odd: object,
) -> Path:
    """Write MINC 2, as `minc1` does."""
    with h5py.File(path, "w") as file:
        dimensions = file.create_group("minc-2.0/dimensions")
        for name in names:
            attributes = dimensions.create_dataset(name, data=0).attrs
            for key, value in _axis(name, odd).items():
                attributes[key] = np.bytes_(value) if isinstance(value, bytes) else value
        folder = file.create_group("minc-2.0/image/0")
        image = folder.create_dataset("image", data=voxels, chunks=(1, *voxels.shape[1:]), compression="gzip")
        image.attrs["dimorder"] = np.bytes_(",".join(names))
        if "image__valid_range" in odd:
            image.attrs["valid_range"] = np.array(odd["image__valid_range"], np.float64)
        for name, ends in (("image-min", low), ("image-max", high)):
            each = folder.create_dataset(name, data=np.asarray(ends, np.float64))
            each.attrs["dimorder"] = np.bytes_(",".join(names[: np.ndim(ends)]))
    return path
