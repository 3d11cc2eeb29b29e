"""Each verb loads only what it uses: no renderer to plan, no library of reports to build."""

import json
import sys
from pathlib import Path

import pytest
from command_line import ended
from phantom_scene import with_filter, write_phantom_scene

from volprep_cli.main import _VERBS

WATCHED = (
    *("numpy", "scipy", "skimage", "matplotlib", "jinja2", "rich", "OpenGL", "OpenImageIO", "PIL", "pyvista", "vtk"),
    *("vtkmodules", "dask", "distributed", "pydicom", "nibabel", "nrrd", "tifffile", "zarr", "DracoPy", "fsspec"),
    *(
        "flip_evaluator",
        "pylibjpeg",
        "openjpeg",
        "jpeg_ls",
        "astc_encoder",
        "etcpak",
        "texture2ddecoder",
        "http.server",
    ),
    *("volprep.kernels._native", "volprep_formats._vdb", "volprep_formats._dicom", "volprep.render", "volprep.report"),
    *("volprep.validation", "volprep.view", "volprep.vtk", "volprep.batch"),
)
"""What takes time or memory to load, and rooms that few verbs need."""
NUMBERS = {"numpy"}
KERNELS = NUMBERS | {"volprep.kernels._native"}
TABLES = KERNELS | {"rich"}
DRAWING = TABLES | {"OpenGL", "volprep.render"}
CHECKING = NUMBERS | {"volprep.validation"}
REPORTS = {"scipy", "jinja2", "OpenImageIO", "volprep.report", "volprep.validation"}
_DRAFT, _PACKAGE = "draft.volpkg", "phantom.volpkg"

IN_ONE_PROCESS: list[tuple[list[str], set[str]]] = [
    (["presets"], set()),
    (["import", "phantom.toml", "-o", _DRAFT], KERNELS),
    (["look", "phantom.toml"], KERNELS),
    *((["stage", name, _DRAFT], KERNELS) for name in ("quantize", "pyramid", "transfer", "normals", "mosaic")),
    *((["stage", name, _DRAFT], KERNELS) for name in ("texture", "bricks", "skip", "proxy", "grid", "slices")),
    (["stage", "shaders", _DRAFT], KERNELS),
    (["export", _DRAFT, "level.raw"], KERNELS),
    (["plan", "phantom.toml"], TABLES),
    (["build", "box.toml", "-o", _PACKAGE], DRAWING),
    (["stage", "seal", _DRAFT], DRAWING),
    (["render", _PACKAGE, "-o", "picture.png", "--size", "16"], DRAWING),
]
"""Each may load what those before it may, so that none hides what another one loads."""
APART: list[tuple[list[str], set[str]]] = [
    (["inspect", _DRAFT], TABLES | CHECKING),
    (["zip", _PACKAGE, "-o", "phantom.volpkg.zip"], CHECKING),
    (["validate", _PACKAGE, "--quick"], CHECKING),
    (["cut", _PACKAGE, "--center", "10,10,10", "--size", "4", "-o", "box.nrrd"], NUMBERS | {"volprep.render"}),
    (["study", "walk", _PACKAGE, "walk.toml", "-o", "walked"], DRAWING),
    (["doctor"], DRAWING | {"OpenImageIO", "volprep_formats._vdb"}),
    (["study", "stress", "--case", "one-voxel", "--profile", "gles1"], DRAWING | REPORTS | {"volprep.vtk"}),
    (["judge", _PACKAGE, "--look", "phantom.toml", "-o", "fidelity.json"], DRAWING | REPORTS),
    (["view", _PACKAGE, "-o", "page.html"], DRAWING | {"http.server", "volprep.view", "volprep.validation"}),
    (["batch", "jobs.csv", "-o", "out", "--dry-run"], TABLES | {"volprep.batch", "volprep_formats._dicom"}),
    (["validate", _PACKAGE, "--size", "16"], DRAWING | REPORTS | {"volprep.vtk", "flip_evaluator"}),
]
"""Each in a process of its own, after what came before."""

PROBE = """
import contextlib, io, json, os, sys
from volprep_cli.main import command_line

def loaded(watched):
    return sorted(name for name in watched if name in sys.modules)

def run(arguments):
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            command_line(arguments)(arguments, standalone_mode=False)
    except BaseException as error:
        return f"{type(error).__name__}: {error}"
    return ""

def apart(arguments, watched):
    end, start = os.pipe()
    if os.fork() == 0:
        error = run(arguments)
        os.write(start, json.dumps([arguments, loaded(watched), error]).encode())
        os._exit(0)
    os.close(start)
    with os.fdopen(end) as pipe:
        print(pipe.read())
    os.wait()

chain, others, watched = json.loads(sys.stdin.read())
print(json.dumps([["start"], loaded(watched), ""]))
# Forked before the chain has loaded anything; the package that they read is built there first.
if others:
    for arguments in others:
        apart(arguments, watched)
for arguments in chain:
    error = run(arguments)
    print(json.dumps([arguments, loaded(watched), error]), flush=True)
"""


def probed(folder: Path, chain: list[list[str]], others: list[list[str]]) -> list[tuple[list[str], set[str], str]]:
    """Run verbs; give what is loaded after each, and how it failed."""
    done = ended([sys.executable, "-c", PROBE], input=json.dumps([chain, others, WATCHED]), cwd=folder)
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines() if line.strip()]
    return [(arguments, set(names), error) for arguments, names, error in rows]


@pytest.mark.long
def test_each_verb_loads_only_what_it_uses(tmp_path) -> None:
    scene = write_phantom_scene(tmp_path, level_filter="auto", more="\n[grid]\nsize = 16\n")
    # The verb pyramid chooses a filter: build need not do it again.
    (tmp_path / "box.toml").write_text(with_filter(scene.read_text(), "box"))
    (tmp_path / "walk.toml").write_text("size = 16\n[[step]]\nzoom = 1.0\n")
    (tmp_path / "jobs.csv").write_text("series,scene\nphantom.raw,phantom.toml\n")
    rows = probed(tmp_path, [arguments for arguments, _ in IN_ONE_PROCESS], [])
    assert rows[0] == (["start"], set(), "")
    rows = rows[1:] + probed(tmp_path, [], [arguments for arguments, _ in APART])[1:]
    wrong = []
    for (arguments, allowed), (ran, names, error) in zip(IN_ONE_PROCESS + APART, rows, strict=True):
        assert arguments == ran
        if names - allowed:
            wrong.append(f"{' '.join(arguments)} loads {', '.join(sorted(names - allowed))}")
        # Stages that this scene does not need say so, and the study stress has no case without shaders.
        assert not error or any(code in error for code in ("VP3023", "VP3060", "VP6017", "VP5051")), (arguments, error)
    assert not wrong
    assert {arguments[0] for arguments, _ in IN_ONE_PROCESS + APART} == set(_VERBS)
