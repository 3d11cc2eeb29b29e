"""Names of classes: a reader who meets one knows at once which it is."""

import re
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
CLASS = re.compile(r"^ *class ([A-Za-z]\w*)[(:]", re.MULTILINE)
PRODUCT = ("volprep", "formats/volprep_formats", "cli/volprep_cli")


def test_no_public_class_name_stands_twice_in_product_code() -> None:
    places = defaultdict(list)
    for folder in PRODUCT:
        for path in sorted((ROOT / folder).rglob("*.py")):
            for name in CLASS.findall(path.read_text(encoding="utf-8")):
                places[name].append(str(path.relative_to(ROOT)))
    assert len(places) > 100
    assert {name: found for name, found in places.items() if len(found) > 1} == {}
