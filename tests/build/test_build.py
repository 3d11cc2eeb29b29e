"""The main job on a small phantom: what it makes, what it leaves, and what it does not do twice."""

import fcntl
import json
import os
from dataclasses import replace
from pathlib import Path

import nibabel
import numpy as np
import pytest
from command_line import volprep
from phantom_scene import phantom, seen_phantom, write_phantom_scene

from volprep.parts.stage import Stage
from volprep.pipeline import plan_draft
from volprep.pipeline import stages as pipeline
from volprep.pipeline.build import build, plan_build
from volprep.pipeline.drafts import run_verb
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.origin import read_origin
from volprep.pipeline.prepare import prepare
from volprep.scan import import_volume, slabs
from volprep.scene.channels import ONLY_CHANNEL
from volprep.scene.request import load_request, request_of
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.textures import ktx2


class Tasks:
    """Remembers which tasks were begun."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def start(self, task: str, total: int) -> None:
        self.names.append(task)

    def advance(self, units: int = 1) -> None:
        pass


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def scene(tmp_path, request) -> Path:
    return write_phantom_scene(tmp_path, level_filter=getattr(request, "param", "box"))


ANY_FILTER = pytest.mark.parametrize("scene", ["box", "auto"], indirect=True)
CHOSEN_FILTER = pytest.mark.parametrize("scene", ["auto"], indirect=True)


def build_here(scene: Path, progress=None) -> Path:
    target = scene.parent / "phantom.volpkg"
    build(load_request(scene), target, progress or Silent())
    return target


def failing(name: str, error: Exception) -> tuple[Stage, ...]:
    """The stages, one of which fails."""

    def run(draft, plan, progress):
        raise error

    def broken(stage: Stage) -> Stage:
        return replace(
            stage,
            channel=stage.channel and replace(stage.channel, run=run),
            package=stage.package and replace(stage.package, run=run),
        )

    return tuple(broken(stage) if stage.name == name else stage for stage in pipeline.STAGES)


def test_what_cannot_be_drawn_here_is_refused_before_anything_is_read(tmp_path, monkeypatch) -> None:
    def missing(_api: str) -> None:
        raise VolprepError("VP5001", error="libGLESv2 is missing")

    monkeypatch.setattr("volprep.render.egl.require_library", missing)
    tasks = Tasks()
    with pytest.raises(VolprepError, match="libGLESv2"):
        build_here(write_phantom_scene(tmp_path), tasks)
    assert tasks.names == []
    assert {path.name for path in tmp_path.iterdir()} == {"phantom.raw", "phantom.toml"}


class TestWhatItMakes:
    @pytest.mark.long(keep=1)
    def test_a_sound_sealed_package(self, built_package) -> None:
        assert check(built_package) == []

    def test_every_file_is_named_by_exactly_one_item_that_is_kept(self, built_package) -> None:
        manifest = Package.open(built_package).manifest
        named = sorted(path for item in manifest.plan for path in item.files)
        assert named == sorted(set(contents(built_package)) - {"manifest.json"})
        sizes = {record.path: record.size_bytes for record in manifest.files}
        for item in manifest.plan:
            assert item.kept or not item.files
            if item.files:
                assert item.size_bytes == sum(sizes[path] for path in item.files)

    def test_nothing_in_it_tells_where_the_source_was(self, built_package) -> None:
        for path, data in contents(built_package).items():
            assert str(built_package.parent).encode() not in data, path

    def test_the_origin_beside_it_tells_where_the_source_was(self, built_package) -> None:
        origin = read_origin(built_package)
        assert origin is not None
        assert origin.scene.source.path == str(built_package.parent / "phantom.raw")
        assert origin.scene_path == str(built_package.parent / "phantom.toml")

    def test_nothing_else_is_left_beside_it(self, built_package) -> None:
        assert {path.name for path in built_package.parent.iterdir()} == {
            "phantom.raw",
            "phantom.toml",
            "phantom.volpkg",
            "phantom.volpkg.origin.json",
        }

    def test_it_has_a_program_and_a_table_for_each_transfer_function(self, built_package) -> None:
        manifest = Package.open(built_package).manifest
        assert [function.name for function in manifest.transfer_functions] == ["shell", "core"]
        levels = [level.index for level in manifest.levels]
        drawn = [(program.transfer, level) for program in manifest.level_programs for level in program.levels]
        assert drawn == [(name, level) for name in ("shell", "core") for level in levels]
        assert {texture.transfer for texture in manifest.textures if texture.role == "transfer"} == {"shell", "core"}

    def test_the_levels_are_means_of_the_codes_of_level_0_rounded_once(self, scene) -> None:
        scene.write_text(f"{scene.read_text()}\n[quantize]\nbits = 8\n")
        package = Package.open(build_here(scene))
        quantization = package.manifest.quantization
        assert quantization is not None
        low, high = quantization.window
        seen = seen_phantom(package.manifest).astype(float)
        codes = np.rint((np.clip(seen, low, high) - low) * (255 / (high - low)))
        levels = package.manifest.levels
        # Voxels of 2.5×0.75×1 mm become 2.5×1.5×2 and 2.5×3×4.
        assert [level.factors_zyx for level in levels] == [(1, 1, 1), (1, 2, 2), (1, 4, 4)]
        for level in levels:
            fz, fy, fx = level.factors_zyx
            shape = level.grid.shape_zyx
            padding = [(0, n * f - m) for n, f, m in zip(shape, level.factors_zyx, seen.shape, strict=True)]
            padded = np.pad(codes, padding, mode="edge")
            blocks = padded.reshape(shape[0], fz, shape[1], fy, shape[2], fx)
            image = ktx2.decode(package.read_bytes(f"textures/volume-{ONLY_CHANNEL}-{level.index}.ktx2"), "level")
            assert np.array_equal(np.frombuffer(image.data, np.uint8).reshape(shape), np.rint(blocks.mean((1, 3, 5))))

    def test_the_recorded_loss_is_the_loss(self, scene) -> None:
        scene.write_text(f"{scene.read_text()}\n[quantize]\nbits = 8\n")
        manifest = Package.open(build_here(scene)).manifest
        quantization = manifest.quantization
        assert quantization is not None
        low, high = quantization.window
        values = seen_phantom(manifest).astype(float)
        inside = values[(values >= low) & (values <= high)]
        decoded = np.rint((inside - low) * (255 / (high - low))) * quantization.slope + quantization.intercept
        assert quantization.clipped_below == np.count_nonzero(values < low)
        assert quantization.clipped_above == np.count_nonzero(values > high)
        assert quantization.rmse == pytest.approx(np.sqrt(np.mean((decoded - inside) ** 2)), rel=1e-6)
        assert quantization.max_error == pytest.approx(np.abs(decoded - inside).max(), rel=1e-9)


@pytest.mark.usefixtures("stages_run_again")
class TestDeterminism:
    @pytest.mark.long
    def test_two_builds_give_the_same_bytes_whatever_the_threads(self, tmp_path) -> None:
        made = []
        for name, threads in (("a", "1"), ("somewhere-else", "3")):
            folder = tmp_path / name
            folder.mkdir()
            scene = write_phantom_scene(folder)
            run = volprep("build", scene, "-o", folder / "p.volpkg", OMP_NUM_THREADS=threads, PYTHONHASHSEED=threads)
            assert run.returncode == 0, run.stderr
            made.append(contents(folder / "p.volpkg"))
        assert made[0] == made[1]

    @pytest.mark.long
    @CHOSEN_FILTER
    def test_slabs_leave_no_trace(self, scene, monkeypatch) -> None:
        whole = contents(build_here(scene))
        monkeypatch.setattr(slabs, "SLAB_BYTES", 5000)
        assert contents(build_here(scene)) == whole

    @pytest.mark.long
    @ANY_FILTER
    def test_stage_by_stage_gives_what_build_gives(self, scene) -> None:
        built = contents(build_here(scene))
        draft = scene.parent / "draft.volpkg"
        import_draft(prepare(load_request(scene)), draft, Silent())
        for name in ("quantize", "pyramid", "transfer", "texture", "skip", "shaders", "seal"):
            run_verb(draft, name, lambda scene: scene, Silent())
        assert contents(draft) == built


@pytest.mark.usefixtures("stages_run_for_each_plan")
class TestWhatItDoesNotDoTwice:
    @pytest.mark.long
    def test_what_import_measured_is_not_measured_again(self, scene, monkeypatch) -> None:
        def refuse(*_arguments):
            pytest.fail("the working volume was read a second time")

        monkeypatch.setattr(plan_draft, "measure_again", refuse)
        build_here(scene)

    @pytest.mark.long
    def test_a_build_that_broke_down_is_carried_on(self, scene, monkeypatch) -> None:
        monkeypatch.setattr(pipeline, "STAGES", failing("texture", RuntimeError("broke down")))
        with pytest.raises(RuntimeError):
            build_here(scene)
        monkeypatch.undo()
        tasks = Tasks()
        carried_on = contents(build_here(scene, tasks))
        assert tasks.names == ["plan", "texture", "skip", "shaders", "seal", "check"]
        assert contents(build_here(scene)) == carried_on

    @pytest.mark.long(keep=1)
    @pytest.mark.parametrize(
        ("before", "after", "is_kept"),
        [(b"1", b"1", True), (b"1", b"2", False), (b"", b"1", False), (b"1", b"", True), (b"", b"", True)],
    )
    def test_a_draft_of_another_start_of_the_machine_is_begun_anew(
        self, scene, monkeypatch, before, after, is_kept
    ) -> None:
        with monkeypatch.context() as broken:
            broken.setattr("volprep.pipeline.build.start_of_machine", lambda: before)
            broken.setattr(pipeline, "STAGES", failing("texture", RuntimeError("broke down")))
            with pytest.raises(RuntimeError):
                build_here(scene)
        monkeypatch.setattr("volprep.pipeline.build.start_of_machine", lambda: after)
        tasks = Tasks()
        made = contents(build_here(scene, tasks))
        assert ("import" not in tasks.names) == is_kept
        assert contents(build_here(scene)) == made

    @pytest.mark.long
    @pytest.mark.parametrize(
        ("old", "new", "expected"),
        [
            ("[pyramid]", "[render]\nopacity_cutoff = 0.9\n[pyramid]", "import quantize texture unchanged"),
            ("coarsest_longest_axis = 16", "coarsest_longest_axis = 30", "import quantize unchanged"),
            ("value = 900.0", "value = 950.0", "import unchanged"),
            ("spacing_mm_zyx = [2.5", "spacing_mm_zyx = [2.0", "nothing unchanged"),
            ('profile = "gles3"', 'profile = "gles2-2048"', "import unchanged"),
        ],
    )
    @CHOSEN_FILTER
    def test_what_has_changed_in_the_scene_is_done_again(self, scene, monkeypatch, old, new, expected) -> None:
        monkeypatch.setattr(pipeline, "STAGES", failing("seal", RuntimeError("broke down")))
        with pytest.raises(RuntimeError):
            build_here(scene)
        monkeypatch.undo()
        text = scene.read_text(encoding="utf-8")
        assert old in text
        scene.write_text(text.replace(old, new), encoding="utf-8")
        tasks = Tasks()
        carried_on = contents(build_here(scene, tasks))
        for name in expected.split()[:-1]:
            assert name not in tasks.names
        assert contents(build_here(scene)) == carried_on

    @pytest.mark.long
    def test_a_source_that_has_changed_is_imported_again(self, scene, monkeypatch) -> None:
        monkeypatch.setattr(pipeline, "STAGES", failing("seal", RuntimeError("broke down")))
        with pytest.raises(RuntimeError):
            build_here(scene)
        monkeypatch.undo()
        raw = scene.parent / "phantom.raw"
        voxels = phantom()
        voxels[3, 3, 3] = 999
        voxels.tofile(raw)
        # As a copy in the same tick of the clock would be.
        os.utime(raw, ns=(raw.stat().st_atime_ns, raw.stat().st_mtime_ns + 1))
        tasks = Tasks()
        build_here(scene, tasks)
        assert "import" in tasks.names


class TestFailure:
    def test_an_error_leaves_the_older_package_and_nothing_else(self, scene, monkeypatch) -> None:
        target = build_here(scene)
        before = contents(scene.parent)
        monkeypatch.setattr(pipeline, "STAGES", failing("texture", VolprepError("VP4020", path="x", error="disk full")))
        with pytest.raises(VolprepError, match="disk full"):
            build_here(scene)
        assert contents(scene.parent) == before
        assert check(target) == []

    def test_an_error_where_no_package_was_leaves_none(self, scene) -> None:
        before = contents(scene.parent)
        scene.write_text(scene.read_text(encoding="utf-8").replace("45]", "46]"), encoding="utf-8")
        with pytest.raises(VolprepError):
            build_here(scene)
        assert set(contents(scene.parent)) == set(before)
        assert not list(scene.parent.glob(".*"))

    def test_a_second_build_of_the_same_package_is_refused(self, scene) -> None:
        partial = scene.parent / ".phantom.volpkg.partial"
        partial.mkdir()
        other = os.open(partial, os.O_RDONLY | os.O_DIRECTORY)
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(VolprepError, match="VP4041"):
            build_here(scene)
        os.close(other)
        build_here(scene)

    def test_a_folder_of_somebody_else_is_not_replaced(self, scene) -> None:
        target = scene.parent / "phantom.volpkg"
        target.mkdir()
        (target / "thesis.txt").write_text("precious", encoding="utf-8")
        with pytest.raises(VolprepError, match="VP4021"):
            build_here(scene)
        assert (target / "thesis.txt").read_text(encoding="utf-8") == "precious"

    @pytest.mark.long
    def test_a_step_that_nothing_can_draw_gives_no_package(self, scene) -> None:
        text = scene.read_text(encoding="utf-8")
        scene.write_text(text.replace("[pyramid]", "[render]\nstep_voxels = 0.001\n[pyramid]"), encoding="utf-8")
        with pytest.raises(VolprepError, match=r"VP5019|VP5024"):
            build_here(scene)
        assert not (scene.parent / "phantom.volpkg").exists()

    def test_a_damaged_draft_of_a_killed_build_is_begun_anew(self, scene) -> None:
        partial = scene.parent / ".phantom.volpkg.partial"
        (partial / "work").mkdir(parents=True)
        (partial / "manifest.json").write_text('{"format": "volpkg", "version": "0.9"}', encoding="utf-8")
        assert check(build_here(scene)) == []


def test_the_key_of_import_tells_files_by_size_and_time(tmp_path, scene) -> None:
    spec = load_request(scene).scene.source
    key = import_volume.import_key([spec], "1")
    assert import_volume.import_key([spec], "1") == key
    assert import_volume.import_key([spec], "2") != key
    assert import_volume.import_key([spec.model_copy(update={"raw": None})], "1") != key
    os.utime(spec.path, ns=(0, 0))
    assert import_volume.import_key([spec], "1") != key


def test_a_scan_without_a_scene_gets_a_function_over_its_values(scene) -> None:
    nifti = scene.parent / "Head #1.nii"
    import nibabel

    nibabel.save(nibabel.Nifti1Image(phantom().T.astype(np.int16), np.diag([1.0, 0.75, 2.0, 1.0])), nifti)
    draft = scene.parent / "draft.volpkg"
    run = volprep("import", nifti, "-o", draft)
    assert run.returncode == 0, run.stderr
    record = json.loads((draft / "work/scene.json").read_text(encoding="utf-8"))
    assert record["name"] == "scan"
    points = record["transfer"][0]["points"]
    assert points[0]["value"] > float(phantom().min()), "the background is transparent"
    assert points[-1]["value"] == float(phantom().max())
    assert "background" in record["recognised"]
    assert volprep("stage", "quantize", draft).returncode == 0


@pytest.mark.long
def test_a_scan_without_a_scene_is_built_as_it_is_imported_and_planned(tmp_path) -> None:
    scan = tmp_path / "Head (1).nii"
    nibabel.save(nibabel.Nifti1Image(phantom().T.astype(np.int16), np.diag([2.0, 1.0, 1.5, 1.0])), scan)
    manifest = build(request_of(scan), tmp_path / "a.volpkg", Silent())
    assert manifest.name == "scan"
    (function,) = manifest.transfer_functions
    assert function.points[-1].value == manifest.statistics.maximum
    assert function.points[0].extinction_per_mm == 0.0 < function.points[1].extinction_per_mm
    planned = plan_build(request_of(scan), Silent()).items
    assert [(item.name, item.reason) for item in planned] == [(item.name, item.reason) for item in manifest.plan]
    origin = read_origin(tmp_path / "a.volpkg")
    assert origin.scene_path is None
    assert origin.scene.source.path == str(scan)
    done = volprep("validate", tmp_path / "a.volpkg", "--size", "32", "--json")
    assert done.returncode == 0, done.stderr
    with pytest.raises(VolprepError, match="VP3004"):
        request_of(scan, source=scan)
