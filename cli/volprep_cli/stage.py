"""Helpers of the verbs of single stages."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import print_done, progress

if TYPE_CHECKING:
    from volprep.scene.scene import Scene

Draft = Annotated[Path, typer.Argument(help="Draft that volprep import began.", metavar="PACKAGE")]


def run_stage(package: Path, verb: str, **wishes: object) -> None:
    """Run a stage on a draft. Each option of the verb that is not None replaces a key of the scene's table."""
    from volprep.pipeline.drafts import run_verb
    from volprep.scene.scene import changed

    def change(scene: "Scene") -> "Scene":
        return changed(scene, verb, **wishes) if wishes else scene

    with progress() as watcher:
        draft = run_verb(package, verb, change, watcher)
    state = draft.manifest.state
    print_done(f"{package}: {verb} done, {state}", package=str(package), stage=verb, state=state)
