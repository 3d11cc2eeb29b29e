"""What formats/js takes for visible after an edit is what the compositings of volprep do."""

import json
import subprocess
from pathlib import Path
from typing import get_args

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep_formats.package.function_table import Table
from volprep_formats.package.program import CompositingName

JS = Path(__file__).parents[2] / "formats" / "js"
SCRIPT = """
const { visible } = await import("%s/edit/edit.js");
const [names, extinctions, window, isovalues] = %s;
const found = (name, isovalue) => Array.from(visible(Float64Array.from(extinctions), name, window, isovalue));
console.log(JSON.stringify(names.map((name) => isovalues.map((isovalue) => found(name, isovalue)))));
"""


def test_what_can_be_seen_of_each_entry_is_what_the_compositing_says() -> None:
    extinctions, window = [0.0, 0.0, 0.2, 0.0, 0.7, 0.1, 0.0, 0.0], (-100.0, 250.0)
    # Outside the window, between two entries, and exactly at one.
    isovalues, names = [-300.0, -100.0, 30.0, 50.0, 249.0, 400.0], get_args(CompositingName)
    script = SCRIPT % (JS, json.dumps([names, extinctions, window, isovalues]))
    command = ["node", "--input-type=module", "-e", script]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    for name, found in zip(names, json.loads(done.stdout), strict=True):
        for isovalue, entries in zip(isovalues, found, strict=True):
            values = np.linspace(*window, len(extinctions))
            table = Table(values, np.zeros((len(values), 3)), np.array(extinctions), 1.0, isovalue)
            assert np.array_equal(entries, COMPOSITINGS[name].visible(table)), (name, isovalue)
