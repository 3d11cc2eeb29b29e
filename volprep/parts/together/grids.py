"""Channels on several grids in one picture: the box that holds them, and what does not go with several grids."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from volprep.parts.case import Case
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import Scene
from volprep.scene.wishes import refuse_any, refuse_wishes
from volprep_formats.grid import Affine, Grid, box_from_box, inverse_of

_MOST = 4
"""Media of a picture that may lie on grids of their own; each takes two uniforms, which have numbered sources."""
_SLACK = 1e-6
"""Part of a voxel that rounding may move a corner beyond a face without making the box larger."""


@dataclass(frozen=True)
class Grids:
    """Where the media of a picture lie."""

    grid: Grid
    """Grid with the box of the picture: voxels of the first channel, and all that it takes beside them."""
    placed: tuple[Affine | None, ...]
    """Registration of each channel, in their order."""
    text: str
    """For people."""


def grids_of(cases: Sequence[Case], channels: Iterable[str], scene: Scene) -> Grids | None:
    """Return where the `channels` of a picture lie; None if all have one grid.

    Raises VP1246 for what does not go with several grids.
    """
    media = [next(case for case in cases if case.channel == name) for name in channels]
    if scene.together is None or len({(case.grid, case.placed) for case in media}) < 2:
        return None
    _require_possible(media, scene)
    first, *others = media
    grid = first.grid if scene.together.box == "first" else _around(first.grid, others)
    sizes = ", ".join(f"{case.channel} {shape_text(case.grid.shape_zyx)}" for case in media)
    box = "what the first channel shows" if scene.together.box == "first" else "what all channels show"
    text = f"each channel keeps its own grid ({sizes}), in a box around {box}"
    return Grids(grid, tuple(case.placed for case in media), text)


def _around(first: Grid, others: Sequence[Case]) -> Grid:
    """Return the grid of the first channel, grown by whole voxels until it holds all boxes."""
    low = [0.0, 0.0, 0.0]
    high = [float(n) for n in first.shape_zyx[::-1]]
    for case in others:
        rows = np.array(inverse_of(box_from_box(case.grid, case.placed, first)))
        corners = np.array(list(product(*((0.0, length) for length in case.grid.extent_mm_zyx[::-1]), (1.0,))))
        voxels = corners @ rows.T / first.spacing_mm_zyx[::-1]
        low = [min(a, b) for a, b in zip(low, voxels.min(axis=0).tolist(), strict=True)]
        high = [max(a, b) for a, b in zip(high, voxels.max(axis=0).tolist(), strict=True)]
    z0, y0, x0 = (math.floor(at + _SLACK) for at in low[::-1])
    z1, y1, x1 = (math.ceil(at - _SLACK) for at in high[::-1])
    return first.part((z0, y0, x0), (z1, y1, x1))


def _require_possible(media: Sequence[Case], scene: Scene) -> None:
    """Raise VP1246 for what does not go with several grids."""
    name = next(case.channel for case in media[1:] if (case.grid, case.placed) != (media[0].grid, media[0].placed))
    refuse_wishes("VP1246", scene, ("editable", "textures.compression", "textures.mipmaps"), path=scene.name, name=name)
    render = scene.render
    profile = media[0].profile
    others = {
        f"profile {profile.name}, which has no 3D textures": not profile.max_3d_texture_size,
        f"more than {_MOST} channels in a picture": len(media) > _MOST,
        f"technique {render.technique}": render.technique != "ray-casting",
        f"compositing {render.compositing}": render.compositing != "emission-absorption",
        'textures.channels = "packed"': scene.textures.channels == "packed",
        "[hybrid]": scene.hybrid is not None,
        "a transform of the first channel": media[0].placed is not None,
    }
    refuse_any("VP1246", others, path=scene.name, name=name)
