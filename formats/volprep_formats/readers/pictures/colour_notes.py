"""What picture files say about their colours that is not applied: profiles, and a gamma."""

from typing import Any

NOTHING, PROFILE, GAMMA = range(3)
_TEXTS = {
    PROFILE: "the pictures have a colour profile other than sRGB, which is not applied: values are as they are stored",
    GAMMA: "the pictures give another gamma than that of sRGB, which is not applied: values are as they are stored",
}
_SRGB_GAMMA, _SAME_GAMMA = 2.2, 0.05


def colour_note(spec: Any) -> int:
    """Return what the ImageSpec of OpenImageIO says of a picture of integers."""
    if str(spec.format) in {"half", "float"}:
        return NOTHING
    if spec.getattribute("ICCProfile") is not None:
        name = spec.get_string_attribute("ICCProfile:profile_description").lower()
        return NOTHING if "srgb" in name else PROFILE
    gamma = spec.get_float_attribute("oiio:Gamma", _SRGB_GAMMA)
    is_linear = spec.get_string_attribute("oiio:ColorSpace").startswith("lin_")
    return GAMMA if is_linear or abs(gamma - _SRGB_GAMMA) > _SAME_GAMMA else NOTHING


def colour_note_remarks(note: int) -> list[str]:
    """Return the remark about a note."""
    return [_TEXTS[note]] if note in _TEXTS else []
