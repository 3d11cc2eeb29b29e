"""Loops that a driver ends: some drivers end a shader's loops after a number of turns, and report no error.

llvmpipe makes 65,535 turns in one run of a shader, those of all its loops together (LP_MAX_TGSI_LOOP_ITERATIONS), so
that splitting a ray's loop into several gains nothing. What lies behind is missing from the picture, which gets darker
and at last black. How many turns a driver makes is counted by a shader.
"""

import math

import numpy as np

from volprep.render.gl import Bindings, Gl, ShaderText
from volprep.shading.compose import compose
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


def turns_of_rays(manifest: Manifest, program: Program, level: int, step_mm: float) -> float:
    """Return how many turns the loops of a program may take along the longest ray."""
    samples = _longest_mm(manifest) / step_mm
    per_sample, others = _loop(manifest, program, level)
    return per_sample * samples + others


def step_mm_of_turns(manifest: Manifest, program: Program, level: int, turns: int) -> float:
    """Return the finest step at which no ray takes more turns; infinity if there is none."""
    per_sample, others = _loop(manifest, program, level)
    return _longest_mm(manifest) * per_sample / (turns - others) if turns > others else math.inf


def _loop(manifest: Manifest, program: Program, level: int) -> tuple[float, float]:
    """Return the turns for each sample, and those beside."""
    if program.slab_samples is not None:
        # A run of samples takes two turns more.
        return 0.0, _APART * (2.0 * program.slab_samples + 1.0)
    if program.blend is not None:
        return 0.0, 1.0
    if all(sampler.role != "skip" for sampler in program.samplers):
        return 1.0, 1.0
    table = skip_table(manifest, program.transfer, level)
    blocks = sum(table.blocks_zyx) if table else 0
    # A run of samples takes a turn of the outer loop and of the one that looks, and one in which its own ends. A jump
    # takes a turn of each loop; of a block that a ray leaves by rounding it may take two.
    return _APART * (SKIP_RUN + 3) / SKIP_RUN, _APART * 6 * blocks + 1.0


def _longest_mm(manifest: Manifest) -> float:
    grid = manifest.grid or manifest.source.info.grid
    return math.hypot(*grid.extent_mm_zyx)
