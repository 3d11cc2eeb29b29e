"""volprep build --timing: where a build spends its time."""

import json

import numpy as np
from command_line import volprep

from volprep_cli.timing import Timing
from volprep_formats.progress import Silent


def test_a_task_that_starts_again_adds_to_its_time() -> None:
    timing = Timing(Silent())
    for task in ("import", "skip", "import"):
        timing.start(task, 1)
        sum(range(200_000))
    tasks = {each.task: each for each in timing.tasks()}
    assert list(tasks) == ["prepare", "import", "skip"]
    assert tasks["import"].seconds > tasks["skip"].seconds / 2 > 0


def test_a_build_says_how_long_its_tasks_took(tmp_path) -> None:
    np.save(tmp_path / "a.npy", np.arange(9 * 8 * 7, dtype=np.uint16).reshape(9, 8, 7))
    build = ("build", tmp_path / "a.npy", "-o", tmp_path / "a.volpkg", "--timing", "-q")
    told = volprep(*build).stdout.splitlines()
    assert told[1].split() == ["task", "s", "processor", "s", "share"]
    names = [line.split("  ")[0] for line in told[2:]]
    assert names[0] == "prepare"
    assert names[-1] == "together"
    assert {"import", "quantize", "shaders", "seal"} < set(names)

    again = json.loads(volprep(*build, "--json").stdout)["timing"]
    assert [each["task"] for each in again] == names[:-1]
    assert all(each["seconds"] >= 0 <= each["processor_seconds"] for each in again)
