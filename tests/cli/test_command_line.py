"""The command line as data: command, exit status, what it says. No command may show a traceback."""

import gc
import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import pytest
from command_line import COMMAND, ended, started, volprep
from dicom_files import save_all, stack
from phantom_scene import SCENE, phantom, write_phantom_scene
from pydicom.uid import ExplicitVRLittleEndian

from volprep.scene.profiles import class_names
from volprep_cli.main import _VERBS, command_line, main
from volprep_formats.diagnostics import ExitStatus, VolprepError

HEAVY = {"numpy", "pydantic", "rich", "pydicom", "nibabel", "OpenGL", "OpenImageIO", "skimage", "matplotlib", "pyvista"}
GOOD = SCENE.format(profile="gles3")
TINY_PROFILE = """
name = "watch"
api = "es3.0"
max_texture_size = 64
max_3d_texture_size = 4
texture_units = 2
texture_formats = ["r8unorm", "rgba8unorm"]
index_bits = 16
max_texture_bytes = 1000
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A folder with a good scene, bad ones, a package, a draft, and things that are in the way."""
    folder = tmp_path_factory.mktemp("place")
    write_phantom_scene(folder)
    variants = {
        "misspelt": GOOD.replace("opacity", "").replace("[pyramid]", "[pyramyd]"),
        "no-source": GOOD.replace("phantom.raw", "nowhere.raw"),
        "wrong-size": GOOD.replace("[21, 34, 45]", "[21, 34, 46]"),
        "not-finite": GOOD.replace("phantom.raw", "not-finite.raw").replace("uint16", "float32"),
        "empty-folder": '[source]\npath = "empty"\n' + GOOD[GOOD.index("[[transfer]]") :],
    }
    variants["empty-folder"] = 'name = "e"\n' + variants["empty-folder"]
    for name, text in variants.items():
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    voxels = phantom().astype("<f4")
    voxels[7, 8, 9] = float("nan")
    voxels.tofile(folder / "not-finite.raw")
    (folder / "watch.profile.toml").write_text(TINY_PROFILE, encoding="utf-8")
    (folder / "empty").mkdir()
    (folder / "a-file").write_text("x", encoding="utf-8")
    (folder / "nothing.nii").touch()
    (folder / "broken.toml").write_text("name =", encoding="utf-8")
    (folder / "thesis").mkdir()
    (folder / "thesis" / "chapter1.txt").write_text("x", encoding="utf-8")
    assert volprep("build", "phantom.toml", "-o", "good.volpkg", cwd=folder).returncode == 0
    assert volprep("import", "phantom.toml", "-o", "draft.volpkg", cwd=folder).returncode == 0
    damaged = folder / "damaged.volpkg"
    subprocess.run(["cp", "-r", folder / "good.volpkg", damaged], check=True)
    with (damaged / "textures/volume-scan-0.ktx2").open("r+b") as file:
        file.seek(1000)
        file.write(b"\xff\xff\xff")
    return folder


@dataclass(frozen=True)
class Case:
    """A command line, its exit status, and patterns that its output matches."""

    command: str
    status: int
    stdout: str = ""
    stderr: str = ""


CASES = [
    Case("--help", 0, stdout=r"build .*\n.*plan .*"),
    Case("--version", 0, stdout=r"^volprep \d+\.\d+\.\d+( \(.+\))?$"),
    Case("", 2, stderr=r"Usage: volprep"),
    Case("biuld x", 2, stderr=r"No such command 'biuld'"),
    Case("build", 2, stderr=r"Missing argument 'SCENE\|SCAN'"),
    Case("stage quantize draft.volpkg --bits 12", 4, stderr=r"VP3003 \[quantize\]: bits: Input should be"),
    Case("plan phantom.toml --frame-ms 16", 2, stderr=r"--frame-ms: it is for --device and --devices"),
    # the source
    Case("build no-source.toml -o x.volpkg", 3, stderr=r"VP1001 .*nowhere.raw: no such file"),
    Case("build phantom.toml --source elsewhere.raw -o x.volpkg", 3, stderr=r"VP1001 .*elsewhere.raw"),
    Case("plan no-source.toml", 3, stderr=r"VP1001 .*nowhere.raw: no such file"),
    Case("build wrong-size.toml -o x.volpkg", 3, stderr=r"VP1011 .*phantom.raw: .*65688 bytes, but the file has 64260"),
    Case("build not-finite.toml -o x.volpkg", 3, stderr=r"VP1090 the source has 1 voxels .* slice 7"),
    Case("build empty-folder.toml -o x.volpkg", 3, stderr=r"VP1030 .*empty: there are no DICOM images"),
    Case("import phantom.raw -o x.volpkg", 3, stderr=r"VP1002 .*phantom.raw: no reader knows"),
    Case("import nothing.nii -o x.volpkg", 3, stderr=r"VP1002 .*nothing.nii: the file is empty"),
    # scene and profile
    Case("build missing.toml -o x.volpkg", 4, stderr=r"VP3001 missing.toml: cannot read the file: No such file"),
    Case("build broken.toml -o x.volpkg", 4, stderr=r"VP3002 broken.toml: not a TOML file"),
    Case("build phantom.raw --source phantom.raw -o x.volpkg", 4, stderr=r"VP3004 phantom.raw: this is not a scene"),
    Case("build phantom.raw -o x.volpkg", 3, stderr=r"VP1002 .*phantom.raw: no reader knows"),
    Case("plan empty", 3, stderr=r"VP1030 .*empty: there are no DICOM images"),
    Case("build misspelt.toml -o x.volpkg", 4, stderr=r"VP3003 misspelt.toml: pyramyd: unknown key"),
    Case("build phantom.toml --profile gles9 -o x.volpkg", 4, stderr=r"VP3010 there is no profile gles9.*gles2-2048"),
    Case("build phantom.toml --profile no.toml -o x.volpkg", 4, stderr=r"VP3011 .*no.toml: cannot read the profile"),
    Case("build phantom.toml --profile misspelt.toml -o x.volpkg", 4, stderr=r"VP3012 .*misspelt.toml: .*unknown key"),
    Case("build phantom.toml --profile watch.profile.toml -o x.volpkg", 4, stderr=r"VP3022 profile watch .* at most 4"),
    Case("plan phantom.toml --profile watch.profile.toml", 4, stderr=r"VP3022 profile watch"),
    Case("stage mosaic draft.volpkg", 4, stderr=r"VP3023 .*profile gles3 does not need the stage mosaic"),
    # packages
    Case("inspect nowhere.volpkg", 5, stderr=r"VP4001 nowhere.volpkg: no such package"),
    Case("stage quantize good.volpkg", 5, stderr=r"VP4006 good.volpkg"),
    Case("stage texture draft.volpkg", 5, stderr=r"VP4040 draft.volpkg: stage texture needs stage quantize"),
    Case("stage seal draft.volpkg", 5, stderr=r"VP4040 draft.volpkg: stage seal needs stage quantize"),
    Case("validate damaged.volpkg --quick", 5, stderr=r"VP4009|VP6"),
    Case("validate good.volpkg --quick", 0),
    Case("validate good.volpkg --quick --curves", 2, stderr=r"--curves: --quick draws nothing"),
    Case("validate good.volpkg --quick --devices elsewhere", 2, stderr=r"--devices: --quick draws nothing"),
    Case("validate good.volpkg --report good.volpkg/report", 6, stderr=r"VP6020 good.volpkg/report: .*in the package"),
    # output
    Case("build phantom.toml -o a-file/x.volpkg", 6, stderr=r"VP4020 .*a-file/x.volpkg"),
    Case("build phantom.toml -o /proc/x.volpkg", 6, stderr=r"VP4020 /proc/x.volpkg"),
    Case("build phantom.toml -o thesis", 6, stderr=r"VP4021 .*thesis"),
    Case("build phantom.toml -o a-file", 6, stderr=r"VP4021 .*a-file: not replaced: not a volume package"),
    Case("build phantom.toml -o /", 6, stderr=r"\Avolprep: VP4021 /: .*it has no manifest.json"),
    Case("import phantom.toml -o /", 6, stderr=r"\Avolprep: VP4023 /: a new draft needs an empty folder"),
    Case("zip damaged.volpkg -o nowhere/a.zip", 6, stderr=r"\Avolprep: VP4020 nowhere/a.zip: .*No such file"),
    Case("export damaged.volpkg nowhere/a.nii", 6, stderr=r"\Avolprep: VP4020 nowhere/a.nii: .*No such file"),
    Case("render damaged.volpkg -o nowhere/a.png", 6, stderr=r"\Avolprep: VP5021 nowhere/a.png: .*No such file"),
    Case("look phantom.raw -o a.jpg", 6, stderr=r"\Avolprep: VP5021 a.jpg: .*names end in .png. Name a file"),
    Case("zip good.volpkg -o /dev/null --force", 6, stderr=r"VP4060 /dev/null: .* a device and no file"),
    Case("import phantom.toml -o thesis", 6, stderr=r"VP4023 thesis"),
    # results
    Case(
        "plan phantom.toml",
        0,
        stdout=r"(?s)level 0 +scan +kept.*normals +scan +left out .*no lighting.*stages: import, ",
    ),
    Case("inspect good.volpkg", 0, stdout=r"good.volpkg: sealed package"),
    Case("view good.volpkg -o page.html", 0, stdout=r"\Apage.html: one file", stderr=r"(?m)^note: no report of this"),
    Case("view good.volpkg --quiet -o quiet.html", 0, stdout=r"\Aquiet.html: one file", stderr=r"\A\Z"),
]


@pytest.fixture
def in_process(monkeypatch, capsys):
    """Run the entry point here: status, stdout and stderr. A process for each command would take 0.5 s to load."""
    pipe_handler = signal.getsignal(signal.SIGPIPE)

    def run(folder: Path, command: str) -> tuple[int, str, str]:
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "argv", ["volprep", *command.split()])
        with pytest.raises(SystemExit) as ended:
            main()
        gc.unfreeze()
        return int(ended.value.code or 0), *capsys.readouterr()

    yield run
    signal.signal(signal.SIGPIPE, pipe_handler)


@pytest.mark.long(keep=4)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.command or "nothing")
def test_a_command_ends_with_its_status_and_says_why(place, case, in_process) -> None:
    status, stdout, stderr = in_process(place, case.command)
    assert status == case.status, stdout + stderr
    assert re.search(case.stdout, stdout), stdout
    assert re.search(case.stderr, stderr), stderr
    assert "Traceback" not in stderr
    if case.status > ExitStatus.USAGE:
        # One message, after what progress said.
        assert len(re.findall(r"^volprep: VP\d{4} ", stderr, re.MULTILINE)) == 1
        assert stderr.splitlines()[-1].startswith("volprep: VP")
    assert not (place / "x.volpkg").exists()
    assert not list(place.glob(".*"))


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "command",
    [
        "plan phantom.toml --json",
        "build phantom.toml -o again.volpkg --json",
        "inspect good.volpkg --json",
        "inspect good.volpkg --picture slices.png --json",
        "render good.volpkg -o good.png --size 16x16 --json",
    ],
)
def test_a_result_is_json_where_it_is_asked_for(place, command, in_process) -> None:
    status, stdout, _ = in_process(place, command)
    assert status == 0
    assert isinstance(json.loads(stdout), dict)


def test_an_error_is_json_where_it_is_asked_for(place, in_process) -> None:
    _, stdout, _ = in_process(place, "build no-source.toml -o x.volpkg --json")
    error = json.loads(stdout)["error"]
    assert error["code"] == "VP1001"
    assert "nowhere.raw" in error["summary"]
    assert error["remedy"]


def test_plan_names_the_files_that_build_makes(place, in_process) -> None:
    _, stdout, _ = in_process(place, "plan phantom.toml --json")
    named = {path for item in json.loads(stdout)["items"] for path in item.get("files", [])}
    package = place / "good.volpkg"
    made = {path.relative_to(package).as_posix() for path in package.rglob("*") if path.is_file()}
    # Whether a level gains by a lookup table of its own is found out when it is made.
    own = {path for path in made if re.fullmatch(r"textures/transfer-.*-level\d+\.ktx2", path)}
    assert named == made - {"manifest.json"} - own


@pytest.mark.long
def test_a_verb_with_settings_changes_the_draft(place, tmp_path, in_process) -> None:
    draft = tmp_path / "d.volpkg"
    coarser = "stage pyramid {} --coarsest-longest-axis 20"
    for command in ("import phantom.toml -o {}", "stage quantize {} --bits 16 --window [100,800]", coarser):
        assert in_process(place, command.format(draft))[0] == 0
    manifest = json.loads((draft / "manifest.json").read_text(encoding="utf-8"))
    (channel,) = manifest["channels"]
    assert channel["quantization"]["bits"] == 16
    assert channel["quantization"]["window"] == [100.0, 800.0]
    assert [level["factors_zyx"] for level in channel["levels"]] == [[1, 1, 1], [1, 2, 2]]


def test_a_full_disk_is_one_message_and_leaves_nothing(place, tmp_path) -> None:
    scene = write_phantom_scene(tmp_path)
    before = sorted(tmp_path.iterdir())
    # A limit on the size of files stops a write in the middle, as a full disk does.
    run = ended(
        [*COMMAND, "build", scene, "-o", tmp_path / "x.volpkg"],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000)),
    )
    assert run.returncode == ExitStatus.OUTPUT, run.stderr
    assert re.search(r"VP4020 .*level0-scan.raw.*File too large", run.stderr)
    assert "Traceback" not in run.stderr
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "command", ["inspect good.volpkg --json", "inspect good.volpkg", "plan phantom.toml --json", "--help"]
)
def test_output_that_cannot_be_written_is_one_message_and_no_verdict(place, command) -> None:
    with Path("/dev/full").open("w") as full:
        run = subprocess.run(
            [*COMMAND, *command.split()], cwd=place, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert run.returncode == ExitStatus.OUTPUT, run.stderr
    assert re.search(r"^volprep: VP4020 standard output: cannot write: No space left", run.stderr.splitlines()[-1])
    assert "Traceback" not in run.stderr


def test_an_error_keeps_its_status_where_its_json_cannot_be_written(place) -> None:
    with Path("/dev/full").open("w") as full:
        run = subprocess.run(
            [*COMMAND, "plan", "missing.toml", "--json"],
            cwd=place,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert run.returncode == ExitStatus.SCENE, run.stderr
    assert re.fullmatch(r"volprep: VP3001 .*\n", run.stderr)


TYPER = [sys.executable, "-c", "import typer"]
"""Least work of any command: the library that reads its arguments."""


def test_help_is_fast_and_loads_nothing_heavy() -> None:
    code = f"""
import atexit, sys
atexit.register(lambda: print("LOADED", *sorted({HEAVY!r} & set(sys.modules)), file=sys.stderr))
{COMMAND[-1]}
"""
    run = subprocess.run([sys.executable, "-c", code, "--help"], capture_output=True, text=True, check=True)
    assert run.stderr.splitlines()[-1] == "LOADED"
    # Processor times in turns, the least of several: other work on this machine counts for both.
    ways = {"help": lambda: started("--help"), "typer": lambda: subprocess.run(TYPER, check=True)}
    taken = {name: [] for name in ways}
    for _ in range(5):
        for name, run in ways.items():
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            run()
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            taken[name].append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    assert min(taken["help"]) < 2.5 * min(taken["typer"])


def test_import_of_a_series_loads_neither_the_planner_nor_a_stage_nor_pydicom(tmp_path) -> None:
    save_all(stack(5), tmp_path / "series", ExplicitVRLittleEndian)
    code = f"""
import atexit, sys
not_needed = {{"volprep.pipeline.make_plan", "volprep.pipeline.stages", "volprep.parts.values.stage", "volprep.render"}}
not_needed |= {{"pydicom", "rich"}}
atexit.register(lambda: print("LOADED", *sorted(not_needed & set(sys.modules)), file=sys.stderr))
{COMMAND[-1]}
"""
    command = [sys.executable, "-c", code, "import", tmp_path / "series", "-o", tmp_path / "a.volpkg"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert run.stderr.splitlines()[-1] == "LOADED"


def test_help_lists_each_verb_with_its_whole_first_sentence() -> None:
    told = volprep("--help", COLUMNS="80").stdout.replace("sub-\n", "sub-")
    for verb, name in _VERBS.items():
        first, _, _ = getattr(import_module(f"volprep_cli.{name}"), name).__doc__.partition("\n\n")
        assert " ".join([verb, *first.split()]) in " ".join(told.split()).replace("sub- ", "sub-")


def test_help_names_what_an_option_takes_and_not_its_type(tmp_path, in_process) -> None:
    for verb in (*_VERBS, "stage quantize", "stage skip", "study stress", "study progressive"):
        _, told, _ = in_process(tmp_path, f"{verb} --help")
        assert not re.search(r"<(str|int|float|path)[ >]", told.partition("Options:")[2]), told


def test_help_names_every_profile(tmp_path, in_process) -> None:
    _, told, _ = in_process(tmp_path, "build --help")
    assert f"Class of devices: {', '.join(class_names())}, a device" in " ".join(told.split())


def test_help_tells_every_exit_status() -> None:
    text = " ".join(volprep("--help").stdout.split())
    told = {int(number) for number in re.findall(r"(?:statuses: |; )(\d+) ", text)}
    assert told == {*ExitStatus, 130}


def test_a_defect_is_one_message_without_a_traceback(place) -> None:
    broken = [COMMAND[0], "-c", "import sys; sys.modules['volprep.pipeline.build'] = None; " + COMMAND[2]]
    command = [*broken, "plan", place / "phantom.toml"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == ExitStatus.INTERNAL
    assert re.fullmatch(r"volprep: VP9001 internal error: ModuleNotFoundError: .*\n", run.stderr)
    asked = {**os.environ, "VOLPREP_TRACEBACK": "1"}
    run = subprocess.run(command, capture_output=True, text=True, check=False, env=asked)
    assert "Traceback" in run.stderr


def test_a_reader_that_closes_early_ends_the_command_without_a_word(place) -> None:
    process = subprocess.Popen(
        [*COMMAND, "inspect", place / "good.volpkg", "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait() == -signal.SIGPIPE


def test_ctrl_c_ends_a_build_without_a_traceback(tmp_path) -> None:
    scene = write_phantom_scene(tmp_path)
    # A source that takes seconds to import: 2 GB of zeros, which take no room.
    scene.write_text(scene.read_text().replace("[21, 34, 45]", "[1024, 1024, 1024]"))
    os.truncate(tmp_path / "phantom.raw", 2**31)
    process = subprocess.Popen([*COMMAND, "build", scene, "-o", tmp_path / "x.volpkg"], stderr=subprocess.PIPE)
    deadline = time.monotonic() + 30
    while not (tmp_path / ".x.volpkg.partial").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=30)
    # By the signal, which a shell shows as status 130: after an exit with that status its loop would go on.
    assert process.returncode == -signal.SIGINT
    assert b"volprep: interrupted; run the same command again, and it goes on" in told
    assert b"Traceback" not in told
    assert not (tmp_path / "x.volpkg").exists()


def test_ctrl_c_while_a_verb_is_loaded_ends_without_a_traceback() -> None:
    interrupted = "import signal; signal.raise_signal(signal.SIGINT)"
    loading = f"import volprep_cli.main as m; m.command_line = lambda arguments: exec({interrupted!r}); m.main()"
    run = subprocess.run([sys.executable, "-c", loading], stderr=subprocess.PIPE, text=True, check=False)
    assert (run.returncode, run.stderr) == (-signal.SIGINT, "volprep: interrupted\n")


def test_what_cannot_be_read_is_left_to_the_errors_with_a_code(tmp_path, monkeypatch) -> None:
    (tmp_path / "empty.nii").touch()
    # Who runs the tests may be allowed to read everything.
    monkeypatch.setattr(os, "access", lambda *_asked, **_how: False)
    with pytest.raises(VolprepError, match=r"VP1002 .*the file is empty"):
        command_line(["look"])(["look", str(tmp_path / "empty.nii")], standalone_mode=False)
