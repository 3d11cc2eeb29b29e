"""Loops that a driver ends: some drivers end a shader's loops after a number of turns, and report no error.

llvmpipe makes 65,535 turns in one run of a shader, those of all its loops together (LP_MAX_TGSI_LOOP_ITERATIONS), so
that splitting a ray's loop into several gains nothing. What lies behind is missing from the picture, which gets darker
and at last black. How many turns a driver makes is counted by a shader.
"""

import math
from dataclasses import dataclass

import numpy as np

from volprep.render.gl import Bindings, Gl, ShaderText
from volprep.shading.compose import compose
from volprep.shading.compositing import SURFACES
from volprep.shading.skipping import SKIP_RUN, skip_table
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.program import Program

CERTAIN_TURNS = 2**14
"""Every driver makes so many turns, so nobody counts up to here. It saves compiling a shader, 0.1 s."""
_COUNTED_TO = 2.0**23
"""float32 counts on up to here."""
_APART = 2.0
"""Rays that are drawn side by side, of which one skips and one does not, take more turns together than each alone."""


class LoopLimit:
    """How many turns of a loop the driver of a context makes; counted once, when a picture needs many."""

    def __init__(self, gl: Gl) -> None:
        self._gl = gl
        self._made = CERTAIN_TURNS
        self._ends = False

    def made(self, turns: float) -> int:
        """Return how many of so many turns the driver makes."""
        if turns > self._made and not self._ends:
            wanted = math.ceil(min(turns, _COUNTED_TO))
            self._made = counted_turns(self._gl, wanted)
            self._ends = self._made < wanted or wanted == _COUNTED_TO
        return math.ceil(min(turns, self._made))


def counted_turns(gl: Gl, turns: int) -> int:
    """Return how many of so many turns, 2^23 at most, a shader makes."""
    vertex, fragment = (
        ShaderText(part, compose(part, "es100", {"dialect": "ray/dialect_es100"}, {}))
        for part in ("vertex/picture", "ray/turns")
    )
    bindings = Bindings({}, {"u_turns": np.array(turns, np.float32)})
    with (
        gl.program("turns", vertex, fragment) as program,
        gl.triangle() as triangle,
        gl.target("rgba8", (1, 1)) as target,
    ):
        gl.draw(program, bindings, target, triangle)
        digits = np.rint(gl.read(target)[0, 0] * 255).astype(int)
    return int(digits[0] + 256 * digits[1] + 65536 * digits[2])


_OF_SEARCH = 7.0
"""Most turns of the search for a surface that a ray touches between two samples."""


@dataclass(frozen=True)
class _Turns:
    """Turns of a program's loops along the longest ray, by the samples that it has."""

    squared: float
    """For each pair of samples: where a sample has a ray of its own, to the light."""
    each: float
    """For each sample."""
    others: float
    """Those beside."""


def turns_of_rays(manifest: Manifest, program: Program, level: int, step_mm: float) -> float:
    """Return how many turns the loops of a program may take along the longest ray."""
    samples = _longest_mm(manifest) / step_mm
    turns = _loop(manifest, program, level)
    return (turns.squared * samples + turns.each) * samples + turns.others


def step_mm_of_turns(manifest: Manifest, program: Program, level: int, made: int) -> float:
    """Return the finest step at which no ray takes more turns; infinity if there is none."""
    turns = _loop(manifest, program, level)
    left = made - turns.others
    if left <= 0.0:
        return math.inf
    # The greater root of squared · n² + each · n = left, written so that squared may be 0.
    root = turns.each + math.sqrt(turns.each**2 + 4.0 * turns.squared * left)
    return _longest_mm(manifest) * root / (2.0 * left)


def _loop(manifest: Manifest, program: Program, level: int) -> _Turns:
    # A ray to the light takes one more sample at its end.
    shadow = 1.0 if program.light is not None and program.light.shadows == "rays" else 0.0
    if program.slab_samples is not None:
        # A run of samples takes two turns more.
        slab = program.slab_samples
        return _Turns(0.0, shadow * slab, _APART * (2.0 * slab + 1.0) + 2.0 * shadow * slab)
    if program.blend is not None:
        return _Turns(0.0, 0.0, 1.0)
    if program.compositing in SURFACES:
        # A ray ends at the surface, and begins its only ray to the light there.
        return _unlit(manifest, program, level, each=shadow + _OF_SEARCH)
    return _unlit(manifest, program, level, squared=shadow, each=2.0 * shadow)


def _unlit(manifest: Manifest, program: Program, level: int, *, squared: float = 0.0, each: float = 0.0) -> _Turns:
    """Return the turns of the loop through the volume, added to those of the loops to the light."""
    if all(sampler.role != "skip" for sampler in program.samplers):
        return _Turns(squared, each + 1.0, 1.0)
    table = skip_table(manifest, program.transfer, level)
    blocks = sum(table.blocks_zyx) if table else 0
    # A run of samples takes a turn of the outer loop and of the one that looks, and one in which its own ends. A jump
    # takes a turn of each loop; of a block that a ray leaves by rounding it may take two.
    return _Turns(squared, each + _APART * (SKIP_RUN + 3) / SKIP_RUN, _APART * 6 * blocks + 1.0)


def _longest_mm(manifest: Manifest) -> float:
    grid = manifest.grid or manifest.source.info.grid
    return math.hypot(*grid.extent_mm_zyx)
