"""Light that was computed once, in a shader: textures that multiply the colour of each sample.

It comes before anything else that lights a sample. The value of the sample is kept when it is classified.
"""

from collections.abc import Sequence
from dataclasses import replace

from volprep.shading.compose import Instance, Slot, literal
from volprep.shading.feature import Feature
from volprep_formats.package.parts.light.record import StoredLight
from volprep_formats.package.program import Sampler, Uniform
from volprep_formats.package.texture import MosaicLayout, Texture

_PART = "light/baked"
_SLOTS = {"lighting": _PART, "lighting_start": f"{_PART}:start", "light": f"{_PART}:sample"}
_READS = "stored_value("


def with_baked_light(
    classification: Feature, lighting: Feature | None, textures: Sequence[Texture]
) -> tuple[Feature, Feature]:
    """Return a classification that keeps the value of each sample, and the light with what else lights samples.

    `textures` hold the light, in the order of their parts. Raises ValueError for a texture without light.
    """
    light = textures[0].light
    if light is None:
        msg = f"texture {textures[0].name} holds no light"
        raise ValueError(msg)
    other, own = lighting or Feature({}), _textures(light, textures)
    slots: dict[str, Slot] = {
        **other.slots,
        **{name: (Instance(part), *_instances(other.slots.get(name))) for name, part in _SLOTS.items()},
        **own.slots,
    }
    medium = classification.offers["MEDIUM"].replace(_READS, f"stored = {_READS}")
    return (
        replace(classification, offers={**classification.offers, "MEDIUM": medium}),
        Feature(
            slots,
            {**other.words, **_words(light), **own.words},
            other.offers,
            (*other.uniforms, *own.uniforms),
            (*other.samplers, *own.samplers),
        ),
    )


def _words(light: StoredLight) -> dict[str, str]:
    """Return the constants of a light, and how it follows from `part`."""
    low, high = light.stored_values
    whole = "LARGEST_LIGHT * part"
    if light.subtracted > 0.0:
        whole = f"{whole} - {literal(light.subtracted)}"
    if light.model.turnable:
        whole = f"(u_environment * ({whole})).rgb"
    # Only shares of environments may be negative where no light is subtracted.
    may_be_negative = light.model.turnable or light.subtracted > 0.0
    return {
        "LIGHT": "float" if _is_grey(light) else "vec3",
        "LARGEST_LIGHT": literal(light.largest),
        "LIGHT_OF": f"max({whole}, 0.0)" if may_be_negative else whole,
        "SHARE_SCALE": literal(1.0 / (high - low)),
        "SHARE_OFFSET": literal(-low / (high - low)),
    }


def _textures(light: StoredLight, textures: Sequence[Texture]) -> Feature:
    """Return how the textures of a light are declared and read."""
    names = ["u_light"] if len(textures) == 1 else [f"u_light_{part}" for part in range(len(textures))]
    mosaic = textures[0].mosaic
    scale = (1, 1, 1) if mosaic is None else (mosaic.tile_shape_yx[1], mosaic.tile_shape_yx[0], mosaic.slices)
    per_mm = (n * per for n, per in zip(scale, light.texture_from_box_per_mm_xyz, strict=True))
    # Half a texel: of the whole texture, or of a tile's pixels.
    start = [0.5 if mosaic is not None else 0.5 / n for n in textures[0].shape_zyx[::-1]]
    reads = [
        f"textureLod({name}, at, 0.0)" if mosaic is None else f"{_function(name)}(places, slice - lower)"
        for name in names
    ]
    words = {"LIGHT_FROM_BOX": literal(*per_mm), "LIGHT_START": literal(*start), "LIGHT_TEXEL": reads[0]}
    if light.model.turnable:
        ends = "two_textures"
        words["HIGH_TEXEL"] = reads[1]
    elif light.first_colour is not None:
        ends = "two_colours"
        words["FIRST_COLOUR"] = literal(*light.first_colour)
    else:
        ends = "one_texture"
        # Luminance comes as red, green and blue.
        words["NUMBERS"] = "ra" if textures[0].gl.format == "LUMINANCE_ALPHA" else "rg"
    return Feature(
        slots={
            "light_texels": _declared(names, mosaic),
            "light_places": None if mosaic is None else f"{_PART}:places",
            "light_ends": f"{_PART}:{ends}",
            "light_around": f"{_PART}:environment" if light.model.turnable else None,
        },
        words=words,
        uniforms=(Uniform(name="u_environment", type="mat4", source="environment"),) if light.model.turnable else (),
        samplers=tuple(Sampler(name=name, role="light", part=part) for part, name in enumerate(names)),
    )


def _declared(names: Sequence[str], mosaic: MosaicLayout | None) -> tuple[Instance, ...]:
    if mosaic is None:
        return tuple(Instance(f"{_PART}:texture3d", {"LIGHT_SAMPLER": name}) for name in names)
    rows, columns = mosaic.texture_shape_yx
    words = {
        "LIGHT_PITCH": literal(*mosaic.pitch_yx[::-1]),
        "LIGHT_MOSAIC": literal(columns, rows),
        "LIGHT_TILES_X": literal(mosaic.tiles_x),
        "LIGHT_LAST_SLICE": literal(mosaic.slices - 1),
    }
    textures = (Instance(f"{_PART}:in_mosaic", {"LIGHT_SAMPLER": name, "TEXEL": _function(name)}) for name in names)
    return (Instance(f"{_PART}:mosaic", words), *textures)


def _function(sampler: str) -> str:
    """Return the function that reads a texel of a mosaic."""
    return f"{sampler.removeprefix('u_')}_texel"


def _is_grey(light: StoredLight) -> bool:
    return not light.model.turnable and light.model.channels == "luminance"


def _instances(slot: Slot) -> tuple[Instance, ...]:
    if slot is None:
        return ()
    return (Instance(slot),) if isinstance(slot, str) else slot
