"""Drawing into the most precise target that a driver has."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from volprep.validation.results.measurements import Target
from volprep_formats.arrays import Float32Array
from volprep_formats.diagnostics import VolprepError

Drawn = TypeVar("Drawn")

NO_SUCH_TARGET = "VP5008"
"""Code of the error where a driver cannot draw into a format."""

_FLOAT_TARGETS: tuple[Target, ...] = ("rgba32f", "rgba16f")


def most_precise(draw: Callable[[Target], Drawn]) -> Drawn | None:
    """Return the result of `draw` for the most precise float target of the driver; None if it has only 8 bits."""
    for target in _FLOAT_TARGETS:
        try:
            return draw(target)
        except VolprepError as error:
            if error.code != NO_SUCH_TARGET:
                raise
    return None


def finite(picture: Float32Array, program: str, target: Target) -> Float32Array:
    """Return a picture. Raises VP6082 if a driver has drawn NaN or infinite pixels."""
    wrong = int((~np.isfinite(picture).all(axis=-1)).sum())
    if wrong:
        pixels = picture.shape[0] * picture.shape[1]
        raise VolprepError("VP6082", program=program, target=target, wrong=wrong, pixels=pixels)
    return picture
