"""Hybrid resolution: whether an app draws the volume with fewer pixels than the lines around it."""

from collections.abc import Iterator

from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.hybrid.record import Hybrid, ShaderPair
from volprep_formats.package.profile import DeviceProfile


def plan_hybrid(scene: Scene, profile: DeviceProfile) -> Hybrid | None:
    """Return how the small picture and the lines are drawn; None if the scene does not ask for it.

    Raises VP3166 for an estimate of the opacity where pictures have alpha.
    """
    wanted = scene.hybrid
    if wanted is None:
        return None
    if profile.has_shaders and wanted.opacity != "alpha":
        raise VolprepError("VP3166", opacity=wanted.opacity, profile=profile.name)
    return Hybrid(
        longest_side=wanted.longest_side,
        opacity=wanted.opacity,
        has_lines=wanted.lines,
        enlarged=_pair("enlarged") if profile.has_shaders else None,
        lines=_pair("lines") if profile.has_shaders and wanted.lines else None,
    )


def describe_hybrid(hybrid: Hybrid | None) -> Iterator[PlanItem]:
    """List it, where the scene asks for it."""
    if hybrid is not None:
        lines = "lines with all pixels" if hybrid.has_lines else "no lines"
        reason = f"the volume in a picture of {hybrid.longest_side} pixels along its longer side, {lines}"
        yield PlanItem(name="hybrid resolution", kind="hybrid", kept=True, reason=reason, files=hybrid.shaders)


def _pair(name: str) -> ShaderPair:
    return ShaderPair(vertex=f"shaders/{name}.vert", fragment=f"shaders/{name}.frag")
