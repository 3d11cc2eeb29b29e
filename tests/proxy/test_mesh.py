"""Meshes around blocks are closed, turned outwards, and enclose what they must, whatever the blocks."""

import numpy as np
import pytest

from volprep.parts.proxy.mesh import ProxyMesh, block_planes, proxy_mesh
from volprep.parts.proxy.sound import edge_uses, problems_of, winding_numbers

FORMS = ["blocks", "merged", "convex", "box"]
forms = pytest.mark.parametrize("form", FORMS)


def random_blocks(seed):
    """A volume of any shape, one-voxel axes included, and which of its blocks are occupied."""
    rng = np.random.default_rng(seed)
    shape = tuple(int(n) for n in rng.choice([1, 2, 3, 5, 8, 13, 21, 34], 3))
    planes = block_planes(shape, int(rng.choice([1, 2, 3, 5, 8, 64])))
    blocks = tuple(len(along) - 1 for along in planes)
    return rng.random(blocks) < rng.choice([0.0, 0.02, 0.3, 0.7, 1.0]), planes


def volume_of(mesh):
    """Six times the enclosed volume (divergence theorem), in whole numbers."""
    a, b, c = (mesh.positions_xyz[mesh.triangles[:, k]].astype(np.int64) for k in range(3))
    return int(np.einsum("ij,ij->", np.cross(a, b), c))


@forms
def test_random_blocks_have_sound_meshes(form):
    for seed in range(150):
        occupied, planes = random_blocks(seed)
        mesh = proxy_mesh(occupied, planes, form)
        assert list(problems_of(mesh, occupied, planes, form)) == [], seed


@pytest.mark.parametrize("form", ["blocks", "merged"])
def test_a_mesh_encloses_the_occupied_blocks_and_no_more(form):
    for seed in range(60):
        occupied, planes = random_blocks(seed + 500)
        z, y, x = (np.diff(along).astype(np.int64) for along in planes)
        sizes = z[:, None, None] * y[None, :, None] * x[None, None, :]
        assert volume_of(proxy_mesh(occupied, planes, form)) == 6 * int(sizes[occupied].sum())


@pytest.mark.parametrize("form", ["blocks", "merged"])
@pytest.mark.parametrize("size", [1, 8])
def test_blocks_that_touch_at_an_edge_or_a_corner_alone_have_no_common_edge(form, size):
    planes = block_planes((2 * size + 1,) * 3, size)
    for number in range(256):
        occupied = np.array([number >> k & 1 for k in range(8)], np.bool_).reshape(2, 2, 2)
        mesh = proxy_mesh(occupied, planes, form)
        along, back = edge_uses(mesh.triangles)
        assert (along == 1).all()
        assert (back == 1).all()
        # A reader that joins vertices of one position leaves the mesh as it is.
        assert len(np.unique(mesh.positions_xyz, axis=0)) == len(mesh.positions_xyz)


@pytest.mark.parametrize("form", ["blocks", "merged"])
def test_no_vertex_lies_on_an_edge_between_others(form):
    """T-junctions would open the mesh by a pixel where edges round differently."""
    occupied, planes = np.random.default_rng(7).random((5, 6, 7)) < 0.5, block_planes((15, 18, 21), 3)
    mesh = proxy_mesh(occupied, planes, form)
    points = mesh.positions_xyz.astype(np.int64)
    edges = np.unique(np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    for start, end in points[edges]:
        length = end - start
        to_points = points - start
        on_line = ~np.cross(to_points, length).any(axis=1)
        share = to_points @ length
        between = on_line & (share > 0) & (share < length @ length)
        # Two blocks that touch at an edge alone have each a vertex on it, which is no crack: each mesh is closed there.
        for point in points[between]:
            corners = occupied_around(occupied, planes, point)
            assert corners in {(True, False, False, True), (False, True, True, False)}, point


def occupied_around(occupied, planes, point_xyz):
    """The four blocks around an edge on which a point lies between two planes."""
    own = [np.searchsorted(planes[axis], point_xyz[2 - axis], "right") - 1 for axis in range(3)]
    free = next(axis for axis in range(3) if planes[axis][own[axis]] != point_xyz[2 - axis])
    solid = np.pad(occupied, 1)
    one, other = (axis for axis in range(3) if axis != free)
    found = []
    for i in (0, 1):
        for j in (0, 1):
            at = [number + 1 for number in own]
            at[one] -= i
            at[other] -= j
            found.append(bool(solid[tuple(at)]))
    return tuple(found)


def test_merged_faces_of_a_slab_are_six_rectangles():
    planes = block_planes((100, 80, 60), 4)
    occupied = np.zeros(tuple(len(along) - 1 for along in planes), np.bool_)
    occupied[3:9, 2:12] = True
    mesh = proxy_mesh(occupied, planes, "merged")
    assert (len(mesh.positions_xyz), len(mesh.triangles)) == (8, 12)
    assert mesh.positions_xyz.min(axis=0).tolist() == [0, 4 * 8 + 2, 4 * 12 + 2]
    assert mesh.positions_xyz.max(axis=0).tolist() == [240, 4 * 48 + 2, 4 * 36 + 2]


@forms
def test_all_visible_is_the_box_and_nothing_visible_is_nothing(form):
    planes = block_planes((9, 17, 4), 100)
    full = proxy_mesh(np.ones((1, 1, 1), np.bool_), planes, form)
    assert (full.positions_xyz.max(axis=0) == (16, 68, 36)).all()
    assert volume_of(full) == 6 * 16 * 68 * 36
    assert len(proxy_mesh(np.zeros((1, 1, 1), np.bool_), planes, form).triangles) == 0


def test_broken_meshes_are_found():
    occupied, planes = np.zeros((3, 3, 3), np.bool_), block_planes((10, 10, 10), 3)
    occupied[1, 1, :2] = True
    for form in FORMS:
        mesh = proxy_mesh(occupied, planes, form)
        missing = ProxyMesh(mesh.positions_xyz, mesh.triangles[1:])
        turned = ProxyMesh(mesh.positions_xyz, mesh.triangles[:, ::-1])
        moved = ProxyMesh((mesh.positions_xyz * 3) // 4, mesh.triangles)
        for broken in (missing, turned, moved):
            assert list(problems_of(broken, occupied, planes, form)), form


def test_a_hollow_turns_around_no_point_within():
    occupied, planes = np.ones((5, 5, 5), np.bool_), block_planes((11, 11, 11), 2)
    occupied[1:4, 1:4, 1:4] = False
    mesh = proxy_mesh(occupied, planes, "merged")
    assert (winding_numbers(mesh, planes) == occupied).all()
