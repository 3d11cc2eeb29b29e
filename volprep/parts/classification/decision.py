"""How samples become colours: by lookup tables, pre-integrated tables or palettes, and the error of each.

Pre-integration is measured on the sample of rays, along which the field is linear between voxels, so the truth is known
exactly; the errors are the variation that samples miss between them, and the rounding of a table of this size.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.parts.case import Case
from volprep.parts.values.decision import TABLE_SHARE
from volprep.plan.decisions import Tables, ValueChoice
from volprep.plan.item_kinds import TABLE_NAMES
from volprep.plan.item_kinds import TABLES as TABLE_KINDS
from volprep.plan.probe import PictureDifference, difference_of_views
from volprep.plan.records import ChannelPlan, LookupPlan, PalettePlan, PreintegratedPlan
from volprep.plan.room import lookup_format
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene, SceneRender
from volprep.scene.wishes import refuse_wishes
from volprep.transfer.integral import ends_of_entries, integrate
from volprep.transfer.lookup import lookup_table
from volprep.transfer.palette import even_palette
from volprep.transfer.preclassified import classified_texels, medium_of_texels
from volprep.transfer.segment_light import segment_light
from volprep.transfer.texel_forms import LARGEST_HALF, opaque_per_mm
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import WITH_TABLES
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures.texel_formats import BYTES_PER_TEXEL

Classify = Callable[[Float64Array, Float64Array], tuple[Float64Array, Float64Array]]
"""Values at the front and the back of segments become their colours [..., 3] and mean extinctions per millimetre."""

_ENTRIES = (1024, 2048)
"""Sizes of a pre-integrated table, of 16 and 32 kB."""
_BLOCKS_OF_COLOUR = {"none", "auto", "astc-4x4"}
"""Compression that a volume in colour may have."""
_NOT_IN_COLOUR = (
    "[grid]",
    "[bricks]",
    "[proxy]",
    "[normals]",
    "render.lighting",
    "lighting.baked",
    "textures.mipmaps",
    "skip.ranges",
    "fidelity",
)
"""Wishes that need values."""
_RAYS = 256
_MORE_SAMPLES = 4
_REFERENCES = 8
"""Reference lengths of classified voxels that are tried: 1 to 128 steps."""
CLASSIFIED_BITS = 32
"""Bits of a classified voxel."""


def tables_bytes(wishes: SceneRender, profile: DeviceProfile, entries: int) -> int:
    """Return the bytes that the tables of one transfer function may take at most; lookup tables have `entries`."""
    if wishes.decided_classification not in WITH_TABLES:
        return 0
    if wishes.classification == "preintegrated":
        return _integral_bytes(_largest(profile))
    return entries * BYTES_PER_TEXEL[lookup_format(profile)]


def require_one_channel(scene: Scene, _profile: DeviceProfile, channels: int) -> Scene:
    """Raise VP1244 for classified voxels of several channels."""
    if channels > 1 and scene.render.classification == "preclassified":
        raise VolprepError("VP1244", path=scene.name, what="voxels that are classified")
    return scene


def require_classification(scene: Scene, _profile: DeviceProfile) -> None:
    """Raise VP3041, VP3045 and VP3046 if the scene has what its classification or compositing excludes."""
    name = scene.render.classification
    if name == "colour":
        _require_colour(scene)
    _require_compositing(scene)
    if name == "preclassified":
        refuse_wishes("VP3041", scene, ("several transfer functions", "[proxy]", "skip.ranges"))
        if scene.must_be_cut:
            raise VolprepError("VP3041", what="[grid]")


def _require_colour(scene: Scene) -> None:
    """Raise VP3046 for settings that a volume in colour does not support."""
    refuse_wishes("VP3046", scene, _NOT_IN_COLOUR)
    if scene.textures.compression not in _BLOCKS_OF_COLOUR:
        raise VolprepError("VP3046", what=f'textures.compression = "{scene.textures.compression}"')
    if scene.textures.channels == "apart":
        raise VolprepError("VP3046", what="channels in textures of their own")


def _require_compositing(scene: Scene) -> None:
    """Raise VP3045 for settings that the compositing does not support, VP3115 to VP3120 for missing ones."""
    render = scene.render
    compositing = COMPOSITINGS[render.compositing]
    unwanted = {
        f"classification {render.classification}": render.classification in compositing.classifications,
        f"lighting {render.lighting}": render.lighting == "none" or compositing.lit,
    }
    for what, is_possible in unwanted.items():
        if not is_possible:
            raise VolprepError("VP3045", compositing=render.compositing, what=what)
    able = {"[together]": compositing.several, "source.labels": compositing.labels, "[proxy]": compositing.meshes}
    excluded = [name for name, is_able in able.items() if not is_able]
    refuse_wishes("VP3045", scene, excluded, compositing=render.compositing)
    if render.lighting in {"phong", "blinn-phong"} and scene.lighting.light_mm is None:
        raise VolprepError("VP3119", lighting=render.lighting)
    if render.lighting != "none" and scene.lighting.normals != "volume" and render.classification == "preclassified":
        raise VolprepError("VP3120", normals=scene.lighting.normals)
    for transfer in scene.transfer:
        if compositing.isovalue and transfer.isovalue is None:
            raise VolprepError("VP3115", transfer=transfer.name, compositing=render.compositing)
        if compositing.intensities:
            low, high = transfer.resolved().intensity_range
            if not low < high:
                raise VolprepError("VP3118", transfer=transfer.name, low=low, high=high)


def require_isovalues(case: Case) -> Case:
    """Return the channel. Raises VP3116 for an isovalue that no voxel has, VP3117 for one that the function hides."""
    if not COMPOSITINGS[case.scene.render.compositing].isovalue:
        return case
    low, high = case.measured.statistics.minimum, case.measured.statistics.maximum
    for function in case.functions:
        isovalue = function.isovalue or 0.0
        if not low <= isovalue <= high:
            raise VolprepError("VP3116", transfer=function.name, isovalue=isovalue, low=low, high=high)
        if not Table.exact(function).largest_extinction(isovalue, isovalue):
            raise VolprepError("VP3117", transfer=function.name, isovalue=isovalue)
    return case


def choose_tables(case: Case, step_mm: float) -> Tables:
    """Choose the tables, as small as their error allows; `step_mm` is the step of the package."""
    wishes, profile, functions, values = case.scene.render, case.profile, case.functions, case.values
    step = StepLengths(segment_mm=step_mm, voxel_mm_zyx=case.info.grid.spacing_mm_zyx)
    if wishes.classification == "lookup":
        reason = f"{values.entries} entries: the sample of rays changes by {values.error.text}"
        lookups = tuple(_lookup(function, values.entries, profile, step.segment_mm) for function in functions)
        return Tables(lookups=lookups, reasons=(reason,) * len(functions))
    rays = _Rays(values, case.measured, step)
    if wishes.classification == "palette":
        palettes = tuple(PalettePlan(transfer=function.name, entries=wishes.palette_entries) for function in functions)
        reasons = tuple(rays.palette_reason(function, wishes.palette_entries) for function in functions)
        return Tables(palettes=palettes, reasons=reasons)
    if wishes.classification == "control-points":
        names = tuple(function.name for function in functions)
        reasons = tuple(rays.points_reason(function, values.entries) for function in functions)
        return Tables(points=names, reasons=reasons)
    if wishes.classification == "colour":
        return Tables()
    if wishes.classification == "preclassified":
        (function,) = functions
        reference_mm, error = rays.best_reference(function)
        reason = rays.classified_reason(function, reference_mm, error)
        return Tables(voxels=(function.name, reference_mm), reasons=(reason,))
    planned: list[PreintegratedPlan] = []
    texts: list[str] = []
    for function in functions:
        entries, error = rays.smallest_table(function, profile, TABLE_SHARE * case.scene.tolerance.rmse)
        planned.append(_preintegrated(function, entries))
        texts.append(rays.preintegration_reason(function, entries, error))
    return Tables(preintegrated=tuple(planned), reasons=tuple(texts))


def table_bytes(table: LookupPlan | PreintegratedPlan) -> int:
    """Return the bytes of a table."""
    if isinstance(table, LookupPlan):
        return table.entries * BYTES_PER_TEXEL[table.format]
    return _integral_bytes(table.entries)


def describe_tables(plan: ChannelPlan, tables: Tables) -> Iterator[PlanItem]:
    """Say with what samples are classified, and why it has the size that it has."""
    reasons = iter(tables.reasons)
    tables_held: tuple[LookupPlan | PreintegratedPlan, ...] = (*plan.lookups, *plan.preintegrated)
    for table in tables_held:
        yield PlanItem(
            name=f"{TABLE_NAMES[type(table)]} {table.transfer}",
            kind=TABLE_KINDS[type(table)],
            transfer=table.transfer,
            kept=True,
            reason=next(reasons),
            files=(table.file,),
            size_bytes=table_bytes(table),
        )
    if tables.voxels is not None:
        yield PlanItem(
            name=f"voxels classified by {tables.voxels[0]}", kind="classified-voxels", kept=True, reason=next(reasons)
        )
    for name in tables.points:
        yield PlanItem(
            name=f"control points {name}", kind="control-points", transfer=name, kept=True, reason=next(reasons)
        )
    for palette in plan.palettes:
        yield PlanItem(
            name=f"palette {palette.transfer}",
            kind="palette",
            transfer=palette.transfer,
            kept=True,
            reason=next(reasons),
        )
    if not plan.preintegrated:
        yield PlanItem(
            name="pre-integrated tables",
            kind=TABLE_KINDS[PreintegratedPlan],
            kept=False,
            reason="the scene classifies single samples",
            size_bytes=len(plan.transfer_functions) * _integral_bytes(_largest(plan.profile)),
        )


@dataclass(frozen=True)
class StepLengths:
    """Distances along a ray."""

    segment_mm: float
    """Nominal step of the package."""
    voxel_mm_zyx: tuple[float, float, float]
    """Distance of the voxels along the samples of rays."""

    def along_axes(self, finer: int = 1) -> list[tuple[int, float]]:
        """Return, for each axis, the number of segments between two voxels and their length, near the nominal step.

        `finer` multiplies the number.
        """
        pieces = [finer * max(1, round(voxel_mm / self.segment_mm)) for voxel_mm in self.voxel_mm_zyx]
        return [(count, voxel_mm / count) for count, voxel_mm in zip(pieces, self.voxel_mm_zyx, strict=True)]


class _Rays:
    """The samples of rays as the codes give them."""

    def __init__(self, values: ValueChoice, measured: Measured, step: StepLengths) -> None:
        few = [rays[:, :: max(1, rays.shape[1] // _RAYS)] for rays in measured.rays_zyx]
        self._rays_zyx = [values.quantizer.decoded(values.quantizer.texels(rays)) for rays in few]
        self._window = values.quantize.window
        self._step = step

    def smallest_table(
        self, function: TransferFunction, profile: DeviceProfile, slack_rmse: float
    ) -> tuple[int, PictureDifference]:
        """Number of entries, and error against exact segments."""
        sizes = _sizes(profile)
        truth = self._truth(function)
        errors = [difference_of_views(self._light(self._table(function, n)), truth) for n in sizes]
        found = next(i for i, error in enumerate(errors) if error.rmse <= errors[-1].rmse + slack_rmse)
        return sizes[found], errors[found]

    def preintegration_reason(self, function: TransferFunction, entries: int, error: PictureDifference) -> str:
        """Compare the table with the same number of samples, and with four times that number."""
        truth = self._truth(function)
        samples = _samples(Table.exact(function))
        few, many = (difference_of_views(self._light(samples, finer), truth) for finer in (1, _MORE_SAMPLES))
        return (
            f"{entries} entries for segments of any length: with {self._step.segment_mm:.3g} mm the sample "
            f"of rays is off by {error.text}; single samples would be off by {few.text}, "
            f"four times as many by {many.text}"
        )

    def palette_reason(self, function: TransferFunction, entries: int) -> str:
        """Compare the palette with the function, both by samples."""
        exact = self._light(_samples(Table.exact(function)))
        error = difference_of_views(self._light(_nearest(function, self._window, entries)), exact)
        return f"{entries} entries in the shader: the sample of rays changes by {error.text}"

    def points_reason(self, function: TransferFunction, entries: int) -> str:
        """Compare the function itself with a lookup table of it, both by samples."""
        exact = self._light(_samples(Table.exact(function)))
        rows = lookup_table(function, self._window, entries)
        table = Table(np.linspace(*self._window, entries), rows[:, :3], rows[:, 3])
        error = difference_of_views(self._light(_samples(table)), exact)
        return (
            f"{len(function.points)} points in the shader, which are the function itself, and no texture; with a "
            f"lookup table of {entries} entries the sample of rays would change by {error.text}"
        )

    def best_reference(self, function: TransferFunction) -> tuple[float, PictureDifference]:
        """Reference length of classified voxels, a multiple of the step, and its error against exact segments."""
        truth = self._truth(function)
        lengths = [self._step.segment_mm * 2**power for power in range(_REFERENCES)]
        errors = [difference_of_views(self._classified_light(function, length), truth) for length in lengths]
        best = min(range(_REFERENCES), key=lambda index: errors[index].rmse)
        return lengths[best], errors[best]

    def classified_reason(self, function: TransferFunction, reference_mm: float, error: PictureDifference) -> str:
        """Compare classified voxels with samples that are classified after the filter."""
        samples = difference_of_views(self._light(_samples(Table.exact(function))), self._truth(function))
        return (
            f"four channels instead of one; opacities are for {reference_mm:.3g} mm: the sample of rays "
            f"is off by {error.text}; samples of the values would be off by {samples.text}"
        )

    def _classified_light(self, function: TransferFunction, reference_mm: float) -> list[Float64Array]:
        """Colour and opacity of the rays, where the filter mixes classified voxels."""
        table = Table.exact(function)
        return [
            _light(*_classified(table, rays, reference_mm), pieces, length_mm)
            for rays, (pieces, length_mm) in zip(self._rays_zyx, self._step.along_axes(), strict=True)
        ]

    def _truth(self, function: TransferFunction) -> list[Float64Array]:
        table = Table.exact(function)

        def exactly(length_mm: float) -> Classify:
            return lambda front, back: segment_light(table, front, back, length_mm)

        return [
            _light(rays, exactly(length_mm), pieces, length_mm)
            for rays, (pieces, length_mm) in zip(self._rays_zyx, self._step.along_axes(), strict=True)
        ]

    def _table(self, function: TransferFunction, entries: int) -> Classify:
        opaque = opaque_per_mm(self._step.segment_mm)
        table = Table.exact(function)
        return integrate(table, ends_of_entries([table], self._window, entries), entries, opaque).at

    def _light(self, classify: Classify, finer: int = 1) -> list[Float64Array]:
        """Colour and opacity of the rays of each axis, with `finer` times the nominal segments."""
        return [
            _light(rays, classify, pieces, length_mm)
            for rays, (pieces, length_mm) in zip(self._rays_zyx, self._step.along_axes(finer), strict=True)
        ]


def _light(rays: Float64Array, classify: Classify, pieces: int, length_mm: float) -> Float64Array:
    """Colour and opacity of rays [voxel, ray] as [ray, 4], with so many segments between two voxels."""
    light = np.zeros((rays.shape[1], 4))
    depth = np.zeros(rays.shape[1])
    for lower, upper in pairwise(rays):
        ends = lower + np.linspace(0.0, 1.0, pieces + 1)[:, None] * (upper - lower)
        colour, extinction = classify(ends[:-1], ends[1:])
        depths = depth + np.vstack([np.zeros(len(depth)), np.cumsum(extinction * length_mm, axis=0)])
        weight = np.exp(-depths[:-1]) - np.exp(-depths[1:])
        light[:, :3] += (weight[..., None] * colour).sum(axis=0)
        depth = depths[-1]
    light[:, 3] = -np.expm1(-depth)
    return light


def _classified(table: Table, rays: Float64Array, reference_mm: float) -> tuple[Float64Array, Classify]:
    """Return the place of each voxel on its ray [voxel, ray], and the filter of classified voxels between them."""
    depth, count = rays.shape
    texels = classified_texels(table, rays.ravel(), reference_mm).reshape(depth, count, 4) / 255

    def classify(front: Float64Array, back: Float64Array) -> tuple[Float64Array, Float64Array]:
        at = (front + back) / 2
        lower = np.clip(at.astype(np.intp), 0, max(depth - 2, 0))
        share = (at - lower)[..., None]
        ray = np.arange(count)
        upper = np.minimum(lower + 1, depth - 1)
        return medium_of_texels(texels[lower, ray] * (1 - share) + texels[upper, ray] * share, reference_mm)

    return np.broadcast_to(np.arange(depth, dtype=np.float64)[:, None], (depth, count)), classify


def _samples(table: Table) -> Classify:
    def classify(front: Float64Array, back: Float64Array) -> tuple[Float64Array, Float64Array]:
        colour, extinction = table.at(((front + back) / 2).ravel())
        return colour.reshape(*front.shape, 3), extinction.reshape(front.shape)

    return classify


def _nearest(function: TransferFunction, window: tuple[float, float], entries: int) -> Classify:
    colour, extinction = even_palette(function, window, entries)
    low, high = window

    def classify(front: Float64Array, back: Float64Array) -> tuple[Float64Array, Float64Array]:
        share = ((front + back) / 2 - low) / (high - low)
        entry = np.clip(np.floor(share * (entries - 1) + 0.5), 0, entries - 1).astype(np.intp)
        return colour[entry], extinction[entry]

    return classify


def _sizes(profile: DeviceProfile) -> list[int]:
    return [entries for entries in _ENTRIES if entries <= profile.max_texture_size] or [profile.max_texture_size]


def _largest(profile: DeviceProfile) -> int:
    return _sizes(profile)[-1]


def _lookup(function: TransferFunction, entries: int, profile: DeviceProfile, step_mm: float) -> LookupPlan:
    name = f"transfer-{function.name}"
    # Of voxels of some nanometres, half floats cannot hold the extinction per millimetre; bytes have a scale.
    largest_per_mm = min(max(point.extinction_per_mm for point in function.points), opaque_per_mm(step_mm))
    texel_format = lookup_format(profile) if largest_per_mm <= LARGEST_HALF else "rgba8unorm"
    return LookupPlan(
        transfer=function.name, name=name, file=f"textures/{name}.ktx2", format=texel_format, entries=entries
    )


def _preintegrated(function: TransferFunction, entries: int) -> PreintegratedPlan:
    name = f"preintegrated-{function.name}"
    return PreintegratedPlan(transfer=function.name, name=name, file=f"textures/{name}.ktx2", entries=entries)


def _integral_bytes(entries: int) -> int:
    """Return the bytes of a pre-integrated table: four sums of four bytes each."""
    return 16 * entries
