"""volprep stage: the stages of a build, one by one; the registry of parts lists them with their options."""

import inspect
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import print_done, progress

if TYPE_CHECKING:
    from volprep.parts.stage import Stage
    from volprep.scene.scene import Scene

_Draft = Annotated[Path, typer.Argument(help="Draft that volprep import began.", metavar="DRAFT")]


def stage() -> None:
    """Run one stage of a build on a draft that volprep import began; volprep stage --help lists the stages.

    An option replaces a key of the draft's scene, and is written as there. If the change affects stages that this one
    reads, these run again first; the output of stages that read this one is dropped.
    """


def commands() -> dict[str, Callable[..., None]]:
    """Return the function of each stage, by name."""
    from volprep.pipeline.stage_graph import STAGES

    return {stage.name: _command(stage) for stage in STAGES}


def _command(stage: "Stage") -> Callable[..., None]:
    table, keys = stage.options

    def run(package: Path, **given: str | bool | None) -> None:
        _run(package, stage.name, table, {key: _value(text) for key, text in given.items()})

    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    draft = inspect.Parameter("package", kind, annotation=_Draft)
    options = [inspect.Parameter(key, kind, default=None, annotation=_option(table, key)) for key in keys]
    run.__doc__ = stage.summary
    run.__signature__ = inspect.Signature([draft, *options])  # type: ignore[attr-defined]
    return run


def _option(table: str, key: str) -> object:
    """Return the type of an option for a key of the scene, with the key's documentation as help."""
    from volprep.scene.lab import KEYS
    from volprep.scene.scene import table_of

    record = table_of(table)
    documented = record.model_json_schema()["properties"][key].get("description", "")
    name = f"lab.{table}.{key}" if key in KEYS.get(table, ()) else f"{table}.{key}"
    told = f"{' '.join(documented.split())} Replaces {name} of the scene."
    if record.model_fields[key].annotation is bool:
        return Annotated[bool | None, typer.Option(help=told)]
    return Annotated[str | None, typer.Option(help=told, metavar="VALUE")]


def _value(text: str | bool | None) -> object:
    """Read a value as a scene has it; text that is not TOML is a string without its quotes."""
    if not isinstance(text, str):
        return text
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _run(package: Path, name: str, table: str, wishes: dict[str, object]) -> None:
    from volprep.pipeline.drafts import run_verb
    from volprep.scene.scene import changed

    def change(scene: "Scene") -> "Scene":
        return changed(scene, table, **wishes) if wishes else scene

    with progress() as watcher:
        draft = run_verb(package, name, change, watcher)
    state = draft.manifest.state
    print_done(f"{package}: {name} done, {state}", package=str(package), stage=name, state=state)
