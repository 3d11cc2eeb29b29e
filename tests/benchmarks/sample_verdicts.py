"""Verdict of the sample scenes, as the table of docs/MEASURED.md.

    python -m tests.benchmarks.sample_verdicts [SCENE ...]

Builds and validates each scene of `sample_specs` whose scan lies in VOLPREP_TEST_DATA or was made by `make demo`. There
are no scans for `cells`, `cryosections` and `tissues`. The numbers are those of the worst of nine views at the finest
level; all coarse levels are judged, too.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from volprep.validation.results.report import Report

SAMPLES = Path(__file__).parents[2] / "sample_specs"
_ENGINE, _HEAD = "engine_pair/data/*.raw.gz", "mr_t1_studyforrest/dicoms"
_SHELL = "qim_microct/shell_*.tif"
MADE = {"brain-mr": "mni152-dicom"}
"""The scan of each scene that `make demo` makes, below build/scans."""
SCANS = {
    "engine-lit": _ENGINE,
    "engine-raw": _ENGINE,
    "engine-slices": _ENGINE,
    "head-segments": "segments/norm.mgz",
    "head-surface": _HEAD,
    "mr-head": _HEAD,
    "shell-editable": _SHELL,
    "shell-microct": _SHELL,
    "shell-proxy": _SHELL,
}
"""The scan of each scene, below the folder of real scans."""
SEGMENTS = {"head-segments": "segments/aparc.a2009s+aseg.mgz"}
HEAD = "| scene | RMSE, seen | largest | FLIP | kept light | verdict | previews |\n|---|---|---|---|---|---|---|"


def main(names: list[str]) -> None:
    """Print the table, a row as soon as it is known."""
    scans = Path(os.environ["VOLPREP_TEST_DATA"])
    print(HEAD)
    for name in names or [*MADE, *SCANS]:
        with tempfile.TemporaryDirectory() as folder:
            print(row(name, report_of(name, scans, Path(folder))), flush=True)


def report_of(name: str, scans: Path, folder: Path) -> Report:
    """Build and validate a scene."""
    if name in MADE:
        source = SAMPLES.parent / "build" / "scans" / MADE[name]
        if not source.exists():
            sys.exit(f"{name} needs {source}: run make demo first")
    else:
        (source,) = scans.glob(SCANS[name])
    extra = ["--segments", scans / SEGMENTS[name]] if name in SEGMENTS else []
    package = folder / "sample.volpkg"
    _volprep("build", SAMPLES / f"{name}.toml", "--source", source, *extra, "-o", package)
    # Exit status 1 is a verdict, too.
    _volprep("validate", package, allowed=(0, 1))
    return Report.model_validate(json.loads((folder / "sample.report" / "report.json").read_text(encoding="utf-8")))


def row(name: str, report: Report) -> str:
    """Return the row of a scene."""
    views = [view for program in report.programs for view in program.views]
    kept = [view.seen.kept_light for view in views if view.seen.kept_light is not None]
    cells = (
        f"`{name}`",
        f"{max(view.seen.rmse for view in views):.4f}",
        f"{max(view.total.maximum for view in views):.3f}",
        f"{max(view.seen.flip for view in views):.3f}",
        f"{min(kept):.2f}" if kept else "–",
        report.verdict.code,
        f"{sum(each.preview_only for each in report.verdict.levels)}",
    )
    return f"| {' | '.join(cells)} |"


def _volprep(*words: object, allowed: tuple[int, ...] = (0,)) -> None:
    done = subprocess.run(
        [Path(sys.executable).with_name("volprep"), *map(str, words)], check=False, capture_output=True, text=True
    )
    if done.returncode not in allowed:
        sys.exit(f"volprep {words[0]} ended with {done.returncode}:\n{done.stderr}")


if __name__ == "__main__":
    main(sys.argv[1:])
