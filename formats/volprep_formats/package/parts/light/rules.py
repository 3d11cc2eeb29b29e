"""Check the consistency of a manifest's precomputed light; docs/CHECKS.md states the rules."""

import math
from collections.abc import Iterator

import numpy as np

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.mosaic_rules import mosaic_contradictions
from volprep_formats.package.parts.light.record import StoredLight, form_of
from volprep_formats.package.texture import Texture, TextureRole
from volprep_formats.textures.texel_formats import COMPONENTS, has_bytes

ROLE: TextureRole = "light"
"""Role of its textures and samplers."""
_TEXEL_TOLERANCE = 1e-9
_UNIT_TOLERANCE = 1e-6


def light_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of textures of light."""
    held: dict[str | None, list[Texture]] = {}
    cut: dict[str | None, list[Texture]] = {}
    for texture in manifest.textures:
        yield from (f"texture {texture.name} {problem}" for problem in _texture(texture, manifest))
        if texture.role == ROLE:
            (cut if texture.is_of_a_cut else held).setdefault(texture.transfer, []).append(texture)
    known = {function.name for function in manifest.transfer_functions}
    for transfer, textures in (*held.items(), *cut.items()):
        if transfer not in known:
            yield f"texture {textures[0].name} holds light of {transfer}, which is no transfer function"
        if len(textures) > 1:
            yield f"the light of {transfer} has {len(textures)} textures"
    for transfer, textures in cut.items():
        if any(_reading(each) != _reading(textures[0]) for each in held.get(transfer, ())):
            yield f"the light of {transfer} for a cut is read in another way than that of the whole volume"
        if transfer not in held:
            yield f"there is light of {transfer} for a cut, but none of the whole volume"


def _texture(texture: Texture, manifest: Manifest) -> Iterator[str]:
    light = texture.light
    if (texture.role == ROLE) != (light is not None):
        yield f"has the role {texture.role}, {'but a record of light' if light else 'but no record of its light'}"
        return
    if light is None:
        return
    components = form_of(light.model).components
    if COMPONENTS.get(texture.format) != components or not has_bytes(texture.format):
        yield f"holds light of {components} bytes, its format is {texture.format}"
    if texture.part != 0:
        yield f"holds light, so it must be part 0, not {texture.part}"
    if texture.filter != "linear" or texture.level is not None:
        yield "holds light, so its filter must be linear and it must be for all levels"
    is_coloured = light.model.channels == "rgb" and not light.model.turnable
    brightest = max(light.first_colour or (0.0,))
    if brightest != float(is_coloured):
        yield f"has a first colour of {brightest} at most; that of light in colour has 1, and other light has none"
    low, high = light.stored_values
    if not low < high:
        yield f"has the stored values {low} and {high}, which must ascend"
    if any(abs(math.hypot(*plane.normal) - 1.0) > _UNIT_TOLERANCE for plane in light.planes):
        yield "holds light of a cut by planes whose normals have not the length 1"
    yield from _form(texture, light, manifest)


def _form(texture: Texture, light: StoredLight, manifest: Manifest) -> Iterator[str]:
    """Light lies in a 3D texture, or in a mosaic of one texture without a gutter, and covers the box."""
    mosaic = texture.mosaic
    if (texture.dimension == "3d") != (mosaic is None):
        yield "holds light, so it must be a 3D texture or a mosaic"
    shape_zyx = texture.shape_zyx if mosaic is None else (mosaic.slices, *mosaic.tile_shape_yx)
    yield from (f"holds light, but {problem}" for problem in mosaic_contradictions(texture, shape_zyx))
    if mosaic is not None and (mosaic.textures, mosaic.slices_per_texel, mosaic.gutter) != (1, 1, 0):
        yield "holds light in a mosaic of several textures, with a gutter, or with several slices in a texel"
    if manifest.grid is None:
        return
    reach = np.array(light.texture_from_box_per_mm_xyz) * np.array(manifest.grid.extent_mm_zyx[::-1])
    texels, ends = np.array(shape_zyx[::-1]), form_of(light.model).ends
    if shape_zyx[0] % ends:
        yield f"holds light that turns, so it must have two halves along z, and has {shape_zyx[0]} slices"
    # The outer texels lie on the faces of the box.
    if not np.all(np.abs(reach - (1.0 / np.array([1, 1, ends]) - 1.0 / texels)) <= _TEXEL_TOLERANCE):
        yield f"has {reach.tolist()} of its length in the box, which does not follow from its texels"


def _reading(texture: Texture) -> tuple[object, ...]:
    """Return everything that says how a texture of light is read."""
    light = texture.light
    of_light = () if light is None else (form_of(light.model), *_numbers(light))
    return texture.format, texture.dimension, texture.shape_zyx, texture.mosaic, *of_light


def _numbers(light: StoredLight) -> tuple[object, ...]:
    return light.largest, light.subtracted, light.first_colour, light.stored_values, light.texture_from_box_per_mm_xyz
