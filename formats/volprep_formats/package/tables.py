"""Which table classifies the samples of a level: the level's own if it has one, else the common one."""

from collections.abc import Iterable

from volprep_formats.package.texture import Texture


def table_for(textures: Iterable[Texture], role: str, transfer: str, level: int) -> Texture | None:
    """Return the table of this role, transfer function and level, or None."""
    found: Texture | None = None
    for texture in textures:
        if (texture.role, texture.transfer) != (role, transfer):
            continue
        if texture.level == level:
            return texture
        if texture.level is None:
            found = texture
    return found
