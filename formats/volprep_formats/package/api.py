"""Graphics APIs of device profiles: version, shading language, and names of texture formats.

This is the only definition of each API name. A new API adds a record here and a name in `ContextApi`.
"""

from typing import Literal, NamedTuple

from volprep_formats.diagnostics import VolprepError

Api = Literal["es1.1", "es2.0", "es3.0"]
"""Graphics APIs that a profile may name."""
ContextApi = Literal[Api, "es3.1"]
"""The same, and OpenGL ES 3.1, which compute shaders need."""
Dialect = Literal["es100", "es300", "es310"]
"""Shading languages: GLSL ES 1.00, 3.00 and 3.10. Only compute shaders use the last one."""


class GraphicsApi(NamedTuple):
    """Properties of a graphics API."""

    version: tuple[int, int]
    """Version of OpenGL ES, major and minor."""
    dialect: Dialect | None
    """Shading language of programs; None if there are no shaders."""
    sized_formats: bool
    """Whether internal formats of textures are sized: RGBA8 instead of RGBA."""

    @property
    def number(self) -> str:
        """Version as text, for example "3.0"."""
        major, minor = self.version
        return f"{major}.{minor}"


_APIS: dict[ContextApi, GraphicsApi] = {
    "es1.1": GraphicsApi((1, 1), None, sized_formats=False),
    "es2.0": GraphicsApi((2, 0), "es100", sized_formats=False),
    "es3.0": GraphicsApi((3, 0), "es300", sized_formats=True),
    "es3.1": GraphicsApi((3, 1), "es310", sized_formats=True),
}


def graphics_api(name: ContextApi) -> GraphicsApi:
    """Return the record of an API. Raises VP4073 for a name that has none."""
    found = _APIS.get(name)
    if found is None:
        raise VolprepError("VP4073", api=name, known=", ".join(_APIS))
    return found
