"""A class of devices: what its OpenGL ES guarantees. A package keeps the profile that it was made for."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.record import Record

Api = Literal["es1.1", "es2.0", "es3.0"]
TextureFormat = Literal[
    "LUMINANCE8",
    "LUMINANCE_ALPHA8",
    "RGB8",
    "RGBA8",
    "R8",
    "RG8",
    "RGB8_SNORM",
    "RGBA8_SNORM",
    "R16",
    "R16F",
    "RGBA16F",
    "PALETTE8_RGBA8",
    "EAC_R11",
    "ETC2_RGBA8",
    "ASTC_4X4",
    "ASTC_5X5",
    "ASTC_6X6",
    "ASTC_8X8",
]
LookupFormat = Literal["RGBA8", "RGBA16F"]


class DeviceProfile(Record):
    """Limits that a package for this class of devices keeps, whatever the driver of this machine allows."""

    name: str
    """Name, for example gles3."""
    api: Api
    """OpenGL ES version whose contexts draw the package."""
    max_texture_size: Annotated[int, Field(ge=64)]
    """Largest width and height of a 2D texture, in texels."""
    max_3d_texture_size: Annotated[int, Field(ge=0)]
    """Largest width, height and depth of a 3D texture, in texels; 0 if there are no 3D textures."""
    texture_units: Annotated[int, Field(ge=1)]
    """Number of textures that a fragment shader may read."""
    texture_formats: tuple[TextureFormat, ...]
    """Formats that can be uploaded and filtered linearly."""
    npot: bool = True
    """Whether textures may have sizes that are not powers of two."""
    square: bool = False
    """Whether textures must be as high as they are wide, except tables of one row."""
    index_bits: Literal[16, 32]
    """Widest index of a draw call."""
    max_texture_bytes: Annotated[int, Field(ge=1)]
    """Memory that all textures in use at one time may take together, in bytes."""

    @property
    def has_shaders(self) -> bool:
        """Whether there are shaders; OpenGL ES 1.1 has none, and draws stacks of slices."""
        return self.api != "es1.1"
