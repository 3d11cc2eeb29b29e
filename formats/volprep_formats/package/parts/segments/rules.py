"""Whether the labels of a manifest name segments."""

from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest


def segments_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of labels."""
    if manifest.segments is None:
        return
    known = {segment.name for segment in manifest.segments.segments}
    for number, label in enumerate(manifest.segments.labels):
        if not known.issuperset(label.segments):
            yield f"label {number} is of segments {', '.join(label.segments)}, which are not there"
