// A cell in which several fields show something: the cuts of all of them together make pieces on which every extinction
// and every colour is linear in its field.
#include "volprep/oracle/sum.hpp"

namespace volprep::oracle {

namespace {

// Lists where the field of a path goes from one segment of its transfer function to another.
void list_parts(std::vector<SumPart>& parts, const SumPath& path, Cuts& cuts) {
    parts.clear();
    find_cuts(cuts, path.path, *path.transfer);
    visit_media(path.path, cuts, [&](const Cuts::Medium& medium, double from, double to, bool ascending) {
        if (to > from || parts.empty()) parts.push_back({to, medium, ascending});
        return true;
    });
    parts.back().end = 1.0;
}

// The medium of a path between two places. A jump counts as what the ray is about to enter, as for one field.
SumMedium medium_of(const SumPath& path, const SumPart& part, double from, double to) {
    SumMedium medium{part.medium.segment, nullptr, path.path.value.between(from, to), path.path.base,
                     path.path.value_error};
    if (part.medium.jump != nullptr) {
        const Knot& jump = *part.medium.jump;
        medium.segment = part.ascending ? &jump.above : &jump.below;
        medium.front = part.ascending ? &jump.below : &jump.above;
    }
    return medium;
}

}  // namespace

void gather_sum_cell(Beam& beam, const std::vector<SumPath>& paths, const RayLimits& limits, SumCuts& cuts) noexcept {
    const std::size_t count = paths.size();
    cuts.parts.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        list_parts(cuts.parts[i].list, paths[i], cuts.cuts);
        cuts.parts[i].now = 0;
    }
    double from = -1.0;
    while (from < 1.0 && !beam.stopped) {
        double to = 1.0;
        for (const SumCuts::Parts& parts : cuts.parts) to = std::min(to, parts.list[parts.now].end);
        if (to > from) {
            cuts.media.clear();
            for (std::size_t i = 0; i < count; ++i) {
                const SumCuts::Parts& parts = cuts.parts[i];
                const SumMedium medium = medium_of(paths[i], parts.list[parts.now], from, to);
                if (!medium.segment->empty || medium.front != nullptr) cuts.media.push_back(medium);
            }
            gather_sum(beam, cuts.media, paths[0].path.length_mm * 0.5 * (to - from), limits);
        }
        for (SumCuts::Parts& parts : cuts.parts) {
            if (parts.list[parts.now].end <= to && parts.now + 1 < parts.list.size()) ++parts.now;
        }
        from = to;
    }
}

}  // namespace volprep::oracle
