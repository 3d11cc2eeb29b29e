"""Components of texels by their letters in a shader."""

from volprep.shading.compose import Dialect


def component_letter(texel: str, component: int, dialect: Dialect) -> str:
    """Return the letter of a component, 0 for the first.

    OpenGL ES 2.0 has luminance in place of red: it comes as red, green and blue, and alpha beside it.
    """
    return "ra"[component] if (texel, dialect) == ("rg8unorm", "es100") else "rgba"[component]
