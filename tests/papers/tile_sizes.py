"""Figures 9, 10 and 13 of Díaz-García et al.: the tiles that a picture is finished by, in several sizes."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from volprep.validation.comparison.altered import Altered
from volprep_formats.package.reader import Package

from .bench import Bench, View
from .lines import Line
from .progress import budget_s_of, dssim, finishing, opened
from .record import Cell, PaperCurves, PaperTable
from .volumes import Volume

SIZES = (1, 2, 4, 8, 16, 32)
"""Pixels of a tile along each axis, as in the paper."""
_CHOSEN = 8
"""The paper's choice."""


@dataclass(frozen=True)
class Sized:
    """A picture of one scan that tiles of one size finished."""

    scan: str
    """Scan and size."""
    size: int
    """Pixels of a tile along each axis."""
    frames_ms: tuple[float, ...]
    """Time of each frame."""
    changes: tuple[float, ...]
    """DSSIM of each frame from the one before it; of the first, from the small picture that the view had before."""

    @property
    def seconds(self) -> float:
        """Time until the picture is complete."""
        return sum(self.frames_ms) / 1000


def by_sizes(bench: Bench, volume: Volume, package: Package, view: View) -> Iterator[Sized]:
    """Finish a picture by tiles of each size."""
    with bench.renderer(_of_size(package, _CHOSEN)) as renderer, opened(renderer) as shown:
        # First the small one: the driver compiles the shaders for it.
        budget_s_of(shown, View(view.camera, view.small_hw))
        budget_s = budget_s_of(shown, view)
    for size in SIZES:
        with bench.renderer(_of_size(package, size)) as renderer, opened(renderer) as shown:
            budget_s_of(shown, View(view.camera, view.small_hw))
            times, changes = [], []
            for one, other in pairwise(finishing(shown, "tiles", view, budget_s)):
                times.append(other.ms)
                changes.append(dssim(one.picture, other.picture))
        yield Sized(volume.name, size, tuple(times), tuple(changes))


def size_parts(sized: list[Sized], names: list[str], shape_hw: tuple[int, int]) -> Iterator[PaperTable | PaperCurves]:
    """Give both tables and the curves."""
    found = {(each.scan, each.size): each for each in sized}
    yield PaperTable(
        "Figure 9: seconds until a picture is complete, by size of tiles",
        ("pixels of a tile", *names),
        tuple((f"{size}×{size}", *(found[name, size].seconds for name in names)) for size in SIZES),
        f"One view of {shape_hw[1]}×{shape_hw[0]} pixels; the tiles of a frame are one draw.",
    )
    rows: list[tuple[Cell, ...]] = []
    for size in SIZES:
        changes = _changes(sized, size)
        frames = np.mean([len(found[name, size].frames_ms) for name in names])
        rows.append((f"{size}×{size}", float(np.mean(changes)), float(np.std(changes)), f"{frames:.0f}"))
    yield PaperTable(
        "Figure 10: DSSIM of a frame from the one before it, by size of tiles",
        ("pixels of a tile", "mean", "standard deviation", "frames"),
        tuple(rows),
        "The first frame is compared with the small picture.",
    )
    lines = []
    for size in SIZES[2:]:
        run = found[names[0], size]
        times = (np.cumsum(run.frames_ms) / 1000).tolist()
        lines.append(Line(f"{size}×{size}", tuple(zip(times, run.changes, strict=True))))
    yield PaperCurves(
        f"Figure 13: DSSIM of each frame from the one before it, by size of tiles, {names[0]} voxels",
        "seconds",
        "DSSIM",
        tuple(lines),
        "Figures 9 and 10 have the smaller ones, too.",
    )


def about_sizes(sized: list[Sized]) -> str:
    """Say what of the paper's finding holds."""

    def seconds(size: int) -> float:
        return float(np.mean([each.seconds for each in sized if each.size == size]))

    def change(size: int) -> float:
        return float(np.mean(_changes(sized, size)))

    least, most = SIZES[0], SIZES[-1]
    faster = [seconds(_CHOSEN) <= seconds(least), seconds(most) <= seconds(_CHOSEN)]
    where = {
        (True, True): "holds",
        (True, False): f"holds up to {_CHOSEN}² only",
        (False, True): f"holds from {_CHOSEN}² on only",
        (False, False): "does not hold here",
    }[faster[0], faster[1]]
    larger_changes_more = change(most) >= change(_CHOSEN)
    return (
        f" Tiles of {most}² pixels finish a picture in {seconds(most):.3g} seconds, of {_CHOSEN}² in "
        f"{seconds(_CHOSEN):.3g}, single pixels in {seconds(least):.3g}: that larger tiles are faster {where}. "
        f"A frame differs from the one before it by {change(most):.4f} with the largest tiles and by "
        f"{change(_CHOSEN):.4f} with those of {_CHOSEN}²: that larger ones change more from frame to frame "
        f"{'holds' if larger_changes_more else 'does not hold here'}. The paper has all smaller ones alike; here "
        f"single pixels change by {change(least):.4f}, {change(least) / change(_CHOSEN):.1f} times as much."
    )


def _changes(sized: list[Sized], size: int) -> list[float]:
    return [value for each in sized if each.size == size for value in each.changes]


def _of_size(package: Package, size: int) -> Package:
    program = package.manifest.level_programs[0]
    assert program.tiles is not None
    tiles = program.tiles.model_copy(update={"size": size})
    text = package.read_text(tiles.cost)
    declared = f"TILE = {program.tiles.size:.1f};"
    assert declared in text
    texts = {tiles.cost: text.replace(declared, f"TILE = {size:.1f};")}
    return Altered(package, texts, program.model_copy(update={"tiles": tiles}))
