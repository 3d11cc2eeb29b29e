"""Colours of scenes and their light."""

import math


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
