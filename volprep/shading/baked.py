"""Light that was computed once, in a shader: a texture that multiplies the colour of each sample.

It comes before anything else that lights a sample. The value of the sample is kept when it is classified.
"""

from dataclasses import replace

from volprep.shading.components import component_letter
from volprep.shading.compose import Dialect, Instance, Slot, literal
from volprep.shading.feature import Feature
from volprep_formats.package.parts.light.record import StoredLight, form_of
from volprep_formats.package.program import Sampler, Uniform
from volprep_formats.package.texture import MosaicLayout, Texture

_FIXED, _TURNED = "light/baked", "light/turned"
_READS = "stored_value("


def with_baked_light(
    classification: Feature, lighting: Feature | None, texture: Texture, dialect: Dialect, *, in_runs: bool
) -> tuple[Feature, Feature]:
    """Return a classification that keeps the value of each sample, and the light with what else lights samples.

    `in_runs` for rays that skip, whose loop begins again after each jump. Raises ValueError for a texture that holds no
    light.
    """
    light = texture.light
    if light is None:
        msg = f"texture {texture.name} holds no light"
        raise ValueError(msg)
    other, own = lighting or Feature({}), _turned(light, in_runs=in_runs) if light.model.turnable else _fixed(light)
    read = _read(light, texture, dialect)
    parts: dict[str, Slot] = {
        name: (*_instances(slot), *_instances(other.slots.get(name))) for name, slot in own.slots.items()
    }
    medium = classification.offers["MEDIUM"].replace(_READS, f"stored = {_READS}")
    return (
        replace(classification, offers={**classification.offers, "MEDIUM": medium}),
        Feature(
            {**other.slots, **parts, **read.slots},
            {**other.words, **own.words, **read.words},
            other.offers,
            (*other.uniforms, *own.uniforms),
            (*other.samplers, *read.samplers),
        ),
    )


def _fixed(light: StoredLight) -> Feature:
    """Return the light at a sample, and how it follows from `part`."""
    whole = "LARGEST_LIGHT * part"
    if light.subtracted > 0.0:
        whole = f"max({whole} - {literal(light.subtracted)}, 0.0)"
    return Feature(
        {"lighting": _FIXED, "lighting_start": f"{_FIXED}:start", "light": f"{_FIXED}:sample"},
        {"LIGHT": "float" if light.first_colour is None else "vec3", "LIGHT_OF": whole},
    )


def _turned(light: StoredLight, *, in_runs: bool) -> Feature:
    """Return the light at a sample from that around the volume."""
    is_moved = light.subtracted > 0.0
    subtracted = Instance(f"{_TURNED}:subtracted", {"SUBTRACTED": literal(light.subtracted)})
    start = Instance(f"{_TURNED}:start", slots={"light_subtracted": (subtracted,) if is_moved else None})
    return Feature(
        {
            "lighting": _TURNED,
            "lighting_start": (start,),
            "lighting_run": (Instance(f"{_TURNED}:run", {"RUN_START": "run_start" if in_runs else "$FIRST"}),),
            "light": f"{_TURNED}:sample",
        },
        {"LESS": " - subtracted" if is_moved else ""},
        uniforms=(Uniform(name="u_environment", type="mat4x4f", source="environment"),),
    )


def _read(light: StoredLight, texture: Texture, dialect: Dialect) -> Feature:
    """Return how the texture of a light is declared and read."""
    mosaic, ends = texture.mosaic, form_of(light.model).ends
    scale = (1, 1, 1) if mosaic is None else (mosaic.tile_shape_yx[1], mosaic.tile_shape_yx[0], mosaic.slices)
    per_mm = (n * per for n, per in zip(scale, light.texture_from_box_per_mm_xyz, strict=True))
    # Half a texel: of the whole texture, or of a tile's pixels.
    start = [0.5 if mosaic is not None else 0.5 / n for n in texture.shape_zyx[::-1]]
    low, high = light.stored_values
    words = {
        "LIGHT_FROM_BOX": literal(*per_mm),
        "LIGHT_START": literal(*start),
        "LARGEST_LIGHT": literal(light.largest),
        "LIGHT_TEXEL": "textureLod(u_light, at, 0.0)" if mosaic is None else "light_texel(places, slice - lower)",
        "SHARE_SCALE": literal(1.0 / (high - low)),
        "SHARE_OFFSET": literal(-low / (high - low)),
    }
    places = None if mosaic is None else f"{_FIXED}:places"
    slots: dict[str, Slot] = {"light_texels": _declared(mosaic, ends)}
    if light.model.turnable:
        slots["light_half"] = f"{_TURNED}:{'half_of_texture3d' if mosaic is None else 'half_of_places'}"
    elif light.first_colour is not None:
        slots |= {"light_places": places, "light_ends": f"{_FIXED}:two_colours"}
        words["FIRST_COLOUR"] = literal(*light.first_colour)
    else:
        slots |= {"light_places": places, "light_ends": f"{_FIXED}:one_number"}
        words["NUMBERS"] = "".join(component_letter(texture.format, k, dialect) for k in range(2))
    return Feature(slots=slots, words=words, samplers=(Sampler(name="u_light", role="light"),))


def _declared(mosaic: MosaicLayout | None, ends: int) -> tuple[Instance, ...]:
    if mosaic is None:
        return (Instance(f"{_FIXED}:texture3d"),)
    rows, columns = mosaic.texture_shape_yx
    words = {
        "LIGHT_PITCH": literal(*mosaic.pitch_yx[::-1]),
        "LIGHT_MOSAIC": literal(columns, rows),
        "LIGHT_TILES_X": literal(mosaic.tiles_x),
        "LIGHT_LAST_SLICE": literal(mosaic.slices // ends - 1),
    }
    return (Instance(f"{_FIXED}:mosaic", words),)


def _instances(slot: Slot) -> tuple[Instance, ...]:
    if slot is None:
        return ()
    return (Instance(slot),) if isinstance(slot, str) else slot
