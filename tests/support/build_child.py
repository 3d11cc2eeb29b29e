"""A build in a process of its own that starts at once and may be killed."""

import multiprocessing
from multiprocessing.process import BaseProcess
from pathlib import Path

# Children are forked from a server that has loaded everything and run nothing: no 0.5 s of imports for each, and no
# OpenMP threads to lose in the fork.
_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload(["volprep.pipeline.build", "volprep.scene.request", "volprep.pipeline.preview"])


def _build(scene: Path, target: Path) -> None:
    from volprep.pipeline.build import build
    from volprep.scene.request import load_request
    from volprep_formats.progress import Silent

    build(load_request(scene), target, Silent())


def start_build(scene: Path, target: Path) -> BaseProcess:
    """Start a build; its exit code is 0 only if it succeeded."""
    process = _CONTEXT.Process(target=_build, args=(scene, target))
    process.start()
    return process
