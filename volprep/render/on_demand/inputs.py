"""Inputs of the program of bricks on demand: the pool of the bricks that are held, and the page table."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from volprep.render.inputs import Inputs, undrawable
from volprep.render.on_demand.bricks import BrickFile, Held
from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import Level
from volprep_formats.package.parts.bricks.places import constant_entry
from volprep_formats.package.picture import ON_DEMAND
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.textures.texel_formats import TEXELS


def from_bricks(
    bricks: BrickFile, held: Held, picture: str | None, missing: Callable[[VolprepError], None] | None = None
) -> Inputs:
    """Return the inputs of a picture from the bricks that are held.

    A damaged brick is drawn from the coarser level and told to `missing`. Without that it raises VP5043; VP5018 for a
    picture that is not drawn from bricks.
    """
    manifest, layout = bricks.package.manifest, bricks.layout
    shown = next(
        (
            candidate
            for candidate in manifest.pictures
            if candidate.on_demand is not None and picture in {None, candidate.name}
        ),
        None,
    )
    if shown is None or shown.on_demand is None:
        raise undrawable(bricks.package, "bricks on demand", picture, "no such picture from bricks")
    pool, pages = _texels(bricks, held, missing)
    textures = {texture.name: texture for texture in manifest.textures}
    texels = dict(zip(ON_DEMAND, (pool, pages), strict=True))
    textures |= {
        name: _texture(name, texel, array)
        for (name, array), texel in zip(texels.items(), (layout.format, "rgba8unorm"), strict=True)
    }
    return Inputs(
        program=manifest.picture_program(shown.on_demand.program, shown),
        level=Level(index=0, factors_zyx=(1, 1, 1), grid=bricks.grid, filter="none"),
        textures=[textures[name] for name in shown.on_demand.textures],
        values={},
        step_mm=shown.on_demand.step_mm,
        texels=texels,
    )


def edit_of(bricks: BrickFile, held: Held, picture: str | None) -> Callable[[Package, Inputs], Inputs]:
    """Return what a renderer takes in place of the inputs of a level."""
    inputs = from_bricks(bricks, held, picture)
    return lambda _package, _inputs: inputs


def _texels(
    bricks: BrickFile, held: Held, missing: Callable[[VolprepError], None] | None
) -> tuple[NDArray[np.generic], UInt8Array]:
    """Fill the places of the pool in order, and let each cell name the finest brick there, or its one value."""
    layout = bricks.layout
    pool: NDArray[np.generic] = np.zeros(layout.pool_zyx, TEXELS[layout.format].dtype)
    pages: UInt8Array = np.zeros((*bricks.records[0].shape, 4), np.uint8)
    filled = 0
    for level in reversed(range(len(bricks.records))):
        entries = constant_entry(bricks.records[level]["low"] / _largest(bricks))
        there = bricks.records[level]["size_bytes"] == 0
        for place in zip(*np.nonzero(held[level]), strict=True):
            z, y, x = (int(at) for at in place)
            try:
                texels = bricks.texels(level, (z, y, x))
            except VolprepError as error:
                if missing is None:
                    raise
                missing(error)
                continue
            at = np.unravel_index(filled, layout.places_zyx)
            pool[tuple(slice(k * layout.pitch, (k + 1) * layout.pitch) for k in at)] = texels
            entries[z, y, x] = np.array([at[2], at[1], at[0], 1 + level])
            there[z, y, x] = True
            filled += 1
        drawn = bricks.at_cells(level, there).astype(bool)
        pages[drawn] = bricks.at_cells(level, entries)[drawn]
    return pool, pages


def _largest(bricks: BrickFile) -> int:
    return 255 if bricks.layout.format == "r8unorm" else 65535


def _texture(name: str, texel: str, texels: NDArray[np.generic]) -> Texture:
    z, y, x = texels.shape[:3]
    between = "nearest" if texel == "rgba8unorm" else "linear"
    return Texture(
        name=name, role=name, file=name, format=texel, dimension="3d", shape_zyx=(z, y, x), filter=between, level=0
    )
