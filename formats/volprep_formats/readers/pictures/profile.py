"""Colours of pictures that are not sRGB, as an ICC profile or the gamma of a PNG says: converted by Little CMS.

Only volumes in colour are converted. Grey values are measurements, which stay as they are stored. Little CMS is foreign
code, so all but the remarks runs in workers.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

IS_SRGB, PROFILE, GAMMA, UNUSABLE = range(4)
"""Colour space of a file."""
_TEXTS = {PROFILE: "have a colour profile other than that of sRGB", GAMMA: "give another gamma than that of sRGB"}
_SRGB_GAMMA, _SAME_GAMMA = 2.2, 0.05
_SAME_CODE = 1
"""Profiles of sRGB differ by rounding."""
_D65_XYY = (0.3127, 0.3290, 1.0)
_PRIMARIES_XYY = (0.64, 0.33, 1.0, 0.30, 0.60, 1.0, 0.15, 0.06, 1.0)
"""White and primaries of sRGB, IEC 61966-2-1."""
_RELATIVE_COLORIMETRIC = 1
_NO_OPTIMIZATION = 0x0100
"""Otherwise 16 bits pass a table of 33³ colours, which is off by up to 0.03 of 1."""


def colour_note(spec: Any) -> int:
    """Return what the ImageSpec of OpenImageIO says of the colours of a picture of integers."""
    if str(spec.format) not in {"uint8", "uint16"}:
        return IS_SRGB
    if spec.getattribute("ICCProfile") is not None:
        return _note_of(_profile(spec), spec.nchannels)
    return GAMMA if abs(_gamma(spec) - _SRGB_GAMMA) > _SAME_GAMMA else IS_SRGB


def colour_note_remarks(note: int, *, in_colour: bool) -> list[str]:
    """Return the remark about a note."""
    if note == IS_SRGB:
        return []
    if note == UNUSABLE:
        return ["the pictures have a colour profile that is damaged or of other colours: values are as they are stored"]
    if in_colour:
        return [f"the pictures {_TEXTS[note]}: their colours are converted to sRGB"]
    return [f"the pictures {_TEXTS[note]}, which is not applied to grey values: they are as they are stored"]


def in_srgb(pixels: NDArray[np.generic], spec: Any, alpha: int, *, is_premultiplied: bool) -> NDArray[np.generic]:
    """Convert pixels [y, x, channel] of 8 or 16 bits to sRGB of 16 bits, by the profile or gamma of their picture.

    Channel `alpha` (-1: none), which may have multiplied the others, stays. Other pixels than of three colours are
    returned as they are.
    """
    colours = [channel for channel in range(pixels.shape[-1]) if channel != alpha]
    if len(colours) != 3:
        return pixels
    wide = pixels.astype(np.uint16) * np.uint16(257 if pixels.dtype.itemsize == 1 else 1)
    if not is_premultiplied:
        wide[..., colours] = _converted(wide[..., colours], _profile(spec))
        return wide
    share = wide[..., [alpha]] / 65535
    straight = np.divide(wide[..., colours], share, out=np.zeros((*wide.shape[:-1], 3)), where=share > 0)
    converted = _converted(np.rint(np.minimum(straight, 65535)).astype(np.uint16), _profile(spec))
    wide[..., colours] = np.rint(converted * share)
    return wide


def _gamma(spec: Any) -> float:
    is_linear = spec.get_string_attribute("oiio:ColorSpace").startswith("lin_")
    return 1.0 if is_linear else float(spec.get_float_attribute("oiio:Gamma", _SRGB_GAMMA))


def _profile(spec: Any) -> bytes:
    import imagecodecs  # noqa: PLC0415 - in workers only

    found = spec.getattribute("ICCProfile")
    if found is not None:
        return np.asarray(found, np.uint8).tobytes()
    return bytes(imagecodecs.cms_profile("rgb", whitepoint=_D65_XYY, primaries=_PRIMARIES_XYY, gamma=_gamma(spec)))


def _note_of(profile: bytes, channels: int) -> int:
    """Compare colours of all kinds before and after conversion, since names of profiles do not say what they do."""
    import imagecodecs  # noqa: PLC0415 - in workers only

    steps = np.arange(0, 256, 15, dtype=np.uint16) * np.uint16(257)
    colours = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(1, -1, 3)
    try:
        moved = np.abs(_converted(colours, profile).astype(np.int64) - colours).max()
    except imagecodecs.CmsError:
        return PROFILE if channels < 3 else UNUSABLE
    return PROFILE if moved > _SAME_CODE * 257 else IS_SRGB


def _converted(colours: NDArray[np.uint16], profile: bytes) -> NDArray[np.uint16]:
    import imagecodecs  # noqa: PLC0415 - in workers only

    converted: NDArray[np.uint16] = imagecodecs.cms_transform(
        np.ascontiguousarray(colours),
        profile,
        imagecodecs.cms_profile("srgb"),
        colorspace="rgb",
        outcolorspace="rgb",
        outdtype="uint16",
        intent=_RELATIVE_COLORIMETRIC,
        flags=_NO_OPTIMIZATION,
    )
    return converted
