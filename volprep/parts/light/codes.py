"""Store a field of light as bytes: its two ends, the light where the share is 0 and where it is 1.

The light of seen places lies between the ends of a node, or a little outside; the ends themselves may lie far outside,
also below 0, where few seen places have the values of an end: there the line through the light of the others counts. So
codes cover the range of the ends and not that of the light. With ends cut off at 0, pictures of an opaque head came
within 29.8 dB of path tracing at half of its resolution and 23.1 dB at a quarter, where the field itself has 31.0 and
29.6 dB.

Light in colour has six numbers, and a texel four. Colours of one light lie near a plane through black and white: it
goes from the colours of the surroundings to the colours of the volume. So light is the sum of two numbers in two
colours, which together are white. On the Colin27 head (91×109×91 voxels) this keeps 51.2 of 53.9 dB with a soft
function and 40.0 of 40.3 dB with a hard one. A brightness for each end with one chroma for both kept 43.4 and 35.5 dB.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from volprep.parts.light.solve import LightField
from volprep_formats.arrays import Float32Array, Float64Array, UInt8Array
from volprep_formats.package.parts.light.record import Colour, two_colours

_RARE = 1e-4
"""Part of the ends that may lie above the largest code, and part below the smallest: a few outliers would cost all
others precision."""
_MOST_IN_ONE = 4
"""Numbers of a texel."""
_GREY = 1e-12
"""Mean square beyond grey of light that has no colour."""
_DIGITS = 4
"""Of the first colour: more change no code."""


class LightCodes(NamedTuple):
    """Codes of a field: an end is code / 255 · largest - subtracted."""

    texels: UInt8Array
    """[z, y, x, 2, numbers]: of both ends, one number, two of light in colour, four of light that turns."""
    largest: float
    subtracted: float
    first_colour: Colour | None
    """Linear RGB of the first of two numbers; None for others."""

    def decoded(self, field: LightField) -> LightField:
        """Return the values of these codes of `field`."""
        ends = self.texels.astype(np.float32) * np.float32(self.largest / 255.0) - np.float32(self.subtracted)
        if self.first_colour is not None:
            ends = ends @ two_colours(self.first_colour).astype(np.float32)
        texels = np.stack([ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]], axis=-2)
        return replace(field, texels=texels)

    @property
    def slices(self) -> UInt8Array:
        """Texels of the texture [z, y, x, components]: with both ends, or, of four numbers, one end after the other."""
        z, y, x, ends, numbers = self.texels.shape
        if ends * numbers <= _MOST_IN_ONE:
            return self.texels.reshape(z, y, x, -1)
        return np.moveaxis(self.texels, 3, 0).reshape(-1, y, x, numbers)


def coded(field: LightField) -> LightCodes:
    """Return the codes of a field."""
    return coded_alike([field])[0]


def coded_alike(fields: Sequence[LightField], *, holds_one: bool = False) -> list[LightCodes]:
    """Return the codes of fields that one shader reads. With `holds_one` the light 1 is one of the codes."""
    all_ends = [_ends(field) for field in fields]
    colour = _first_colour([field.hues for field in fields if field.hues is not None])
    if colour is not None:
        all_ends = [_numbers(ends, colour) for ends in all_ends]
    lit = np.concatenate([ends[ends != 0.0] for ends in all_ends])
    low, high = np.quantile(lit, [_RARE, 1.0 - _RARE]).tolist() if lit.size else (0.0, 1.0)
    subtracted = max(-low, 0.0)
    largest = high + subtracted if high + subtracted > 0.0 else 1.0
    if holds_one:
        one = 1.0 + subtracted
        # Where a step of the codes is more than 1, the nearest code has to do.
        largest = 255.0 * one / (int(255.0 * one / max(largest, one)) or 255.0 * one / largest)
    return [
        LightCodes(
            np.rint(np.clip((ends + subtracted) / largest, 0.0, 1.0) * 255.0).astype(np.uint8),
            largest,
            subtracted,
            colour,
        )
        for ends in all_ends
    ]


def left_out(hues: Float64Array) -> float:
    """Return the root mean square of light beyond the plane of two colours that suit it best.

    `hues` [3, 3] has the mean products of what red, green and blue have beyond grey.
    """
    *beyond, _ = np.linalg.eigvalsh(hues).tolist()
    return math.sqrt(max(sum(beyond), 0.0) / len(hues))


def _ends(field: LightField) -> Float32Array:
    first, second = field.texels[..., 0, :], field.texels[..., 1, :]
    return np.stack([first, first + second], axis=-2)


def _numbers(ends: Float32Array, colour: Colour) -> Float32Array:
    """Return the two numbers of light [..., RGB] in two colours that come nearest to it."""
    parts = np.linalg.pinv(two_colours(colour))
    # No matrix product: its rounding depends on the machine.
    numbers = sum(ends[..., [channel]] * parts[channel] for channel in range(len(parts)))
    return np.asarray(numbers, np.float32)


def _first_colour(hues: Sequence[Float64Array]) -> Colour | None:
    """Return the first of two colours that make white, in the plane through grey in which most light lies.

    Each of `hues` [3, 3] has the mean products of what red, green and blue have beyond grey; without one there is no
    colour. The largest component is 1, so that neither colour has a component below 0.
    """
    if not hues:
        return None
    most, ways = np.linalg.eigh(np.sum(hues, axis=0))
    # Grey light has no way of its own, and would take one from rounding.
    along = ways[:, -1] if most[-1] > _GREY else np.array([1.0, 0.0, -1.0])
    along -= along.mean()
    # The sign of an eigenvector is arbitrary.
    along /= along[np.argmax(np.abs(along))]
    red, green, blue = np.round(0.5 + 0.5 * along, _DIGITS).tolist()
    return red, green, blue
