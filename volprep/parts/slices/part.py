"""The part *slices*: stacks of slices, for devices without shaders."""

from volprep.parts.part import Images, Part
from volprep.parts.slices.decision import refuse_slices
from volprep.parts.slices.error import settle
from volprep.parts.slices.stage import STAGE
from volprep.plan.products import SlicesPlan
from volprep.plan.records import ChannelPlan
from volprep.scene.scene import Scene
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ProgramDesign


def _require(scene: Scene, profile: DeviceProfile) -> None:
    if profile.has_shaders:
        refuse_slices(scene, profile)


def _images(plan: ChannelPlan, transfer: str, _level: int, _program: ProgramDesign | None) -> Images:
    slices = plan.part(SlicesPlan)
    if slices is None:
        return {}
    textures = [each for stack in slices.stacks if stack.transfer == transfer for each in stack.textures]
    return {each.file: (slices.format, (1, *each.shape_yx)) for each in textures}


PART = Part(name="slices", require=_require, images=_images, stages=(STAGE,), settle=settle)
