"""Whether bricks on demand agree with the volume and with the size of their index."""

from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest


def on_demand_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of the bricks on demand, one sentence each."""
    found = manifest.on_demand
    if found is None or manifest.grid is None:
        return
    sizes = {record.path: record.size_bytes for record in manifest.files}
    for problem in found.problems(manifest.grid.shape_zyx, sizes.get(found.index)):
        yield f"on_demand: {problem}"
