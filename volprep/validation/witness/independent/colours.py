"""Colours of scenes and of pictures, and their light."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.scan import CannotWitnessError, Floats

_PARTS = ("red", "green", "blue")
_FIXED = ("name", "colour")
_LUMINANCE = (0.299, 0.587, 0.114)


def linear_light(colour: str | list[float], *, linear: bool) -> list[float]:
    """Decode IEC 61966-2-1 (sRGB): a straight line below 0.04045, and a power of 2.4 above it.

    A colour "#rrggbb" is always sRGB; three numbers are linear already if `linear`.
    """
    if isinstance(colour, str):
        parts = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    elif linear:
        return [float(part) for part in colour]
    else:
        parts = [float(part) for part in colour]
    return [part / 12.92 if part <= 0.04045 else math.pow((part + 0.055) / 1.055, 2.4) for part in parts]


def encoded_light(light: Floats) -> Floats:
    """Return the sRGB numbers of linear light, from 0 to 1."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0.0) ** (1 / 2.4) - 0.055)


def channel_of(pixels: NDArray[Any], wanted: Mapping[str, Any]) -> Floats:
    """Return one channel [...] of straight RGB or RGBA pixels [..., component], from 0 to 1.

    `wanted` is the table `colour` of a channel. The opacity is the share of the largest extinction; red, green and blue
    are linear light times this share. Integers are sRGB, floats linear light.
    """
    if pixels.dtype.names:
        pixels = np.stack([pixels[name] for name in pixels.dtype.names], axis=-1)
    if pixels.shape[-1] not in {3, 4} or pixels.dtype.kind != "u":
        raise CannotWitnessError("its voxels are no RGB or RGBA integers")
    numbers = pixels / float(np.iinfo(pixels.dtype).max)
    encoded, alpha = numbers[..., :3], numbers[..., 3] if pixels.shape[-1] == 4 else None
    share = _share(encoded, alpha, wanted)
    if wanted["part"] == "opacity":
        return share
    own = encoded[..., _PARTS.index(wanted["part"])]
    return np.asarray(share * np.where(own <= 0.04045, own / 12.92, ((own + 0.055) / 1.055) ** 2.4))


def _share(encoded: Floats, alpha: Floats | None, wanted: Mapping[str, Any]) -> Floats:
    """Return the share of the largest extinction of each pixel."""
    kind = wanted["opacity_of"]
    if kind == "alpha":
        if alpha is None:
            raise CannotWitnessError("its pixels have no alpha")
        number = alpha
    elif kind == "luminance":
        number = encoded @ np.array(_LUMINANCE)
    elif kind == "background":
        number = np.sqrt(((encoded - np.array(wanted["background"])) ** 2).mean(axis=-1))
    else:
        number = encoded[..., _PARTS.index(kind)]
    share: Floats = np.interp(number, *np.transpose(wanted["shares"]))
    return share if alpha is None or kind == "alpha" else share * alpha


def with_channels(scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a scene with the channels and transfer functions of its table [colour]; other scenes as they are.

    Each channel has one straight line: light, or extinction, in proportion to its values.
    """
    table = scene.get("colour")
    if not table:
        return scene
    first = (scene["source"].get("channels") or [scene["source"]])[0]
    source = {key: value for key, value in first.items() if key not in _FIXED}
    largest = max(float(point["extinction_per_mm"]) for point in table["points"])
    settings = {
        "opacity_of": table.get("extinction") or "alpha",
        "background": table.get("background") and [int(table["background"][i : i + 2], 16) / 255 for i in (1, 3, 5)],
        "shares": [(point["value"], point["extinction_per_mm"] / largest) for point in table["points"]],
    }
    parts = (*_PARTS, "opacity")
    channels = [{**source, "name": part, "colour": {"part": part, **settings}} for part in parts]
    functions = []
    for part, light in zip(parts, (*np.eye(3).tolist(), [0.0, 0.0, 0.0]), strict=True):
        points = [{"value": at, "colour": light, "extinction_per_mm": at * largest} for at in (0.0, 1.0)]
        functions.append({"name": part, "channel": part, "colour_space": "linear", "points": points})
    return {**scene, "source": {"channels": channels}, "transfer": functions}
