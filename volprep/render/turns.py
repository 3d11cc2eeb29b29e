"""Limits of drivers on loops: some drivers end a shader's loops after a number of turns, and report no error.

llvmpipe makes 65,535 turns in one run of a shader, summed over all its loops (LP_MAX_TGSI_LOOP_ITERATIONS), so
splitting a ray's loop into several gains nothing. The rest of the ray is missing from the picture, which gets darker
and at last black. A shader counts the turns that a driver makes.
"""

import math
from dataclasses import dataclass

import numpy as np

from volprep.render.gl import Gl
from volprep.render.gl_records import Bindings, ShaderText
from volprep.shading.compose import compose
from volprep.shading.compositing import CELL_BY_CELL, SURFACES
from volprep.shading.raycast import most_faces
from volprep.shading.rays import vertex_shader
from volprep.shading.skipping import SKIP_RUN, skip_table
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.program import PictureProgram

CERTAIN_TURNS = 2**14
"""Every driver makes at least this many turns: a picture with fewer needs no count, which saves 0.1 s."""
_COUNTED_TO = 2.0**23
"""float32 counts on up to here."""
_APART = 2.0
"""Two rays that are drawn side by side, one skipping and one not, take more turns together than each alone."""


class LoopLimit:
    """Number of loop turns that the driver of a context makes; counted once, when a picture needs many."""

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
    vertex = ShaderText("vertex/picture", vertex_shader("box", "es100"))
    fragment = ShaderText("ray/turns", compose("ray/turns", "es100", {"dialect": "ray/dialect_es100"}, {}))
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
    """Turns of a program's loops along the longest ray, as a function of the number of samples."""

    squared: float
    """Per pair of samples: if each sample has a ray of its own to the light."""
    each: float
    """For each sample."""
    others: float
    """Turns independent of the samples."""


def turns_of_rays(manifest: Manifest, program: PictureProgram, level: int, step_mm: float) -> float:
    """Return how many turns the loops of a program may take along the longest ray."""
    samples = _longest_mm(manifest) / step_mm
    turns = _loop(manifest, program, level)
    return (turns.squared * samples + turns.each) * samples + turns.others


def step_mm_of_turns(manifest: Manifest, program: PictureProgram, level: int, made: int) -> float:
    """Return the finest step that keeps all rays within the turns; infinity if no step does."""
    turns = _loop(manifest, program, level)
    left = made - turns.others
    if left <= 0.0:
        return math.inf
    # The greater root of squared · n² + each · n = left, written so that squared may be 0.
    root = turns.each + math.sqrt(turns.each**2 + 4.0 * turns.squared * left)
    return _longest_mm(manifest) * root / (2.0 * left)


def _loop(manifest: Manifest, program: PictureProgram, level: int) -> _Turns:
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


def _unlit(
    manifest: Manifest, program: PictureProgram, level: int, *, squared: float = 0.0, each: float = 0.0
) -> _Turns:
    """Return the turns of the loop through the volume, added to the turns of the loops to the light."""
    if program.compositing in CELL_BY_CELL:
        return _in_cells(manifest, program, level)
    picture = manifest.picture(program.transfer)
    on_grids = picture is not None and picture.grid is not None and picture.mixing == "sum"
    if not manifest.skips(program) and not on_grids:
        return _Turns(squared, each + 1.0, 1.0)
    jumping = [medium.transfer for medium in picture.media] if on_grids and picture else [program.transfer]
    tables = [skip_table(manifest, transfer, level) for transfer in jumping]
    # Runs also end where a ray enters or leaves the box of a medium.
    blocks = sum(sum(table.blocks_zyx) for table in tables if table is not None) + (2 * len(tables) if on_grids else 0)
    # A run of samples takes a turn of the outer loop and, for each medium that jumps, of the one that looks, and one in
    # which its own ends. A jump takes a turn of each loop; of a block that a ray leaves by rounding it may take two.
    run = 1 + 2 * len(tables)
    return _Turns(squared, each + _APART * (SKIP_RUN + run) / SKIP_RUN, _APART * (3 + run) * blocks + 1.0)


def _in_cells(manifest: Manifest, program: PictureProgram, level: int) -> _Turns:
    """Return the turns of a loop from cell to cell: no step makes them more."""
    grid = next((held.grid for held in manifest.levels if held.index == level), manifest.grid)
    faces = most_faces(grid or manifest.source.info.grid)
    table = skip_table(manifest, program.transfer, level)
    if table is None or not manifest.skips(program):
        return _Turns(0.0, 0.0, faces + 1.0)
    # As below; behind a jump a cell that begins before its end is taken whole.
    return _Turns(0.0, 0.0, _APART * (faces * (SKIP_RUN + 3) / SKIP_RUN + 7 * sum(table.blocks_zyx)) + 1.0)


def _longest_mm(manifest: Manifest) -> float:
    grid = manifest.grid or manifest.source.info.grid
    return math.hypot(*grid.extent_mm_zyx)
