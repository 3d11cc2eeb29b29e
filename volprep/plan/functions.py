"""Transfer functions over the physical values of one scan, and their differences from the scene."""

import math
from collections.abc import Iterator

import numpy as np

from volprep.scan.statistics import Measured
from volprep.scene.points import Measure
from volprep.scene.presets import load_preset
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.transfer_function import MOST_OPAQUE, TransferFunction
from volprep_formats.source import SourceInfo

_OUTLIERS = 0.1
"""Per cent of the sample of rays below the range of a scan, and the same per cent above it: noise, and single hot
voxels."""


def resolved_functions(scene: Scene, info: SourceInfo, measured: Measured) -> tuple[TransferFunction, ...]:
    """Return the scene's transfer functions over the values of a scan."""
    measure = _measure(info, measured)
    return tuple(transfer.resolved(measure) for transfer in scene.transfer)


def describe_functions(scene: Scene, functions: tuple[TransferFunction, ...]) -> Iterator[PlanItem]:
    """List the presets that transfer functions come from, and the points that were changed."""
    wishes = {transfer.name: transfer for transfer in scene.transfer}
    for function in functions:
        transfer = wishes[function.name]
        wish = transfer.wish
        if transfer.preset is not None:
            low, high = function.points[0].value, function.points[-1].value
            yield PlanItem(
                name=f"preset {transfer.name}",
                kind="preset",
                transfer=transfer.name,
                kept=True,
                reason=f"{transfer.preset}: {load_preset(transfer.preset).shows}; here from {low:.4g} to {high:.4g}",
            )
        if wish.opaque_points:
            points = ", ".join(f"points.{index}" for index in wish.opaque_points)
            yield PlanItem(
                name=f"full opacity in {transfer.name}",
                kind="full-opacity",
                transfer=transfer.name,
                kept=False,
                reason=f"{points}: opacity 1 has no finite extinction, so it became {MOST_OPAQUE:.6f}",
            )


def _measure(info: SourceInfo, measured: Measured) -> Measure:
    low, high = (float(value) for value in np.percentile(measured.rays_zyx[0], (_OUTLIERS, 100 - _OUTLIERS)))
    if low == high:
        low, high = measured.statistics.minimum, measured.statistics.maximum
    if low == high:
        # A scan of one value: all of it is at the place 0, and the upper end does not matter.
        high = low + max(1.0, abs(low))
    return Measure(low=low, high=high, diagonal_mm=math.hypot(*info.grid.extent_mm_zyx))
