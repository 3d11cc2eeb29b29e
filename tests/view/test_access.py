"""The page is for everyone: axe-core finds nothing to object to, on small and large screens, in light and in dark."""

import pytest
from npm_package import npm_package
from view_page import READY, served

SCREENS = {
    "telephone": {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True},
    "desk": {"width": 1280, "height": 900, "deviceScaleFactor": 1, "mobile": False},
}
OPEN_ALL = """
for (const card of document.querySelectorAll("details")) Object.assign(card, { name: "", open: true });
document.getElementById("picture").setAttribute("fidelity", "");
document.getElementById("ruler").click();
const drawn = () => document.querySelector(".slice canvas")?.width > 1;
while (!drawn()) await new Promise((resolve) => setTimeout(resolve, 20));
"""
AXE = """
const { violations } = await axe.run(document);
return violations.map(({ id, nodes }) => [id, nodes.map((each) => each.html.slice(0, 200))]);
"""


@pytest.mark.long
@pytest.mark.parametrize("screen", SCREENS)
def test_axe_finds_nothing_to_object_to_in_either_theme(browser, phantom, screen) -> None:
    axe = npm_package("axe-core", "4.10.3") / "node_modules" / "axe-core" / "axe.min.js"
    with served(phantom.package) as server:
        browser.open(server.url, SCREENS[screen])
        assert browser.run(READY) == "ready"
        # Evaluated by the tool, not loaded by the page: its content policy stays as it is.
        browser.send("Runtime.evaluate", expression=axe.read_text(encoding="utf-8"))
        browser.run(OPEN_ALL)
        found = {}
        for theme in ("light", "dark"):
            browser.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
            found[theme] = browser.run(AXE)
        browser.send("Emulation.setEmulatedMedia", features=[])
    assert found == {"light": [], "dark": []}
