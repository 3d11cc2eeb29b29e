"""Build the package of a scene, validate it and ask the witness, in this process; print as JSON who found what.

`python tests/mutants/trial.py SCENE FOLDER`; the process imports the product with the bug.
"""

import json
import sys
import traceback
from pathlib import Path


def main(name: str, folder: Path) -> dict[str, object]:
    """Try a scene of tests/support/foreign_scans.py."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
    from foreign_scans import SCENES

    import volprep
    from volprep.report.validate import validate
    from volprep_formats.progress import Silent

    try:
        scene, package = SCENES[name](folder), folder / "tried.volpkg"
        volprep.build_package(scene, package)
        report = validate(package, folder / "report", Silent(), witness=True)
    except Exception as error:  # noqa: BLE001 - a bug may raise anything
        traceback.print_exc()
        return {"validate": True, "witness": True, "said": f"{type(error).__name__}: {error}"[:300]}
    verdict, witness = report.verdict, report.witness
    assert witness is not None
    lists = {name: value for name, value in verdict if isinstance(value, tuple)}
    own = [str(each) for name, value in lists.items() if name not in {"disagreeing", "previews"} for each in value]
    own += [f"{verdict.failed} of {verdict.views} views"] if verdict.failed else []
    checks = [f"{each.item}: {each.found:.3g} of {each.limit:.3g}" for each in witness.checks if not each.passed]
    others = [f"VTK: {each}" for each in witness.disagreeing] + checks
    return {"validate": bool(own), "witness": bool(own or others), "said": "; ".join(own + others)[:300]}


if __name__ == "__main__":
    sys.stdout.write("\n" + json.dumps(main(sys.argv[1], Path(sys.argv[2]))) + "\n")
