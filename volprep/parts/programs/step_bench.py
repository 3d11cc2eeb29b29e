"""The error that a step makes: rays with fine samples, drawn in segments as shaders do it.

A ray is cut into equal segments and drawn with one sample for each, or, with pre-integrated tables, with the exact
light of a straight segment. The truth are pieces so short that shorter ones change nothing. Layers that are blended are
segments, too, but each is rounded to the format of the picture.

Where the scene lights samples, rays are lit by a headlight, whatever the light is. The angle of a surface changes
faster along a ray than its opacity: on a ball and on a masked head of 20 to 36 voxels, steps of 0.35 to 1 voxel had 3
to 6 times the error with a headlight, and the worst view of `validate` had the same.

Segments are drawn all together, and each style without the others, as an app may show them.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from volprep.compositing import Compositing
from volprep.kernels import _native
from volprep.parts.programs.patch_rays import PatchRays
from volprep.plan.probe import PictureDifference, difference, worst
from volprep.transfer.segment_light import segment_light
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.program import PassTarget

STEP_SHARE = 0.25
"""Part of the tolerance that samples may take; codes may take a half."""
_VOXELS = (2.0, 1.4, 1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.125)
"""Steps that are tried, in voxels of the level. Half as long is four times as exact; beyond 2 a few rays do not tell
what small things samples miss."""
FINER_VOXELS = (*_VOXELS, 0.09)
"""The same along finer samples."""
_BETWEEN = 4
"""Pieces of a fine sample whose light is the truth where samples are lit."""
_SEEN = 1 / 510
"""Rays of less opacity than a rounding of 8 bits do not count: many of them would make a bad step look good."""


def in_voxels(number: float) -> str:
    """Write a number of voxels."""
    return "1 voxel" if number == 1 else f"{number:.3g} voxels"


class LongestStep(NamedTuple):
    """The longest step whose error is within its part of the tolerance."""

    voxels: float
    """Length in voxels of the level."""
    reason: str
    """Why, for people."""
    keeps: bool
    """Whether it was measured, and keeps the promise."""
    is_beyond: bool = False
    """Whether its error is beyond the whole tolerance."""


def longest_step(  # noqa: PLR0917 - the rays, and the allowed error
    bench: "StepBench",
    voxel_mm: float,
    tolerance: Tolerance,
    usual: float,
    margin: float = 1.0,
    part: str = "a quarter of the tolerance",
    tried_voxels: Sequence[float] = _VOXELS,
) -> LongestStep:
    """Return the longest step whose error is within its part of the tolerance, which `part` names for people.

    If no step is, it is the finest, or the best one of layers, because each layer is rounded.

    The sample of rays may take `margin` of that part, because some views are worse than the sample.
    Rays that see nothing are no evidence: then the step is the `usual` one.
    """
    if not bench.sees:
        reason = "as usual: no ray of a sample sees anything, so that nothing was measured"
        return LongestStep(usual, reason, keeps=False)
    limit = PictureDifference(STEP_SHARE * tolerance.rmse, STEP_SHARE * tolerance.maximum)
    part = f"{part} ({limit.text})"
    tried: dict[float, PictureDifference] = {}
    beyond = ""
    for voxels in tried_voxels:
        error = bench.error(voxels * voxel_mm)
        if error.rmse <= margin * limit.rmse and error.maximum <= limit.maximum:
            return LongestStep(voxels, f"a sample of rays is off by {error.text}, within {part}{beyond}", keeps=True)
        tried[voxels] = error
        beyond = f"; {in_voxels(voxels)} would be off by {error.text}"
    best = min(tried, key=lambda voxels: tried[voxels].rmse) if bench.rounds else tried_voxels[-1]
    reason = f"a sample of rays is off by {tried[best].text}, more than {part}: no step that was tried keeps it"
    found = tried[best]
    is_beyond = found.rmse > tolerance.rmse or found.maximum > tolerance.maximum
    return LongestStep(best, reason, keeps=False, is_beyond=is_beyond)


class _Part(NamedTuple):
    """Rays of one length."""

    values: Float64Array  # [sample, ray]
    headlight: Float64Array | None  # [sample, ray], if samples are lit
    looks: Float32Array | None  # [style, sample, ray, 4], if segments are drawn
    fine_mm: float  # distance of the samples
    weights: Float64Array  # [ray], in a mean


class _Drawn(NamedTuple):
    """One function, or the styles of segments that are drawn together."""

    exact: tuple[Table, ...]
    tables: tuple[Table, ...]
    """The tables that shaders use for them."""
    styles: tuple[int, ...] = ()


class _Case(NamedTuple):
    """One function, or some styles, in one view."""

    view: int
    drawn: _Drawn
    parts: tuple[_Part, ...]
    truth: Float64Array  # [ray, 4], of all parts


class StepBench:
    """Rays, and their light in truth."""

    def __init__(
        self,
        compositing: Compositing,
        tables: Sequence[Table],
        rays: Sequence[PatchRays],
        *,
        is_segments: bool,
        layers: PassTarget | None = None,
        drawn: Sequence[Table] = (),
    ) -> None:
        """Take transfer functions, and rays of several lengths that have the same views.

        `is_segments` says whether segments are classified, not samples; `layers` is the format of the picture, if
        layers are blended. Samples are classified by the tables `drawn`, if they are not the functions themselves.
        """
        self._segments = is_segments
        self._compositing = compositing
        self._layers = layers
        self._cases: list[_Case] = []
        is_labelled = any(ray.looks is not None for ray in rays)
        for one in _each_drawn(tables, drawn or tables, is_labelled=is_labelled):
            for number, views in enumerate(zip(*(bench.views for bench in rays), strict=True)):
                pairs = zip(rays, views, strict=True)
                found = [
                    error for these, view in pairs for error in [self._seen(these, one, view)] if error is not None
                ]
                if found:
                    parts, truths = zip(*found, strict=True)
                    self._cases.append(_Case(number, one, parts, np.concatenate(truths)))

    @property
    def rounds(self) -> bool:
        """Whether each segment is rounded, so that finer steps may be worse."""
        return self._layers is not None

    @property
    def sees(self) -> bool:
        """Whether any ray shows anything."""
        return bool(self._cases)

    def error(self, step_mm: float) -> PictureDifference:
        """Return the worst error of any function in any view, over the rays that show something; `sees` must hold."""
        return worst(list(self.errors(step_mm).values()))

    def errors(self, step_mm: float) -> dict[int, PictureDifference]:
        """Return the worst error of any function by the number of the view, of those views that show something."""
        found: dict[int, PictureDifference] = {}
        for case in self._cases:
            weights = np.concatenate([part.weights for part in case.parts])
            error = difference(self._light(case, step_mm), case.truth, weights)
            found[case.view] = worst([error, found.get(case.view, error)])
        return found

    def _seen(self, rays: PatchRays, drawn: _Drawn, view: slice) -> tuple[_Part, Float64Array] | None:
        """Return the rays of a view that show something, and their light in truth; or None."""
        values = np.ascontiguousarray(rays.values[:, view])
        if not values.size:
            return None
        lit = None if rays.headlight is None else np.ascontiguousarray(rays.headlight[:, view])
        looks = None if rays.looks is None else np.ascontiguousarray(rays.looks[list(drawn.styles), :, view])
        weights = np.ones(values.shape[1]) if rays.weights is None else rays.weights[view]
        part = _Part(values, lit, looks, rays.step_mm, weights)
        truth = self._truth(part, drawn.exact)
        (chosen,) = np.nonzero(truth[:, 3] > _SEEN)
        if not len(chosen):
            return None
        headlight = None if lit is None else lit.take(chosen, axis=1)
        shown = None if looks is None else looks.take(chosen, axis=2)
        return _Part(values.take(chosen, axis=1), headlight, shown, rays.step_mm, weights[chosen]), truth[chosen]

    def _truth(self, part: _Part, tables: Sequence[Table]) -> Float64Array:
        """Return the light of straight pieces between fine samples; where no such light is known, of finer samples."""
        if part.headlight is not None or part.looks is not None:
            return self._of_samples(part, _BETWEEN * len(part.values), part.fine_mm / _BETWEEN, tables)
        if "preintegrated" in self._compositing.classifications:
            return _straight_light(part, tables[0], part.fine_mm)
        return self._compositing.rays(part.values, part.fine_mm, tables[0], "nearest")

    def _light(self, case: _Case, step_mm: float) -> Float64Array:
        draw = self._part_drawn(step_mm)
        tables = case.drawn.exact if self._segments else case.drawn.tables
        return np.concatenate([draw(part, tables) for part in case.parts])

    def _part_drawn(self, step_mm: float) -> Callable[[_Part, Sequence[Table]], Float64Array]:
        if self._layers is not None:
            return lambda part, tables: self._layers_light(part, tables[0], step_mm)
        if self._segments:
            return lambda part, tables: _segments_light(part, tables[0], step_mm)
        return lambda part, tables: self._samples_light(part, tables, step_mm)

    def _samples_light(self, part: _Part, tables: Sequence[Table], step_mm: float) -> Float64Array:
        return self._of_samples(part, *_cut(part, step_mm), tables)

    def _of_samples(self, part: _Part, count: int, step_mm: float, tables: Sequence[Table]) -> Float64Array:
        """Return the light of so many samples of each ray, which lie so far apart."""
        if part.looks is not None:
            return _mixed_light(part, part.looks, count, step_mm, tables)
        places = _middles(part, count)
        values = _at(part.values, places)
        headlight = None if part.headlight is None else _at(part.headlight, places)
        if headlight is None or self._compositing.lit_rays is None:
            return self._compositing.rays(values, step_mm, tables[0], "nearest")
        return self._compositing.lit_rays(values, step_mm, tables[0], "nearest", headlight)

    def _layers_light(self, part: _Part, table: Table, step_mm: float) -> Float64Array:
        """Return the light of segments that are blended front to back, rounding each."""
        colour, extinction, segment_mm = _media(part, table, step_mm, is_segments=self._segments)
        light = np.zeros((extinction.shape[1], 4))
        for layer_colour, layer_extinction in zip(colour, extinction, strict=True):
            opacity = -np.expm1(-layer_extinction * segment_mm)
            given = opacity[:, None] * np.column_stack([layer_colour, np.ones(len(opacity))])
            light = _rounded(light + (1.0 - light[:, 3:]) * given, self._layers)
        return light


def _media(part: _Part, table: Table, step_mm: float, *, is_segments: bool) -> tuple[Float64Array, Float64Array, float]:
    """Return the colours [segment, ray, 3] of segments as they are lit, their extinctions, and their length."""
    count, segment_mm = _cut(part, step_mm)
    middles = _middles(part, count)
    if is_segments:
        ends = _at(part.values, np.linspace(0.0, len(part.values), count + 1))
        colour, extinction = segment_light(table, ends[:-1], ends[1:], segment_mm)
    else:
        samples = _at(part.values, middles)
        colour, extinction = (value.reshape(*samples.shape, *value.shape[1:]) for value in table.at(samples.ravel()))
    if part.headlight is not None:
        colour = colour * _at(part.headlight, middles)[..., None]
    return colour, extinction, segment_mm


def _each_drawn(tables: Sequence[Table], used: Sequence[Table], *, is_labelled: bool) -> Iterator[_Drawn]:
    """Yield each function; of segments, all styles together and then each of several alone."""
    if not is_labelled:
        yield from (_Drawn((exact,), (drawn,)) for exact, drawn in zip(tables, used, strict=True))
        return
    every = range(len(tables))
    for styles in dict.fromkeys((tuple(every), *((style,) for style in every))):
        yield _Drawn(tuple(tables[style] for style in styles), tuple(used[style] for style in styles), styles)


def _mixed_light(part: _Part, looks: Float32Array, count: int, step_mm: float, tables: Sequence[Table]) -> Float64Array:
    """Return the light of so many samples of each ray, in which styles are mixed."""
    light = np.empty((part.values.shape[1], 4))
    styles = [table.points for table in tables]
    _native.mixed_light(part.values, looks, styles, count, step_mm, light, part.headlight)
    return light


def _segments_light(part: _Part, table: Table, step_mm: float) -> Float64Array:
    if part.headlight is None:
        return _straight_light(part, table, step_mm)
    colour, extinction, segment_mm = _media(part, table, step_mm, is_segments=True)
    depths = np.cumsum(extinction * segment_mm, axis=0)
    left = np.exp(-np.vstack([np.zeros(depths.shape[1]), depths]))
    light = ((left[:-1] - left[1:])[..., None] * colour).sum(axis=0)
    return np.column_stack([light, 1.0 - left[-1]])


def _straight_light(part: _Part, table: Table, step_mm: float) -> Float64Array:
    pieces, piece_mm = _cut(part, step_mm)
    light = np.empty((part.values.shape[1], 4))
    _native.straight_light(part.values, pieces, piece_mm, *table.points, light)
    return light


def _cut(part: _Part, step_mm: float) -> tuple[int, float]:
    """Return how many equal segments, none longer than the step, rays are cut into; and their length."""
    length_mm = len(part.values) * part.fine_mm
    count = max(1, int(np.ceil(length_mm / step_mm - 1e-3)))
    return count, length_mm / count


def _middles(part: _Part, count: int) -> Float64Array:
    """Return the middles of so many equal segments, in samples from the ends of rays."""
    ends = np.linspace(0.0, len(part.values), count + 1)
    middles: Float64Array = (ends[:-1] + ends[1:]) / 2
    return middles


def _rounded(light: Float64Array, target: PassTarget | None) -> Float64Array:
    """Return what a picture of this format keeps of light."""
    if target == "rgba8":
        whole: Float64Array = np.rint(light * 255.0) / np.float64(255.0)
        return whole
    return light.astype(np.float16).astype(np.float64)


def _at(rays: Float64Array, places: Float64Array) -> Float64Array:
    """Return the values of rays [sample, ray] at places in samples from their ends, linear between two."""
    inside = np.clip(places - 0.5, 0.0, len(rays) - 1)
    lower = np.minimum(inside.astype(np.intp), max(len(rays) - 2, 0))
    share = (inside - lower)[:, None]
    values: Float64Array = rays[lower] + share * (rays[np.minimum(lower + 1, len(rays) - 1)] - rays[lower])
    return values
