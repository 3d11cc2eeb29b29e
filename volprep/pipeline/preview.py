"""The preview picture of a package, for lists of packages and file browsers."""

import numpy as np

from volprep.render.choose import renderer_of
from volprep.truth.camera import standard_views
from volprep.truth.picture import encoded
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.reader import Package
from volprep_formats.png import png_bytes

_VIEW = "anterior-left"
_SIZE = 256
_FIRST_LOOK = 64
"""Pixels along each side of the picture that tells where something is seen."""
_SEEN = 0.02
"""Opacity from which on a pixel counts as seen: haze does not decide what the picture is of."""
_MARGIN = 1.06


def preview_png(package: Package) -> bytes:
    """Draw the finest level from the front, the left and above, over black, and give the PNG file.

    What is seen fills the picture: a scan holds much air, and the volume's diagonal must fit only where it turns.
    The package may be a draft that has its textures and programs. Raises what `renderer_of` raises.
    """
    manifest = package.manifest
    projection = manifest.render.projection if manifest.render else "orthographic"
    grid = manifest.levels[0].grid
    camera = standard_views(grid, projection)[_VIEW]
    with renderer_of(package) as renderer:
        box_from_clip = camera.box_from_clip(grid, 1.0)
        window = window_of_seen(renderer.render(box_from_clip, (_FIRST_LOOK, _FIRST_LOOK))[..., 3])
        picture = renderer.render(box_from_clip @ window, (_SIZE, _SIZE))
    return png_bytes(encoded(picture, "black"))


def window_of_seen(opacity: Float32Array) -> Float64Array:
    """Return 4×4 from the clip coordinates of a picture of what is seen to those of the whole, given its [row, column].

    The window is a square with a margin, and never larger than the whole; where nothing is seen it is the whole.
    """
    window = np.eye(4)
    rows, columns = np.nonzero(opacity > _SEEN)
    if not len(rows):
        return window
    height, width = opacity.shape
    low = np.array([columns.min() / width, 1 - (rows.max() + 1) / height]) * 2 - 1
    high = np.array([(columns.max() + 1) / width, 1 - rows.min() / height]) * 2 - 1
    half = min(float((high - low).max()) / 2 * _MARGIN, 1.0)
    window[:2, :2] *= half
    window[:2, 3] = np.clip((low + high) / 2, half - 1, 1 - half)
    return window
