"""Default look of a second scan over a first one: PET or a dose over CT, a map over MR.

The first scan is a translucent body, lit from the viewer, whose bones or dense parts show where things lie. The second
one is a veil of colour that keeps its colours, over the values that people look for: uptake from an SUV of 1.5 on, or
from a fifth of the largest value, and a dose from a tenth on in the colours of isodoses.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from volprep.scene.first_look import lit_from_viewer
from volprep.scene.points import ScenePoint
from volprep.scene.scene import Scene, TogetherSettings
from volprep.scene.transfer import SceneTransfer
from volprep.scene.values import hounsfield_offset, values_of
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Affine
from volprep_formats.package.channel import Statistics
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.source import SUV_UNIT, ChannelSpec, SourceInfo, SourceSpec

BODY, VEIL = "body", "veil"
"""Names of the channels, and of their transfer functions."""
_PICTURE = "fused"
_SHARE = 0.01
"""Part of the diagonal that opacities are for."""
_BODY_HU = (
    (-350.0, "#5a3d30", 0.0),
    (-100.0, "#a87c62", 0.004),
    (60.0, "#c79a80", 0.008),
    (160.0, "#e2cdb4", 0.03),
    (350.0, "#fff3dd", 0.16),
    (1200.0, "#ffffff", 0.4),
)
_UPTAKE = ((0.2, "#3a0a00", 0.0), (0.35, "#c83200", 0.25), (0.6, "#ff8a10", 0.55), (0.9, "#ffe860", 0.8))
"""Share of the largest value, colour and opacity."""
_SUV = ((1.5, "#3a0a00", 0.0), (3.0, "#c83200", 0.25), (6.0, "#ff8a10", 0.55), (10.0, "#ffe860", 0.8))
_DOSE = (
    (0.08, "#1030c0", 0.0),
    (0.3, "#1478e0", 0.05),
    (0.5, "#20b070", 0.1),
    (0.8, "#f0d020", 0.18),
    (0.95, "#e02818", 0.35),
)
_Steps = Sequence[tuple[float, str, float]]


@dataclass(frozen=True)
class MeasuredScan:
    """A scan that has been measured."""

    info: SourceInfo
    """Header of its source."""
    statistics: Statistics
    """Its least and its largest value."""
    values: Float64Array
    """A sample of physical values."""


def with_veil(scene: Scene, source: SourceSpec, registration: Affine | None = None) -> Scene:
    """Return the scene of one scan with a second scan over it, whose looks are decided when both are measured.

    `registration` is that of the second one onto the first one, if they are in two spaces.
    """
    body = ChannelSpec.model_validate({**scene.source.model_dump(exclude={"channels"}), "name": BODY})
    veil = ChannelSpec.model_validate({**source.model_dump(exclude={"channels"}), "name": VEIL, "suv": True})
    channels = scene.with_source(SourceSpec(channels=(body, veil.placed(registration))))
    both = channels.with_transfer(undecided((BODY, VEIL)))
    return both.model_copy(update={"together": TogetherSettings(name=_PICTURE, unlit=(VEIL,))})


def with_fused_look(scene: Scene, profile: DeviceProfile, body: MeasuredScan, veil: MeasuredScan) -> Scene:
    """Return the scene of two scans with the transfer functions that suit them, and with light on the first one."""
    kind, looks = _of_body(body)
    what, colours = _of_veil(veil)
    said = f"recognised as {what} over {kind}; a scene with [[source.channels]] draws them in another way"
    scene = lit_from_viewer(scene.with_transfer((looks, colours)), profile)
    return scene.model_copy(update={"recognised": said})


def undecided(names: Sequence[str]) -> tuple[SceneTransfer, ...]:
    """Return a transfer function for each channel, until its values have been measured."""
    points = (ScenePoint(value=0.0, colour="#ffffff", extinction_per_mm=0.0),)
    return tuple(SceneTransfer(name=name, channel=name, points=points) for name in names)


def _of_body(scan: MeasuredScan) -> tuple[str, SceneTransfer]:
    offset = 0.0 if scan.info.unit == "HU" else hounsfield_offset(scan.values)
    if offset is not None:
        return "a CT", transfer_of(BODY, [(value - offset, colour, opacity) for value, colour, opacity in _BODY_HU])
    values = values_of(scan.values)
    steps = (
        (values.background, "#6b5a50", 0.0),
        (values.median, "#b09a88", 0.012),
        (max(values.high, scan.statistics.maximum), "#fff3e4", 0.08),
    )
    return "an object in a dark field", transfer_of(BODY, steps)


def _of_veil(scan: MeasuredScan) -> tuple[str, SceneTransfer]:
    low, high = scan.statistics.minimum, scan.statistics.maximum
    if scan.info.modality == "RTDOSE" or scan.info.unit == "Gy":
        return "a dose, coloured from a tenth of its largest value on", _over(_DOSE, 0.0, high)
    if scan.info.unit == SUV_UNIT:
        return "uptake, coloured from an SUV of 1.5 on", transfer_of(VEIL, _SUV)
    if scan.info.modality in {"PT", "NM"}:
        return "uptake, coloured from a fifth of its largest value on", _over(_UPTAKE, 0.0, high)
    return "a map, coloured from a fifth of its range on", _over(_UPTAKE, low, high)


def _over(steps: _Steps, low: float, high: float) -> SceneTransfer:
    return transfer_of(VEIL, [(low + share * (high - low), colour, opacity) for share, colour, opacity in steps])


def transfer_of(name: str, steps: _Steps) -> SceneTransfer:
    """Return the transfer function of a channel from values, colours and opacities; a value that falls is left out."""
    points = [ScenePoint(value=steps[0][0], colour=steps[0][1], opacity=steps[0][2])]
    for value, colour, opacity in steps[1:]:
        if value > points[-1].value:
            points.append(ScenePoint(value=value, colour=colour, opacity=opacity))
    return SceneTransfer(name=name, channel=name, points=tuple(points), reference_share=_SHARE)
