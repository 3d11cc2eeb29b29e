"""The limit of a ray caster: a loop that reads the same samples from volume and table, and adds them.

It has the package's own rays, positions and texture reads, and nothing else: no opacity, no end, no jump. What a ray
caster takes beyond its time is the price of the picture; no shader that takes all samples can be faster.
"""

from volprep.shading.program import compose_program
from volprep.validation.comparison.altered import Altered
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package

_LAST_OF_RAY = "  vec3 stride = "


def bare(package: Package, program: Program) -> Package:
    """Return the package whose shader adds what a loop over all samples reads, for 3D textures and lookup tables."""
    text = taking_all(package, program).read_text(program.fragment)
    head, found, rest = text.partition(_LAST_OF_RAY)
    assert found, f"{program.fragment} has no rays that a loop could follow"
    lit = "    sum.rgb += normal_at(start + stride * i);\n" if program.lighting != "none" else ""
    loop = (
        "  vec4 sum = vec4(0.0);\n"
        "  for (float i = 0.5; i < count; i++) {\n"
        f"    sum += classify(stored_value(start + stride * i));\n{lit}"
        "  }\n"
        "  picture = sum / max(count, 1.0);\n}\n"
    )
    changed = _without_skip(package, program)
    return Altered(package, {program.fragment: f"{head}{found}{rest.partition(chr(10))[0]}\n\n{loop}"}, changed)


def taking_all(package: Package, program: Program) -> Package:
    """Return the package whose rays take every sample: they look at no skip table and run to their end."""
    whole = compose_program(package, program, package.manifest.rays(program), ends_early=False, skips=False)
    return Altered(package, {program.fragment: whole.fragment}, _without_skip(package, program))


def _without_skip(package: Package, program: Program) -> Program:
    whole = compose_program(package, program, package.manifest.rays(program), ends_early=False, skips=False)
    names = tuple(each.name for each in whole.samplers)
    return program.model_copy(update={"uniforms": whole.uniforms, "samplers": names})
