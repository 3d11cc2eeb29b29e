"""Firefox draws what the reference renderer draws, and its custom element works as in Chromium."""

import pytest
from web_pictures import TWO_STEPS, box_from_clip_of, drawn_by_reference, drawn_in_page, rmse

SCENES = [
    *("lit, skips by distance", "lit mosaic, skips by distance", "bricks", "half floats", "isosurface", "meshes"),
    *("two passes", "slabs", "slices across the view", "editable mosaic"),
]


@pytest.mark.long
@pytest.mark.parametrize("name", SCENES)
def test_views_are_those_of_the_reference_renderer(firefox, server, scene_package, name) -> None:
    package = scene_package(name)
    matrices = box_from_clip_of(package)[::3]
    program = package.manifest.level_programs[0]
    options = {"program": program.transfer, "level": min(program.levels)}
    kind = "webgl2" if package.manifest.profile.api == "es3.0" else "webgl"
    found = drawn_in_page(firefox, server, package.path, matrices, kind=kind, options=options)
    assert (found.said["program"], found.said["level"], found.said["error"]) == (*options.values(), 0)
    wanted = drawn_by_reference(package, matrices, level=options["level"], transfer=program.transfer)
    for picture, reference in zip(found.pictures, wanted, strict=True):
        assert reference[..., 3].max() > 0.1
        assert rmse(picture, reference) < TWO_STEPS


@pytest.mark.long
def test_the_element_loads_and_is_turned_by_keys(firefox, server, scene_package) -> None:
    server.folders["package"] = scene_package("lit, skips by distance").path.parent
    firefox.open(f"{server.url}/")
    script = """
    await import("/js/element.js");
    document.body.innerHTML = "<volume-viewer src='/package/p.volpkg' controls annotations style='width: 200px'>";
    const [viewer] = document.body.children;
    await new Promise((resolve) => viewer.addEventListener("load", resolve));
    await viewer.renderer.ready;
    const inside = viewer.shadowRoot;
    const letters = () => [...inside.querySelectorAll("[part=annotations] text")].map((each) => each.textContent);
    while (!letters().length) await new Promise((resolve) => setTimeout(resolve, 30));
    const before = letters()[0];
    const turn = () => inside.querySelector("canvas").dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
    for (let i = 0; i < 18; i++) turn();
    while (letters()[0] === before) await new Promise((resolve) => setTimeout(resolve, 30));
    viewer.remove();
    return true;
    """
    assert firefox.run(script)
