"""Runs verbs that write files, and kills each before every operation on the file system. Not a test itself.

    python crash_verbs.py VERB PACKAGE SCENE FOLDER

Prints one line of JSON for each run, as crash.py does: what the killed verb left, and whether the next one makes good.
"""

import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from crash import every_step, tree

from volprep.pipeline.cut_files import write_cut
from volprep.pipeline.import_draft import begin_draft
from volprep.scene.request import load_request
from volprep_cli.main import command_line
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

OLDER = b"older"


def said(*words: str | Path) -> None:
    """Run a verb here, without what it prints."""
    sys.stdout = sys.stderr
    command_line([str(each) for each in words])([str(each) for each in words], standalone_mode=False)
    sys.stdout = sys.__stdout__


def killed_everywhere(
    room: Path, work: Callable[[], object], older: dict[str, bytes], same: Callable[[Path], object] = tree
) -> Iterator[str]:
    """Kill `work`, which writes into `room`, before each of its steps; at first `older` is there."""

    def prepare() -> Callable[[], object]:
        shutil.rmtree(room, ignore_errors=True)
        room.mkdir()
        for name, data in older.items():
            (room / name).write_bytes(data)
        return work

    # What it loads when it runs first is no operation of its own.
    prepare()()
    newer = same(room)

    def look() -> dict[str, object]:
        plain = {name: data for name, data in tree(room).items() if not name.startswith(".")}
        wanted = {name: {older.get(name), data} for name, data in tree_of_newer.items()}
        broken = [name for name, data in plain.items() if data not in wanted.get(name, set())]
        work()
        hidden = [path.name for path in room.iterdir() if path.name.startswith(".")]
        return {"broken": broken, "healed": same(room) == newer, "hidden": hidden, "new": plain == tree_of_newer}

    tree_of_newer = tree(room)
    return every_step(prepare, look)


def export_file(package: Path, _scene: Path, room: Path) -> Iterator[str]:
    work = lambda: said("export", package, room / "a.nii.gz", "--force")  # noqa: E731 -- a name for one call
    return killed_everywhere(room, work, {"a.nii.gz": OLDER})


def export_raw(package: Path, _scene: Path, room: Path) -> Iterator[str]:
    work = lambda: said("export", package, room / "a.raw", "--force")  # noqa: E731 -- as above
    return killed_everywhere(room, work, {"a.raw": OLDER, "a.raw.toml": OLDER})


def export_series(package: Path, _scene: Path, room: Path) -> Iterator[str]:
    def work() -> None:
        if not (room / "series").exists():
            said("export", package, room / "series")

    return killed_everywhere(room, work, {})


def zip_package(package: Path, _scene: Path, room: Path) -> Iterator[str]:
    work = lambda: said("zip", package, "-o", room / "a.zip", "--force")  # noqa: E731 -- as above
    return killed_everywhere(room, work, {"a.zip": OLDER})


def cut(package: Path, _scene: Path, room: Path) -> Iterator[str]:
    def work() -> object:
        return write_cut(Package.open(package), (20.0, 15.0, 7.0), 9, room, force=True)

    return killed_everywhere(room, work, {"cut.ktx2": OLDER, "cut.png": OLDER, "cut.json": OLDER})


def import_scan(_package: Path, scene: Path, room: Path) -> Iterator[str]:
    request = load_request(scene)

    def work() -> object:
        return begin_draft(request, room / "a.volpkg", Silent())

    yield from killed_everywhere(room, work, {})


def main() -> None:
    verb, *places = sys.argv[1:]
    for line in globals()[verb](*map(Path, places)):
        print(line, flush=True)


if __name__ == "__main__":
    main()
