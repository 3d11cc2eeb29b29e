"""How each texture format of a profile is uploaded and filed: OpenGL ES 2.0 table 3.4, OpenGL ES 3.0 table 3.13."""

from typing import Literal

from volprep_formats.package.manifest import GlFormat
from volprep_formats.package.profile import Api, TextureFormat
from volprep_formats.textures.ktx2 import Ktx2Format

Target = Literal["TEXTURE_2D", "TEXTURE_3D"]

BYTES_PER_TEXEL: dict[TextureFormat, int] = {"LUMINANCE8": 1, "R8": 1, "R16F": 2, "RGBA8": 4, "RGBA16F": 8}
"""Size of a texel, in the file and in the memory of the GPU."""

KTX2_FORMAT: dict[TextureFormat, Ktx2Format] = {
    "LUMINANCE8": "R8",
    "R8": "R8",
    "R16F": "R16F",
    "RGBA8": "RGBA8",
    "RGBA16F": "RGBA16F",
}
"""Format of the file. KTX 2 has no luminance; its one channel is red."""


def gl_format(name: TextureFormat, target: Target, api: Api) -> GlFormat:
    """Arguments of glTexImage2D or glTexImage3D for a texture of this format.

    OpenGL ES 2.0 knows unsized internal formats only, so RGBA8 is called RGBA there.
    """
    internal, pixels, kind = {
        "LUMINANCE8": ("LUMINANCE", "LUMINANCE", "UNSIGNED_BYTE"),
        "RGBA8": ("RGBA" if api == "es2.0" else "RGBA8", "RGBA", "UNSIGNED_BYTE"),
        "R8": ("R8", "RED", "UNSIGNED_BYTE"),
        "R16F": ("R16F", "RED", "HALF_FLOAT"),
        "RGBA16F": ("RGBA16F", "RGBA", "HALF_FLOAT"),
    }[name]
    return GlFormat(target=target, internal_format=internal, format=pixels, type=kind)


def texture_format(gl: GlFormat, api: Api) -> TextureFormat | None:
    """Format that is uploaded like this, or none if no profile knows it."""
    return next((name for name in BYTES_PER_TEXEL if gl_format(name, gl.target, api) == gl), None)
