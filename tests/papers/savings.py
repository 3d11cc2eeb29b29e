"""What leaving out work saves, alone and together: skip tables, proxy geometry, early ends, light only where it shows.

All ways are the package's own shader, composed with and without; pictures must stay the same, but for what an early end
may lose. Light is left out where a sample is invisible; in the other ways each sample is lit.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.shading.program import compose_program
from volprep.truth.camera import standard_views
from volprep.validation.comparison.altered import Altered
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.skip.record import SkipKind
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package

from .bench import ALONE, Bench, View
from .record import Measured
from .volumes import Volume

_WHERE_SEEN = "if (medium.a > 0.0) {"
VIEWS = ("anterior", "superior", "anterior-left")
PIXELS = 256


@dataclass(frozen=True)
class Way:
    """What a picture is drawn with."""

    name: str
    """What it is, in words."""
    seen: bool = False
    """Whether only what is seen is lit."""
    early: bool = False
    """Whether rays end early."""
    table: SkipKind | None = None
    """Skip table, if there is one."""
    proxy: bool = False
    """Whether rays begin at proxy geometry."""


PLAIN = Way("nothing left out")
WAYS = (
    PLAIN,
    Way("light where seen", seen=True),
    Way("early exit", early=True),
    Way("blocks, 16 along an axis", table="table16"),
    Way("blocks of 4³", table="blocks"),
    Way("distance map, blocks of 4³", table="distance"),
    Way("proxy", proxy=True),
    Way("light where seen, distance map", seen=True, table="distance"),
    Way("light where seen, early exit", seen=True, early=True),
    Way("these and the distance map", seen=True, early=True, table="distance"),
    Way("these and the proxy", seen=True, early=True, table="distance", proxy=True),
)


@dataclass(frozen=True)
class Saving:
    """A way, drawn: means over three views."""

    way: Way
    """The way."""
    drawn: Measured
    """Time, error and samples."""
    difference: float
    """Largest difference of a picture from the one of which nothing is left out."""


@dataclass(frozen=True)
class Savings:
    """All ways on one scan."""

    scan: str
    """Scan and size."""
    found: tuple[Saving, ...]
    """One for each way."""
    decided: tuple[PlanItem, ...]
    """What the plan says of this scan where it decides for itself: of skip table and early end."""

    def times(self, way: str) -> float:
        """How many times as fast a way is as the one that leaves nothing out."""
        return self.of(PLAIN.name).ms / self.of(way).ms

    def of(self, way: str) -> Measured:
        """Return what was measured of a way."""
        return next(each.drawn for each in self.found if each.way.name == way)


def savings(bench: Bench, volume: Volume, look: str, ways: tuple[Way, ...] = WAYS) -> Savings:
    """Draw a scan in all ways, lit from the viewer."""
    plain: list[np.ndarray] = []
    found = []
    for way in ways:
        package = _package(bench, volume, look, way)
        grid = package.manifest.levels[0].grid
        views = [View(standard_views(grid)[name], (PIXELS, PIXELS)) for name in VIEWS]
        with _opened(bench, package, way) as (renderer, drawn):
            cells = [bench.measured(renderer, package, volume, view) for view in views]
            pictures = [renderer.render(view.camera.box_from_clip(grid, 1.0), view.small_hw) for view in views]
            samples = [bench.samples(renderer, drawn, view) for view in views]
        plain = plain or pictures
        whole = Measured(
            float(np.mean([cell.ms for cell in cells])),
            float(np.sqrt(np.mean([(cell.rmse or 0.0) ** 2 for cell in cells]))),
            float(np.mean(samples)),
        )
        difference = max(float(np.abs(a - b).max()) for a, b in zip(plain, pictures, strict=True))
        found.append(Saving(way, whole, difference))
    planned = bench.package(volume, look, render=_LIT, more=ALONE).manifest
    return Savings(volume.name, tuple(found), tuple(each for each in planned.plan if each.name.startswith(_DECIDED)))


_LIT = 'lighting = "headlight"\nstep_voxels = 0.5\n'
_RENDER = f"{_LIT}opacity_cutoff = 0.998"
_DECIDED = ("skip table", "early ray termination")


def _package(bench: Bench, volume: Volume, look: str, way: Way) -> Package:
    skip = f'[skip]\nkind = "{way.table or "none"}"\n'
    proxy = "[proxy]\n" if way.proxy else ""
    return bench.package(volume, look, render=_RENDER, more=ALONE + skip + proxy)


@contextmanager
def _opened(bench: Bench, package: Package, way: Way) -> Iterator[tuple[Renderer, Package]]:
    """Open the renderer of a way; gives the package that it draws, too."""
    drawn = _altered(package, ray_caster_of(package, 0, None)(package, level=0).program, way)
    with bench.renderer(drawn) as renderer:
        yield renderer, drawn


def _altered(package: Package, program: Program, way: Way) -> Package:
    text = compose_program(package, program, package.manifest.rays(program), ends_early=way.early).fragment
    assert _WHERE_SEEN in text
    if not way.seen:
        text = text.replace(_WHERE_SEEN, "{")
    return Altered(package, {program.fragment: text})
