// Outer faces of blocks. Merging is the greedy sweep over the mask of each plane; T-junctions, which would open the
// mesh by what rounds differently along an edge, are closed by giving rectangles the vertices on their borders.
#include "volprep/block_surface.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <unordered_map>

namespace volprep {
namespace {

using Triple = std::array<int64_t, 3>;  // x, y, z

// Faces of one plane and side: cells first_u to last_u - 1 and first_v to last_v - 1 of the two axes after `axis`.
struct Rectangle {
    int axis;
    bool upper;  // whether its blocks lie below the plane, so that it looks up along the axis
    int64_t plane, first_u, last_u, first_v, last_v;
};

// A set of numbers that tells the rank of each of its members.
class RankedSet {
  public:
    explicit RankedSet(int64_t size) : words_(static_cast<size_t>((size + 63) / 64)) {}
    void insert(int64_t number) { words_[word(number)] |= bit(number); }
    bool contains(int64_t number) const { return (words_[word(number)] & bit(number)) != 0; }
    void rank() {
        ranks_.reserve(words_.size());
        for (const uint64_t each : words_) {
            ranks_.push_back(count_);
            count_ += std::popcount(each);
        }
    }
    int32_t rank_of(int64_t number) const {
        return ranks_[word(number)] + std::popcount(words_[word(number)] & (bit(number) - 1));
    }
    int32_t count() const { return count_; }
    template <typename Visit>
    void visit(Visit visit) const {
        for (size_t index = 0; index < words_.size(); ++index) {
            for (uint64_t left = words_[index]; left != 0; left &= left - 1) {
                visit(static_cast<int64_t>(index) * 64 + std::countr_zero(left));
            }
        }
    }

  private:
    static size_t word(int64_t number) { return static_cast<size_t>(number >> 6); }
    static uint64_t bit(int64_t number) { return uint64_t{1} << (number & 63); }
    std::vector<uint64_t> words_;
    std::vector<int32_t> ranks_;
    int32_t count_ = 0;
};

class Surface {
  public:
    Surface(const uint8_t* occupied, Shape3 blocks, BlockPlanes planes, SurfaceMesh& mesh)
        : occupied_(occupied),
          blocks_{blocks.x, blocks.y, blocks.z},
          cell_step_{1, blocks.x, blocks.x * blocks.y},
          corner_step_{1, blocks.x + 1, (blocks.x + 1) * (blocks.y + 1)},
          planes_{planes.x, planes.y, planes.z},
          corners_((blocks.x + 1) * (blocks.y + 1) * (blocks.z + 1)),
          mesh_(mesh) {}

    void make(bool merged) {
        for (int axis = 0; axis < 3; ++axis) {
            for (int64_t plane = 0; plane <= blocks_[axis]; ++plane) {
                find_rectangles(axis, plane, merged);
            }
        }
        mark_corners();
        corners_.rank();
        corners_.visit([&](int64_t corner) {
            for (int axis = 0; axis < 3; ++axis) {
                mesh_.positions_xyz.push_back(planes_[axis][corner_part(corner, axis)]);
            }
        });
        vertices_ = corners_.count();
        for (const Rectangle& rectangle : rectangles_) {
            add(rectangle);
        }
    }

  private:
    bool is_occupied(Triple cell) const {
        for (int axis = 0; axis < 3; ++axis) {
            if (cell[axis] < 0 || cell[axis] >= blocks_[axis]) {
                return false;
            }
        }
        return occupied_[cell[0] + cell[1] * cell_step_[1] + cell[2] * cell_step_[2]] != 0;
    }

    int64_t corner_part(int64_t corner, int axis) const { return corner / corner_step_[axis] % (blocks_[axis] + 1); }

    // The faces of a plane, both sides.
    void find_rectangles(int axis, int64_t plane, bool merged) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const int64_t width = blocks_[u], height = blocks_[v];
        for (const bool upper : {false, true}) {
            const int64_t own = plane - (upper ? 1 : 0), other = plane - (upper ? 0 : 1);
            if (own < 0 || own >= blocks_[axis]) {
                continue;
            }
            const bool outermost = other < 0 || other >= blocks_[axis];
            mask_.assign(static_cast<size_t>(width * height), 0);
            for (int64_t j = 0; j < height; ++j) {
                for (int64_t i = 0; i < width; ++i) {
                    const int64_t cell = i * cell_step_[u] + j * cell_step_[v];
                    mask_[static_cast<size_t>(j * width + i)] =
                        occupied_[cell + own * cell_step_[axis]] != 0 &&
                        (outermost || occupied_[cell + other * cell_step_[axis]] == 0);
                }
            }
            sweep({axis, upper, plane, 0, 0, 0, 0}, width, height, merged);
        }
    }

    void sweep(Rectangle rectangle, int64_t width, int64_t height, bool merged) {
        const auto row = [&](int64_t j) { return mask_.begin() + j * width; };
        for (int64_t j = 0; j < height; ++j) {
            for (int64_t i = 0; i < width; ++i) {
                if (row(j)[i] == 0) {
                    continue;
                }
                int64_t right = i + 1, top = j + 1;
                if (merged) {
                    right = std::find(row(j) + i, row(j) + width, uint8_t{0}) - row(j);
                    while (top < height && std::find(row(top) + i, row(top) + right, uint8_t{0}) == row(top) + right) {
                        ++top;
                    }
                }
                for (int64_t k = j; k < top; ++k) {
                    std::fill(row(k) + i, row(k) + right, uint8_t{0});
                }
                rectangle.first_u = i, rectangle.last_u = right, rectangle.first_v = j, rectangle.last_v = top;
                rectangles_.push_back(rectangle);
            }
        }
    }

    int64_t corner_of(const Rectangle& face, int64_t u, int64_t v) const {
        return face.plane * corner_step_[face.axis] + u * corner_step_[(face.axis + 1) % 3] +
               v * corner_step_[(face.axis + 2) % 3];
    }

    // Calls side(axis, first corner, step, edges) for the four sides, counter-clockwise as seen from above the plane.
    template <typename Side>
    void walk(const Rectangle& face, Side side) const {
        const int u = (face.axis + 1) % 3, v = (face.axis + 2) % 3;
        const int64_t width = face.last_u - face.first_u, height = face.last_v - face.first_v;
        side(u, corner_of(face, face.first_u, face.first_v), corner_step_[u], width);
        side(v, corner_of(face, face.last_u, face.first_v), corner_step_[v], height);
        side(u, corner_of(face, face.last_u, face.last_v), -corner_step_[u], width);
        side(v, corner_of(face, face.first_u, face.last_v), -corner_step_[v], height);
    }

    // Whether only two blocks touch the edge from `corner` along `axis`, and these at the edge alone.
    bool is_shared_by_two(int64_t corner, int axis) const {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        Triple cell{corner_part(corner, 0), corner_part(corner, 1), corner_part(corner, 2)};
        const bool high = is_occupied(cell);
        --cell[u];
        const bool low_u = is_occupied(cell);
        --cell[v];
        const bool low = is_occupied(cell);
        ++cell[u];
        const bool low_v = is_occupied(cell);
        return high == low && low_u == low_v && high != low_u;
    }

    void mark_corners() {
        for (const Rectangle& face : rectangles_) {
            walk(face, [&](int axis, int64_t corner, int64_t step, int64_t edges) {
                corners_.insert(corner);
                for (int64_t edge = 0; edge < edges; ++edge, corner += step) {
                    if (is_shared_by_two(std::min(corner, corner + step), axis)) {
                        corners_.insert(corner);
                        corners_.insert(corner + step);
                    }
                }
            });
        }
    }

    // The vertex that one of the two blocks at an edge has there for itself; at different places, so that a reader that
    // joins vertices of one position leaves the mesh as it is.
    int32_t own_vertex(const Rectangle& face, int64_t corner, int axis) {
        const int across = (axis + 1) % 3;
        const int64_t at = corner_part(corner, across);
        // Does the face's block lie below the edge along `across`?
        const bool below = across == face.axis ? face.upper : at == last_of(face, across);
        const auto [found, is_new] = own_vertices_.try_emplace((corner * 3 + axis) * 2 + (below ? 1 : 0), vertices_);
        if (is_new) {
            ++vertices_;
            Triple part{corner_part(corner, 0), corner_part(corner, 1), corner_part(corner, 2)};
            for (int each = 0; each < 3; ++each) {
                const int32_t* planes = planes_[each] + part[each];
                const int32_t third = each == axis ? (planes[1] - planes[0]) / 3 : 0;
                mesh_.positions_xyz.push_back(below && each == axis ? planes[1] - third : planes[0] + third);
            }
        }
        return found->second;
    }

    static int64_t last_of(const Rectangle& face, int axis) {
        return axis == (face.axis + 1) % 3 ? face.last_u : face.last_v;
    }

    // The border as vertices, and for each side how many it has beside its corners and where the first of these is.
    void add(const Rectangle& face) {
        border_.clear();
        size_t fan = 0, more = 0;
        bool has_fan = false;
        walk(face, [&](int axis, int64_t corner, int64_t step, int64_t edges) {
            const size_t begin = border_.size();
            for (int64_t edge = 0; edge < edges; ++edge, corner += step) {
                if (corners_.contains(corner)) {
                    border_.push_back(corners_.rank_of(corner));
                }
                const int64_t low = std::min(corner, corner + step);
                if (is_shared_by_two(low, axis)) {
                    border_.push_back(own_vertex(face, low, axis));
                }
            }
            const size_t extra = border_.size() - begin - 1;
            more += extra;
            if (extra == 1) {
                fan = begin + 1;
                has_fan = true;
            }
        });
        // From a corner where there are only corners; else no triangle may lie in one side, so from the only other
        // vertex of a side, or from a new one in the middle.
        const size_t count = border_.size();
        if (more == 0 || has_fan) {
            for (size_t k = 1; k + 1 < count; ++k) {
                triangle(face, border_[fan], border_[(fan + k) % count], border_[(fan + k + 1) % count]);
            }
            return;
        }
        const int32_t middle = middle_vertex(face);
        for (size_t k = 0; k < count; ++k) {
            triangle(face, middle, border_[k], border_[(k + 1) % count]);
        }
    }

    int32_t middle_vertex(const Rectangle& face) {
        const int u = (face.axis + 1) % 3, v = (face.axis + 2) % 3;
        std::array<int32_t, 3> at{};
        at[face.axis] = planes_[face.axis][face.plane];
        at[u] = planes_[u][face.first_u] + (planes_[u][face.last_u] - planes_[u][face.first_u]) / 2;
        at[v] = planes_[v][face.first_v] + (planes_[v][face.last_v] - planes_[v][face.first_v]) / 2;
        mesh_.positions_xyz.insert(mesh_.positions_xyz.end(), at.begin(), at.end());
        return vertices_++;
    }

    void triangle(const Rectangle& face, int32_t a, int32_t b, int32_t c) {
        mesh_.triangles.insert(mesh_.triangles.end(), {a, face.upper ? b : c, face.upper ? c : b});
    }

    const uint8_t* occupied_;
    Triple blocks_, cell_step_, corner_step_;
    std::array<const int32_t*, 3> planes_;
    RankedSet corners_;
    SurfaceMesh& mesh_;
    std::vector<uint8_t> mask_;
    std::vector<Rectangle> rectangles_;
    std::vector<int32_t> border_;
    std::unordered_map<int64_t, int32_t> own_vertices_;
    int32_t vertices_ = 0;
};

}  // namespace

void block_surface(const uint8_t* occupied, Shape3 blocks, BlockPlanes planes, bool merged, SurfaceMesh& mesh) {
    Surface(occupied, blocks, planes, mesh).make(merged);
}

}  // namespace volprep
