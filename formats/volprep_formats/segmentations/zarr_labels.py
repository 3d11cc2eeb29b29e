"""Label images inside an OME-Zarr store, which are in its folder `labels`.

Source: https://ngff.openmicroscopy.org/0.5 ("labels" metadata).
"""

from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.ome.zarr_kind import is_zarr


def label_image(path: Path) -> Path:
    """Return the label image of an OME-Zarr store, or of its folder `labels`; any other path as it is.

    Raises VP1416 if there are several.
    """
    folder = path if path.name == "labels" else path / "labels"
    if not (path.is_dir() and is_zarr(path, b"") and folder.is_dir()):
        return path
    images = sorted(path for path in folder.iterdir() if path.is_dir() and is_zarr(path, b""))
    if len(images) > 1:
        raise VolprepError("VP1416", path=path, count=len(images), names=", ".join(image.name for image in images))
    return images[0] if images else path
