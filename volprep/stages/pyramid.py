"""Coarser levels: the mean over blocks of the codes of level 0.

Every level is made from level 0 and rounded once, half to even: means of rounded means would drift. A block that
hangs over the edge of an odd size sees the edge repeated.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep import _native
from volprep.plan import LevelPlan, Plan
from volprep.slabs import RawVolume, bytes_of, slab_ranges
from volprep.stages import Changes, Stage
from volprep.work import codes_name, codes_of_source, levels_of
from volprep_formats.package.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _settings(plan: Plan) -> tuple[Record, ...]:
    return plan.levels


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    source = codes_of_source(draft, plan)
    coarser = [level for level in plan.levels if level.index > 0]
    progress.start("pyramid", len(coarser) * source.shape_zyx[0])
    for level in coarser:
        draft.write(codes_name(level.index), "work", _reduced(source, level, progress))
    return {"levels": levels_of(plan)}


def _reduced(source: RawVolume, level: LevelPlan, progress: Progress) -> Iterator[memoryview]:
    factors = level.factors_zyx
    # Slabs of whole blocks: each gives slices of the level that no other slab touches.
    for z0, z1 in slab_ranges(source.shape_zyx[0], source.slice_bytes, multiple=factors[0]):
        slab: NDArray[Any] = source.read_slab(z0, z1)
        means = np.empty(_native.box_reduced_shape(slab.shape, factors), source.dtype)
        _native.box_reduce(slab, means, factors)
        yield bytes_of(means)
        progress.advance(z1 - z0)


STAGE = Stage(name="pyramid", reads=("quantize",), settings=_settings, run=_run)
