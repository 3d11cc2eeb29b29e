"""Cache of plans and of the output of slow stages, shared by all tests, workers and runs.

A plan follows from scene, profile and measurements of the scan; the output of a stage follows from its settings and
from the files that it reads. The key is a digest of these and of the product's own files, so that a change of the
product empties the cache. Of the 0.6 to 4 seconds of processor time of a small build 0.15 are left, the second time.
"""

import hashlib
import json
import os
import pickle
import shutil
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

import volprep
import volprep_formats
from volprep.parts.light import decision, solve
from volprep.parts.stage import Stage
from volprep.parts.work import FORMS, SCENE
from volprep.pipeline import build, make_plan, plan_draft, preview, stages
from volprep.pipeline.make_plan import Scanned
from volprep.pipeline.stage_graph import STAGES as STAGES_OF_BUILD
from volprep.plan.records import Plan
from volprep.scan import slabs
from volprep.scan.segments.record import FoundSegments
from volprep.scan.slabs import RawVolume
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress

FOLDER = "VOLPREP_TEST_STAGES"
"""Environment variable: where remembered output lies, for processes that tests start."""
STAGES = frozenset({"pyramid", "light", "seal"})
"""Choosing the filters of levels takes three quarters of the build of a small phantom; the preview takes 0.2 s."""
_MOST_BYTES = 4_000_000
"""Of the output of one stage."""
_PLANNERS = (build, plan_draft)
"""Modules that make plans."""
_run = stages._made
_plan = make_plan.make_plan


def kept_in(cache: Path) -> Path:
    """Return the folder of this version of the product in a folder that lasts; those of other versions are removed."""
    folder = cache / product_digest()[:16]
    folder.mkdir(parents=True, exist_ok=True)
    for other in cache.iterdir():
        if other != folder:
            shutil.rmtree(other, ignore_errors=True)
    return folder


@contextmanager
def remember(folder: Path, *, whole_plan: bool = False) -> Iterator[None]:
    """Make no plan and run no stage of STAGES again whose output lies in `folder`, also in commands that tests start.

    With `whole_plan` a stage counts as the same only if nothing in the plan differs: for tests of what it depends on.
    """

    def made(stage: Stage, draft: Draft, plan: Plan, progress: Progress) -> Iterator[Contribution]:
        # Tests put failing stages in the place of some.
        if stage.name not in STAGES or stage not in STAGES_OF_BUILD:
            return _run(stage, draft, plan, progress)
        return iter(_remembered(folder / _key(stage, draft, plan, whole_plan), stage, draft, plan, progress))

    def planned(scene: Scene, profile: DeviceProfile, scanned: Sequence[Scanned], *segments: Any) -> Plan:
        return _remembered_plan(folder, scene, profile, scanned, *segments)

    with _replaced(made, planned), _named(str(folder)):
        yield


@contextmanager
def in_full() -> Iterator[None]:
    """Make every plan and run every stage."""
    with _replaced(_run, _plan), _named(None):
        yield


@contextmanager
def _replaced(made: Callable[..., Iterator[Contribution]], planned: Callable[..., Plan]) -> Iterator[None]:
    with ExitStack() as patches:
        patches.enter_context(patch.object(stages, "_made", made))
        for module in _PLANNERS:
            patches.enter_context(patch.object(module, "make_plan", planned))
        yield


@contextmanager
def _named(folder: str | None) -> Iterator[None]:
    """Set FOLDER. Not with `patch.dict`, which forgets what is set meanwhile: bindings of EGL choose their platform."""
    before = os.environ.get(FOLDER)
    _set(folder)
    try:
        yield
    finally:
        _set(before)


def _set(folder: str | None) -> None:
    if folder is None:
        os.environ.pop(FOLDER, None)
    else:
        os.environ[FOLDER] = folder


def _remembered(path: Path, stage: Stage, draft: Draft, plan: Plan, progress: Progress) -> tuple[Contribution, ...]:
    """Return the output of a stage that lies in the file `path`; if none does, run the stage and write the file."""
    with suppress(FileNotFoundError):
        files, made = pickle.loads(path.read_bytes())  # noqa: S301 - tests have written it
        progress.start(stage.name, 1)
        progress.advance()
        for name, role, data in files:
            draft.write(name, role, data)
        return made
    written: list[tuple[str, str, bytes]] = []
    write = draft.write

    def noting(name: str, role: Any, data: Any, **_: Any) -> Any:
        whole = data if isinstance(data, bytes) else b"".join(bytes(chunk) for chunk in data)
        written.append((name, role, whole))
        return write(name, role, whole)

    with patch.object(draft, "write", noting):
        made = tuple(_run(stage, draft, plan, progress))
    if sum(len(data) for *_, data in written) <= _MOST_BYTES:
        _keep(path, (written, made))
    return made


def _keep(path: Path, what: object) -> None:
    """Write a file that is whole or absent."""
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(f"{path.name}.{os.getpid()}.{threading.get_ident()}")
    new.write_bytes(pickle.dumps(what))
    new.replace(path)


def _remembered_plan(  # noqa: PLR0917 - as make_plan takes them
    folder: Path,
    scene: Scene,
    profile: DeviceProfile,
    scanned: Sequence[Scanned],
    segments: FoundSegments | None = None,
    labels: RawVolume | None = None,
) -> Plan:
    """Return the plan that lies in the folder; if none does, make it and write it."""
    path = folder / _plan_key(scene, profile, scanned, segments, knows_labels=labels is not None)
    tried = [[] if each.whole is None else each.whole.known for each in scanned]
    with suppress(FileNotFoundError):
        plan, forms = pickle.loads(path.read_bytes())  # noqa: S301 - tests have written it
        for known, now_known in zip(tried, forms, strict=True):
            known[:] = now_known
        return plan
    plan = _plan(scene, profile, scanned, segments, labels)
    _keep(path, (plan, tried))
    return plan


def _plan_key(
    scene: Scene,
    profile: DeviceProfile,
    scanned: Sequence[Scanned],
    segments: FoundSegments | None,
    *,
    knows_labels: bool,
) -> str:
    """Return the digest of all that a plan follows from; the record of segments has a digest of their labels."""
    follows_from = {
        "product": product_digest(),
        "scene": _placeless(scene.model_dump(mode="json")),
        "profile": profile.model_dump(mode="json"),
        "segments": None if segments is None else segments.model_dump(mode="json"),
        "labels": knows_labels,
        "constants": _constants(),
        "scans": [
            {
                "info": each.info.model_dump(mode="json"),
                "measured": hashlib.sha256(pickle.dumps(each.measured)).hexdigest(),
                "voxels": each.voxels is not None,
                "forms": None if each.whole is None else [form.model_dump(mode="json") for form in each.whole.known],
            }
            for each in scanned
        ],
    }
    return hashlib.sha256(json.dumps(follows_from, sort_keys=True).encode()).hexdigest()


def _placeless(value: Any) -> Any:
    """Return JSON data with the digest of each file in place of its path; what a folder holds has been measured."""
    match value:
        case dict():
            return {name: _placeless(each) for name, each in value.items()}
        case list():
            return [_placeless(each) for each in value]
        case str() if value.startswith("/") and Path(value).exists():
            return hashlib.sha256(Path(value).read_bytes()).hexdigest() if Path(value).is_file() else "folder"
    return value


def _constants() -> list[int]:
    """Return what tests patch."""
    return [slabs.SLAB_BYTES, solve.BATCH, decision._LEAST_SAMPLES, preview._SIZE]


def _key(stage: Stage, draft: Draft, plan: Plan, whole_plan: bool) -> str:
    """Return the digest of all that the output of a stage follows from."""
    digests = {record.path: record.sha256 for record in draft.manifest.files}
    read = [record for record in draft.manifest.stages if record.name in stage.reads]
    follows_from = {
        "product": product_digest(),
        "stage": stage.name,
        "profile": plan.shared.profile.model_dump(mode="json"),
        "settings": [record.model_dump(mode="json") for record in stages._settings(stage, plan)],
        # The scene and the tried forms are kept for the next verb; no stage reads them.
        "files": {path: digests[path] for record in read for path in record.files if path not in {SCENE, FORMS}},
        "made": [made.model_dump(mode="json") for record in read for made in record.made],
        "constants": _constants(),
        "plan": plan.model_dump(mode="json") if whole_plan else None,
    }
    return hashlib.sha256(json.dumps(follows_from, sort_keys=True).encode()).hexdigest()


@cache
def product_digest() -> str:
    """Return the digest of every file of the product, and of the versions of Python and NumPy."""
    digest = hashlib.sha256(f"{sys.version} {np.__version__}".encode())
    for package in (volprep, volprep_formats):
        for root in map(Path, package.__path__):
            for path in sorted(root.rglob("*")):
                if path.is_file() and "__pycache__" not in path.parts:
                    digest.update(f"{path.relative_to(root)} {path.stat().st_size}\n".encode())
                    digest.update(path.read_bytes())
    return digest.hexdigest()
