"""Cache of the output of slow stages, shared by all tests, workers and runs.

The output of a stage follows from its settings and from the files that it reads. The key is a digest of these and of
the product's own files, so that a change of the product empties the cache. Most tests that build a package ask nothing
about its levels, and choosing their filters takes 1.7 of the 2.1 seconds of processor time of such a build.
"""

import hashlib
import json
import os
import pickle
import shutil
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

import volprep
import volprep_formats
from volprep.parts.stage import Stage
from volprep.parts.work import FORMS, SCENE
from volprep.pipeline import stages
from volprep.pipeline.stage_graph import STAGES as STAGES_OF_BUILD
from volprep.plan.records import Plan
from volprep.scan import slabs
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress

FOLDER = "VOLPREP_TEST_STAGES"
"""Environment variable: where remembered output lies, for processes that tests start."""
STAGES = frozenset({"pyramid"})
"""Choosing the filters of levels takes three quarters of the build of a small phantom."""
_MOST_BYTES = 4_000_000
"""Of the output of one stage."""
_run = stages._made


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
    """Do not run a stage of STAGES again whose output lies in `folder`, here and in commands that tests start.

    With `whole_plan` only where nothing in the plan differs: for tests of what a stage says that it depends on.
    """

    def made(stage: Stage, draft: Draft, plan: Plan, progress: Progress) -> Iterator[Contribution]:
        # Tests put failing stages in the place of some.
        if stage.name not in STAGES or stage not in STAGES_OF_BUILD:
            return _run(stage, draft, plan, progress)
        return iter(_remembered(folder / _key(stage, draft, plan, whole_plan), stage, draft, plan, progress))

    with patch("volprep.pipeline.stages._made", made), patch.dict(os.environ, {FOLDER: str(folder)}):
        yield


@contextmanager
def in_full() -> Iterator[None]:
    """Run every stage."""
    folder = os.environ.pop(FOLDER, None)
    try:
        with patch("volprep.pipeline.stages._made", _run):
            yield
    finally:
        # This variable alone: EGL is told its platform in the environment, by the first test that draws.
        if folder is not None:
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

    def noting(name: str, role: Any, data: Any) -> Any:
        whole = data if isinstance(data, bytes) else b"".join(bytes(chunk) for chunk in data)
        written.append((name, role, whole))
        return write(name, role, whole)

    with patch.object(draft, "write", noting):
        made = tuple(_run(stage, draft, plan, progress))
    if sum(len(data) for *_, data in written) <= _MOST_BYTES:
        path.parent.mkdir(parents=True, exist_ok=True)
        new = path.with_name(f"{path.name}.{os.getpid()}.{threading.get_ident()}")
        new.write_bytes(pickle.dumps((written, made)))
        new.replace(path)
    return made


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
        "slabs": slabs.SLAB_BYTES,
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
