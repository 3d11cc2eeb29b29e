"""Programs that draw the levels of a package: which there are, and which levels each draws."""

from collections.abc import Iterator, Sequence

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.parts.case import Case
from volprep.plan.records import VolumePlan
from volprep.scene.scene import Scene
from volprep.techniques import TECHNIQUES
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import Light, ProgramDesign, Rays, Shadows, TechniqueName

_TECHNIQUE_OF: dict[Shadows, TechniqueName] = {"map": "ray-casting", "half-angle": "view-slices"}
"""The technique that shadows need, where it is only one."""
_PREFIX = {"ray-casting": "raycast", "tiles": "tiles"}
VERTEX = "shaders/raycast.vert"
"""Vertex shader of programs that cast rays in one pass."""
MESH_VERTEX = "shaders/proxy-mesh.vert"
"""Vertex shader of passes over proxy geometry."""


def require_technique(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3130 for settings that the technique does not support, VP3164 where the profile does not support it."""
    render = scene.render
    technique = TECHNIQUES[render.technique]
    possible = {
        f"compositing {render.compositing}": render.compositing in technique.compositings,
        f"classification {render.classification}": render.classification in technique.classifications,
        "[grid]": scene.grid is None or "subvolumes" in technique.samplings,
        "[proxy]": scene.proxy is None or technique.meshes,
        f"skip.kind {scene.skip.kind}": scene.skip.kind in {"auto", "none"} or technique.loops,
        # Compressed levels are mosaics.
        f"textures.compression {scene.textures.compression}": scene.textures.compression == "none"
        or "mosaic" in technique.samplings,
    }
    for what, goes in possible.items():
        if not goes:
            raise VolprepError("VP3130", technique=technique.name, what=what)
    if not profile.max_3d_texture_size and "mosaic" not in technique.samplings:
        raise VolprepError("VP3164", technique=technique.name, profile=profile.name, problem="no 3D textures")


def require_shadows(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3160 to VP3162 for shadows without a light, on unsuitable devices, or with unsupported settings."""
    shadows, render = scene.lighting.shadows, scene.render
    if shadows == "none":
        return
    if light_of(scene) is None:
        raise VolprepError("VP3160", shadows=shadows, lighting=render.lighting)
    if profile.graphics.dialect != "es300":
        raise VolprepError("VP3161", shadows=shadows, profile=profile.name, api=profile.api)
    wanted = _TECHNIQUE_OF.get(shadows)
    possible = {
        f"technique {render.technique}": render.technique == wanted if wanted else TECHNIQUES[render.technique].loops,
        # The pieces around a point do not hold the volume between them and the light.
        "[grid]": scene.grid is None,
    }
    if shadows == "map":
        possible |= {
            # A map holds one distance for each ray of the light.
            f"compositing {render.compositing}": COMPOSITINGS[render.compositing].isovalue,
            "[proxy]": scene.proxy is None,
        }
    for what, goes in possible.items():
        if not goes:
            raise VolprepError("VP3162", shadows=shadows, what=what)


def require_light_outside(case: Case) -> None:
    """Raise VP3163 for a light inside the volume, where shadows need its view: that would have no one direction."""
    light, grid = light_of(case.scene), case.grid
    if light is None or light.shadows not in {"map", "half-angle"}:
        return
    place = (np.linalg.inv(grid.world_from_box) @ [*light.place_mm_xyz, 1.0])[:3]
    if ((place >= 0.0) & (place <= grid.extent_mm_zyx[::-1])).all():
        raise VolprepError("VP3163", shadows=light.shadows, light=light.place_mm_xyz)


def ray_casters(transfer: str, volumes: Sequence[VolumePlan], scene: Scene) -> Iterator[ProgramDesign]:
    """Return the programs that draw a transfer function, or a picture of several.

    One draws all 3D textures; mosaics and bricks have one each, whose text holds the layout.
    """
    technique = scene.render.technique
    name = f"{_PREFIX.get(technique, technique)}-{transfer}"
    if len(volumes) == 1 or volumes[0].sampling == "texture3d":
        yield _program(name, transfer, volumes, scene)
        return
    for volume in volumes:
        yield _program(f"{name}-{volume.level}", transfer, (volume,), scene)


def passes_before(technique: TechniqueName, shadows: Shadows, rays: Rays) -> int:
    """Return how many passes come before a picture, each of whose targets takes a texture unit."""
    own = 1 if rays == "mesh" else TECHNIQUES[technique].passes_before
    return own + (shadows in {"map", "half-angle"})


def shader_files(program: ProgramDesign) -> tuple[str, ...]:
    """Return the files of the shaders of a program, including its passes."""
    shadows = "none" if program.light is None else program.light.shadows
    passes = [pass_file(program, number) for number in range(passes_before(program.technique, shadows, program.rays))]
    over_mesh = (MESH_VERTEX,) if program.rays == "mesh" else ()
    sorting = tile_files(program) if program.technique == "tiles" else ()
    return (program.vertex, program.fragment, *over_mesh, *passes, *sorting)


def pass_file(program: ProgramDesign, number: int) -> str:
    """Return the file of the fragment shader of a pass that comes first."""
    return f"{program.fragment.removesuffix('.frag')}-pass-{number}.frag"


def tile_files(program: ProgramDesign) -> tuple[str, str, str]:
    """Return the files of the compute shaders that sort tiles: cost, offsets, place."""
    cost = f"{program.fragment.removesuffix('.frag')}-cost.comp"
    return cost, "shaders/tiles-offsets.comp", "shaders/tiles-place.comp"


def light_of(scene: Scene) -> Light | None:
    """Return the light with a place; none where the scene has no such lighting."""
    wanted = scene.lighting
    if scene.render.lighting not in {"phong", "blinn-phong"} or wanted.light_mm is None:
        return None
    return Light(
        place_mm_xyz=wanted.light_mm,
        ambient=wanted.ambient,
        diffuse=wanted.diffuse,
        specular=wanted.specular,
        shininess=wanted.shininess,
        shadows=wanted.shadows,
    )


def _program(name: str, transfer: str, volumes: Sequence[VolumePlan], scene: Scene) -> ProgramDesign:
    render = scene.render
    return ProgramDesign(
        name=name,
        sampling=volumes[0].sampling,
        compositing=render.compositing,
        classification=render.classification,
        lighting=render.lighting,
        normals_from=scene.lighting.normals if render.lighting != "none" else "volume",
        light=light_of(scene),
        baked=scene.lighting.baked != "none",
        technique=render.technique,
        vertex=VERTEX if render.technique in _PREFIX else f"shaders/{render.technique}.vert",
        fragment=f"shaders/{name}.frag",
        levels=tuple(volume.level for volume in volumes),
        transfer=transfer,
    )
