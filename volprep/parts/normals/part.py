"""The part *normals*: directions of gradients, for lighting or as data."""

from collections.abc import Iterator

from volprep.parts.ablation import AblationItem, Changes, by_the_scene
from volprep.parts.case import Case
from volprep.parts.normals.decision import KIND, beside_level, normal_items, plan_normals, wanted_normals
from volprep.parts.normals.stage import STAGE
from volprep.parts.part import Part, PlannedImage
from volprep.plan.products import NormalsPlan
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.plan.room import Beside, Misfit
from volprep.scene.scene import Scene
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ProgramDesign


def _beside(scene: Scene, profile: DeviceProfile, level: LevelPlan, beside: Beside) -> Beside | Misfit:
    return beside_level(beside, level, wanted_normals(scene), profile)


def _plan(case: Case) -> Case:
    layout, scene = case.layout, case.scene
    labels = bool(scene.source.labels)
    return case.plus(plan_normals(wanted_normals(scene), layout.profile, layout.levels, layout.beside, labels=labels))


def _images(plan: ChannelPlan) -> Iterator[PlannedImage]:
    normals = plan.part(NormalsPlan)
    if normals is None:
        return
    for texture in normals.textures:
        for file in texture.files:
            yield PlannedImage(file, normals.format, texture.shape_zyx, level=texture.level, is_read_by=_reads)


def _reads(program: ProgramDesign) -> bool:
    return program.lighting != "none" and program.normals_from == "volume"


def _is_lit(scene: Scene) -> bool:
    """Return whether light can read normals: shaders compute normals of segments, which apps hide."""
    return scene.render.lighting != "none" and scene.segments is None


def _added(scene: Scene) -> Changes:
    return {"lighting": {"normals": "volume"}} if _is_lit(scene) else {"normals": {}}


PART = Part(
    name="normals",
    beside=_beside,
    plan=_plan,
    items=lambda plan, case: normal_items(plan.part(NormalsPlan), case.scene, plan.levels),
    images=_images,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "normals",
            KIND,
            lambda scene: "time" if _is_lit(scene) else "wish",
            without={"normals": None, "lighting": {"normals": "central"}},
            added=_added,
            chosen_by=by_the_scene,
            lossy=True,
            with_everything=True,
        ),
    ),
)
