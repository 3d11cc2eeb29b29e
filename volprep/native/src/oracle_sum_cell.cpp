// A cell in which several fields show something: the cuts of all of them together make pieces on which every extinction
// and every colour is linear in its field.
#include "volprep/oracle/sum.hpp"

namespace volprep::oracle {

void gather_sum_cell(Beam& beam, const std::vector<SumPath>& paths, const RayLimits& limits, SumCuts& cuts) noexcept {
    gather_parts(
        beam, paths.size(), cuts, [&](std::size_t i) -> const CellPath& { return paths[i].path; },
        [&](std::size_t i) -> const Transfer& { return *paths[i].transfer; },
        [&](std::size_t i, double from, double to) {
            const CellPath& path = paths[i].path;
            return SumMedium{nullptr, nullptr, path.value.between(from, to), path.base, path.value_error, path.normals,
                             from,    to};
        },
        [&](const std::vector<SumMedium>& media, double share) {
            gather_sum(beam, media, paths[0].path.length_mm * share, limits);
        });
}

}  // namespace volprep::oracle
