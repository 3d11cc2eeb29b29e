"""Light that was computed once, in a shader: a texture that multiplies the colour of each sample.

It comes before anything else that lights a sample. The value of the sample is kept when it is classified.
"""

from dataclasses import replace

from volprep.shading.compose import Instance, Slot, literal
from volprep.shading.feature import Feature
from volprep_formats.package.program import Sampler
from volprep_formats.package.texture import Texture

_PART = "light/baked"
_SLOTS = {"lighting": _PART, "lighting_start": f"{_PART}:start", "light": f"{_PART}:sample"}
_READS = "stored_value("


def with_baked_light(classification: Feature, lighting: Feature | None, texture: Texture) -> tuple[Feature, Feature]:
    """Return a classification that keeps the value of each sample, and the light with what else lights samples.

    Raises ValueError for a texture without light.
    """
    light = texture.light
    if light is None:
        msg = f"texture {texture.name} holds no light"
        raise ValueError(msg)
    low, high = light.stored_values
    other, whole = lighting or Feature({}), "LARGEST_LIGHT * part"
    slots: dict[str, Slot] = {
        **other.slots,
        **{name: (Instance(part), *_instances(other.slots.get(name))) for name, part in _SLOTS.items()},
    }
    words = {
        "LIGHT_FROM_BOX": literal(*light.texture_from_box_per_mm_xyz),
        "LARGEST_LIGHT": literal(light.largest),
        "LIGHT_OF": f"max({whole} - {literal(light.subtracted)}, 0.0)" if light.subtracted > 0.0 else whole,
        "SHARE_SCALE": literal(1.0 / (high - low)),
        "SHARE_OFFSET": literal(-low / (high - low)),
    }
    medium = classification.offers["MEDIUM"].replace(_READS, f"stored = {_READS}")
    return (
        replace(classification, offers={**classification.offers, "MEDIUM": medium}),
        Feature(
            slots,
            {**other.words, **words},
            other.offers,
            other.uniforms,
            (*other.samplers, Sampler(name="u_light", role="light")),
        ),
    )


def _instances(slot: Slot) -> tuple[Instance, ...]:
    if slot is None:
        return ()
    return (Instance(slot),) if isinstance(slot, str) else slot
