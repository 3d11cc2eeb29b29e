"""The profile's limits, enforced even if the driver at hand allows more: target devices can then draw it, too."""

from collections.abc import Sequence

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import Program
from volprep_formats.package.texture import Texture
from volprep_formats.textures.texel_formats import is_held, size_bytes

_ES3_HEAD = "#version 300 es"


def check_program(program: Program, textures: Sequence[Texture], manifest: Manifest) -> None:
    """Check the textures that `program` reads, one for each of its samplers, and all with mipmaps together.

    Raises VP5010 for one that is too large, VP5011 for its format, VP5012 for 3D without 3D textures, VP5013 if there
    are more than units, VP5014 if they take too much memory together.
    """
    profile = manifest.profile
    count = len(textures) + len(program.passes)
    if count > profile.texture_units:
        raise VolprepError("VP5013", name=program.name, count=count, limit=profile.texture_units, profile=profile.name)
    files = {texture.file for texture in textures if texture.mipmap is not None}
    mipmaps = [texture for texture in manifest.textures if texture.file in files and texture not in textures]
    check_textures(program.name, [*textures, *mipmaps], profile)


def check_textures(name: str, textures: Sequence[Texture], profile: DeviceProfile) -> None:
    """Check the textures that `name` uses at one time.

    Raises VP5010 for one that is too large, VP5011 for its format, VP5012 for 3D without 3D textures, VP5014 if they
    take too much memory together.
    """
    for texture in textures:
        _check_format(texture, profile)
    size = sum(size_bytes(texture.format, texture.shape_zyx) for texture in textures)
    if size > profile.max_texture_bytes:
        raise VolprepError("VP5014", name=name, size=size, limit=profile.max_texture_bytes, profile=profile.name)


def check_shader(path: str, text: str, profile: DeviceProfile) -> None:
    """Raise VP5015 for a shader in a language that the profile's API does not have: drivers often accept it."""
    if profile.dialect == "es100" and text.lstrip().startswith(_ES3_HEAD):
        raise VolprepError("VP5015", path=path, api=profile.graphics.number, profile=profile.name)


def _check_format(texture: Texture, profile: DeviceProfile) -> None:
    if texture.dimension == "3d" and profile.max_3d_texture_size == 0:
        raise VolprepError("VP5012", name=texture.name, profile=profile.name)
    if not is_held(texture.format, profile.texture_formats):
        raise VolprepError(
            "VP5011",
            name=texture.name,
            profile=profile.name,
            format=texture.format,
            known=", ".join(profile.texture_formats),
        )
    if texture.dimension == "3d":
        limit_name, limit = "max_3d_texture_size", profile.max_3d_texture_size
    else:
        limit_name, limit = "max_texture_size", profile.max_texture_size
    for axis, size in zip(("depth", "height", "width"), texture.shape_zyx, strict=True):
        if size > limit:
            fields = {"axis": axis, "size": size, "limit_name": limit_name, "limit": limit, "profile": profile.name}
            raise VolprepError("VP5010", name=texture.name, **fields)
