"""How compression of a whole level changes the pictures that validation judges: measured, not estimated.

The level is encoded as in its stage, decoded as on a GPU, and the oracle draws its standard views, which are compared
with the same views of the source. So the error includes both codes and blocks: it is the data error of validation. The
oracle needs whole volumes: source and decoded level are files that are mapped into memory.
"""

import hashlib
import json
import math

import numpy as np
from numpy.typing import NDArray

from volprep.parts.compression.level_blocks import encoded_level, oracle_of_view
from volprep.parts.compression.source_level import LevelData, SourceLevel
from volprep.parts.values.decision import within_share
from volprep.plan.form_trial import FormTrial
from volprep.plan.probe import PictureDifference, difference
from volprep.plan.records import VolumePlan
from volprep.plan.whole_source import WholeSource
from volprep.scan.slabs import slab_ranges, temporary_codes
from volprep.truth.camera import Camera, standard_views
from volprep.truth.volume import Medium, Volume
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.installation import generator
from volprep_formats.textures.block_formats import CompressedFormat

_SCALE = 65535
"""Decoded values are kept in 16 bits; no format has more than 11."""


class WholeLevel:
    """A level with its true pictures. Each picture is drawn once for all forms."""

    def __init__(self, source: WholeSource, data: LevelData) -> None:
        """Store the source and the parameters of the trial."""
        self._source = source
        self._data = data
        self._level = SourceLevel(source, data)
        self._truth: dict[tuple[int, str], Float64Array] = {}

    def try_form(self, volume: VolumePlan, form: CompressedFormat) -> FormTrial:
        """Encode the level in `form`, as `volume` lays it out; draw views until one is beyond half of the tolerance.

        Encoding and drawing take as long as an encoder and half a validation, so known results are not computed again.
        """
        key = self._key(volume, form)
        for trial in self._source.known:
            if trial.key == key:
                return trial
        with temporary_codes(self._source.volume.path.parent, self._level.grid.shape_zyx) as decoded:
            blocks, seconds = encoded_level(self._level.codes, volume, form)
            square = self._decode(blocks, volume, form, decoded)
            error, pictures = self._compare(decoded, form)
        trial = FormTrial(
            channel=self._data.level.channel,
            format=form,
            kept=within_share(error, self._data.tolerance),
            level=volume.level,
            size_bytes=sum(part.nbytes for part in blocks),
            basis="level",
            pictures=pictures,
            psnr_db=10 * math.log10(255**2 / square) if square else None,
            rmse=error.rmse,
            maximum=error.maximum,
            seconds=seconds,
            key=key,
        )
        self._source.known.append(trial)
        return trial

    def _key(self, volume: VolumePlan, form: CompressedFormat) -> str:
        from volprep_formats.textures.blocks import encoder_of  # noqa: PLC0415 - needed only for compression

        data = self._data
        records = (data.level, data.crop, data.quantize, *data.functions, data.render, data.tolerance, volume)
        listed = [record.model_dump(mode="json") for record in records]
        text = json.dumps([generator(), encoder_of(form), self._source.sha256, *listed], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def _decode(
        self, blocks: list[UInt8Array], volume: VolumePlan, form: CompressedFormat, decoded: NDArray[np.uint16]
    ) -> float:
        """Decode all slices into `decoded`; return the mean square error, in codes."""
        from volprep_formats.textures.blocks import decoded_slices  # noqa: PLC0415 - needed only for compression

        layout = volume.mosaic
        assert layout is not None  # noqa: S101 - as above
        read = decoded_slices(blocks.__getitem__, layout, form)
        squares = 0.0
        for z0, z1 in slab_ranges(len(decoded), 4 * decoded[0].size):
            texels = read(z0, z1)
            decoded[z0:z1] = np.rint(texels * np.float32(_SCALE))
            squares += float(np.sum((texels * np.float32(255) - self._level.codes(z0, z1)) ** 2, dtype=np.float64))
        return squares / decoded.size

    def _compare(self, decoded: NDArray[np.uint16], form: CompressedFormat) -> tuple[PictureDifference, int]:
        """Largest errors over views and transfer functions, and how many pictures were drawn."""
        low, high = self._data.quantize.window
        volume = Volume(decoded, self._level.grid, (high - low) / _SCALE, low)
        views = self._views()
        self._source.progress.start(f"pictures of {form}", len(views) * len(self._data.functions))
        worst = PictureDifference(0.0, 0.0)
        drawn = 0
        for name, camera in views.items():
            for index in range(len(self._data.functions)):
                medium = Medium(volume, self._data.functions[index])
                picture = oracle_of_view([medium], camera, self._data.render)
                found = difference(picture, self._true_picture(index, name))
                worst = PictureDifference(max(worst.rmse, found.rmse), max(worst.maximum, found.maximum))
                drawn += 1
                self._source.progress.advance()
                if not within_share(worst, self._data.tolerance):
                    return worst, drawn
        return worst, drawn

    def _true_picture(self, function: int, view: str) -> Float64Array:
        if (function, view) not in self._truth:
            medium = self._level.medium(self._data.functions[function])
            camera = self._views()[view]
            self._truth[function, view] = oracle_of_view([medium], camera, self._data.render)
        return self._truth[function, view]

    def _views(self) -> dict[str, Camera]:
        return standard_views(self._level.grid, self._data.render.projection)
