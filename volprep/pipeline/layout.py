"""Levels, textures and settings of all channels; a volume in colour in compressed blocks, if pictures bear them.

The levels and programs of a channel depend on whether it is compressed, but blocks of a volume in colour hold all of
its channels, and can be tried only when their common texels are known. So the channels are laid out as blocks first,
and once more without them if these are refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from volprep.parts.channel_scan import ChannelScan
from volprep.parts.compression.colour import choose_blocks, no_room, why_no_blocks
from volprep.parts.programs.early_end import EarlyEnd, most
from volprep.parts.programs.step import common_steps, measures_steps
from volprep.parts.together.decision import DrawnTogether, choose_together
from volprep.parts.together.packing import Packed, pack_channels
from volprep.pipeline.channel_plan import Finished, begin
from volprep.plan.decisions import CompressionChoice, ValueChoice
from volprep.plan.hybrid import plan_hybrid
from volprep.plan.records import ChannelPlan, CropPlan, Shared
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import RenderSettings
from volprep_formats.package.profile import DeviceProfile


@dataclass(frozen=True)
class LaidOutChannels:
    """All channels with their textures."""

    shared: Shared
    """Settings that they share."""
    early_end: EarlyEnd
    """Largest opacity of their rays."""
    finished: list[Finished]
    """Each channel, with texels of its own."""
    together: DrawnTogether
    """Which of them are drawn into one picture."""
    packed: Packed
    """Texels that they share."""

    @property
    def channels(self) -> list[ChannelPlan]:
        """Plans of the channels, with the texels that they share."""
        plans = [each.plan for each in self.finished]
        return [plan.model_copy(update={"volumes": self.packed.of(plan)}) for plan in plans]


def lay_channels_out(  # noqa: PLR0917 - the scene, its channels, and the device class and box in common
    scene: Scene,
    scans: Sequence[ChannelScan],
    values: Sequence[ValueChoice],
    profile: DeviceProfile,
    crop: CropPlan,
    grid: Grid,
) -> tuple[LaidOutChannels, CompressionChoice]:
    """Lay all channels out; the choice is that of a volume in colour.

    Raises the errors of `begin`, and VP1245 for channels that cannot be drawn together.
    """

    def laid_out(each: Sequence[ChannelScan]) -> LaidOutChannels:
        return _laid_out(scene, each, values, profile, crop, grid)

    if scene.colour is None or scene.textures.compression == "none":
        return laid_out(scans), CompressionChoice()
    plain = [replace(scan, scene=_without_blocks(scan.scene)) for scan in scans]
    sources = [scan.whole for scan in scans if scan.whole is not None]
    never = why_no_blocks(scene, profile, values[0].quantize.bits, is_build=len(sources) == len(scans))
    if never is not None:
        return laid_out(plain), never
    try:
        compressed = laid_out(scans)
    except VolprepError as error:
        if error.code != "VP3022":
            raise
        return laid_out(plain), no_room(profile)
    if not compressed.packed.volumes:
        return laid_out(plain), no_room(profile)
    choice = choose_blocks(sources, compressed.channels, compressed.packed.volumes[0], scene)
    return (laid_out(plain) if choice.form is None else compressed), choice


def _laid_out(  # noqa: PLR0917 - as `lay_channels_out`
    scene: Scene,
    scans: Sequence[ChannelScan],
    values: Sequence[ValueChoice],
    profile: DeviceProfile,
    crop: CropPlan,
    grid: Grid,
) -> LaidOutChannels:
    begun = [begin(scan, each, profile, crop, grid) for scan, each in zip(scans, values, strict=True)]
    early_end = most([each.early_end for each in begun])
    steps = common_steps([channel.steps for channel in begun])
    shared = Shared(
        profile=profile,
        crop=crop,
        grid=grid,
        render=RenderSettings(
            projection=scene.render.projection, tolerance=scene.tolerance, hybrid=plan_hybrid(scene, profile)
        ),
        rays=steps.model_copy(update={"opacity_cutoff": early_end.cutoff(scene)}),
        compositing=scene.render.compositing,
        measure_steps=profile.has_shaders and measures_steps(scene),
    )
    finished = [channel.finished(shared) for channel in begun]
    channels = [each.plan for each in finished]
    together = choose_together(channels, [scan.measured for scan in scans], scene)
    packed = pack_channels(channels, scene, [*together.transfers])
    return LaidOutChannels(shared, early_end, finished, together, packed)


def _without_blocks(scene: Scene) -> Scene:
    textures = scene.textures.model_copy(update={"compression": "none"})
    return scene.model_copy(update={"textures": textures})
