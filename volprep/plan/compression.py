"""Whether textures of levels are compressed, and how: only if pictures bear it, which is measured before.

Patches of the scan are encoded as the slices of a mosaic would be, decoded as a GPU does, and rays in z direction
through them give the pictures: the same measure by which codes are chosen, and the same share of the tolerance.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.plan.probe import Codes, PictureError, difference, picture
from volprep.plan.values import ValueChoice, within_share
from volprep.scene import Compression, Scene
from volprep.statistics import Measured
from volprep.transfer.table import Table
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo
from volprep_formats.textures.block_formats import BLOCKS, CompressedFormat

FORMATS: dict[Compression, CompressedFormat] = {
    "eac": "EAC_R11",
    "etc2": "ETC2_RGBA8",
    "astc-4x4": "ASTC_4X4",
    "astc-5x5": "ASTC_5X5",
    "astc-6x6": "ASTC_6X6",
    "astc-8x8": "ASTC_8X8",
}
"""What a scene may ask for."""
_RAW_BITS = 8.0


@dataclass(frozen=True)
class CompressionChoice:
    """What was decided."""

    format: CompressedFormat | None
    """Format of the textures of levels; None: not compressed."""
    items: tuple[PlanItem, ...]
    """The decision for people, one item for each format that was tried."""


def bits_per_voxel(texture_format: CompressedFormat) -> float:
    """Bits that a voxel takes, without padding."""
    block = BLOCKS[texture_format]
    return 8 * block.bytes / block.size**2 / block.channels


def choose_compression(  # noqa: PLR0917 - all that was found and decided before
    scene: Scene,
    profile: DeviceProfile,
    info: SourceInfo,
    measured: Measured,
    functions: tuple[TransferFunction, ...],
    values: ValueChoice,
) -> CompressionChoice:
    """Take the format that the scene names, or with "auto" the smallest, if it changes pictures little enough.

    Raises VP3070 where the scene names a format that the profile does not have.
    """
    wanted = scene.textures.compression
    if wanted == "none":
        return CompressionChoice(None, ())
    known = [name for name in BLOCKS if name in profile.texture_formats]
    if wanted != "auto" and FORMATS[wanted] not in known:
        fields = {"wanted": wanted, "format": FORMATS[wanted], "profile": profile.name}
        raise VolprepError("VP3070", **fields, known=", ".join(profile.texture_formats))
    if reason := _why_never(scene, values, profile, known):
        return CompressionChoice(None, (PlanItem(name="compressed textures", kept=False, reason=reason),))
    # A form that saves nothing is for those who ask for it.
    smaller = sorted((name for name in known if bits_per_voxel(name) < _RAW_BITS), key=bits_per_voxel)
    patches = _Patches(measured, info.grid.spacing_mm_zyx[0], functions, values)
    items: list[PlanItem] = []
    for name in smaller if wanted == "auto" else [FORMATS[wanted]]:
        error = patches.error(name)
        kept = within_share(error, scene.tolerance)
        items.append(_item(name, error, kept=kept))
        if kept:
            return CompressionChoice(name, tuple(items))
    return CompressionChoice(None, tuple(items))


def _why_never(scene: Scene, values: ValueChoice, profile: DeviceProfile, known: list[CompressedFormat]) -> str | None:
    if not known:
        return f"profile {profile.name} has no compressed format of linear values"
    if scene.source.labels:
        return "blocks would put values between labels"
    if values.quantize.bits != 8:
        return "values have 16 bits, of which no format keeps more than 11"
    if scene.render.classification == "preclassified":
        return "classified voxels are 3D textures, and compressed 3D textures are missing on most devices"
    return None


def _item(name: CompressedFormat, error: PictureError, *, kept: bool) -> PlanItem:
    limit = "within" if kept else "not within"
    return PlanItem(
        name=f"textures as {name}",
        kept=kept,
        reason=f"{bits_per_voxel(name):.3g} bits a voxel; it changes rays through patches of the scan by {error.text}, "
        f"{limit} half of the tolerance",
    )


class _Patches:
    """Patches of the scan with the pictures of their codes."""

    def __init__(
        self,
        measured: Measured,
        spacing_mm: float,
        functions: tuple[TransferFunction, ...],
        values: ValueChoice,
    ) -> None:
        self._spacing_mm = spacing_mm
        self._codes = Codes(8, values.quantize.window)
        texels = self._codes.texels(measured.patches.astype(np.float64))
        self._texels = np.rint(texels * 255).astype(np.uint8)
        self._tables = [Table.exact(each).resampled(values.quantize.window, values.entries) for each in functions]
        self._truth = [self._picture(texels, table) for table in self._tables]

    def error(self, name: CompressedFormat) -> PictureError:
        """What compression changes, at worst over the transfer functions."""
        decoded = _through_blocks(self._texels, name)
        errors = [
            difference(self._picture(decoded, table), truth)
            for table, truth in zip(self._tables, self._truth, strict=True)
        ]
        return PictureError(max(error.rmse for error in errors), max(error.maximum for error in errors))

    def _picture(self, texels: NDArray[np.float64], table: Table) -> NDArray[np.float64]:
        # Every column of voxels is a ray: few rays have the largest error.
        columns = self._codes.decoded(texels.transpose(1, 0, 2, 3).reshape(texels.shape[1], -1))
        return picture(columns, self._spacing_mm, table)


def _through_blocks(texels: NDArray[np.uint8], name: CompressedFormat) -> NDArray[np.float64]:
    """Encode and decode patches [patch, z, y, x], each slice of each in blocks of its own; gives values 0 to 1."""
    # Encoders are heavy, and for those who compress.
    from volprep_formats.textures.blocks import decode_blocks, encode_blocks  # noqa: PLC0415

    block = BLOCKS[name]
    patches, depth, height, width = texels.shape
    beyond = [(-depth % block.channels), (-height % block.size), (-width % block.size)]
    padded = np.pad(texels, [(0, 0), *((0, more) for more in beyond)], mode="edge")
    _, slices, rows, columns = padded.shape
    # Slices that share a texel come last, the others go down the picture.
    tiles = padded.reshape(patches, slices // block.channels, block.channels, rows, columns)
    sheet = tiles.transpose(1, 3, 0, 4, 2).reshape(-1, patches * columns, block.channels)
    sheet = np.ascontiguousarray(sheet[..., 0] if block.channels == 1 else sheet)
    shape_yx = sheet.shape[0], sheet.shape[1]
    decoded = decode_blocks(encode_blocks(sheet, name), name, shape_yx, block.channels)
    volume = decoded.reshape(slices // block.channels, rows, patches, columns, block.channels)
    inside = volume.transpose(2, 0, 4, 1, 3).reshape(padded.shape)[:, :depth, :height, :width]
    return inside.astype(np.float64)
