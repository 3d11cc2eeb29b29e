"""The modules of the page, one by one, without a browser."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import ended
from npm_package import npm_package

from volprep import view as view_room
from volprep.transfer.preclassified import code_colours
from volprep_formats.diagnostics import CATALOGUE
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.runtime import runtime_modules

PAGE = Path(view_room.__file__).parent / "page"
CHROME_ON_ANDROID = "Mozilla/5.0 (Linux; Android 10; K) AppleWebKit/537.36 (KHTML, like Gecko) Chrome/150.0.0.0 Mobile"
SAFARI_ON_A_PHONE = (
    "Mozilla/5.0 (iPhone; CPU iPhone OS 17_5 like Mac OS X) AppleWebKit/605.1.15 (KHTML, like Gecko) Version/17.5 "
    "Mobile/15E148 Safari/604.1"
)
FIREFOX = "Mozilla/5.0 (X11; Linux x86_64; rv:150.0) Gecko/20100101 Firefox/150.0"


def node(script: str) -> str:
    """What a script prints; `PAGE` in it is the folder of the modules."""
    text = script.replace("PAGE", PAGE.as_uri())
    done = ended(["node", "--input-type=module", "-e", text], timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_words_of_the_page_are_those_of_the_catalogue() -> None:
    words = json.loads(node('console.log(JSON.stringify((await import("PAGE/problems.js")).WORDS))'))
    assert words == {code: [CATALOGUE[code].summary, CATALOGUE[code].remedy] for code in words}
    thrown = {code for file in PAGE.glob("*.js") for code in re.findall(r"\"(VP\d{4})\"", file.read_text())}
    assert thrown == set(words)


@pytest.mark.parametrize(
    ("about", "browser", "platform"),
    [
        ({"userAgent": CHROME_ON_ANDROID}, "Chrome 150.0.0.0", "Linux; Android 10"),
        ({"userAgent": SAFARI_ON_A_PHONE}, "Safari 17.5", "iPhone; CPU iPhone OS 17_5 like Mac OS X"),
        ({"userAgent": FIREFOX}, "Firefox 150.0", "X11; Linux x86_64"),
        ({"userAgent": ""}, "unknown browser", "unknown"),
        (
            {
                "userAgentData": {
                    "platform": "Windows",
                    "brands": [
                        {"brand": "Not=A?Brand", "version": "8"},
                        {"brand": "Chromium", "version": "150"},
                        {"brand": "Microsoft Edge", "version": "150"},
                    ],
                }
            },
            "Microsoft Edge 150",
            "Windows",
        ),
    ],
)
def test_browser_and_system_have_names(about, browser, platform) -> None:
    script = f'console.log(JSON.stringify((await import("PAGE/device.js")).browserNames({json.dumps(about)})))'
    assert json.loads(node(script)) == {"browser": browser, "platform": platform}


def write_runtime(folder: Path) -> None:
    """Write the modules that a page imports, as it finds them: all in one folder."""
    folder.mkdir()
    for name, text in runtime_modules().items():
        (folder / name).write_text(text, encoding="utf-8")


def test_palettes_of_edited_slices_are_the_bytes_of_the_reference(tmp_path: Path) -> None:
    """A jump from haze to a wall at an entry: a palette has the mean of both sides, unlike a lookup table."""
    shutil.copytree(PAGE, tmp_path / "page")
    write_runtime(tmp_path / "runtime")
    sides = ((10.0, (0.2, 0.4, 0.9), 0.0), (51.0, (0.2, 0.4, 0.9), 0.01), (51.0, (1.0, 0.5, 0.1), 4.0))
    points = [TransferPoint(value=v, colour=c, extinction_per_mm=e) for v, c, e in sides]
    given = json.dumps([{"points": [each.model_dump() for each in points]}, [0, 255], 0.75])
    found = node(f"""
        const {{ paletteOf }} = await import("{tmp_path.as_uri()}/page/slice_renderer.js");
        console.log(JSON.stringify([...paletteOf(...{given})]));
    """)
    expected = code_colours(TransferFunction(name="t", points=tuple(points)), (0.0, 255.0), 0.75)
    np.testing.assert_array_equal(np.reshape(json.loads(found), (256, 4)), expected)


def test_the_time_of_a_draw_is_the_slope_whatever_a_wait_costs() -> None:
    """A clock of its own: a draw takes 3 ms, a wait 20 ms, and the second of five repetitions is disturbed."""
    found = node("""
        let now = 0;
        let pending = 0;
        let waits = 0;
        globalThis.performance = { now: () => now };
        const { Clock } = await import("PAGE/timing.js");
        const wait = () => { now += 20 + 3 * pending + (++waits === 6 ? 30 : 0); pending = 0; };
        const clock = new Clock({ gl: { getExtension: () => null }, draw: () => { pending += 1; }, wait });
        await clock.choose(1000);
        console.log(JSON.stringify([clock.kind, clock.note, await clock.time(1000)]));
    """)
    kind, note, time = json.loads(found)
    assert (kind, note) == ("fence", "this browser has none")
    assert time["draw_ms"] == pytest.approx(3.0)
    assert time["fastest_ms"] <= 3.0 <= time["slowest_ms"]
    assert time["draws"] > 10


def test_of_calls_while_one_runs_only_the_last_follows() -> None:
    found = node("""
        const { latest } = await import("PAGE/latest.js");
        const [begun, ends] = [[], []];
        let rested = 0;
        const task = (call) => { begun.push(call); return new Promise((end) => ends.push(end)); };
        const run = latest(task, () => (rested += 1));
        const first = run(1);
        run(2);
        run(3);
        ends[0]();
        await Promise.resolve().then(() => {});
        ends[1]();
        await first;
        console.log(JSON.stringify([begun, rested]));
    """)
    assert json.loads(found) == [[1, 3], 1]


def test_a_call_that_failed_keeps_no_later_one_from_running() -> None:
    found = node("""
        const { latest } = await import("PAGE/latest.js");
        const begun = [];
        const run = latest(async (call) => { begun.push(call); if (call === 1) throw new Error("wrong"); });
        const failed = await run(1).catch(({ message }) => message);
        await run(2);
        console.log(JSON.stringify([begun, failed]));
    """)
    assert json.loads(found) == [[1, 2], "wrong"]


def test_a_draw_that_takes_longer_than_its_time_is_not_timed() -> None:
    found = node("""
        let now = 0;
        globalThis.performance = { now: () => now };
        const { Clock } = await import("PAGE/timing.js");
        const clock = new Clock({ gl: { getExtension: () => null }, draw: () => { now += 900; }, wait: () => {} });
        console.log(JSON.stringify([await clock.time(1000), now, await clock.time(3000)]));
    """)
    none, spent, time = json.loads(found)
    assert (none, spent) == (None, 900)
    assert (time["draw_ms"], time["draws"]) == (900, 3)


@pytest.mark.long
def test_types_of_the_page_hold(tmp_path) -> None:
    tsc = npm_package("typescript", "5.9.3") / "node_modules" / "typescript" / "bin" / "tsc"
    (tmp_path / "page").symlink_to(PAGE)
    write_runtime(tmp_path / "runtime")
    options = {"strict": True, "allowJs": True, "checkJs": True, "noEmit": True, "preserveSymlinks": True, "types": []}
    target = {"target": "es2022", "module": "es2022", "moduleResolution": "bundler"}
    libraries = {"lib": ["es2023", "dom", "dom.iterable", "dom.asynciterable"]}
    config = {"compilerOptions": {**options, **target, **libraries}, "files": ["page/main.js"]}
    (tmp_path / "tsconfig.json").write_text(json.dumps(config), encoding="utf-8")
    done = ended(["node", str(tsc), "-p", str(tmp_path)])
    assert done.returncode == 0, done.stdout


def test_the_height_of_a_function_is_an_opacity_where_a_picture_shows_one_value() -> None:
    told = json.loads(
        node("""
const { Heights } = await import("PAGE/heights.js");
const found = [2, null].map((referenceMm) => {
  const heights = new Heights(referenceMm);
  return [heights.label(0.5), heights.text(0.5), heights.extinction(heights.of(0.5)).toFixed(9)];
});
console.log(JSON.stringify(found));
""")
    )
    assert told == [
        ["height: opacity of the pixel, up to 0.632", "opacity 0.632", "0.500000000"],
        ["height: extinction per mm, up to 0.500", "extinction 0.500 per mm", "0.500000000"],
    ]
