"""A class of devices: the guarantees of its OpenGL ES. A package keeps the profile that it was made for."""

from typing import Annotated, Literal, get_args

from pydantic import Field

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import LONGEST_AXIS, Count, Index
from volprep_formats.package.api import Api, Dialect, GraphicsApi, graphics_api
from volprep_formats.package.values import open_word
from volprep_formats.record import Record
from volprep_formats.textures.texel_formats import TextureFormat


class DeviceProfile(Record):
    """Limits of a package for this class of devices, independent of the driver of this machine."""

    name: str
    """Name, for example gles3."""
    api: Api
    """OpenGL ES version whose contexts draw the package."""
    max_texture_size: Annotated[int, Field(ge=64, le=LONGEST_AXIS)]
    """Largest width and height of a 2D texture, in texels."""
    max_3d_texture_size: Index
    """Largest width, height and depth of a 3D texture, in texels; 0 if there are no 3D textures."""
    texture_units: Count
    """Number of textures that a fragment shader may read."""
    texture_formats: tuple[Annotated[str, open_word(*get_args(TextureFormat))], ...]
    """Formats that can be uploaded and filtered linearly. A reader ignores formats that it does not know."""
    npot: bool = True
    """Whether textures may have sizes that are not powers of two."""
    square: bool = False
    """Whether textures must be as high as they are wide, except tables of one row."""
    index_bits: Literal[16, 32]
    """Widest index of a draw call."""
    max_texture_bytes: Annotated[int, Field(ge=1, le=2**53 - 1)]
    """Memory in bytes for all textures in use at one time."""

    @property
    def graphics(self) -> GraphicsApi:
        """The record of its graphics API. Raises VP4073 for an API without a record."""
        return graphics_api(self.api)

    @property
    def has_shaders(self) -> bool:
        """Whether there are shaders; OpenGL ES 1.1 has none, and draws stacks of slices."""
        return self.graphics.dialect is not None

    @property
    def dialect(self) -> Dialect:
        """Shading language of its programs. Raises VP4073 if the API has no shaders."""
        dialect = self.graphics.dialect
        if dialect is None:
            raise VolprepError("VP4073", api=self.api, known="APIs with shaders")
        return dialect
