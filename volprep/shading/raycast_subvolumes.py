"""Ray casting through the eight sub-volumes around a point of the grid: 3D textures, or mosaics in OpenGL ES 2.0.

In the Beaver Volume Renderer (Schultz and Bailey, 7.3.3) the eight pieces share no voxels, and each is stretched over
half of the texture coordinates, so that the outer half voxels of neighbours clamp against each other: a seam. Here a
position lies between voxels that one piece holds.
"""

from volprep.shading.components import component_letter
from volprep.shading.compose import Dialect, Instance, literal
from volprep.shading.feature import Feature
from volprep.shading.mosaic import Mosaic
from volprep.shading.positions import in_voxels, voxel_positions
from volprep.shading.raycast_mosaic import values_of
from volprep_formats.grid import Grid
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid, label_bytes
from volprep_formats.package.program import Sampler, Uniform, UniformSource
from volprep_formats.package.texture import MosaicLayout, SampleFilter
from volprep_formats.textures.mosaic import own_slices

PIECES = 8
_VECTORS: dict[str, UniformSource] = {
    "u_split": "split_voxel",
    "u_low_start": "low_start_voxel",
    "u_low_size": "low_size_voxels",
    "u_high_start": "high_start_voxel",
    "u_high_size": "high_size_voxels",
    "u_box_low_mm": "block_low_mm",
    "u_box_high_mm": "block_high_mm",
}


def sampling(grid: Grid, pieces: SubvolumeGrid) -> Feature:
    """Return how level 0 of this grid is read; outside nothing is drawn.

    Lit pieces have ghost voxels, and so all voxels that differences need.
    """
    if pieces.mosaic is None:
        parts: tuple[Instance, ...] = (Instance("sampling/subvolumes"),)
        samplers = tuple(Sampler(name=f"u_subvolume_{part}", role="subvolume", part=part) for part in range(PIECES))
    else:
        mosaic = _block(pieces.mosaic)
        parts, samplers = _tiles(mosaic, pieces.filter), mosaic.samplers
    return Feature(
        slots={"sampling": (voxel_positions(grid.spacing_mm_zyx), *parts)},
        words={"LOW_CORNER_MM": "u_box_low_mm", "HIGH_CORNER_MM": "u_box_high_mm"},
        uniforms=tuple(Uniform(name=name, type="vec3f", source=source) for name, source in _VECTORS.items()),
        samplers=samplers,
        offers=in_voxels(grid.shape_zyx),
    )


def labels(pieces: SubvolumeGrid, dialect: Dialect) -> tuple[str, str]:
    """Return the part that reads labels of pieces, and the number of a label from the byte or the bytes of a texel.

    They are read through a linear filter at the centres of texels, and rounded.
    """
    texels = pieces.texture_format
    letters = "".join(component_letter(texels, 1 + byte, dialect) for byte in range(label_bytes(texels)))
    texel = f"label_texel(at).{letters}"
    part = "subvolumes" if pieces.mosaic is None else "subvolumes_mosaic"
    return f"sampling/{part}:labels", texel if len(letters) == 1 else f"dot({texel}, vec2(1.0, 256.0))"


def _block(piece: MosaicLayout) -> Mosaic:
    """Return all eight pieces as one mosaic of eight textures, with a piece in each."""
    slices = PIECES * piece.tiles_x * piece.tiles_y * own_slices(piece)
    layout = piece.model_copy(update={"textures": PIECES, "slices": slices})
    about = (
        "Eight pieces, a texture for each: normalised stored values, 0 to 1, in tiles of one slice and channel each."
    )
    return Mosaic(about, layout, sampler="u_subvolume", role="subvolume", texel="tile_texel", centres=True)


def _tiles(mosaic: Mosaic, between: SampleFilter) -> tuple[Instance, ...]:
    named = {"STORED": "block_value"}
    slices = {"SLICES": literal(mosaic.layout.slices // PIECES)}
    reads = values_of(mosaic, "r", between, named)
    return mosaic.texels, *reads, Instance("sampling/subvolumes_mosaic", slices)
