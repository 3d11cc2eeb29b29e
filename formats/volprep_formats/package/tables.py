"""Which table classifies the samples of a level: the level's own where it has one, the common one elsewhere."""

from collections.abc import Iterable

from volprep_formats.package.texture import Texture


def table_for(textures: Iterable[Texture], role: str, transfer: str, level: int) -> Texture | None:
    """Return the table of this role, transfer function and level; none where there is none."""
    found: Texture | None = None
    for texture in textures:
        if (texture.role, texture.transfer) != (role, transfer):
            continue
        if texture.level == level:
            return texture
        if texture.level is None:
            found = texture
    return found
