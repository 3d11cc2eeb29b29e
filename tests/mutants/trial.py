"""Build the package of a scene, validate it and ask the witness, in this process; print as JSON who found what.

`python tests/mutants/trial.py SCENE FOLDER`; the process imports the product with the bug. The witness is asked only if
the verdict finds nothing, and VTK only if the second reading finds nothing. No page is written.
"""

import json
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch


def main(name: str, folder: Path) -> dict[str, object]:
    """Try a scene of tests/support/foreign_scans.py."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
    from foreign_scans import SCENES

    try:
        return _found(SCENES[name](folder), folder)
    except Exception as error:  # noqa: BLE001 - a bug may raise anything
        traceback.print_exc()
        return {"validate": True, "witness": True, "said": f"{type(error).__name__}: {error}"[:300]}


def _found(scene: Path, folder: Path) -> dict[str, object]:
    import volprep
    from volprep.validation import run
    from volprep.validation.folder import report_folder
    from volprep.validation.witness.records import Witness
    from volprep_formats.progress import Silent

    package, scratch = folder / "tried.volpkg", folder / "scratch"
    scratch.mkdir()
    volprep.build_package(scene, package)
    asked: list[tuple[Any, ...]] = []

    def ask_later(*given: Any) -> Witness:
        asked.append(given)
        return Witness(renderer=None, driver=None, programs=(), missing=())

    later = patch.object(run, "_witnessed", ask_later), patch.object(run, "_layout_picture", lambda *_: None)
    with report_folder(folder / "report") as report, later[0], later[1]:
        verdict = run.measure_package(package, report, scratch, Silent(), witness=True).verdict
        own = [
            str(each)
            for name, value in verdict
            if isinstance(value, tuple) and name not in {"finest", "levels", "unwitnessed"}
            for each in value
        ]
        own += [f"{verdict.failed} of {verdict.views} views"] if verdict.failed else []
        others = [] if own else next((said for said in _witnesses(*asked[0]) if said), [])
    return {"validate": bool(own), "witness": bool(own or others), "said": "; ".join(own + others)[:300]}


def _witnesses(*given: Any) -> Iterator[list[str]]:
    """Return what the second reading, and then VTK, has to say."""
    from volprep.validation import run
    from volprep.validation.timing.sweep import SWEEP_VIEW
    from volprep.validation.witness.judge import ask_witness

    *_, measured, scratch = given
    checks = run.reread(*given[:-1]).checks
    yield [f"{each.item}: {each.found:.3g} of {each.limit:.3g}" for each in checks if not each.passed]
    yield [f"VTK: {each}" for each in ask_witness(measured.statements, SWEEP_VIEW, scratch).disagreeing]


if __name__ == "__main__":
    sys.stdout.write("\n" + json.dumps(main(sys.argv[1], Path(sys.argv[2]))) + "\n")
