"""Check the fidelity records of a manifest against its levels and transfer functions."""

from collections import Counter
from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest


def fidelity_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of the records: each names an existing level and transfer function, once."""
    levels = {level.index for level in manifest.levels}
    functions = {function.name for function in manifest.transfer_functions}
    for (transfer, level), count in Counter((each.transfer, each.level) for each in manifest.fidelity).items():
        if count > 1:
            yield f"the fidelity of level {level} with {transfer} is stated {count} times"
        if level not in levels:
            yield f"a fidelity is stated for level {level}, which is not among the levels"
        if transfer not in functions:
            yield f"a fidelity is stated for transfer function {transfer}, which is not there"
