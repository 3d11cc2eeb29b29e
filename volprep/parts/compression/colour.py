"""Whether a volume in colour is stored in blocks: only if its pictures hardly change, which is measured first.

Light and extinction share texels, so that one form is tried for all channels, on their common layout. A sample has no
part in it: blocks mix the colours of neighbours, and rays through a few patches miss where that is worst.
"""

from collections.abc import Sequence

from volprep.parts.compression.decision import COLOUR_FORM, KIND, bits_per_voxel, item_of, misfit, require_form
from volprep.parts.compression.source_level import LevelData
from volprep.parts.compression.whole_colour import WholeColour
from volprep.plan.decisions import CompressionChoice
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep.plan.whole_source import WholeSource
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile


def why_no_blocks(scene: Scene, profile: DeviceProfile, bits: int, *, is_build: bool) -> CompressionChoice | None:
    """Return the refusal if blocks are not even tried, else None. Raises as `require_form`."""
    require_form(scene, profile)
    name = "compressed textures"
    if scene.textures.compression == "auto" and "astc-4x4-unorm" not in profile.texture_formats:
        reason = f"profile {profile.name} has no astc-4x4-unorm, the only form of a volume in colour"
    elif bits == 8:
        reason = "light is linear and has 8 bits here, and blocks of a volume in colour are sRGB"
    elif not is_build:
        name, bits_text = f"textures as {COLOUR_FORM}", f"{bits_per_voxel(COLOUR_FORM):.3g} bits a voxel"
        reason = f"{bits_text}; a build tries the whole level, and uses it within half of the tolerance"
    else:
        return None
    return CompressionChoice(items=(PlanItem(name=name, kind=KIND, kept=False, reason=reason),))


def no_room(profile: DeviceProfile) -> CompressionChoice:
    """Return the refusal of blocks for a profile that has no room for a level of them."""
    return CompressionChoice(items=(misfit(COLOUR_FORM, profile),))


def choose_blocks(
    sources: Sequence[WholeSource], plans: Sequence[ChannelPlan], volume: VolumePlan, scene: Scene
) -> CompressionChoice:
    """Try blocks on the finest level, `volume`, whose texels the channels of `plans` share."""
    data = [
        LevelData(
            level=plan.level(volume.level),
            crop=plan.crop,
            grid=plan.grid,
            quantize=plan.quantize,
            functions=plan.transfer_functions,
            render=scene.render,
            tolerance=scene.tolerance,
        )
        for plan in plans
    ]
    trial = WholeColour(sources, data).try_form(volume, COLOUR_FORM)
    return CompressionChoice(COLOUR_FORM if trial.kept else None, (item_of(trial),), (trial,))
