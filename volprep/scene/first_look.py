"""What a scan looks like of which nobody has said anything: a transfer function made from its values."""

import math

from volprep.scene.points import ScenePoint
from volprep.scene.scene import RenderWishes, Scene
from volprep.scene.transfer import SceneTransfer
from volprep_formats.package.channel import Statistics
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.source import SourceInfo

_BONE_HU = 300.0
"""A CT that reaches this has bone in it, or contrast medium, and the preset shows it."""
_DENSE_SHARE = 50.0
"""Extinction of the densest value: opaque (1 - exp(-5)) after a tenth of the diagonal."""


def with_first_look(scene: Scene, profile: DeviceProfile, info: SourceInfo, statistics: Statistics) -> Scene:
    """Return the scene with a transfer function that shows something of any scan.

    Labels get a colour each. CT in Hounsfield units gets its bones, lit where the devices can. A level set gets its
    surface, lit, from devices with shaders. Other values on both sides of 0, as maps of differences have, become denser
    with their distance from 0: blue below, red above. All others get a grey ramp, from nothing and black to dense and
    white.
    """
    if scene.source.labels:
        return scene.with_preset("labels", profile)
    if info.level_set and profile.has_shaders and statistics.minimum < 0.0 < statistics.maximum:
        return _with_surface(scene, statistics)
    if info.unit == "HU" and statistics.maximum >= _BONE_HU:
        return scene.with_preset("ct-bone", profile)
    if statistics.minimum < 0.0 < statistics.maximum and info.unit != "HU":
        return scene.with_transfer((_signed(info, statistics),))
    return scene.with_transfer((_grey(info, statistics),))


def _with_surface(scene: Scene, statistics: Statistics) -> Scene:
    points = tuple(
        ScenePoint(value=value, colour="#d9d2c5", opacity=1.0) for value in (statistics.minimum, statistics.maximum)
    )
    wishes = {"compositing": "isosurface", "lighting": "headlight"} | scene.render.model_dump(exclude_unset=True)
    surface = SceneTransfer(name="surface", points=points, reference_mm=1.0, isovalue=0.0)
    # At an outline a pixel shows the surface or nothing: only the mean error says something.
    tolerance = scene.tolerance.model_copy(update={"maximum": 1.0})
    update = {"render": RenderWishes.model_validate(wishes), "tolerance": tolerance}
    return scene.with_transfer((surface,)).model_copy(update=update)


def _dense_per_mm(info: SourceInfo) -> float:
    return _DENSE_SHARE / math.hypot(*info.grid.extent_mm_zyx)


def _grey(info: SourceInfo, statistics: Statistics) -> SceneTransfer:
    points = (
        ScenePoint(value=statistics.minimum, colour="#000000", extinction_per_mm=0.0),
        ScenePoint(value=statistics.maximum, colour="#ffffff", extinction_per_mm=_dense_per_mm(info)),
    )
    return SceneTransfer(name="grey", points=points)


def _signed(info: SourceInfo, statistics: Statistics) -> SceneTransfer:
    """Return a ramp to both sides of 0, equally steep, so that equal distances look equally dense."""
    farthest = max(-statistics.minimum, statistics.maximum)
    dense_per_mm = _dense_per_mm(info)
    points = (
        ScenePoint(
            value=statistics.minimum,
            colour="#2f6fde",
            extinction_per_mm=dense_per_mm * -statistics.minimum / farthest,
        ),
        ScenePoint(value=0.0, colour="#2f6fde", extinction_per_mm=0.0),
        ScenePoint(value=0.0, colour="#d8432f", extinction_per_mm=0.0),
        ScenePoint(
            value=statistics.maximum, colour="#d8432f", extinction_per_mm=dense_per_mm * statistics.maximum / farthest
        ),
    )
    return SceneTransfer(name="signed", points=points)
