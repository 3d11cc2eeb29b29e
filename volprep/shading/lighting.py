"""Light on samples: diffuse light from where the viewer is (Lambert 1760), or a light with a place.

Normals are read from the package, or computed by the shader as differences of values. The shorter a normal is, because
the gradient is nearly zero or codes around it cancel, the less is its sample a surface, and the more it keeps its own
colour. Such places are where directions change fast, and steps would have to be shorter.
"""

from volprep.shading.components import component_letter
from volprep.shading.compose import Dialect, Instance, Slot, literal
from volprep.shading.feature import Feature
from volprep.shading.mosaic import Mosaic
from volprep.shading.shadows import shadows_of
from volprep_formats.grid import Grid
from volprep_formats.package.parts.normals.record import SOFT_LENGTH, SOFT_SLOPE
from volprep_formats.package.picture import Mixing
from volprep_formats.package.program import Light, ProgramDesign, Sampler
from volprep_formats.package.texture import Texture

_SHINE = {
    "phong": "dot(reflect(-to_light, normal), to_viewer)",
    "blinn-phong": "dot(normal, normalize(to_light + to_viewer))",
}


def lighting(program: ProgramDesign, normals: Texture | None, grid: Grid, dialect: Dialect, mixing: Mixing) -> Feature:
    """Return the light of a program: the same for every level that it draws.

    Of normals in a mosaic of several textures, `normals` is any; none where the shader takes differences of values on
    levels of `grid`. Borders of segments have slopes a voxel wide, and so have values beside them.
    """
    if program.normals_from == "volume":
        if normals is None:
            msg = f"program {program.name} reads normals that its package does not hold"
            raise ValueError(msg)
        found, soft = normals_of(normals, dialect), SOFT_LENGTH
    else:
        found = _slopes(program, grid, mixing)
        soft = SOFT_SLOPE / min(grid.spacing_mm_zyx)
    words = {**found.words, "SOFT_SQUARED": literal(soft**2)}
    slots: dict[str, Slot] = {**found.slots, "lighting_start": "light/headlight:start"}
    if program.light is None:
        return Feature({**slots, "light": "light/headlight:sample"}, words, samplers=found.samplers)
    shadows = shadows_of(program, grid)
    return Feature(
        slots={
            **slots,
            "normals": found.slots["lighting"],
            "lighting": "light/placed",
            "light": "light/placed:sample",
            **shadows.slots,
        },
        words={**words, **_light_words(program.light), "SHINE": _SHINE[program.lighting], **shadows.words},
        uniforms=shadows.uniforms,
        samplers=found.samplers,
    )


def light_of_medium(
    program: ProgramDesign, grid: Grid, suffix: str, voxel: str, *, on_grid: bool
) -> tuple[Instance, Instance]:
    """Return the slopes of a medium among several, on its `grid`, and the light from the viewer on a sample of it.

    Names in the shader end in `suffix`. `voxel` is the voxel of u_volume, if each medium has a texture of its own. A
    medium `on_grid` of its own has places of its own, and gradients in its own box.
    """
    slopes = _slopes(program, grid, "sum")
    part = slopes.slots["lighting"]
    assert isinstance(part, str)  # noqa: S101 - a section of one file
    words = {"OF": suffix, "NEAR": f"stored_value{suffix}", **slopes.words}
    words |= {"VOXEL": voxel.replace("u_volume", f"u_volume{suffix}")} if voxel else {}
    normal = f"normal_at{suffix}(at)"
    if on_grid:
        words |= {"LAST_POSITION": "1.0", "POSITION_PER_MM": f"u_texture_from_medium{suffix}"}
        normal = f"normal_at{suffix}(start{suffix} + stride{suffix} * i) * mat3(u_medium{suffix}_from_box)"
    soft = literal((SOFT_SLOPE / min(grid.spacing_mm_zyx)) ** 2)
    return Instance(part, words), Instance("light/headlight:sample", {"NORMAL": normal, "SOFT_SQUARED": soft})


def _slopes(program: ProgramDesign, grid: Grid, mixing: Mixing) -> Feature:
    """Return the feature that takes differences of values."""
    name = f"light/gradient:{program.normals_from}"
    if program.normals_from == "central" and max(program.levels) > 0 and mixing != "labels":
        return Feature({"lighting": f"{name}_of_levels"}, {"FINEST_VOXEL_MM": literal(*grid.spacing_mm_zyx[::-1])})
    return Feature(slots={"lighting": name})


def _light_words(light: Light) -> dict[str, str]:
    return {
        "AMBIENT": literal(light.ambient),
        "DIFFUSE": literal(light.diffuse),
        "SPECULAR": literal(light.specular),
        "SHININESS": literal(light.shininess),
    }


def normals_of(texture: Texture, dialect: Dialect) -> Feature:
    """Return the feature that gives the normal at a position."""
    if texture.normals is None:
        msg = f"texture {texture.name} holds no normals"
        raise ValueError(msg)
    code = texture.normals.code
    slots: dict[str, Slot] = {
        "lighting": "light/normals",
        "normal_code": f"light/normal_codes:{code}",
        "normal_texels": "light/normals:texture3d",
        "octahedron": "light/octahedron",
    }
    words = {"NORMAL_TEXEL": "textureLod(u_normals, at, 0.0)"}
    samplers: tuple[Sampler, ...] = (Sampler(name="u_normals", role="normals"),)
    if code == "oct8":
        words["NUMBERS"] = "".join(component_letter(texture.format, k, dialect) for k in range(2))
    if texture.mosaic is not None:
        mosaic = Mosaic(
            "They are a mosaic, in tiles of one slice each.",
            texture.mosaic,
            sampler="u_normals",
            role="normals",
            texel="normal_tile_texel",
            prefix="NORMAL_",
        )
        voxels: Instance = mosaic.voxels("normal_texel", texture.filter)
        slots["normal_texels"] = (mosaic.texels, voxels)
        words["NORMAL_TEXEL"] = "normal_texel(at)"
        samplers = mosaic.samplers
    return Feature(slots, words, samplers=samplers)
