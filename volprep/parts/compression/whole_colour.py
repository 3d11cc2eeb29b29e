"""How blocks change the pictures of a volume in colour: measured on the whole level, as validation judges it.

Light and extinction are encoded together, so that one trial is of all four channels. FLIP counts too: over a tissue of
one hue blocks shift the hue, which is small as a number and seen at once. A stack of photographs had half of the
allowed RMSE and all of the allowed FLIP.
"""

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.parts.compression.level_blocks import encoded_level, oracle_of_view
from volprep.parts.compression.source_level import LevelData, SourceLevel
from volprep.parts.values.decision import within_share
from volprep.plan.form_trial import FormTrial
from volprep.plan.probe import SHARE, PictureDifference, difference
from volprep.plan.records import VolumePlan
from volprep.plan.whole_source import WholeSource
from volprep.scan.slabs import slab_ranges, temporary_codes
from volprep.truth.camera import standard_views
from volprep.truth.colour import media_of_colour
from volprep.truth.seen import seen_flip
from volprep.truth.volume import Medium, Volume
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.installation import generator
from volprep_formats.package.manifest import Tolerance
from volprep_formats.record import Record
from volprep_formats.textures.block_formats import CompressedFormat
from volprep_formats.textures.srgb_texels import encoded_srgb

_SCALE = 65535
"""Decoded values are kept in 16 bits. The lowest code of sRGB is 20 of them."""


@dataclass(frozen=True)
class _Loss:
    """Largest errors of some pictures."""

    rmse: float = 0.0
    maximum: float = 0.0
    flip: float = 0.0
    pictures: int = 0

    def with_picture(self, picture: Float64Array, truth: Float64Array) -> "_Loss":
        found, flip = difference(picture, truth), seen_flip(picture, truth)
        rmse, maximum = max(self.rmse, found.rmse), max(self.maximum, found.maximum)
        return _Loss(rmse, maximum, max(self.flip, flip.black, flip.white), self.pictures + 1)

    def is_within(self, tolerance: Tolerance) -> bool:
        numbers = PictureDifference(self.rmse, self.maximum)
        return within_share(numbers, tolerance) and self.flip <= SHARE * tolerance.flip


class WholeColour:
    """A level in colour, with its true pictures."""

    def __init__(self, sources: Sequence[WholeSource], data: Sequence[LevelData]) -> None:
        """Store the sources and the parameters of red, green, blue and opacity."""
        self._sources = sources
        self._data = data
        self._levels = [SourceLevel(*pair) for pair in zip(sources, data, strict=True)]
        self._grid = self._levels[0].grid

    def try_form(self, volume: VolumePlan, form: CompressedFormat) -> FormTrial:
        """Encode the level in `form`, as `volume` lays it out; draw views until one is beyond half of the tolerance.

        A known result is not computed again.
        """
        key = self._key(volume, form)
        known = self._sources[0].known
        for trial in known:
            if trial.key == key:
                return trial
        blocks, seconds = encoded_level(self._texels, volume, form)
        shape = (len(self._levels), *self._grid.shape_zyx)
        with temporary_codes(self._sources[0].volume.path.parent, shape) as decoded:
            square = self._decode(blocks, volume, form, decoded)
            loss = self._compared(decoded, form)
        trial = FormTrial(
            channel=volume.channels[0],
            format=form,
            kept=loss.is_within(self._data[0].tolerance),
            level=volume.level,
            size_bytes=sum(part.nbytes for part in blocks),
            basis="level",
            pictures=loss.pictures,
            psnr_db=10 * math.log10(255**2 / square) if square else None,
            rmse=loss.rmse,
            maximum=loss.maximum,
            flip=loss.flip,
            seconds=seconds,
            key=key,
        )
        known.append(trial)
        return trial

    def _key(self, volume: VolumePlan, form: CompressedFormat) -> str:
        from volprep_formats.textures.blocks import encoder_of  # noqa: PLC0415 - needed only for compression

        records: list[Record] = [volume]
        for data in self._data:
            records += [data.level, data.crop, data.quantize, *data.functions, data.render, data.tolerance]
        digests = [source.sha256 for source in self._sources]
        listed = [record.model_dump(mode="json") for record in records]
        text = json.dumps([generator(), encoder_of(form), digests, listed], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def _texels(self, z0: int, z1: int) -> UInt8Array:
        """Slices z0 to z1 - 1 as the stage encodes them, [z, y, x, RGBA]."""
        return np.stack([encoded_srgb(level.codes(z0, z1), k) for k, level in enumerate(self._levels)], axis=-1)

    def _decode(
        self, blocks: list[UInt8Array], volume: VolumePlan, form: CompressedFormat, decoded: NDArray[np.uint16]
    ) -> float:
        """Decode all slices into `decoded` [channel, z, y, x]; return the mean square error, in bytes of texels."""
        from volprep_formats.textures.blocks import decoded_slices  # noqa: PLC0415 - needed only for compression

        assert volume.mosaic is not None  # noqa: S101 - as above
        read = decoded_slices(blocks.__getitem__, volume.mosaic, form)
        squares = 0.0
        for z0, z1 in slab_ranges(decoded.shape[1], 16 * decoded[0, 0].size):
            linear = np.rint(read(z0, z1) * np.float32(_SCALE)).astype(np.uint16)
            texels = self._texels(z0, z1)
            for k in range(len(decoded)):
                decoded[k, z0:z1] = linear[..., k]
                error = encoded_srgb(linear[..., k], k).astype(np.float64) - texels[..., k]
                squares += float(np.sum(error**2))
        return squares / decoded.size

    def _compared(self, decoded: NDArray[np.uint16], form: CompressedFormat) -> _Loss:
        functions = [data.functions[0] for data in self._data]
        volumes = [Volume(value, self._grid, 1 / _SCALE) for value in decoded]
        blocks = media_of_colour([Medium(*pair) for pair in zip(volumes, functions, strict=True)])
        pairs = zip(self._levels, functions, strict=True)
        truth = media_of_colour([level.medium(function) for level, function in pairs])
        render = self._data[0].render
        views = standard_views(self._grid, render.projection)
        self._sources[0].progress.start(f"pictures of {form}", len(views))
        loss = _Loss()
        for camera in views.values():
            picture = oracle_of_view(blocks, camera, render)
            loss = loss.with_picture(picture, oracle_of_view(truth, camera, render))
            self._sources[0].progress.advance()
            if not loss.is_within(self._data[0].tolerance):
                break
        return loss
