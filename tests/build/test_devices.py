"""A small package for each profile that comes with volprep: its limits are kept, and it can be drawn."""

from pathlib import Path

import pytest
from scene_builds import view_of
from slice_packages import missing_es11
from tamper_scenes import write_kind

from volprep.pipeline.build import build
from volprep.render.renderers import renderer_of
from volprep.scene.profiles import class_names, device_names, load_profile
from volprep.scene.request import load_request
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

needs_es11 = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")


def profiles():
    """Names of profiles; those without shaders are skipped where no driver can draw them."""
    for name in (*class_names(), *device_names()):
        shaders = load_profile(name, Path()).has_shaders
        yield pytest.param(name, marks=() if shaders else needs_es11)


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("name", list(profiles()))
def test_a_package_for_a_device_keeps_its_limits_and_is_drawn(tmp_path, name) -> None:
    request = load_request(write_kind(tmp_path, "plain"), name)
    build(request, tmp_path / "p.volpkg", Silent())
    package = Package.open(tmp_path / "p.volpkg")
    profile = load_profile(name, Path())
    assert package.manifest.profile == profile
    for texture in package.manifest.textures:
        limit = profile.max_3d_texture_size if texture.dimension == "3d" else profile.max_texture_size
        assert max(texture.shape_zyx) <= limit
    for _, drawing in package.manifest.drawings:
        assert drawing.cost.upload_bytes <= profile.max_texture_bytes
    grid = package.manifest.levels[0].grid
    with renderer_of(package) as renderer:
        picture = renderer.render(view_of(grid, "anterior-left"), (16, 16))
    assert picture[..., 3].max() > 0.5
