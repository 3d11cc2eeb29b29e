"""Components of texels by their letters in a shader."""


def component_letter(pixels: str | None, component: int) -> str:
    """Return the letter of a component, 0 for the first; `pixels` is the format of the upload, without GL_.

    Luminance comes as red, green and blue, and alpha beside it.
    """
    return "ra"[component] if pixels == "LUMINANCE_ALPHA" else "rgba"[component]
