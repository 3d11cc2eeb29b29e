"""Results of the study, a file for each subject: a study that was ended goes on, and processes share the subjects."""

import hashlib
import os
import pickle
import sys
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from tests.levels_study.measure import StudyPicture, StudyRow, measure
from tests.levels_study.promise import PromiseRow, promises
from tests.levels_study.subjects import Subject


@dataclass(frozen=True)
class Settings:
    """Levels and pictures of a study."""

    pixels: int
    """Width and height of pictures."""
    levels: tuple[int, ...]
    """Levels."""
    thorough: bool
    """Whether levels are also refined with `refine = "thorough"`."""


@dataclass(frozen=True)
class Found:
    """Results of one subject."""

    rows: tuple[StudyRow, ...]
    """Ways to make levels; the truth is the first."""
    pictures: tuple[StudyPicture, ...]
    """Their pictures."""
    steps: tuple[PromiseRow, ...]
    """Steps of a default build."""


def results(subjects: Iterable[Subject], settings: Settings, folder: Path, processes: int) -> Iterator[Found]:
    """Measure subjects, or read what an earlier run has measured with the same settings, in the order of `subjects`."""
    folder.mkdir(parents=True, exist_ok=True)
    if processes == 1:
        for subject in subjects:
            yield _found(subject, settings, folder)
        return
    # Each process takes its share of the cores; those that are started read this.
    os.environ.setdefault("OMP_NUM_THREADS", str(max(1, (os.cpu_count() or 1) // processes)))
    with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        waiting: Sequence[Future[Found]] = [pool.submit(_found, each, settings, folder) for each in subjects]
        for each in waiting:
            yield each.result()


def _found(subject: Subject, settings: Settings, folder: Path) -> Found:
    path = folder / f"{_digest(subject, settings)}.pickle"
    if path.exists():
        kept: Found = pickle.loads(path.read_bytes())  # noqa: S301 - the study wrote it
        return kept
    print(f"{subject.name}: measuring", file=sys.stderr, flush=True)
    measured = list(measure(subject, settings.levels, settings.pixels, thorough=settings.thorough))
    found = Found(
        rows=tuple(row for row, _ in measured),
        pictures=tuple(picture for _, picture in measured),
        steps=tuple(promises(subject, settings.pixels)),
    )
    unfinished = path.with_suffix(".part")
    unfinished.write_bytes(pickle.dumps(found))
    unfinished.rename(path)
    return found


def _digest(subject: Subject, settings: Settings) -> str:
    asked = f"{subject.name} {subject.window} {subject.function} {settings}"
    return hashlib.sha256(asked.encode() + subject.codes.tobytes()).hexdigest()[:16]
