"""Whether the fidelity that a manifest states holds for views that made no part of it."""

from collections.abc import Iterator, Mapping

import numpy as np

from volprep.parts.fidelity.measured import VIEWS as STATED_VIEWS
from volprep.parts.fidelity.measured import MeasuredFidelity, by_chance, cameras_from, measure
from volprep.truth.volume import Volume
from volprep.validation.results.measurements import Deviation
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.manifest import Manifest, Projection
from volprep_formats.package.picture import Fidelity
from volprep_formats.package.reader import Package

VIEWS = 20
SHARE = 0.2
"""Largest difference between the RMSE of other views and the stated one, as a part of it."""
_NOISE = 0.0005
"""RMSE that two drivers may differ by, in targets of 8 bits."""
_FLIP_NOISE = 0.005
"""FLIP that two drivers may differ by."""


def fidelity_findings(package: Package, scans: Mapping[str, Volume], *, wanted: bool) -> Iterator[Deviation]:
    """Measure the values that the manifest states in 20 other views, and return the wrong ones.

    `wanted` is whether the scene asks for the record. Raises the errors of drawing.
    """
    manifest = package.manifest
    stated = {
        (shown.name, drawing.level): drawing.fidelity
        for shown, drawing in manifest.drawings
        if drawing.fidelity is not None
    }
    if wanted != bool(stated):
        is_there = "a fidelity that the scene does not ask for" if stated else "no fidelity"
        yield Deviation(code="VP6044", item="fidelity", problem=f"the manifest states {is_there}")
        return
    if not wanted:
        return
    found = {(fidelity.transfer, fidelity.level): fidelity for fidelity in _measured(package, scans)}
    for transfer, level in sorted(stated.keys() ^ found.keys()):
        problem = "is stated for nothing" if (transfer, level) in stated else "is not stated"
        yield Deviation(code="VP6044", item=f"fidelity of level {level} with {transfer}", problem=problem)
    for key in sorted(stated.keys() & found.keys()):
        wrong = _problem(stated[key], found[key])
        if wrong is not None:
            yield Deviation(code="VP6044", item=f"fidelity of level {key[1]} with {key[0]}", problem=wrong)


def _measured(package: Package, scans: Mapping[str, Volume]) -> Iterator[MeasuredFidelity]:
    # Other views in every package, the same ones in every validation of it.
    chance = np.random.default_rng(int(package.manifest.source.sha256[16:32], 16))
    directions = by_chance(VIEWS, chance)
    for name, part in channel_packages(package).items():
        yield from measure(
            part, scans[name], cameras_from(part.manifest.levels[0].grid, directions, _projection(part.manifest))
        )


def _projection(manifest: Manifest) -> Projection:
    return manifest.render.projection if manifest.render else "orthographic"


def _problem(stated: Fidelity, found: MeasuredFidelity) -> str | None:
    if stated.pixels != found.pixels or abs(stated.pixels_per_voxel / found.pixels_per_voxel - 1) > 0.01:
        return f"is stated for {stated.pixels} pixels, and measured for {found.pixels}"
    if abs(found.rmse - stated.rmse) > SHARE * stated.rmse + _NOISE:
        return f"RMSE {stated.rmse:g} is stated, {len(found.views)} other views have {found.rmse:.3g}"
    flip = sum(view.flip for view in found.views) / len(found.views)
    if abs(flip - stated.flip) > SHARE * stated.flip + _FLIP_NOISE:
        return f"FLIP {stated.flip:g} is stated, {len(found.views)} other views have {flip:.3g}"
    if stated.views != STATED_VIEWS:
        return f"is stated for {stated.views} views; volprep measures {STATED_VIEWS}"
    if found.maximum > stated.maximum:
        return f"a largest error of {stated.maximum:g} is stated, another view has {found.maximum:.3g}"
    return None
