// Several transfer functions along the part of a ray in one cell: their cuts together make pieces on which each is
// linear in its value.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "volprep/oracle/beam.hpp"
#include "volprep/oracle/cell.hpp"

namespace volprep::oracle {

// A part of a path on one segment of its transfer function; it ends at `end`.
struct Part {
    double end;
    Cuts::Medium medium;
    bool ascending;
};

// Working memory. Medium is what one path is on a piece: segment, front, value and more.
template <typename Medium>
struct PartCuts {
    struct Parts {
        std::vector<Part> list;
        std::size_t now;
    };
    Cuts cuts;
    std::vector<Parts> parts;  // of each path
    std::vector<Medium> media;
};

// Lists where the value of a path goes from one segment of a transfer function to another.
inline void list_parts(std::vector<Part>& parts, const CellPath& path, const Transfer& transfer, Cuts& cuts) {
    parts.clear();
    find_cuts(cuts, path, transfer);
    visit_media(path, cuts, [&](const Cuts::Medium& medium, double from, double to, bool ascending) {
        if (to > from || parts.empty()) parts.push_back({to, medium, ascending});
        return true;
    });
    parts.back().end = 1.0;
}

// Sets the segment of a medium to that of a part. A jump counts as what the ray is about to enter, as for one field.
template <typename Medium>
void enter(Medium& medium, const Part& part) {
    medium.segment = part.medium.segment;
    if (part.medium.jump == nullptr) return;
    const Knot& jump = *part.medium.jump;
    medium.segment = part.ascending ? &jump.above : &jump.below;
    medium.front = part.ascending ? &jump.below : &jump.above;
}

// Gathers all pieces of a cell. path(i) and transfer(i) belong to `count` paths, medium(i, from, to) is a medium
// without its segment, and gather(media, share) takes a piece that is `share` of [-1, 1].
template <typename Medium, typename Path, typename Function, typename Make, typename Gather>
void gather_parts(Beam& beam, std::size_t count, PartCuts<Medium>& cuts, const Path& path, const Function& transfer,
                  const Make& medium, const Gather& gather) {
    if (cuts.parts.size() < count) cuts.parts.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        list_parts(cuts.parts[i].list, path(i), transfer(i), cuts.cuts);
        cuts.parts[i].now = 0;
    }
    double from = -1.0;
    while (from < 1.0 && !beam.stopped) {
        double to = 1.0;
        for (std::size_t i = 0; i < count; ++i) to = std::min(to, cuts.parts[i].list[cuts.parts[i].now].end);
        if (to > from) {
            cuts.media.clear();
            for (std::size_t i = 0; i < count; ++i) {
                Medium made = medium(i, from, to);
                enter(made, cuts.parts[i].list[cuts.parts[i].now]);
                if (!made.segment->empty || made.front != nullptr) cuts.media.push_back(made);
            }
            gather(cuts.media, 0.5 * (to - from));
        }
        for (std::size_t i = 0; i < count; ++i) {
            auto& parts = cuts.parts[i];
            if (parts.list[parts.now].end <= to && parts.now + 1 < parts.list.size()) ++parts.now;
        }
        from = to;
    }
}

}  // namespace volprep::oracle
