"""Whether textures of levels are compressed, and how: only if pictures hardly change, which is measured first.

First patches of the scan are encoded as the slices of a mosaic would be, and decoded as a GPU does; rays in z direction
through them give the pictures. A form that these do not bear is refused. They see few of the places where it is worst
(on the engine an error of 0.09 where it was 0.34), so that the others are tried on the whole level (`whole_level.py`).
"""

import math

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.parts.case import Case
from volprep.parts.compression.source_level import LevelData
from volprep.parts.compression.whole_level import WholeLevel
from volprep.parts.layout.decision import lay_out
from volprep.parts.values.decision import within_share
from volprep.plan.decisions import CompressionChoice, Layout, ValueChoice
from volprep.plan.form_trial import FormTrial
from volprep.plan.probe import PictureDifference, Quantizer, difference
from volprep.plan.room import texture_bytes
from volprep.scene.scene import FORMATS, Scene
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.textures.block_formats import BLOCKS, CompressedFormat

COLOUR_FORM: CompressedFormat = "astc-4x4-unorm-srgb"
"""The form of a volume in colour. The scene asks for it as for astc-4x4-unorm: the same extension has both."""
KIND = "compression"
"""Kind of its items of the plan."""
_RAW_BITS = 8.0


def bits_per_voxel(texture_format: str) -> float:
    """Return the bits that a voxel takes in a compressed format, without padding."""
    block = next(block for name, block in BLOCKS.items() if name == texture_format)
    slices = 1 if block.is_srgb else block.components
    return 8 * block.bytes / block.size**2 / slices


def require_form(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3070 if the scene names a form that the profile does not have."""
    wanted = scene.textures.compression
    if wanted == "none":
        return
    if wanted != "auto" and FORMATS[wanted] not in profile.texture_formats:
        fields = {"wanted": wanted, "format": FORMATS[wanted], "profile": profile.name}
        raise VolprepError("VP3070", **fields, known=", ".join(profile.texture_formats))


def choose_form(case: Case) -> CompressionChoice:
    """Choose the form that the scene names, or with "auto" the smallest, if it changes pictures little enough.

    Without the whole source a sample decides. A volume in colour has one form, which `colour.py` has decided before.
    Raises VP3070 if the scene names a form that the profile does not have.
    """
    scene, profile = case.scene, case.profile
    wanted = scene.textures.compression
    if wanted == "none":
        return CompressionChoice()
    require_form(scene, profile)
    known = [name for name in BLOCKS if name in profile.texture_formats and not BLOCKS[name].is_srgb]
    if reason := _why_never(scene, case.values, profile, known):
        return CompressionChoice(items=(PlanItem(name="compressed textures", kind=KIND, kept=False, reason=reason),))
    # A form that saves nothing is used only if the scene asks for it.
    smaller = sorted((name for name in known if bits_per_voxel(name) < _RAW_BITS), key=bits_per_voxel)
    return _first_that_bears(case, smaller if wanted == "auto" else [FORMATS[wanted]])


def _first_that_bears(case: Case, names: list[CompressedFormat]) -> CompressionChoice:
    patches = _Patches(case)
    items: list[PlanItem] = []
    forms: list[FormTrial] = []
    wholes: dict[int, WholeLevel] = {}
    for name in names:
        try:
            layout = lay_out(case, name)
        except VolprepError as error:
            if error.code != "VP3022":
                raise
            items.append(misfit(name, case.profile))
            continue
        trial = patches.try_form(name, layout)
        if trial.kept and case.whole is not None:
            level = layout.levels[0]
            if level.index not in wholes:
                wholes[level.index] = WholeLevel(case.whole, _level_data(case, layout))
            trial = wholes[level.index].try_form(layout.volumes[0], name)
        forms.append(trial)
        items.append(item_of(trial))
        if trial.kept:
            return CompressionChoice(name, tuple(items), tuple(forms))
    return CompressionChoice(None, tuple(items), tuple(forms))


def misfit(name: CompressedFormat, profile: DeviceProfile) -> PlanItem:
    """Return the item of a form in which no level fits."""
    reason = (
        f"{bits_per_voxel(name):.3g} bits a voxel; profile {profile.name} has no room for a level of it as a mosaic"
    )
    return PlanItem(name=f"textures as {name}", kind=KIND, kept=False, reason=reason)


def _level_data(case: Case, layout: Layout) -> LevelData:
    return LevelData(
        level=layout.levels[0],
        crop=case.crop,
        grid=case.grid,
        quantize=case.values.quantize,
        functions=case.functions,
        render=case.scene.render,
        tolerance=case.scene.tolerance,
    )


def _why_never(scene: Scene, values: ValueChoice, profile: DeviceProfile, known: list[CompressedFormat]) -> str | None:
    if not known:
        return f"profile {profile.name} has no compressed format of linear values"
    if scene.source.labels:
        return "compressed blocks would put values between labels"
    if values.quantize.bits != 8:
        return "values have 16 bits, and no format keeps more than 11"
    if scene.render.classification == "preclassified":
        return "classified voxels are 3D textures, and most devices have no compressed 3D textures"
    return None


def item_of(trial: FormTrial) -> PlanItem:
    """Return the item of a form that was tried, with the numbers."""
    limit = "within" if trial.kept else "not within"
    error = PictureDifference(trial.rmse, trial.maximum).text
    if trial.flip is not None:
        error = f"{error}, FLIP {trial.flip:.2g}"
    if trial.basis == "level":
        views = "view" if trial.pictures == 1 else "views"
        found = f"encoded whole, it changes {trial.pictures} standard {views} by {error}"
    else:
        found = f"it changes rays through patches of the scan by {error}"
    later = "; a build tries the whole level" if trial.kept and trial.basis == "sample" else ""
    return PlanItem(
        name=f"textures as {trial.format}",
        kind=KIND,
        kept=trial.kept,
        reason=f"{bits_per_voxel(trial.format):.3g} bits a voxel; {found}, {limit} half of the tolerance{later}",
    )


class _Patches:
    """Patches of the scan with the pictures of their codes."""

    def __init__(self, case: Case) -> None:
        values = case.values
        self._tolerance = case.scene.tolerance
        self._rays = COMPOSITINGS[case.scene.render.compositing].rays
        self._spacing_mm = case.info.grid.spacing_mm_zyx[0]
        self._quantizer = Quantizer(8, values.quantize.window)
        stored = case.measured.stored_patches.astype(np.float64)
        texels = self._quantizer.texels(stored * case.info.slope + case.info.intercept)
        self._texels = np.rint(texels * 255).astype(np.uint8)
        exact = [Table.exact(function) for function in case.functions]
        self._tables = [table.resampled(values.quantize.window, values.entries) for table in exact]
        self._truth = [self._picture(texels, table) for table in self._tables]

    def try_form(self, name: CompressedFormat, layout: Layout) -> FormTrial:
        """Return the largest change by compression over all transfer functions."""
        decoded = _through_blocks(self._texels, name)
        errors = [
            difference(self._picture(decoded, table), truth)
            for table, truth in zip(self._tables, self._truth, strict=True)
        ]
        error = PictureDifference(max(error.rmse for error in errors), max(error.maximum for error in errors))
        square = float(np.mean((255 * decoded - self._texels) ** 2))
        return FormTrial(
            channel=layout.levels[0].channel,
            format=name,
            kept=within_share(error, self._tolerance),
            level=layout.levels[0].index,
            size_bytes=texture_bytes(layout.volumes[0]),
            basis="sample",
            pictures=1,
            psnr_db=10 * math.log10(255**2 / square) if square else None,
            rmse=error.rmse,
            maximum=error.maximum,
        )

    def _picture(self, texels: Float64Array, table: Table) -> Float64Array:
        # Every column of voxels is a ray: few rays have the largest error.
        columns = self._quantizer.decoded(texels.transpose(1, 0, 2, 3).reshape(texels.shape[1], -1))
        return self._rays(columns, self._spacing_mm, table, "linear")


def _through_blocks(texels: UInt8Array, name: CompressedFormat) -> Float64Array:
    """Encode and decode patches [patch, z, y, x], each slice of each in blocks of its own; gives values 0 to 1."""
    # Encoders are heavy dependencies, needed only for compression.
    from volprep_formats.textures.blocks import decode_blocks, encode_blocks  # noqa: PLC0415

    block = BLOCKS[name]
    patches, depth, height, width = texels.shape
    beyond = [(-depth % block.components), (-height % block.size), (-width % block.size)]
    padded = np.pad(texels, [(0, 0), *((0, more) for more in beyond)], mode="edge")
    _, slices, rows, columns = padded.shape
    # Slices that share a texel come last, the others go down the picture.
    tiles = padded.reshape(patches, slices // block.components, block.components, rows, columns)
    sheet = tiles.transpose(1, 3, 0, 4, 2).reshape(-1, patches * columns, block.components)
    sheet = np.ascontiguousarray(sheet[..., 0] if block.components == 1 else sheet)
    shape_yx = sheet.shape[0], sheet.shape[1]
    decoded = decode_blocks(encode_blocks(sheet, name), name, shape_yx, block.components)
    volume = decoded.reshape(slices // block.components, rows, patches, columns, block.components)
    inside = volume.transpose(2, 0, 4, 1, 3).reshape(padded.shape)[:, :depth, :height, :width]
    return inside.astype(np.float64)
