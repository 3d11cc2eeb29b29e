"""What validation says of skip tables and proxy meshes: what they save, and whether they change a picture."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from command_line import volprep
from judged import validate
from phantom_scene import write_phantom_scene
from scene_builds import built

from volprep.render.proxy_renderer import ProxyRenderer
from volprep.render.renderer import Renderer
from volprep.render.renderers import renderer_of
from volprep.validation.results.measurements import EmptySpace
from volprep.validation.results.report import Report
from volprep.validation.timing.rays import settled
from volprep_formats.diagnostics import ExitStatus
from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2

BOTH = '[proxy]\nblock = 3\n[skip]\nkind = "distance"\nblock = 3\n'
SIZE = 32


def package_of(folder: Path, profile: str, wishes: str) -> Path:
    """The phantom with the second of its transfer functions, which leaves most of it empty, and one level."""
    scene = write_phantom_scene(folder, profile)
    head, _, core = scene.read_text().replace("longest_axis = 16", "longest_axis = 64").split("[[transfer]]")
    head = head.replace("[pyramid]", f"{wishes}\n[pyramid]")
    scene.write_text(f'crop = "none"\n{head}[[transfer]]{core}')
    built(scene, folder / "phantom.volpkg")
    return folder / "phantom.volpkg"


@pytest.fixture(scope="module", params=["gles3", pytest.param("gles2-2048", marks=pytest.mark.long)])
def package(request, tmp_path_factory) -> Path:
    return package_of(tmp_path_factory.mktemp("both"), request.param, BOTH)


@pytest.fixture(scope="module")
def report(package) -> Report:
    return validate(package, package.parent / "phantom.report", picture_size=SIZE)


def found_in(report: Report) -> list[EmptySpace]:
    return [program.empty_space for program in report.programs if program.empty_space is not None]


@pytest.mark.long(keep=1)
def test_each_way_is_drawn_and_all_pictures_are_the_same(report, package) -> None:
    (found,) = found_in(report)
    assert [way.way for way in found.ways] == ["neither", "table", "mesh", "both"]
    assert found.limit == pytest.approx(1 / 255, abs=2e-6)
    assert found.passed
    for way in found.ways:
        assert way.draw.median > 0
        assert [view.view for view in way.views] == [view.view for view in report.programs[0].views]
        assert way.difference <= found.limit
    assert (package.parent / "phantom.report" / found.picture).is_file()
    assert report.verdict.changed == ()


def test_a_table_and_a_mesh_save_samples_in_every_view(report) -> None:
    (found,) = found_in(report)
    plain, table, mesh, both = ([view.samples_mean for view in way.views] for way in found.ways)
    assert all(np.array(table) < plain)
    assert all(np.array(mesh) < plain)
    # Runs of eight samples between two looks begin elsewhere at a mesh.
    assert all(np.array(both) < 1.05 * np.array(table))
    looks = [way.looks_mean for way in found.ways]
    assert looks[0] == looks[2] == 0.0
    assert 0.0 < looks[3] < looks[1]
    assert found.mesh_read_ms > 0


def test_the_samples_without_both_are_those_of_the_chords(report) -> None:
    (core,) = report.programs
    (nominal,) = (point for point in core.sweep.points if (point.level, point.step_ratio) == (0, 1.0))
    (view,) = (each for each in core.empty_space.ways[0].views if each.view == core.sweep.view)
    # Half as many pixels along each axis; and some rays end early.
    assert view.samples_mean == pytest.approx(nominal.samples_mean, rel=0.1)


def test_what_is_drawn_begins_at_the_mesh(report, package) -> None:
    renderer = renderer_of(Package.open(package))
    assert isinstance(renderer, ProxyRenderer)
    assert renderer.name == "program proxy-raycast-core"
    assert [found.drawn_by for found in found_in(report)] == ["proxy-raycast-core"]
    # The order of convergence is measured on what is drawn, rays running to their end.
    assert all(program.sweep.breakdown.termination is not None for program in report.programs)
    done = volprep("render", package, "-o", package.parent / "picture.png", "--size", "20x20")
    assert "program proxy-raycast-core" in done.stdout


def test_the_page_has_a_section_for_it(report, package) -> None:
    page = (package.parent / "phantom.report" / "index.html").read_text(encoding="utf-8")
    assert '<section id="empty">' in page
    for words in ("What is saved", "Skip tables", "Proxy meshes", "KiB of a decoder", "proxy-raycast-core"):
        assert words in page


@pytest.mark.long
def test_without_table_and_mesh_nothing_is_said(tmp_path) -> None:
    package = package_of(tmp_path, "gles3", '[skip]\nkind = "none"\n')
    report = validate(package, tmp_path / "phantom.report", picture_size=16)
    assert found_in(report) == []
    assert 'id="empty"' not in (tmp_path / "phantom.report" / "index.html").read_text(encoding="utf-8")
    assert type(renderer_of(Package.open(package))) is Renderer


def test_a_table_that_hides_something_fails_whatever_the_tolerance(tmp_path) -> None:
    wishes = (
        '[skip]\nkind = "distance"\nblock = 3\n[tolerance]\nrmse = 1.0\nmaximum = 1.0\nflip = 1.0\nkept_light = 0.0\n'
    )
    package = package_of(tmp_path, "gles3", wishes)
    file = package / "textures" / "skip-core-0.ktx2"
    image = ktx2.decode(file.read_bytes(), file.name)
    # All blocks are said to be empty, and the manifest knows of it.
    far = b"".join(ktx2.encode(ktx2.Ktx2Image(image.format, image.shape_zyx, np.full_like(image.data, 60), 3)))
    manifest = (package / "manifest.json").read_text()
    before = hashlib.sha256(file.read_bytes()).hexdigest()
    file.write_bytes(far)
    (package / "manifest.json").write_text(manifest.replace(before, hashlib.sha256(far).hexdigest()))
    done = volprep("validate", package, "--size", str(SIZE), "--report", tmp_path / "report")
    assert done.returncode == ExitStatus.TOLERANCE
    assert "VP6030" in done.stderr
    assert "skip skip-core-0 of level 0 (textures/skip-core-0.ktx2)" in done.stderr
    report = Report.model_validate_json((tmp_path / "report" / "report.json").read_bytes())
    assert (report.verdict.passed, report.verdict.failed, report.verdict.changed) == (False, 0, ("raycast-core",))
    (found,) = found_in(report)
    assert [way.way for way in found.ways] == ["neither", "table"]
    assert not found.passed
    assert found.ways[1].difference > 0.1
    page = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    assert "What skips empty space changes pictures of raycast-core" in page


@pytest.mark.long
@pytest.mark.parametrize("of_all", [True, False])
def test_what_rounding_does_on_a_driver_is_no_fault_of_a_mesh(package, tmp_path, monkeypatch, of_all) -> None:
    plain = Renderer.render

    def render(renderer, camera, *more):
        # Another picture for rays that rounding has moved: by another camera, or by the corners of a mesh.
        picture = plain(renderer, camera, *more)
        if not of_all and type(renderer) is Renderer:
            return picture
        key = f"{type(renderer).__name__} {camera.tobytes()}"
        chance = np.random.default_rng(list(hashlib.sha256(key.encode()).digest()))
        return picture + np.float32(0.02) * chance.integers(0, 2, picture.shape, dtype=np.int8)

    monkeypatch.setattr(Renderer, "render", render)
    (found,) = found_in(validate(package, tmp_path / "phantom.report", picture_size=SIZE))
    # Two steps of 8 bits may come on top: a ray has hundreds of samples, and one that moves changes its rounding.
    assert max(way.difference for way in found.ways) == pytest.approx(0.02, abs=0.008)
    assert found.rounding == pytest.approx(0.02 if of_all else 0.0, abs=0.008)
    assert found.limit == pytest.approx(1 / 255 + found.rounding, abs=2e-6)
    assert found.passed is of_all


def test_only_rays_of_nearly_whole_steps_may_get_another_number_of_samples() -> None:
    chords = np.array([[0.0, 99.9999, 100.0], [100.5, 1e-6, 3.25]])
    assert settled(chords, 1.0).tolist() == [[False, False, False], [True, False, True]]
