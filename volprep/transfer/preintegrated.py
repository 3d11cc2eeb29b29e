"""Pre-integrated tables: the light of a whole ray segment by the values at its two ends (Engel, Kraus, Ertl 2001).

Along a segment the value is taken to change linearly, so that a feature of the transfer function between the two
values is never missed, however narrow it is. All attenuation inside the segment counts; tables that leave it out are
of first order only.

An entry holds the mean extinction, which does not depend on the segment's length d, and the colour of the segment's
light, light / opacity, for the length that the table is made for. So a shader draws a segment of any length d' with
opacity 1 - exp(-extinction d') = 1 - (1 - opacity)^(d'/d) and with colour times that opacity: exact for d' = d, and
for other lengths off by what attenuation inside d' and d shifts the colour.
"""

from dataclasses import dataclass

import numpy as np

from volprep.kernels import _native
from volprep.transfer.texel_forms import MediumTexels, decoded_texels, medium_texels, opaque_per_mm
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table, colour_of_entries
from volprep_formats.package.profile import LookupFormat
from volprep_formats.package.transfer_function import TransferFunction


def segment_light(
    table: Table, front: Float64Array, back: Float64Array, step_mm: float
) -> tuple[Float64Array, Float64Array]:
    """Colour [..., 3] and mean extinction [...] of segments of `step_mm` from physical values `front` to `back`.

    Colour is light divided by opacity, extinction is per millimetre.
    """
    front, back = np.broadcast_arrays(front, back)
    light = np.empty((front.size, 4))
    _native.preintegrate(
        np.ascontiguousarray(front, dtype=np.float64).ravel(),
        np.ascontiguousarray(back, dtype=np.float64).ravel(),
        *table.points,
        step_mm,
        light,
    )
    light = light.reshape(*front.shape, 4)
    return light[..., :3], light[..., 3]


def preintegrated_texels(
    function: TransferFunction,
    window: tuple[float, float],
    entries: int,
    step_mm: float,
    texel_format: LookupFormat,
) -> MediumTexels:
    """Make the table [1, back, front, RGBA] of `entries`² texels for segments of `step_mm`, over `window`."""
    segments = segment_table(Table.exact(function), window, entries, step_mm)
    return segment_texels(segments, texel_format, min(float(segments[..., 3].max()), opaque_per_mm(step_mm)))


def segment_table(table: Table, window: tuple[float, float], entries: int, step_mm: float) -> Float64Array:
    """Return colour and mean extinction [back, front, 4] of segments of `step_mm` between `entries` values."""
    values = np.linspace(*window, entries)
    colour, extinction = segment_light(table, values[None, :], values[:, None], step_mm)
    return np.concatenate([_bled(colour, extinction), extinction[..., None]], axis=-1)


def segment_texels(segments: Float64Array, texel_format: LookupFormat, largest_per_mm: float) -> MediumTexels:
    """Turn a table [back, front, 4] into texels, with extinctions up to `largest_per_mm`.

    Half floats hold colour times extinction, because a filter may mix these: between an entry of haze and one of a wall
    there is as much of the wall's colour as of its extinction. Colours by themselves would make opaque dots of haze.
    Bytes hold colours by themselves: times a faint extinction there would be nothing left of them.
    """
    colour, extinction = segments[None, ..., :3], np.minimum(segments[None, ..., 3], largest_per_mm)
    shown = colour * extinction[..., None] if texel_format == "RGBA16F" else colour
    return medium_texels(shown, extinction, texel_format, largest_per_mm)


@dataclass(frozen=True)
class PreintegratedTable:
    """A table as a shader reads it, filtered linearly."""

    window: tuple[float, float]
    """Physical values of the first and the last entry."""
    entries: Float64Array
    """[back, front, 4]: colour, or colour times extinction, and mean extinction per millimetre."""
    emits: bool
    """Whether entries hold colour times extinction."""

    @classmethod
    def of_texels(cls, medium: MediumTexels, window: tuple[float, float]) -> "PreintegratedTable":
        """Decode the texels that a package holds."""
        colour, extinction = decoded_texels(medium)
        entries = np.concatenate([colour, extinction[..., None]], axis=-1)[0]
        return cls(window, entries, medium.max_extinction_per_mm is None)

    def at(self, front: Float64Array, back: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Colour [..., 3] and mean extinction [...] of segments between physical values."""
        low, high = self.window
        last = len(self.entries) - 1
        x, y = (np.clip((each - low) / (high - low), 0.0, 1.0) * last for each in (front, back))
        i, j = (np.minimum(each.astype(np.intp), last - 1) for each in (x, y))
        fx, fy = (x - i)[..., None], (y - j)[..., None]
        lower = self.entries[j, i] * (1 - fx) + self.entries[j, i + 1] * fx
        upper = self.entries[j + 1, i] * (1 - fx) + self.entries[j + 1, i + 1] * fx
        found = lower * (1 - fy) + upper * fy
        return colour_of_entries(found, emits=self.emits), found[..., 3]


def _bled(colour: Float64Array, extinction: Float64Array) -> Float64Array:
    """Give entries without extinction the mean colour of their neighbours that have some.

    The filter mixes colours without regard to extinction: the colour of what is never seen must not show.
    """
    seen = np.pad(np.where(extinction > 0.0, 1.0, 0.0), 1)
    shown = np.pad(colour, ((1, 1), (1, 1), (0, 0))) * seen[..., None]
    rows, columns = extinction.shape
    around = [(j, i) for j in range(3) for i in range(3)]
    count = sum(seen[j : j + rows, i : i + columns] for j, i in around)
    total = sum(shown[j : j + rows, i : i + columns] for j, i in around)
    empty = (extinction <= 0.0) & (count > 0.0)
    return np.where(empty[..., None], total / np.maximum(count, 1.0)[..., None], colour)
