"""The preview picture of a package, for lists of packages and file browsers."""

from volprep.pipeline.framing import filled
from volprep.render.choose import renderer_of
from volprep.truth.camera import standard_views, widest_view
from volprep.truth.picture import encoded
from volprep_formats.package.reader import Package
from volprep_formats.png import png_bytes

_SIZE = 256


def preview_png(package: Package) -> bytes:
    """Draw the finest level from where it is widest, over black, and return the PNG file.

    The visible part fills the picture: the volume's diagonal must fit only where it turns. The package may be a draft
    that has its textures and programs. Raises the errors of `renderer_of`.
    """
    manifest = package.manifest
    projection = manifest.render.projection if manifest.render else "orthographic"
    grid = manifest.levels[0].grid
    camera = standard_views(grid, projection)[widest_view(grid)]
    with renderer_of(package) as renderer:
        window = filled(renderer, camera.box_from_clip(grid, 1.0), (_SIZE, _SIZE))
        picture = renderer.render(window, (_SIZE, _SIZE))
    return png_bytes(encoded(picture, "black"))
