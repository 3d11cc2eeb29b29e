// A cell in which several looks meet: the cuts of all of them together make pieces on which every extinction and every
// colour is linear in the value.
#include "volprep/oracle/mixed.hpp"

namespace volprep::oracle {

void gather_mixed_cell(Beam& beam, const CellPath& path, const std::vector<MixedPath>& looks, double weight_error,
                       const RayLimits& limits, MixedCuts& cuts) noexcept {
    gather_parts(
        beam, looks.size(), cuts, [&](std::size_t) -> const CellPath& { return path; },
        [&](std::size_t i) -> const Transfer& { return *looks[i].transfer; },
        [&](std::size_t i, double from, double to) {
            return MixedMedium{nullptr,     nullptr,          path.value.between(from, to),
                               path.base,   path.value_error, looks[i].weight.between(from, to),
                               weight_error};
        },
        [&](const std::vector<MixedMedium>& media, double share) {
            gather_mixed(beam, media, path.length_mm * share, limits);
        });
}

}  // namespace volprep::oracle
