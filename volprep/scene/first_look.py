"""Default look of a scan without a scene file: a transfer function made from its values, lit where devices can.

Labels get a colour each. CT in Hounsfield units, or in values that are offset from them, gets its bones, or its soft
tissue if it has no bone. A level set gets its surface. Values on both sides of 0, as maps of differences have, become
denser with their distance from 0: blue below, red above. All others (MR, ultrasound, microscopy, micro-CT) get what
surrounds the object transparent and the object in warm grey; bright vessels, and bones in other units, stay visible in
a veil of the rest. A piece or a slab that is cut out of an object shows its inside on its faces, where light would show
the noise of normals: they look like slices, and so do thin stacks and slices far apart through an object that is bright
on one side, such as a spine.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from volprep.scene.label_look import label_transfer
from volprep.scene.points import ScenePoint
from volprep.scene.presets import PRESET_LABELS, load_preset
from volprep.scene.scene import LightingSettings, NormalSettings, Scene, SceneRender
from volprep.scene.segments import SegmentStyle
from volprep.scene.transfer import SceneTransfer
from volprep.scene.values import BONE_HU, Values, hounsfield_offset, values_of
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel import Statistics
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.segmentations.records import numbers_text
from volprep_formats.source import SourceInfo

_DENSE_SHARE = 50.0
"""Extinction of the densest value of a signed map: opaque (1 - exp(-5)) after a tenth of the diagonal."""
_INSIDE_SHARE = 4.0
"""Extinction inside segments, as part of that: two thirds are hidden after a two-hundredth of the diagonal, so that
light on their borders shows their shape."""
_VEIL = 0.06
"""Factor of the extinction of what belongs to no segment."""
_FAINT = 2 / 255
"""Factor of the extinction of segments that hold others, a step of the table of looks: half of a body is hidden."""
_BOTH_SIDES = 0.2
"""Part of the farther side of 0 that the nearer one must reach, so that the ringing of a filter makes no signed map."""
_SLICES = "slices"
"""Name of the transfer function of a thin stack."""
_PIECE = "faces"
"""Name of the transfer function of a piece that fills its field."""
_FILLED = 0.4
"""Share of the faces of the box above the background from which on a scan is a piece of something: a block of a head
has 0.6; heads, brains, small animals and parts in a field of their own have 0 to 0.17."""
_OPEN = 0.5
"""Part of the object's mean share of all planes that a face has where it cuts the object open."""
_SLAB = 0.6
"""Thickness of a slab, at most, as part of its widest extent. Cut faces of longer pieces, as of limbs, are small."""
_FAR_APART = 3.0
"""Times the distance of pixels from which on slices are far apart."""
_APART = 1.5
"""The same from which on an object that is bright on one side is shown to its dim end, as an MR is at any distance.
Where voxels are cubes, as in PET, people look at bright places in a dim body."""
_SHARE = 0.01
"""Part of the diagonal that opacities of surfaces are for."""
_CT_SLICES = ((-200.0, "#000000", 0.0), (-150.0, "#1a1a1a", 0.6), (300.0, "#ffffff", 0.99))
"""Value in HU, colour and opacity of slices of a CT: the usual window of soft tissue, in which bone is white."""
_BODY_MM = 150.0
"""Diagonal of a CT below which the presets, whose opacities are for heads and trunks, show a thin veil."""
_BONE, _SOFT_TISSUE = "ct-bone", "ct-soft-tissue"
"""Presets of a CT in Hounsfield units, with and without bone."""
_CT = frozenset(("", "CT"))
"""Modalities whose values may be Hounsfield units although no unit is stated."""


Faces = tuple[Float64Array, Float64Array, Float64Array]
"""Values on the faces of a box across z, y and x, each [first or last, place]."""


@dataclass(frozen=True)
class FirstLook:
    """The kind of scan that was recognised, and its look."""

    said: str
    """For people."""
    scene: Scene
    """The scene with its transfer function."""


def with_first_look(
    scene: Scene,
    profile: DeviceProfile,
    info: SourceInfo,
    statistics: Statistics,
    sample: Float64Array,
    *,
    faces: Faces,
) -> Scene:
    """Return the scene with a transfer function that shows something of any scan, and the kind that was recognised.

    `sample` holds physical values of the scan, `faces` such of the faces of its box. The module docstring describes the
    look of each kind of scan. Raises VP3027 for a table of labels without labels.
    """
    look = _look(scene, profile, info, statistics, sample, faces)
    said = look.scene.recognised or f"recognised as {look.said}; --preset NAME, or a scene, draws it in another way"
    return look.scene.model_copy(update={"recognised": said})


def _look(  # noqa: PLR0917 - of one caller
    scene: Scene, profile: DeviceProfile, info: SourceInfo, statistics: Statistics, sample: Float64Array, faces: Faces
) -> FirstLook:
    if scene.source.labels:
        return FirstLook("labels", _with_labels(scene, profile, info, statistics))
    if scene.source.label_table is not None:
        raise VolprepError("VP3027", table=scene.source.label_table)
    if info.level_set and profile.has_shaders and statistics.minimum < 0.0 < statistics.maximum:
        return FirstLook("a level set, whose surface is drawn", _with_surface(scene, statistics))
    offset = 0.0 if info.unit == "HU" else None
    if offset is None and not info.unit and info.modality in _CT:
        offset = hounsfield_offset(sample)
    if offset is not None and info.grid.is_thin_stack:
        said = "a thin stack of a CT, drawn as its slices look between -200 and 300 HU"
        return FirstLook(said, scene.with_transfer((_ramp(_CT_SLICES, -offset),)))
    if offset is not None:
        return _of_ct(scene, profile, info, statistics, offset)
    values = values_of(sample)
    cut_out = _cut_out(info.grid, values, sample, faces)
    if cut_out:
        on_faces = _slices(values).model_copy(update={"name": _PIECE})
        return FirstLook(f"{cut_out}, whose faces look like slices", scene.with_transfer((on_faces,)))
    return _of_values(scene, profile, info, statistics, values)


def _cut_out(grid: Grid, values: Values, sample: Float64Array, faces: Faces) -> str:
    """Say what part of an object without bright vessels the box cuts out; "" if it holds all of it, or few slices."""
    is_positive = -values.low <= _BOTH_SIDES * values.high
    if grid.is_thin_stack or not is_positive or values.low >= values.high or values.vessels is not None:
        return ""
    on_faces = np.concatenate([ends.ravel() for ends in faces])
    if np.count_nonzero(on_faces > values.background) >= _FILLED * on_faces.size:
        return "a piece that fills its field"
    # A head is cut below; a slab on both sides. A flat volume is looked at along its thin axis: one side is enough.
    axis = int(np.argmin(grid.extent_mm_zyx))
    shares = (faces[axis] > values.background).mean(axis=1)
    share = shares.min() if grid.thin_axis is None else shares.max()
    is_short = grid.extent_mm_zyx[axis] <= _SLAB * max(grid.extent_mm_zyx)
    is_slab = is_short and share >= _OPEN * (sample > values.background).mean()
    return "a slab that is cut out of an object" if is_slab else ""


def _of_values(
    scene: Scene, profile: DeviceProfile, info: SourceInfo, statistics: Statistics, values: Values
) -> FirstLook:
    """Return the look of a scan when only its values are known."""
    if min(-values.low, values.high) > _BOTH_SIDES * max(-values.low, values.high):
        return FirstLook("a map with values on both sides of 0", scene.with_transfer((_signed(info, statistics),)))
    if values.low == values.high < statistics.maximum:
        return _small(scene, profile, info, statistics, values.low)
    if not values.low < values.high:
        return FirstLook("a scan of nearly one value", scene.with_transfer((_grey(info, statistics),)))
    if info.grid.is_thin_stack:
        return FirstLook("a thin stack, drawn as its slices look", scene.with_transfer((_slices(values),)))
    apart = max(info.grid.spacing_mm_zyx) / min(info.grid.spacing_mm_zyx)
    if values.dim is not None and (apart >= _APART or info.modality == "MR"):
        # At most half of the voxels above the lower threshold are above the other one.
        values = replace(values, background=values.dim, median=values.background)
        if apart >= _FAR_APART:
            said = "slices far apart, brighter on one side, drawn as they look"
            return FirstLook(said, scene.with_transfer((_uneven_slices(values),)))
    kind = "an object in a dark field"
    if values.vessels is not None:
        kind = "bright vessels in tissue"
    elif values.dense is not None:
        kind = "an object with dense parts, such as bones"
    background = f"{kind}, whose values up to {values.background:.4g} are background"
    return FirstLook(background, lit_from_viewer(scene.with_transfer((_object(statistics, values),)), profile))


def _small(scene: Scene, profile: DeviceProfile, info: SourceInfo, statistics: Statistics, field: float) -> FirstLook:
    """Return the look of an object of few voxels in a `field` of one value, such as a mask of one structure."""
    high = statistics.maximum
    middle = (field + high) / 2
    found = _object(statistics, Values(field, high, middle, high, None))
    # As dense as a surface over a voxel: parts of the diagonal may be thicker than the object.
    found = found.model_copy(update={"reference_share": None, "reference_mm": min(info.grid.spacing_mm_zyx)})
    said = f"a small object in a field of one value, whose values up to {middle:.4g} are background"
    return FirstLook(said, lit_from_viewer(scene.with_transfer((found,)), profile))


def _with_labels(scene: Scene, profile: DeviceProfile, info: SourceInfo, statistics: Statistics) -> Scene:
    table = scene.source.label_table
    if table is None and statistics.maximum <= PRESET_LABELS:
        return _lit_in_voxels(scene.with_preset("labels", profile), profile)
    return _lit_in_voxels(scene.with_transfer((label_transfer(info, table, int(statistics.maximum)),)), profile)


def _lit_in_voxels(scene: Scene, profile: DeviceProfile) -> Scene:
    """Return a scene of labels lit from the viewer, if devices have 3D textures and the scene says nothing else."""
    stated = {"lighting", "compositing", "technique", "classification"} & scene.render.model_fields_set
    is_other = scene.editable or scene.bricks is not None or scene.grid is not None or scene.textures.mipmaps
    if stated or is_other or not profile.max_3d_texture_size:
        return scene
    normals = scene.normals or NormalSettings(code="oct8")
    lighting = scene.lighting.model_copy(update={"normals": "volume"})
    render = scene.render.model_copy(update={"lighting": "headlight"})
    return scene.model_copy(update={"render": render, "lighting": lighting, "normals": normals})


def _of_ct(scene: Scene, profile: DeviceProfile, info: SourceInfo, statistics: Statistics, offset: float) -> FirstLook:
    """Return the look of a CT whose values are `offset` below Hounsfield units.

    A small piece is as opaque over its own diagonal as a preset is over `_BODY_MM`.
    """
    name = _BONE if statistics.maximum + offset >= BONE_HU else _SOFT_TISSUE
    said = "a CT" if offset == 0.0 else f"a CT whose values are {-offset:g} above Hounsfield units"
    part_of_body = min(1.0, math.hypot(*info.grid.extent_mm_zyx) / _BODY_MM)
    if offset == 0.0 and part_of_body == 1.0:
        return FirstLook(f"{said}, preset {name}", lit_from_viewer(scene.with_preset(name, profile), profile))
    preset = load_preset(name)
    points = tuple(_adapted(point, -offset, 1.0 / part_of_body) for point in preset.points)
    reference_mm = preset.reference_mm and preset.reference_mm * part_of_body
    adapted = SceneTransfer(name=name, points=points, reference_mm=reference_mm)
    opacity = "" if part_of_body == 1.0 else f", {1.0 / part_of_body:.3g} times as opaque because it is a small piece"
    return FirstLook(f"{said}, preset {name}{opacity}", lit_from_viewer(scene.with_transfer((adapted,)), profile))


def _adapted(point: ScenePoint, added: float, denser: float) -> ScenePoint:
    """Return a point with `added` to its value and its extinction, if it has one, multiplied by `denser`."""
    extinction = point.extinction_per_mm and point.extinction_per_mm * denser
    return point.model_copy(update={"value": point.value + added, "extinction_per_mm": extinction})


def _pale(point: ScenePoint) -> ScenePoint:
    """Return a point whose colour is halfway to white: the little that a veil shows of a dark colour is black."""
    parts = (int(str(point.colour)[at : at + 2], 16) for at in (1, 3, 5))
    return point.model_copy(update={"colour": "#" + "".join(f"{(part + 256) // 2:02x}" for part in parts)})


def lit_from_viewer(scene: Scene, profile: DeviceProfile) -> Scene:
    """Return the scene lit from the viewer, where the devices can and the scene says nothing else."""
    if not profile.has_shaders or {"lighting", "compositing"} & scene.render.model_fields_set:
        return scene
    render = scene.render.model_copy(update={"lighting": "headlight"})
    lighting = scene.lighting
    if "normals" not in lighting.model_fields_set:
        lighting = LightingSettings.model_validate(lighting.model_dump(exclude_unset=True) | {"normals": "central"})
    return scene.model_copy(update={"render": render, "lighting": lighting})


def with_segment_styles(
    scene: Scene, profile: DeviceProfile, info: SourceInfo, statistics: Statistics, holding: Sequence[int] = ()
) -> Scene:
    """Return a scene without a scene file, with a second transfer function for the inside of its segments.

    Segments with the numbers `holding` have other segments inside, and are faint.

    The first function becomes a veil around them: a ramp, or pale soft tissue of a CT. A thin stack keeps the function
    of its slices, which the colours of segments tint: a veil of so few hides nothing, and light says nothing.
    """
    if scene.segments is None:
        return scene
    if any(transfer.name == _SLICES for transfer in scene.transfer):
        return scene.model_copy(update={"recognised": _recognised("a thin stack, its slices tinted by its segments")})
    faint = (SegmentStyle(labels=tuple(holding), opacity=_FAINT),) if holding else ()
    veiled = scene.segments.model_copy(update={"outside_opacity": _VEIL, "style": (*faint, *scene.segments.style)})
    if scene.transfer[0].preset in {_BONE, _SOFT_TISSUE} or info.unit == "HU":
        preset = load_preset(_SOFT_TISSUE)
        points = tuple(_pale(point) for point in preset.points)
        scene = scene.with_transfer((SceneTransfer(name=_SOFT_TISSUE, points=points),))
    else:
        scene = scene.with_transfer((_grey(info, statistics),))
    dense_per_mm = _dense_per_mm(info) * _INSIDE_SHARE
    low = statistics.minimum
    high = max(statistics.maximum, low + 1e-6)
    points = (
        ScenePoint(value=low, colour="#8c8c8c", extinction_per_mm=dense_per_mm),
        ScenePoint(value=high, colour="#ffffff", extinction_per_mm=dense_per_mm),
    )
    scene = scene.with_segments(veiled).with_transfer((*scene.transfer, SceneTransfer(name="inside", points=points)))
    if "classification" not in scene.render.model_fields_set:
        # A few points take less time than two tables (parts/classification/automatic.py).
        scene = scene.model_copy(update={"render": scene.render.model_copy(update={"classification": "auto"})})
    held = f"; segments around others are faint: {numbers_text(holding)}" if holding else ""
    return lit_from_viewer(scene, profile).model_copy(update={"recognised": _recognised(f"a scan with segments{held}")})


def _recognised(kind: str) -> str:
    return f"recognised as {kind}; a scene with [segments] and [[segments.style]] draws it in another way"


def _with_surface(scene: Scene, statistics: Statistics) -> Scene:
    points = tuple(
        ScenePoint(value=value, colour="#d9d2c5", opacity=1.0) for value in (statistics.minimum, statistics.maximum)
    )
    wishes = {"compositing": "isosurface", "lighting": "headlight"} | scene.render.model_dump(exclude_unset=True)
    surface = SceneTransfer(name="surface", points=points, reference_mm=1.0, isovalue=0.0)
    # At an outline a pixel shows the surface or nothing: only the mean error says something.
    tolerance = scene.tolerance.model_copy(update={"maximum": 1.0})
    update = {"render": SceneRender.model_validate(wishes), "tolerance": tolerance}
    return scene.with_transfer((surface,)).model_copy(update=update)


def _object(statistics: Statistics, values: Values) -> SceneTransfer:
    """Return a function that leaves out the background and draws the object in warm grey, brighter where it is dense.

    With vessels or dense parts, all below them is a veil.
    """
    start = values.low + 0.7 * (values.background - values.low)
    full = values.background + 0.5 * (values.median - values.background)
    top = max(statistics.maximum, values.high)
    if values.vessels is None and values.dense is not None:
        steps = (
            (start, "#7d6a5a", 0.0),
            (full, "#a08a76", 0.02),
            (values.dense[0], "#c9b49e", 0.05),
            (values.dense[1], "#ecd9b6", 0.95),
            (top, "#ffffff", 0.99),
        )
    elif values.vessels is None:
        steps = (
            (start, "#7d6a5a", 0.0),
            (values.background, "#a08a76", 0.25),
            (full, "#c9b49e", 0.9),
            (values.high, "#fff3e4", 0.99),
            (top, "#ffffff", 0.99),
        )
    else:
        steps = (
            (start, "#7d6a5a", 0.0),
            (full, "#a08a76", 0.02),
            (values.vessels, "#b5654a", 0.05),
            (values.vessels + 0.25 * (values.high - values.vessels), "#d8503a", 0.95),
            (top, "#ffd9b0", 0.99),
        )
    points = [ScenePoint(value=value, colour=colour, opacity=opacity) for value, colour, opacity in _ascending(steps)]
    return SceneTransfer(name="object", points=tuple(points), reference_share=_SHARE)


def _slices(values: Values) -> SceneTransfer:
    """Return a grey ramp over the values without outliers, dense enough that the nearest slice is seen."""
    return _ramp(((values.low, "#000000", 0.0), (values.background, "#404040", 0.6), (values.high, "#ffffff", 0.99)))


def _uneven_slices(values: Values) -> SceneTransfer:
    """Return the same for an object that is bright on one side: most of the greys are for the values of its dim end."""
    dark = (values.low, "#000000", 0.0), (values.background, "#606060", 0.6)
    return _ramp((*dark, (values.median, "#c8c8c8", 0.95), (values.high, "#ffffff", 0.99)))


def _ramp(steps: tuple[tuple[float, str, float], ...], offset: float = 0.0) -> SceneTransfer:
    """Return a function through (value, colour, opacity), with `offset` added to each value."""
    points = tuple(
        ScenePoint(value=value + offset, colour=colour, opacity=opacity) for value, colour, opacity in _ascending(steps)
    )
    return SceneTransfer(name=_SLICES, points=points, reference_share=_SHARE)


def _ascending(steps: tuple[tuple[float, str, float], ...]) -> list[tuple[float, str, float]]:
    """Return the steps, leaving out each that is not greater than the one before."""
    kept = [steps[0]]
    for step in steps[1:]:
        if step[0] > kept[-1][0]:
            kept.append(step)
    return kept


def _dense_per_mm(info: SourceInfo) -> float:
    return _DENSE_SHARE / math.hypot(*info.grid.extent_mm_zyx)


def _grey(info: SourceInfo, statistics: Statistics) -> SceneTransfer:
    """Return a ramp over the values. A scan of exactly one value is white all through.

    A ramp without length is a jump at the very value of all voxels: the picture would depend on rounding.
    """
    is_flat = statistics.minimum == statistics.maximum
    dense_per_mm = _dense_per_mm(info)
    points = (
        ScenePoint(
            value=statistics.minimum,
            colour="#ffffff" if is_flat else "#000000",
            extinction_per_mm=dense_per_mm if is_flat else 0.0,
        ),
        ScenePoint(value=statistics.maximum, colour="#ffffff", extinction_per_mm=dense_per_mm),
    )
    return SceneTransfer(name="grey", points=points)


def _signed(info: SourceInfo, statistics: Statistics) -> SceneTransfer:
    """Return a ramp to both sides of 0, equally steep, so that equal distances look equally dense."""
    farthest = max(-statistics.minimum, statistics.maximum)
    dense_per_mm = _dense_per_mm(info)
    points = (
        ScenePoint(
            value=statistics.minimum, colour="#2f6fde", extinction_per_mm=dense_per_mm * -statistics.minimum / farthest
        ),
        ScenePoint(value=0.0, colour="#2f6fde", extinction_per_mm=0.0),
        ScenePoint(value=0.0, colour="#d8432f", extinction_per_mm=0.0),
        ScenePoint(
            value=statistics.maximum, colour="#d8432f", extinction_per_mm=dense_per_mm * statistics.maximum / farthest
        ),
    )
    return SceneTransfer(name="signed", points=points)
