"""Tiles in 2D textures, as the GLSL of OpenGL ES 2.0 reads them: the volume, normals and skip tables are instances.

The fetch is derived here, not taken from print: the published listing (Congote et al., repeated in the mobile volume
rendering thesis) finds the row with the number of rows instead of columns, reads a slice beyond the last, is half a
slice off in z, and lets the filter reach into the next tile. Each layout has its own text: no texture is chosen where
there is one, and nothing is clamped where gutters hold what the filter reaches.
"""

from dataclasses import dataclass
from typing import Literal

from volprep.shading.compose import Instance, Slot, literal
from volprep_formats.package.program import Sampler
from volprep_formats.package.texture import MosaicLayout, SampleFilter

_PART = "sampling/mosaic"
_SEVERAL = "sampling/mosaic_textures"


@dataclass(frozen=True)
class Mosaic:
    """Something that lies in the tiles of a mosaic, and the names that its GLSL has."""

    about: str
    """Description, for a comment in the shader."""
    layout: MosaicLayout
    """Where the tiles lie."""
    sampler: str
    """Sampler of its texture; of several, the prefix of their names."""
    role: Literal["volume", "normals", "skip", "labels", "subvolume", "bricks"]
    """Which textures these are."""
    texel: str
    """Function that gives a texel of a tile."""
    prefix: str = ""
    """Prefix of the names of its constants."""
    centres: bool = False
    """Whether only centres of texels are read."""

    @property
    def samplers(self) -> tuple[Sampler, ...]:
        """Every sampler that it declares."""
        if self.layout.textures == 1:
            return (Sampler(name=self.sampler, role=self.role),)
        parts = range(self.layout.textures)
        return tuple(Sampler(name=f"{self.sampler}_{part}", role=self.role, part=part) for part in parts)

    @property
    def texels(self) -> Instance:
        """The part that gives a texel of a tile."""
        layout = self.layout
        rows, columns = layout.texture_shape_yx
        words = {
            "ABOUT": self.about,
            "P": self.prefix,
            "TEXEL": self.texel,
            "SAMPLER": self.sampler,
            "PITCH": literal(*layout.pitch_yx[::-1]),
            "MOSAIC": literal(columns, rows),
            "TILES_X": literal(layout.tiles_x),
        }
        slots: dict[str, Slot] = {"sampler": f"{_PART}:sampler", "unit": None, "fetch": f"{_PART}:fetch"}
        if layout.textures > 1:
            slots = {"sampler": _SEVERAL, "unit": f"{_SEVERAL}:unit", "fetch": f"{_SEVERAL}:fetch"}
            words["TILES"] = literal(layout.tiles_x * layout.tiles_y)
            words["UNIT"] = " ".join(str(part) for part in range(layout.textures - 1))
            words["LAST_UNIT"] = str(layout.textures - 1)
        if self.centres:
            slots["place"] = f"{_PART}:centre"
        elif layout.gutter:
            slots["place"] = f"{_PART}:gutter"
            words["GUTTER"] = literal(layout.gutter)
        else:
            height, width = layout.tile_shape_yx
            slots["place"] = f"{_PART}:clamped"
            padded = any(layout.padding_yx)
            words["LAST_PLACE"] = literal(width - 0.5, height - 0.5) if padded else f"{self.prefix}PITCH - 0.5"
        return Instance(_PART, words, slots)

    def voxels(self, function: str, between: SampleFilter) -> Instance:
        """Return the part that gives, with one slice in a texel, the texel of a position in voxels as `function`."""
        words = {"TEXEL": self.texel, "VOXEL": function}
        if self.layout.slices == 1:
            return Instance("sampling/slices_one", words)
        words |= {"P": self.prefix, "LAST_SLICE": literal(self.layout.slices - 1)}
        return Instance(f"sampling/slices_{between}", words)
