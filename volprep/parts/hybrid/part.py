"""The part *hybrid*: whether an app draws the volume with fewer pixels than the lines around it."""

from collections.abc import Iterator

from volprep.parts.case import Joint
from volprep.parts.part import Part
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.hybrid.record import Hybrid, ShaderPair
from volprep_formats.package.profile import DeviceProfile


def _hybrid(scene: Scene, profile: DeviceProfile) -> Hybrid | None:
    """Return how the small picture and the lines are drawn; None if the scene does not ask for it.

    Raises VP3166 for an estimate of the opacity where pictures have alpha.
    """
    wanted, blends = scene.hybrid, profile.has_shaders
    if wanted is None:
        return None
    if blends and wanted.opacity != "alpha":
        raise VolprepError("VP3166", opacity=wanted.opacity, profile=profile.name)
    return Hybrid(
        longest_side=wanted.longest_side,
        opacity=wanted.opacity,
        has_lines=wanted.lines,
        enlarged=_pair("enlarged") if blends else None,
        lines=_pair("lines") if blends and wanted.lines else None,
    )


def _items(hybrid: Hybrid | None) -> Iterator[PlanItem]:
    if hybrid is not None:
        lines = "lines with all pixels" if hybrid.has_lines else "no lines"
        reason = f"the volume in a picture of {hybrid.longest_side} pixels along its longer side, {lines}"
        yield PlanItem(name="hybrid resolution", kind="hybrid", kept=True, reason=reason, files=hybrid.shaders)


def _join(joint: Joint) -> Joint:
    hybrid = _hybrid(joint.scene, joint.shared.profile)
    render = joint.shared.render.model_copy(update={"hybrid": hybrid})
    return joint.plus(shared=joint.shared.model_copy(update={"render": render}), items=_items(hybrid))


def _pair(name: str) -> ShaderPair:
    return ShaderPair(vertex=f"shaders/{name}.vert", fragment=f"shaders/{name}.frag")


PART = Part(name="hybrid", devices="any", join=_join)
