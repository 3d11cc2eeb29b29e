"""The texels of a level in which voxels that no picture can show have one value."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.hidden.runs import Runs, hidden_runs
from volprep.parts.texels import texels_of, volume_reader
from volprep.parts.work import codes_of_level
from volprep.plan.products import FlattenedPlan
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep_formats.arrays import Texels
from volprep_formats.package.storage.draft import Draft
from volprep_formats.record import Record


def flattened_reader(draft: Draft, plan: ChannelPlan, volume: VolumePlan) -> Callable[[int, int], Texels]:
    """Return a function that reads slices z0 to z1 - 1 of a level as the texels of its textures, as `volume_reader`.

    Hidden voxels are flattened if the plan contains that decision.
    """
    flattened = plan.part(FlattenedPlan)
    if flattened is None:
        return volume_reader(draft, plan, volume)
    codes, reach = codes_of_level(draft, plan, volume.level), flattened.reach
    runs = hidden_runs(draft, plan, volume.level)

    def read(z0: int, z1: int) -> Texels:
        below, above = max(0, z0 - reach), min(codes.shape_zyx[0], z1 + reach)
        slab: NDArray[Any] = codes.read_slab(below, above)
        return texels_of(flatten(slab, runs, reach)[z0 - below : z1 - below], volume.format)

    return read


def flattening(plan: ChannelPlan) -> tuple[Record, ...]:
    """Return the decisions of a plan that `flattened_reader` depends on, as settings of a stage."""
    flattened = plan.part(FlattenedPlan)
    return () if flattened is None else (flattened, *plan.transfer_functions, *plan.tables)


def flatten(codes: NDArray[Any], runs: Runs, reach: int) -> NDArray[Any]:
    """Return codes [z, y, x], where a code of a run becomes its first code if all codes within `reach` are of the run.

    Outside the array every run matches, because a texture repeats its border there.
    """
    made = codes.copy()
    distance = np.empty(codes.shape, np.uint8)
    for first, last in runs:
        shown = (codes < first) | (codes > last)
        if shown.all():
            continue
        _native.chebyshev_distance(shown.view(np.uint8), distance)
        made[distance > reach] = first
    return made
