"""Small OME-Zarr stores, written by the library zarr."""

import zipfile
from pathlib import Path
from typing import Any

import zarr
from numpy.typing import NDArray

UNITS = {"space": "micrometer", "time": "second"}


def axis(name: str) -> dict[str, str]:
    """An axis as the metadata name it."""
    kind = {"t": "time", "c": "channel"}.get(name, "space")
    return {"name": name, "type": kind} | ({"unit": UNITS[kind]} if kind in UNITS else {})


def multiscales(
    axes: str, levels: int = 1, scale: tuple[float, ...] = (), shift: tuple[float, ...] = ()
) -> dict[str, Any]:
    """Metadata of an image whose levels are named 0, 1, ... and halve along z, y and x."""
    datasets = []
    for level in range(levels):
        factors = [2**level if name in "zyx" else 1 for name in axes]
        told = [h * f for h, f in zip(scale or (1.0,) * len(axes), factors, strict=True)]
        steps: list[dict[str, Any]] = [{"type": "scale", "scale": told}]
        if shift:
            steps.append({"type": "translation", "translation": list(shift)})
        datasets.append({"path": str(level), "coordinateTransformations": steps})
    return {"axes": [axis(name) for name in axes], "datasets": datasets}


def write_store(
    folder: Path,
    levels: list[NDArray[Any]],
    told: dict[str, Any],
    version: int = 3,
    *,
    labels: tuple[str, ...] = (),
    **array: Any,
) -> Path:
    """Write an image as NGFF 0.4 (version 2) or 0.5 (3); `array` goes to `Group.create_array`."""
    omero = {"omero": {"channels": [{"label": label} for label in labels]}} if labels else {}
    group = zarr.create_group(store=str(folder), zarr_format=version)
    if version == 2:
        group.attrs.update({"multiscales": [{"version": "0.4", **told}], **omero})
    else:
        group.attrs.update({"ome": {"version": "0.5", "multiscales": [told], **omero}})
    for dataset, values in zip(told["datasets"], levels, strict=True):
        stored = group.create_array(dataset["path"], shape=values.shape, dtype=values.dtype, **array)
        stored[...] = values
    return folder


def zipped(folder: Path, file: Path, below: str = "") -> Path:
    """Put a store into a zip, its entries below a folder."""
    with zipfile.ZipFile(file, "w") as output:
        for entry in sorted(folder.rglob("*")):
            if entry.is_file():
                name = zipfile.ZipInfo(below + entry.relative_to(folder).as_posix())
                output.writestr(name, entry.read_bytes())
    return file
