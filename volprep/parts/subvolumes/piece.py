"""How a piece of level 0 becomes a texture: a 3D texture, or a mosaic for devices without them; one form for all.

Around a point are eight pieces, so that a program has eight samplers for them, beside its table. OpenGL ES 2.0 promises
eight texture units: with no more than that, samples are classified by the control points, which take no texture.
Segments need one more, for their looks; so a texel holds the value of a voxel and its label, which shaders read without
the filter. That takes one slice in a texel.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.parts.mosaic.packing import Packing, fit_mosaic, most_slices, pack_mosaic, room_of
from volprep.parts.subvolumes.cuts import cuts_along
from volprep.plan.room import FOUR_CHANNELS, Misfit, if_held, one_channel
from volprep.scene.scene import Scene
from volprep_formats.grid import Grid
from volprep_formats.package.parts.subvolumes.record import spans_of
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import WITH_TABLES, ClassificationName
from volprep_formats.package.texture import MosaicLayout, MosaicOrder, SampleFilter
from volprep_formats.textures.texel_formats import TextureFormat, size_bytes

HELD = 8
"""Pieces that a device draws at a time: those around a point."""
LABELLED: dict[int, TextureFormat] = {1: "rg8unorm", 2: "rgb8unorm"}
"""Format of a value of 8 bits and a label, by the bytes of the label."""
_FETCHES = {"overlapping": 1.0, "interleaved": 1.25, "planar": 2.0}


@dataclass(frozen=True)
class PieceVoxels:
    """The parts of each voxel that pieces hold."""

    bits: int
    """Bits of its value."""
    between: SampleFilter = "linear"
    """Filter between values."""
    label_bytes: int = 0
    """Bytes of its label; 0 without segments."""
    styles: int = 1
    """Number of transfer functions that a sample may have."""
    ghost: int = 0
    """Layers of voxels that a piece holds beyond the shared ones."""


@dataclass(frozen=True)
class Form:
    """The texture of a piece."""

    format: TextureFormat
    """Format of a texel."""
    mosaic: MosaicLayout | None
    """Layout of its slices in a 2D texture; None for a 3D texture."""
    largest_bytes: int
    """Size of the texture of the largest piece."""

    @property
    def held_bytes(self) -> int:
        """Size of the textures that a device draws at a time."""
        return HELD * self.largest_bytes


def form_of(scene: Scene, profile: DeviceProfile, grid: Grid, size: int, voxels: PieceVoxels) -> Form | Misfit:
    """Return the texture of pieces of at most `size` voxels along an axis, or why the profile has none."""
    even, ghost = not profile.max_3d_texture_size, voxels.ghost
    if size < 2 + 2 * ghost:
        return Misfit(f"a lit piece needs {2 + 2 * ghost} voxels along an axis, a cell and its neighbours")
    cuts = [cuts_along(n, size, even=even, ghost=ghost) for n in grid.shape_zyx]
    z, y, x = (max(last - first for first, last in spans_of(cut, ghost)) + 1 for cut in cuts)
    if profile.max_3d_texture_size:
        return _volume((z, y, x), size, voxels, profile)
    found = [_mosaic((z, y, x), order, voxels, profile) for order in _orders(scene, voxels)]
    fitting = [form for form in found if isinstance(form, Form)]
    if not fitting:
        return found[-1]
    return min(fitting, key=lambda form: (_fetches(form, voxels.between), form.largest_bytes))


def classification_of(scene: Scene, profile: DeviceProfile, voxels: PieceVoxels) -> ClassificationName | Misfit:
    """Return how programs of pieces classify samples, or why there are too few texture units for them."""
    wanted = scene.render.classification
    assert wanted != "auto"  # noqa: S101 - rays have chosen before
    looks = voxels.label_bytes > 0
    units = HELD + looks + voxels.styles * (wanted in WITH_TABLES)
    if units <= profile.texture_units:
        return wanted
    others = COMPOSITINGS[scene.render.compositing].classifications
    can_change = wanted == "lookup" and not scene.editable and "control-points" in others
    if can_change and profile.texture_units >= HELD + looks:
        return "control-points"
    table = " and their table" if wanted in WITH_TABLES else ""
    looked = " with looks" if looks else ""
    taken = f"{HELD} pieces{looked}{table} take {units} texture units of {profile.texture_units}"
    return Misfit(f"{taken}: choose a profile that has more")


def file_bytes(form: Form, grid: Grid, size: int, ghost: int) -> int:
    """Return the size of all pieces, empty ones too."""
    spans = [spans_of(cuts_along(n, size, ghost=ghost), ghost) for n in grid.shape_zyx]
    if form.mosaic is not None:
        return math.prod(map(len, spans)) * form.largest_bytes
    shape = [sum(last - first + 1 for first, last in along) for along in spans]
    return size_bytes(form.format, (shape[0], shape[1], shape[2]))


def tiled(texels: NDArray[np.generic], layout: MosaicLayout) -> NDArray[np.generic]:
    """Lay the texels [z, y, x] of a piece out as its mosaic, [1, y, x, component]; beyond them the last ones repeat.

    With labels they are [z, y, x, component].
    """
    whole = layout.slices, *layout.tile_shape_yx, *texels.shape[3:]
    repeated = np.pad(texels, [(0, n - own) for n, own in zip(whole, texels.shape, strict=True)], mode="edge")
    strips = list(pack_mosaic(lambda z0, z1: repeated[z0:z1], layout))
    return np.concatenate(strips)[None]


def _volume(shape_zyx: tuple[int, int, int], size: int, voxels: PieceVoxels, profile: DeviceProfile) -> Form | Misfit:
    texel = _one_slice(voxels, profile)
    if isinstance(texel, Misfit):
        return texel
    if size > profile.max_3d_texture_size:
        return Misfit(f"3D textures hold at most {profile.max_3d_texture_size} along an axis")
    return Form(texel, None, size_bytes(texel, shape_zyx))


def _one_slice(voxels: PieceVoxels, profile: DeviceProfile) -> TextureFormat | Misfit:
    """Return the format of one voxel in a texel."""
    if not voxels.label_bytes:
        texel = one_channel(voxels.bits, profile)
        return texel or Misfit(f"profile {profile.name} has no texture format of {voxels.bits} bits")
    if voxels.bits != 8:
        return Misfit(f"a texel holds a label beside 8 bits, and values have {voxels.bits}: set quantize.bits = 8")
    texel = if_held(LABELLED[voxels.label_bytes], profile)
    return texel or Misfit(f"profile {profile.name} has no texture format of {1 + voxels.label_bytes} bytes")


def _orders(scene: Scene, voxels: PieceVoxels) -> tuple[MosaicOrder | None, ...]:
    """Return the orders of slices to try; None for one slice in a texel."""
    if voxels.label_bytes:
        return (None,)
    return (None, "overlapping", "interleaved") if scene.mosaic.order == "auto" else (scene.mosaic.order,)


def _mosaic(
    shape_zyx: tuple[int, int, int], order: MosaicOrder | None, voxels: PieceVoxels, profile: DeviceProfile
) -> Form | Misfit:
    texel = _one_slice(voxels, profile) if order is None else if_held(FOUR_CHANNELS[voxels.bits], profile)
    if texel is None:
        return Misfit(f"profile {profile.name} has no texture format of {voxels.bits} bits for a mosaic")
    if isinstance(texel, Misfit):
        return texel
    depth, height, width = shape_zyx
    # The last slice of a smaller piece may begin a tile: every third slice needs one.
    slices = depth + 1 if order == "overlapping" else depth
    one = Packing(components_per_voxel=1 + voxels.label_bytes)
    packing, room = one if order is None else Packing(4, order), room_of(profile)
    layout = fit_mosaic((slices, height, width), packing, room)
    if layout is None:
        channels = "one voxel in a texel" if order is None else "four channels"
        return Misfit(
            f"a piece has {depth} slices of {width}×{height} voxels, and a mosaic of {room.size}×{room.size} texels "
            f"with {channels} has room for {most_slices((height, width), packing, room)}"
        )
    return Form(texel, layout, size_bytes(texel, (1, *layout.texture_shape_yx)))


def _fetches(form: Form, between: SampleFilter) -> float:
    """Return the fetches of a sample, on the average. Each chooses among eight textures, so that they count most.

    An engine of 128×128×64 voxels in pieces of 65, 256² pixels, llvmpipe: overlapping 68 ms, interleaved 95, one
    channel 105; pieces as 3D textures 85.
    """
    if form.mosaic is None or between == "nearest":
        return 1.0
    return 2.0 if form.mosaic.slices_per_texel == 1 else _FETCHES[form.mosaic.order]
