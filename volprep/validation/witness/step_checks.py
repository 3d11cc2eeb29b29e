"""Whether ever finer steps reach the truth: without codes, 8 bits and early ends, nothing else may be left.

The sweep of steps draws a program in a float target, rays run to their end, and compares it with the oracle, which
takes the package's data and its lookup table as the transfer function. The rest falls with the step, to what float32
and the weights of a texture filter leave. A shader that looks half an entry beside, or has another isovalue, stops
far above that, and may still be within the scene's tolerance.
"""

from collections.abc import Iterable, Iterator, Mapping

from volprep.validation.results.measurements import ProgramResult
from volprep.validation.witness.check import WitnessCheck
from volprep_formats.package.program import ClassificationName

_OF_FUNCTIONS: frozenset[ClassificationName] = frozenset(("lookup", "control-points"))
"""Classifications that finer steps make exact: colours of classified voxels are mixed, palettes have steps, entries of
pre-integrated tables are constant between."""
_CHANGES = 4.0
"""Of an order of a third or more, the error that is left is at most so many times what the last halving changed."""
_FLOOR = 0.001
"""Error that the 8-bit weights of a GPU's texture filter may cause. On llvmpipe it is 1e-6 to 1e-4; half an entry of
256 left 0.003, an isovalue off by a twentieth of the window 0.13."""


def check_steps(
    programs: Iterable[ProgramResult], classifications: Mapping[str, ClassificationName]
) -> Iterator[WitnessCheck]:
    """Compare the finest step of each program of samples with the oracle on its own data and table.

    `classifications` has an entry for each of the package's programs, by name.
    """
    for program in programs:
        errors = [point.quadrature.seen_rmse for point in program.sweep.points if point.quadrature is not None]
        is_exact = program.technique == "ray-casting" and classifications.get(program.program) in _OF_FUNCTIONS
        if program.sweep.float_target != "rgba32f" or len(errors) <= 1 or not is_exact:
            continue
        yield WitnessCheck(
            item=f"steps of {program.program}",
            by="the oracle on the lookup table of the package",
            what="root mean square difference that is left with the finest step, over seen pixels",
            found=errors[-1],
            limit=max(_FLOOR, _CHANGES * (errors[-2] - errors[-1])),
        )
