"""Check that transfer functions meet the needs of their programs' compositing; docs/CHECKS.md states the rules."""

from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest


def compositing_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of compositings in a manifest of one channel."""
    functions = {function.name: function for function in manifest.transfer_functions}
    for program in manifest.programs:
        function = functions.get(program.transfer)
        if function is None:
            continue
        if program.compositing in {"first-hit", "isosurface"} and function.isovalue is None:
            yield f"program {program.name} shows a surface, but {function.name} has no isovalue"
        low, high = function.intensity_range
        if program.compositing == "mida" and not low < high:
            yield f"program {program.name} needs intensities, but {function.name} has them from {low:g} to {high:g}"
