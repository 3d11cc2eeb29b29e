"""Compressed forms are tried on the whole level: what only a sample bears is not shipped, and what ships validates."""

from pathlib import Path

import numpy as np
import pytest
import scene_builds
from channel_scene import write_channel_scene
from judged import validate
from phantom_scene import SHAPE_ZYX, write_phantom_scene
from plans import plan_of_one

from volprep.parts.compression import whole_level
from volprep.pipeline.build import plan_build
from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.origin import read_origin
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.plan.whole_source import WholeSource
from volprep.render.renderers import renderer_of
from volprep.scan.slabs import RawVolume
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.profiles import load_profile
from volprep.scene.request import load_request
from volprep.scene.scene import Scene
from volprep.validation.subjects.scan import find_scan, read_scan
from volprep.validation.subjects.subject import Subject, errors
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.source import SourceInfo

SIZE = 32
QUICK = "[quantize]\nbits = 8\n[pyramid]"
SMALL = f"[render]\npicture_size = {SIZE}\n"


def smooth(shape=SHAPE_ZYX) -> np.ndarray:
    z, y, x = (np.arange(n) for n in shape)
    field = 128 + 90 * np.sin(z / 5)[:, None, None] * np.cos(y / 9)[None, :, None] * np.sin(x / 11)
    return np.rint(field).astype(np.uint8)


def scene_of(folder: Path, voxels: np.ndarray, form: str, extra: str = "") -> Path:
    """A scene of the smooth transfer function of the phantom, over these values of 8 bits."""
    path = write_phantom_scene(folder, "gles3-astc")
    (4 * voxels.astype("<u2")).tofile(folder / "phantom.raw")
    text = path.read_text()
    text = text[: text.rindex("[[transfer]]")].replace("[pyramid]", f"{extra}{QUICK}")
    path.write_text(f'crop = "none"\n{text}\n{SMALL}[textures]\ncompression = "{form}"\n')
    return path


def built(folder: Path, voxels: np.ndarray, form: str, extra: str = "") -> Package:
    target = folder / "phantom.volpkg"
    return scene_builds.built(scene_of(folder, voxels, form, extra), target)


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    """What "auto" makes of smooth values."""
    return built(tmp_path_factory.mktemp("forms"), smooth(), "auto")


def test_what_is_said_of_the_form_is_the_data_error_of_validation(package) -> None:
    kept = next(form for form in package.manifest.compression if form.kept)
    assert (kept.basis, kept.pictures, kept.level) == ("level", 9, 0)
    scan = read_scan(package.manifest, find_scan(package.path, None).spec_of(""), Silent())
    subject = Subject(package, scan, SIZE)
    data = [errors(subject.on_data("shell", v, 0).rgba, subject.truth("shell", v).rgba) for v in subject.views]
    # Of what is decoded, 16 bits are kept.
    assert kept.rmse == pytest.approx(max(error.seen_rmse for error in data), abs=2e-5)
    assert kept.maximum == pytest.approx(max(error.maximum for error in data), abs=2e-4)
    assert kept.rmse > 1e-4
    files = [each.file for each in package.manifest.textures if each.role == "volume" and each.level == 0]
    blocks = sum(len(package.read_bytes(file)) for file in files)
    assert 0 < blocks - kept.size_bytes < 1000 * len(files)


@pytest.mark.long
def test_it_validates_and_the_report_has_a_section(package) -> None:
    folder = package.path.with_suffix(".report")
    report = validate(package.path, folder, picture_size=SIZE)
    assert report.verdict.passed
    assert [form.as_record for form in report.forms] == list(package.manifest.compression)
    kept = report.forms[-1]
    assert kept.seconds > 0
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert '<section id="compression">' in page
    assert kept.format in page
    assert "the whole level, 9 pictures" in page


def test_the_manifest_knows_no_clock(package, tmp_path) -> None:
    again = built(tmp_path, smooth(), "auto")
    assert again.manifest.compression == package.manifest.compression
    assert not {"seconds", "key"} & set(package.manifest.compression[0].model_dump())
    assert read_origin(package.path).forms[-1].key is not None
    assert not [record for record in again.manifest.files if record.role == "work"]


def uneven() -> np.ndarray:
    """Smooth where patches are taken, noise at both ends of the longest axis."""
    voxels = smooth()
    rng = np.random.default_rng(11)
    voxels[..., :8] = rng.integers(0, 256, (*SHAPE_ZYX[:2], 8))
    voxels[..., -8:] = rng.integers(0, 256, (*SHAPE_ZYX[:2], 8))
    return voxels


@pytest.mark.long
def test_a_form_that_only_the_sample_bears_is_refused(tmp_path) -> None:
    tolerance = "[tolerance]\nrmse = 0.02\nmaximum = 0.1\n"
    request = load_request(scene_of(tmp_path, uneven(), "etc2", tolerance))
    (planned,) = plan_build(request, Silent()).forms
    assert (planned.kept, planned.basis) == (True, "sample")
    package = built(tmp_path, uneven(), "etc2", tolerance)
    (found,) = package.manifest.compression
    assert (found.kept, found.basis) == (False, "level")
    assert found.maximum > 0.05 > planned.maximum
    assert found.pictures < 9
    (item,) = (item for item in package.manifest.plan if item.name == "textures as etc2-rgba8unorm")
    assert not item.kept
    assert "encoded whole, it changes" in item.reason
    assert {each.format for each in package.manifest.textures if each.role == "volume"} == {"r8unorm"}
    assert check(package.path) == []


def test_a_plan_without_a_build_says_that_it_rests_on_a_sample(tmp_path) -> None:
    plan = scene_builds.planned(scene_of(tmp_path, smooth(), "astc-5x5"))
    (item,) = (item for item in plan.items if item.name == "textures as astc-5x5-unorm")
    assert item.reason.endswith("within half of the tolerance; a build tries the whole level")


@pytest.mark.long
def test_a_verb_does_not_try_again_what_an_earlier_one_has_tried(tmp_path, monkeypatch) -> None:
    request = load_request(scene_of(tmp_path, smooth(), "eac"))
    draft = import_draft(prepare(request), tmp_path / "draft", Silent()).draft
    run_verb(tmp_path / "draft", "quantize", lambda scene: scene, Silent())
    (first,) = plan_draft(draft, request.scene, request.profile, Silent()).forms

    def again(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(whole_level, "encoded_level", again)
    draft = run_verb(tmp_path / "draft", "pyramid", lambda scene: scene, Silent())
    (form,) = plan_draft(draft, request.scene, request.profile, Silent()).forms
    assert form.as_record == first.as_record
    # Another tolerance is another question: fewer or more pictures may be drawn.
    other = request.scene.model_copy(update={"tolerance": request.scene.tolerance.model_copy(update={"rmse": 0.5})})
    with pytest.raises(AssertionError):
        plan_draft(draft, other, request.profile, Silent())


def test_a_coarser_level_is_tried_where_it_is_the_finest_that_fits(tmp_path) -> None:
    voxels = smooth((20, 61, 50))
    voxels.tofile(tmp_path / "level0.raw")
    profile = load_profile("gles3-astc", Path()).model_copy(update={"max_texture_size": 64, "texture_units": 4})
    points = [
        {"value": 40.0, "colour": "#204080", "extinction_per_mm": 0.0},
        {"value": 200.0, "colour": "#ffc080", "extinction_per_mm": 0.3},
    ]
    wanted = {"name": "s", "source": {"path": "x"}, "transfer": [{"name": "a", "points": points}], "crop": "none"}
    wanted |= {"textures": {"compression": "eac"}, "render": {"picture_size": 24}}
    scene = Scene.model_validate({**wanted, "pyramid": {"coarsest_longest_axis": 16}})
    info = SourceInfo(format="raw", grid=Grid.of(voxels.shape, (1.0, 1.5, 0.5)), stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    source = RawVolume(tmp_path / "level0.raw", voxels.shape, voxels.dtype)
    whole = WholeSource(source, info, "0" * 64, Silent())
    plan = plan_of_one(scene, profile, info, gauge.result("0" * 64), whole=whole)
    (form,) = plan.forms
    assert form.level == plan.levels[0].index > 0
    assert (form.basis, form.kept) == ("level", True)
    # Misplaced slices would give 20 dB.
    assert form.psnr_db > 40
    assert form.rmse < 0.003
    _, height, width = plan.volumes[0].shape_zyx
    assert form.size_bytes == -(-height // 4) * -(-width // 4) * 8 * len(plan.volumes[0].files)
    # With no coarser level there is no mosaic, but a 3D texture.
    alone = Scene.model_validate(wanted)
    plan = plan_of_one(alone, profile, info, gauge.result("0" * 64), whole=whole)
    assert (plan.forms, plan.levels[0].index, plan.volumes[0].format) == ((), 0, "r8unorm")
    (item,) = (item for item in plan.items if item.name == "textures as eac-r11unorm")
    assert (item.kept, item.reason) == (
        False,
        "4 bits a voxel; profile gles3-astc has no room for a level of it as a mosaic",
    )


def test_channels_are_compressed_each_for_itself(tmp_path) -> None:
    scene = write_channel_scene(tmp_path, "gles3-astc")
    text = scene.read_text().replace("[pyramid]", QUICK)
    scene.write_text(f'{text}\n[textures]\ncompression = "auto"\n[tolerance]\nrmse = 0.2\nmaximum = 0.9\n')
    package = scene_builds.built(scene, tmp_path / "tissues.volpkg")
    assert check(package.path) == []
    kept = {form.channel: form for form in package.manifest.compression if form.kept}
    assert set(kept) == set(channel_packages(package))
    assert all(form.basis == "level" for form in kept.values())
    for name, part in channel_packages(package).items():
        scan = read_scan(part.manifest, find_scan(package.path, None).spec_of(name), Silent())
        subject = Subject(part, scan, 48)
        transfer = part.manifest.transfer_functions[0].name
        with renderer_of(part, transfer=transfer) as renderer:
            drawn = renderer.render(subject.views["left"], (48, 48))
        data = errors(subject.on_data(transfer, "left", 0).rgba, subject.truth(transfer, "left").rgba)
        assert data.rmse <= kept[name].rmse + 2e-5
        assert errors(drawn, subject.truth(transfer, "left").rgba).rmse < data.rmse + 0.02


def test_a_form_that_the_profile_has_not_is_refused_before_anything_is_tried(tmp_path) -> None:
    scene = scene_of(tmp_path, smooth(), "astc-5x5")
    scene.write_text(scene.read_text().replace("gles3-astc", "gles3"))
    with pytest.raises(VolprepError, match="VP3070"):
        scene_builds.built(scene, tmp_path / "phantom.volpkg")
