"""The picture of labels and looks, as a package holds them or should, with any compositing that draws segments."""

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from volprep.truth.labelled import Border, Labelled, labelled_picture, tinted
from volprep.truth.labelled_values import OneValue, labelled_value_picture
from volprep.truth.oracle import OraclePicture
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.segments.texels import looks_of_texels
from volprep_formats.package.program import CompositingName
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures import ktx2

Look = tuple[float, float, float, float]
"""Linear tint, and opacity factor."""


def joined(stored: NDArray[np.generic], labels: NDArray[np.uint16]) -> NDArray[np.void]:
    """Return voxels [z, y, x] with the fields `stored` and `label`."""
    voxels: NDArray[np.void] = np.empty(stored.shape, [("stored", stored.dtype), ("label", labels.dtype)])
    voxels["stored"], voxels["label"] = stored, labels
    return voxels


def parted(voxels: NDArray[np.generic]) -> tuple[NDArray[np.generic], NDArray[np.uint16]]:
    """Return stored values and labels of joined voxels."""
    fields = cast("NDArray[np.void]", voxels)
    return np.ascontiguousarray(fields["stored"]), np.ascontiguousarray(fields["label"])


def held_looks(package: Package) -> Sequence[Look]:
    """Decode the looks of the labels of a package."""
    file = package.manifest.textures_of("looks")[0].file
    held = looks_of_texels(ktx2.decode(package.read_bytes(file), file).data)
    return [(red, green, blue, opacity) for red, green, blue, opacity in held.tolist()]


def labelled_as(
    labels: NDArray[np.uint16], styles: Sequence[TransferFunction], shown: Sequence[Look], border: Border
) -> Labelled:
    """Return labels [z, y, x] with the style and the look of each; a table of looks may have entries of no label."""
    pairs = zip(styles, shown, strict=False)
    looks = tuple(tinted(style, look[:3], look[3]) if look[3] > 0.0 else None for style, look in pairs)
    return Labelled(labels, looks, border)


def picture_of_labels(  # noqa: PLR0917 - a volume, its looks, and a view
    volume: Volume,
    labelled: Labelled,
    compositing: CompositingName,
    window: tuple[float, float],
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
) -> OraclePicture:
    """Draw a volume with its labels; `window` has the least and the greatest physical value that a package stores."""
    if compositing in {"maximum", "first-hit"}:
        shown: OneValue = "maximum" if compositing == "maximum" else "first-hit"
        return labelled_value_picture(shown, volume, window, labelled, box_from_clip, shape_hw)
    return labelled_picture(volume, labelled, box_from_clip, shape_hw)
