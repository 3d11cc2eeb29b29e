"""What the verbs of single stages share."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import progress

if TYPE_CHECKING:
    from volprep.scene import Scene

Draft = Annotated[Path, typer.Argument(help="Draft that volprep import began.", metavar="PACKAGE")]


def unchanged(scene: "Scene") -> "Scene":
    """Leave what the user wants as it is."""
    return scene


def run_stage(package: Path, name: str, change: Callable[["Scene"], "Scene"] = unchanged) -> None:
    """Run the stage `name` on a draft, after `change` has changed the draft's scene."""
    from volprep.drafts import run_verb  # noqa: PLC0415 - keeps volprep --help fast

    with progress() as watcher:
        draft = run_verb(package, name, change, watcher)
    print(f"{package}: {name} done, {draft.manifest.state}")
