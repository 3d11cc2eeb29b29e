"""Which bits and window the stored values get, and how long the lookup tables are: measured, not guessed."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Literal, NamedTuple

import numpy as np

from volprep.compositing import COMPOSITINGS, Compositing
from volprep.parts.values.lit_bench import LitBench
from volprep.parts.values.window import Window, is_exact, windows
from volprep.plan.decisions import ValueChoice
from volprep.plan.probe import SHARE, PictureDifference, Quantizer, difference_of_views, worst
from volprep.plan.records import QuantizePlan
from volprep.plan.room import has_exact_16_bits
from volprep.scan.relabelled import LARGEST_LABEL, MOST_LABELS
from volprep.scan.statistics import Measured
from volprep.scene.scene import QuantizeSettings, Scene
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import SampleFilter
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo
from volprep_formats.textures.texel_formats import SRGB

_FLIP_OF_RMSE = 8.0
"""Largest FLIP of a picture, in parts of its RMSE: a map of doses had 0.0325 with 0.0054, levels have up to 8 times."""
TABLE_SHARE = 0.05
"""Fraction of the scene's tolerance that a smaller table may add to the error of the largest one."""
_ENTRIES = (256, 512, 1024, 2048, 4096)
"""Lengths of a lookup table: the longest has 32 kB as half floats, less than one slice of a volume."""
_EVERY_VALUE = 4096
"""Values that are tried where a pixel may show one value alone."""
_MANY_LABELS_WINDOW = (0.0, 65535 / 64)
"""Window of labels above 255: a label is 64 codes, so that its half float is exact, and four entries of the longest
table: between two entries there is no second label."""
_EDITABLE_ENTRIES = {8: 256, 16: 2048}
"""Where functions may be edited, tables are as fine as texels: codes of 8 bits, and half floats, which have 11."""


class _Bench:
    """The sample of rays with their true pictures, one for each transfer function."""

    def __init__(
        self,
        measured: Measured,
        spacing_mm_zyx: tuple[float, float, float],
        functions: tuple[TransferFunction, ...],
        between: SampleFilter,
        compositing: Compositing,
    ) -> None:
        self._compositing = compositing
        self._rays_zyx = measured.rays_zyx
        self._range = measured.statistics.minimum, measured.statistics.maximum
        # Rays through voxels see no mixture across them, and the others begin at the box's other faces.
        self._pairs_zyx = [np.ascontiguousarray(pairs[:, ::-1]) for pairs in measured.pairs_zyx]
        self._spacing_mm_zyx = spacing_mm_zyx
        self._between: SampleFilter = between
        self._tables = [Table.exact(function) for function in functions]
        rays = [*self._rays_zyx, *map(self._between_pairs, self._pairs_zyx)]
        self._truth = [self._pictures(rays, table) for table in self._tables]

    def error(self, quantizer: Quantizer, entries: int) -> PictureDifference:
        """Return the largest errors over the transfer functions; of projections the maximum is that of any value."""
        values = [quantizer.decoded(quantizer.texels(rays)) for rays in (*self._rays_zyx, *self._pairs_zyx)]
        values[3:] = map(self._between_pairs, values[3:])
        errors = [
            difference_of_views(self._pictures(values, table.resampled(quantizer.window, entries)), truth)
            for table, truth in zip(self._tables, self._truth, strict=True)
        ]
        if self._compositing.cell_by_cell:
            errors.append(PictureDifference(0.0, self.largest_of_any_value(quantizer, entries)))
        return worst(errors)

    def largest_of_any_value(self, quantizer: Quantizer, entries: int) -> float:
        """Return the largest error of any value, where pixels may show one value alone; else 0.

        No mixture evens out their errors, and a sample of rays misses rare values: one slice of a CT, 20 mm thick, was
        0.0023 off on the sample with 256 entries over 4492 HU, and 0.42 in a picture. On rays that meet a single voxel
        it is the error of the table, for projections that of the codes as well.
        """
        single_mm = [mm for rays, mm in zip(self._rays_zyx, self._spacing_mm_zyx, strict=True) if len(rays) == 1]
        is_projection = self._compositing.cell_by_cell
        if self._between == "nearest" or not (single_mm or is_projection):
            return 0.0
        values = np.linspace(*self._range, _EVERY_VALUE)[None]
        coded = quantizer.decoded(quantizer.texels(values)) if is_projection else values
        length_mm = max(single_mm, default=1.0)  # projections do not ask for it

        def light(of: Float64Array, table: Table) -> Float64Array:
            return self._compositing.rays(of, length_mm, table, self._between)

        drawn = ((table, table.resampled(quantizer.window, entries)) for table in self._tables)
        return max(float(np.abs(light(coded, used) - light(values, exact)).max()) for exact, used in drawn)

    def _pictures(self, rays_zyx: Sequence[Float64Array], table: Table) -> list[Float64Array]:
        return [
            self._compositing.rays(rays, spacing_mm, table, self._between)
            for rays, spacing_mm in zip(rays_zyx, 2 * self._spacing_mm_zyx, strict=True)
        ]

    def _between_pairs(self, pairs: Float64Array) -> Float64Array:
        """Return the rays in the middle between pairs of rays [2, voxel, pair]; labels are not mixed."""
        between: Float64Array = pairs.mean(axis=0) if self._between == "linear" else pairs[0]
        return between


class _Trial(NamedTuple):
    """Codes, and their errors."""

    quantizer: Quantizer
    rays: PictureDifference  # with the longest table
    lit: PictureDifference | None  # None where nothing is lit, or codes are exact

    @property
    def error(self) -> PictureDifference:
        return self.rays if self.lit is None else worst([self.rays, self.lit])


class _Trials:
    """Codes that are tried on the sample of rays, for one scene."""

    def __init__(
        self,
        scene: Scene,
        profile: DeviceProfile,
        info: SourceInfo,
        measured: Measured,
        functions: tuple[TransferFunction, ...],
    ) -> None:
        self._scene, self._profile, self._info, self._measured = scene, profile, info, measured
        self._compositing = COMPOSITINGS[scene.render.compositing]
        self._settings = _settings(scene, profile, measured)
        between: SampleFilter = "nearest" if scene.source.labels else "linear"
        self.bench = _Bench(measured, info.grid.spacing_mm_zyx, functions, between, self._compositing)
        self._lit = _lit_bench(scene, info, measured, functions)
        self.lengths = [n for n in _ENTRIES if n <= profile.max_texture_size] or [profile.max_texture_size]
        """Possible lengths of lookup tables."""
        # An edited function may show any value.
        self._shown = () if scene.editable or self._compositing.every_value else functions

    def made(self) -> list[_Trial]:
        """Try codes, fewest bits first, until some suffice; the last ones are to be taken."""
        # A thin stack shows single cells, and few of them lie beside clipped voxels: the sample misses them. A window
        # around soft tissue was wrong by 0.63 where a circle of padding cut a body. None is clipped if codes suffice.
        whole_ranges = (True, False) if self._info.grid.is_thin_stack else (False,)
        trials: list[_Trial] = []
        for whole, bits in product(whole_ranges, _possible_bits(self._settings, self._profile)):
            trials.append(self._best_window(bits, whole=whole))
            if self._suffices(trials[-1]):
                break
        return trials

    def is_exact(self, quantizer: Quantizer) -> bool:
        """Return whether every stored value has a code of its own."""
        return is_exact(quantizer.bits, quantizer.window, self._info, self._measured.statistics)

    def _best_window(self, bits: Literal[8, 16], *, whole: bool) -> _Trial:
        tried = _windows(self._settings, bits, self._info, self._measured, self._shown)[: 1 if whole else None]
        quantizers = [Quantizer(bits, window, not has_exact_16_bits(self._profile)) for window in tried]
        trials = [
            _Trial(quantizer, self.bench.error(quantizer, self.lengths[-1]), self._lit_error(quantizer))
            for quantizer in quantizers
        ]
        # min keeps the first of equal ones: the widest.
        return min(trials, key=lambda trial: trial.error.rmse)

    def _lit_error(self, quantizer: Quantizer) -> PictureDifference | None:
        if self._lit is None or self.is_exact(quantizer):
            return None
        return self._lit.error(quantizer if self._scene.lit_normals is None else replace(quantizer, half_floats=False))

    def normals_error(self, quantizer: Quantizer) -> PictureDifference | None:
        """Return the largest change of lit rays by normals that the package holds; None if no light reads them."""
        held = self._scene.lit_normals
        if self._lit is None or held is None:
            return None
        return self._lit.error(replace(quantizer, half_floats=False), held.code)

    def _suffices(self, trial: _Trial) -> bool:
        # At a silhouette the smallest error of a value decides whether a ray hits: all of a pixel, not a grade of it.
        # Too few of the sampled rays graze a surface to measure that.
        if self._scene.editable or self._compositing.isovalue:
            return self.is_exact(trial.quantizer)
        tolerance = self._scene.tolerance
        return within_share(trial.error, tolerance) and trial.rays.rmse <= most_of_flip(tolerance)


def choose_values(
    scene: Scene, profile: DeviceProfile, info: SourceInfo, measured: Measured, functions: tuple[TransferFunction, ...]
) -> ValueChoice:
    """Choose bits, window and length of the lookup tables.

    Labels keep their value: 8 bits and a window from 0 to 255, or 16 bits for more of them. Else 8 bits if, with the
    best window, they change the pictures of the sample of rays by at most half of the scene's tolerance, lit or not, or
    if the profile has no wider format; else 16. Where users may edit transfer functions, all values have codes. There,
    and for surfaces, 8 bits are enough only if they give every stored value a code of its own. Raises VP3020 when the
    scene asks for bits that the profile does not have, VP3021 for a window without width, VP3025 and VP3026 for labels
    that have no code.
    """
    trials = _Trials(scene, profile, info, measured, functions)
    bench, lengths = trials.bench, trials.lengths
    made = trials.made()
    first, last = made[0], made[-1]
    quantizer = last.quantizer
    if scene.source.labels and quantizer.bits == 16:
        entries = _ENTRIES[-1]
        error = bench.error(quantizer, entries)
    elif scene.editable:
        entries = min(_EDITABLE_ENTRIES[quantizer.bits], lengths[-1])
        error = bench.error(quantizer, entries)
    else:
        allowed = PictureDifference(
            last.rays.rmse + TABLE_SHARE * scene.tolerance.rmse, SHARE * scene.tolerance.maximum
        )
        entries, error = _shortest_table(bench, quantizer, lengths, allowed)
    return ValueChoice(
        quantize=QuantizePlan(bits=quantizer.bits, window=quantizer.window, labels=bool(scene.source.labels)),
        quantizer=quantizer,
        entries=entries,
        error=error,
        lit_error=last.lit,
        normals_error=trials.normals_error(quantizer),
        narrow_error=first.error if first.quantizer.bits < quantizer.bits else None,
        exact=bool(scene.source.labels) or trials.is_exact(quantizer),
    )


def _settings(scene: Scene, profile: DeviceProfile, measured: Measured) -> QuantizeSettings:
    """Return the scene's settings, or the settings that its labels or colours need."""
    if scene.source.labels:
        return _label_settings(scene.quantize, measured, profile)
    if scene.colour is not None:
        # sRGB texels of light come from codes of 16 bits; without them light is linear and has 8.
        return QuantizeSettings(bits=16 if SRGB in profile.texture_formats else 8, window=(0.0, 1.0))
    return scene.quantize


def _lit_bench(
    scene: Scene, info: SourceInfo, measured: Measured, functions: tuple[TransferFunction, ...]
) -> LitBench | None:
    """Return the measurement of lit codes; None where nothing is lit, or codes must be exact."""
    compositing = COMPOSITINGS[scene.render.compositing]
    exact = scene.source.labels or scene.editable or compositing.isovalue
    if scene.render.lighting == "none" or exact or compositing.lit_rays is None:
        return None
    return LitBench(measured, info, [Table.exact(function) for function in functions], compositing.lit_rays, scene)


def _label_settings(settings: QuantizeSettings, measured: Measured, profile: DeviceProfile) -> QuantizeSettings:
    """Settings under which the code of a label is the label, or 64 times the label where there are more than 255."""
    low, high = measured.statistics.minimum, measured.statistics.maximum
    if low < 0 or high > MOST_LABELS:
        raise VolprepError("VP3025", problem=f"the values of the source go from {low:g} to {high:g}")
    if settings != QuantizeSettings():
        raise VolprepError("VP3025", problem="the scene asks for other codes in quantize")
    if high <= LARGEST_LABEL:
        return QuantizeSettings(bits=8, window=(0.0, float(LARGEST_LABEL)))
    if not has_bits(profile, 16) or profile.max_texture_size < _ENTRIES[-1]:
        fields = {"count": f"{high:g}", "low": "1", "high": f"{high:g}", "most": LARGEST_LABEL}
        how = "Choose a profile with textures of 16 bits, such as gles3, or split the labels over several files."
        raise VolprepError("VP3026", **fields, profile=f"for {profile.name}", how=how)
    return QuantizeSettings(bits=16, window=_MANY_LABELS_WINDOW)


def has_bits(profile: DeviceProfile, bits: Literal[8, 16]) -> bool:
    """Return whether the profile has a texture format for stored values of so many bits."""
    if bits == 16 and has_exact_16_bits(profile):
        return True
    formats = {"r8unorm", "rgba8unorm"} if bits == 8 else {"r16float"}
    return not formats.isdisjoint(profile.texture_formats)


def _possible_bits(settings: QuantizeSettings, profile: DeviceProfile) -> list[Literal[8, 16]]:
    """Narrowest first."""
    wanted: list[Literal[8, 16]] = [8, 16] if settings.bits == "auto" else [settings.bits]
    possible = [bits for bits in wanted if has_bits(profile, bits)]
    if not possible:
        raise VolprepError(
            "VP3020",
            profile=profile.name,
            bits=" or ".join(str(bits) for bits in wanted),
            formats=", ".join(profile.texture_formats),
        )
    return possible


def _windows(
    settings: QuantizeSettings, bits: int, info: SourceInfo, measured: Measured, functions: tuple[TransferFunction, ...]
) -> list[Window]:
    if settings.window == "auto":
        return windows(bits, info, measured.statistics, functions)
    low, high = settings.window
    if not low < high:
        raise VolprepError("VP3021", low=low, high=high)
    return [settings.window]


def within_share(error: PictureDifference, tolerance: Tolerance) -> bool:
    """Return whether an error is within the part of the tolerance that one decision may take."""
    return error.rmse <= SHARE * tolerance.rmse and error.maximum <= SHARE * tolerance.maximum


def most_of_flip(tolerance: Tolerance) -> float:
    """Return the RMSE along unlit rays whose FLIP in pictures is within the tolerance.

    Codes shift the colour of whole regions, which FLIP sees. The error of lit codes is noise, which it hardly sees.
    """
    return tolerance.flip / _FLIP_OF_RMSE


def _shortest_table(
    bench: _Bench, quantizer: Quantizer, lengths: list[int], allowed: PictureDifference
) -> tuple[int, PictureDifference]:
    for entries in lengths[:-1]:
        error = bench.error(quantizer, entries)
        within = error.rmse <= allowed.rmse
        if within and bench.largest_of_any_value(quantizer, entries) <= allowed.maximum:
            return entries, error
    return lengths[-1], bench.error(quantizer, lengths[-1])
