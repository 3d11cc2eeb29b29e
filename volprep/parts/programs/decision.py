"""Programs that cast rays through the levels of a package: which there are, and which levels each draws."""

from collections.abc import Iterator, Sequence

from volprep.plan.records import VolumePlan
from volprep.scene.scene import RenderWishes
from volprep_formats.package.program import ProgramDesign, Technique

VERTEX = "shaders/raycast.vert"
"""Vertex shader that they share."""


def ray_casters(transfer: str, volumes: Sequence[VolumePlan], render: RenderWishes) -> Iterator[ProgramDesign]:
    """Return the programs that draw a transfer function, or a picture of several.

    One draws all 3D textures; mosaics and bricks have one each, whose text holds the layout.
    """
    name = f"raycast-{transfer}"
    if len(volumes) == 1 or technique_of(volumes[0]) == "raycast_texture3d":
        yield _program(name, transfer, volumes, render)
        return
    for volume in volumes:
        yield _program(f"{name}-{volume.level}", transfer, (volume,), render)


def technique_of(volume: VolumePlan) -> Technique:
    """Return the technique that samples the textures of a level."""
    if volume.mosaic is not None:
        return "raycast_mosaic"
    return "raycast_texture3d" if volume.bricks is None else "raycast_bricks"


def _program(name: str, transfer: str, volumes: Sequence[VolumePlan], render: RenderWishes) -> ProgramDesign:
    return ProgramDesign(
        name=name,
        technique=technique_of(volumes[0]),
        compositing=render.compositing,
        classification=render.classification,
        lighting=render.lighting,
        vertex=VERTEX,
        fragment=f"shaders/{name}.frag",
        levels=tuple(volume.level for volume in volumes),
        transfer=transfer,
    )
