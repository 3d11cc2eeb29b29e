"""Whether hybrid resolution agrees with the device class."""

from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest


def hybrid_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of `render.hybrid`."""
    hybrid = None if manifest.render is None else manifest.render.hybrid
    if hybrid is None:
        return
    has_shaders = manifest.profile.has_shaders
    found = hybrid.enlarged is not None, hybrid.lines is not None
    if found != (has_shaders, has_shaders and hybrid.has_lines):
        yield "render.hybrid must have the shaders of its passes, and no others"
    if has_shaders and hybrid.opacity != "alpha":
        yield f"render.hybrid takes opacity from {hybrid.opacity}, but pictures of its profile have alpha"
