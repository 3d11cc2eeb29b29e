"""What a manifest says about bricks must agree with its levels, textures and programs."""

import hashlib

import numpy as np
import pytest
from tiny_packages import ES3, function, tiny_package

from volprep.scene.scene import BrickSettings
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.manifest_json import encode_manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.rules import contradictions
from volprep_formats.textures import ktx2

GREY = function((0.0, (0.5, 0.5, 0.5), 0.0), (255.0, (1.0, 1.0, 1.0), 1.0))


@pytest.fixture(scope="module")
def manifest(tmp_path_factory) -> Manifest:
    codes = np.arange(9 * 14).reshape(9, 14, 1).astype(np.uint8)
    folder = tmp_path_factory.mktemp("bricks") / "p"
    return tiny_package(folder, codes, GREY, ES3, bricks=BrickSettings(size=4, reach=2)).manifest


def test_a_package_of_bricks_agrees_with_itself(manifest) -> None:
    (pool,) = [texture for texture in manifest.textures if texture.role == "volume"]
    assert pool.bricks.cells_zyx == (4, 4, 0)
    assert pool.bricks.bricks_zyx == (2, 4, 1)
    assert pool.bricks.pitch_zyx == (7, 7, 3)
    assert [problem for problem in contradictions(manifest) if "sealed" not in problem] == []


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda entries: entries[0, 0, 0].__setitem__(0, 9), "places bricks twice, or outside of the"),
        (lambda entries: entries.__setitem__((0, 0), entries[0, 1]), "places bricks twice, or outside of the"),
        (lambda entries: entries[0, 0, 0].__setitem__(3, 0), "has 7 stored bricks of (2, 4, 1), the manifest 8 of"),
    ],
)
def test_an_index_that_leads_astray_is_found_out(tmp_path, change, says) -> None:
    codes = np.arange(9 * 14).reshape(9, 14, 1).astype(np.uint8)
    package = tiny_package(tmp_path / "p", codes, GREY, ES3, bricks=BrickSettings(size=4))
    file = next(texture.file for texture in package.manifest.textures if texture.role == "bricks")
    image = ktx2.decode(package.read_bytes(file), file)
    entries = image.data.copy()
    change(entries)
    data = b"".join(ktx2.encode(ktx2.Ktx2Image("rgba8unorm", image.shape_zyx, entries, 3)))
    (package.path / file).write_bytes(data)
    files = tuple(
        record.model_copy(update={"sha256": hashlib.sha256(data).hexdigest()}) if record.path == file else record
        for record in package.manifest.files
    )
    manifest = package.manifest.model_copy(update={"files": files})
    (package.path / "manifest.json").write_bytes(encode_manifest(manifest))
    with pytest.raises(VolprepError, match="VP4011") as error:
        level_texels(Package(package.path, manifest), 0)
    assert says in error.value.summary
