"""Texture units and memory of segments on a device, estimated before their labels are counted."""

import math

from volprep.parts.mosaic.decision import MOST_TEXTURES, mosaic_of, part_names
from volprep.parts.mosaic.packing import Packing
from volprep.plan.products import LabelTexturePlan
from volprep.plan.records import LevelPlan
from volprep.plan.room import Beside, Misfit
from volprep.scene.scene import Scene
from volprep_formats.package.parts.segments.record import LARGEST_LABEL
from volprep_formats.package.profile import DeviceProfile

LOOK_UNITS = 1
"""Texture units of the table of looks."""


def beside_segments(scene: Scene, profile: DeviceProfile, level: LevelPlan, beside: Beside) -> Beside | Misfit:
    """Add what segments take: two bytes a voxel, as their labels are not counted yet."""
    if scene.segments is None:
        return beside
    # One table is counted already.
    units = beside.units + LOOK_UNITS + len(scene.transfer) - 1
    texture = label_texture(level, profile, profile.texture_units - units - 1, wide=True)
    if isinstance(texture, Misfit):
        return Misfit(f"its labels: {texture.reason}")
    texels = math.prod(texture.shape_zyx) * len(texture.files)
    most = 2 * texels + 4 * (LARGEST_LABEL + 1) + beside.bytes * len(scene.transfer)
    return Beside(units=units + len(texture.files), bytes=most)


def label_texture(level: LevelPlan, profile: DeviceProfile, units: int, *, wide: bool) -> LabelTexturePlan | Misfit:
    """Lay out the labels of a level as a 3D texture, or as a mosaic of one slice in a texel in at most `units`."""
    name = f"labels-{level.name}"
    layout = None
    if not profile.max_3d_texture_size:
        if units < 1:
            return Misfit(f"the volume, its tables and looks take all {profile.texture_units} texture units")
        packing = Packing(components_per_voxel=1 + wide)
        found = mosaic_of(level, packing, min(units, MOST_TEXTURES), profile)
        if isinstance(found, Misfit):
            return found
        layout = found
    names = (name,) if layout is None else part_names(name, layout.textures)
    return LabelTexturePlan(
        level=level.index,
        names=names,
        files=tuple(f"textures/{name}.ktx2" for name in names),
        shape_zyx=level.shape_zyx if layout is None else (1, *layout.texture_shape_yx),
        mosaic=layout,
        channels=(level.channel,),
        filter="nearest",
    )
