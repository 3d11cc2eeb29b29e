"""Attributes of an OME-NGFF 0.5 image: axes, scale and translation of each level, windows and colours, labels.

NGFF 0.5 has scale and translation but no rotation. The translation of a level is the position of the centre of its
first voxel along the index axes, so that world = direction · position. The direction is kept beside the NGFF metadata,
under "volprep".
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from volprep_formats.grid import Grid
from volprep_formats.package.channel import Channel
from volprep_formats.package.look import VolumeLooks, extras_of
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo
from volprep_formats.srgb import srgb_of_linear
from volprep_formats.writers.label_image import WrittenLabel

_OWN = "volprep"
"""Key of the attributes that NGFF does not define. A store with this key was written by this module."""
_BYTES = (0.0, 255.0)
_OPACITY = 3
"""Place of the opacity among the channels of a volume in colour."""


@dataclass(frozen=True)
class ChannelLook:
    """First look in a viewer: the channel, its window and a colour."""

    channel: str
    """Name of the channel."""
    level_filter: str
    """Filter of the coarse levels, as in the manifest; none if there are no coarse levels."""
    range: tuple[float, float] | None
    """Physical values between which all voxels lie, or None."""
    window: tuple[float, float] | None
    """Physical values that are shown as black and as the full colour; None in a draft without a transfer function."""
    rgb: tuple[int, int, int] = (255, 255, 255)
    """The full colour as sRGB bytes."""
    active: bool = True
    """Whether the channel is shown at first."""

    @classmethod
    def of(cls, manifest: Manifest) -> "ChannelLook":
        """Return the look of a manifest of one channel."""
        channel = manifest.channels[0]
        codes, values = channel.quantization, channel.statistics
        least, most = (values.minimum, values.maximum) if codes is None else codes.window
        function = next(iter(channel.transfer_functions), None)
        if function is None:
            return cls(channel.name, _filters(channel), (least, most), None)
        start, end = _visible_range(function)
        window = (start, end) if start < end else (least, most)
        return cls(channel.name, _filters(channel), (least, most), window, function_colour(function, brightest=True))

    @classmethod
    def of_colour(cls, manifest: Manifest, index: int) -> "ChannelLook":
        """Return the look of a channel of a volume in colour: sRGB bytes, or opacity, which is not shown."""
        channel = manifest.channels[0]
        rgb = (255 * (index in {0, 3}), 255 * (index in {1, 3}), 255 * (index in {2, 3}))
        return cls(channel.name, _filters(channel), _BYTES, _BYTES, rgb, active=index != _OPACITY)


def _filters(channel: Channel) -> str:
    filters = {level.filter for level in channel.levels} - {"none"}
    return ", ".join(sorted(filters)) or "none"


@dataclass(frozen=True)
class WrittenLevel:
    """One array of the store."""

    number: int
    """Number of the level, which is the name of the array."""
    channels: tuple[SourceInfo, ...]
    """Facts of the level in the package, for each channel; several are an axis of the array."""
    stored: bool
    """Whether stored values were written, and not physical ones."""

    @property
    def grid(self) -> Grid:
        """Grid of the level, which its channels share."""
        return self.channels[0].grid


def image_attributes(
    levels: Sequence[WrittenLevel], looks: Sequence[ChannelLook], volume_looks: VolumeLooks | None = None
) -> dict[str, Any]:
    """Return the attributes of the group that holds `levels`, finest first, of channels that look like `looks`.

    `volume_looks`: looks over the values that are written.
    """
    name = ", ".join(look.channel for look in looks)
    kinds = ", ".join(sorted({look.level_filter for look in looks}))
    ome: dict[str, Any] = {"version": "0.5", "multiscales": [_multiscale(levels, name, kinds)]}
    if all(look.window is not None for look in looks):
        ome["omero"] = _omero(levels[0], looks, name)
    direction = [list(row) for row in levels[0].grid.direction]
    units = ["" if levels[0].stored else channel.unit for channel in levels[0].channels]
    own = {"unit": units[0]} if len(units) == 1 else {"units": units}
    attributes = {"ome": ome, _OWN: {"direction": direction, **own}}
    return attributes if volume_looks is None else {**attributes, **extras_of(volume_looks)}


def label_attributes(levels: Sequence[WrittenLevel], name: str, entries: Sequence[WrittenLabel]) -> dict[str, Any]:
    """Return the attributes of the group `labels`/`name` that holds the label arrays of `levels`, finest first."""
    image_label = {
        "version": "0.5",
        "colors": [{"label-value": label.value, "rgba": list(label.rgba)} for label in entries],
        "properties": [{"label-value": label.value, "name": label.name} for label in entries if label.name],
        "source": {"image": "../../"},
    }
    multiscale = _multiscale(levels, name, "labels")
    return {"ome": {"version": "0.5", "multiscales": [multiscale], "image-label": image_label}}


def is_export(document: object) -> bool:
    """Whether the parsed zarr.json of a group has attributes of this module."""
    attributes = document.get("attributes") if isinstance(document, dict) else None
    return isinstance(attributes, dict) and {"ome", _OWN} <= attributes.keys()


def is_rotated(grid: Grid) -> bool:
    """Whether the index axes are not the axes of the world, which NGFF 0.5 cannot express."""
    return not np.array_equal(np.array(grid.direction), np.eye(3))


def _multiscale(levels: Sequence[WrittenLevel], name: str, kind: str) -> dict[str, Any]:
    several = len(levels[0].channels) > 1
    axes: list[dict[str, str]] = [{"name": "c", "type": "channel"}] if several else []
    return {
        "name": name,
        "type": kind,
        "metadata": {"description": "levels of a volume package", "method": "volprep export"},
        "axes": [*axes, *({"name": axis, "type": "space", "unit": "millimeter"} for axis in "zyx")],
        "datasets": [
            {"path": str(level.number), "coordinateTransformations": _transformations(level.grid, several)}
            for level in levels
        ],
    }


def _transformations(grid: Grid, several: bool) -> list[dict[str, Any]]:
    along_axes_xyz = np.array(grid.direction).T @ np.array(grid.origin_mm_xyz)
    scale, translation = list(grid.spacing_mm_zyx), along_axes_xyz[::-1].tolist()
    return [
        {"type": "scale", "scale": [1.0, *scale] if several else scale},
        {"type": "translation", "translation": [0.0, *translation] if several else translation},
    ]


def _omero(finest: WrittenLevel, looks: Sequence[ChannelLook], name: str) -> dict[str, Any]:
    """Rendering settings, as far as these have fields: a window and one colour for each channel."""
    pairs = zip(looks, finest.channels, strict=True)
    return {
        "name": name,
        "channels": [_omero_channel(look, info, stored=finest.stored) for look, info in pairs],
        "rdefs": {"defaultT": 0, "defaultZ": finest.grid.shape_zyx[0] // 2, "model": "color"},
    }


def _omero_channel(look: ChannelLook, info: SourceInfo, *, stored: bool) -> dict[str, Any]:
    if look.window is None:
        raise ValueError(look.channel)
    start, end = look.window
    least, most = look.range or look.window
    if stored:
        start, end, least, most = ((value - info.intercept) / info.slope for value in (start, end, least, most))
    return {
        "label": look.channel,
        "active": look.active,
        "color": "".join(f"{part:02X}" for part in look.rgb),
        "coefficient": 1.0,
        "family": "linear",
        "inverted": False,
        "window": {"start": start, "end": end, "min": min(least, start), "max": max(most, end)},
    }


def _visible_range(function: TransferFunction) -> tuple[float, float]:
    """Physical values from where the extinction begins to rise to where it has fallen to 0 again."""
    points = function.points
    visible = [index for index, point in enumerate(points) if point.extinction_per_mm > 0.0] or [0, len(points) - 1]
    return points[max(visible[0] - 1, 0)].value, points[min(visible[-1] + 1, len(points) - 1)].value


def function_colour(
    function: TransferFunction, tint: Sequence[float] = (1.0, 1.0, 1.0), *, brightest: bool = False
) -> tuple[int, int, int]:
    """Return the mean colour of the points, weighted by extinction and tinted, as sRGB bytes.

    `brightest` scales it to full brightness, for a viewer that multiplies it by the value of a voxel.
    """
    colours = np.array([point.colour for point in function.points])
    weights = np.array([point.extinction_per_mm for point in function.points])
    chosen = weights if weights.any() else np.ones_like(weights)
    mean = chosen @ colours / chosen.sum() * np.array(tint)
    if brightest:
        mean = mean / mean.max() if mean.max() > 0.0 else np.ones(3)
    red, green, blue = (round(255 * float(part)) for part in srgb_of_linear(mean))
    return red, green, blue
