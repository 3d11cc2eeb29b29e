#include <omp.h>

#include "bind.hpp"
#include "checks.hpp"
#include "volprep/bandwidth.hpp"

namespace volprep::bind::machine {
namespace {

using Words = nb::ndarray<const uint64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Bytes = nb::ndarray<const uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using MutableBytes = nb::ndarray<uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

}  // namespace

const Definitions definitions([](nb::module_& module) {
    module.def("max_threads", []() { return omp_get_max_threads(); });
    module.def(
        "memory_read",
        [](const Words& src, int threads) {
            require_threads(threads);
            const nb::gil_scoped_release released;
            return volprep::memory_read(src.data(), static_cast<int64_t>(src.size()), threads);
        },
        "src"_array, "threads"_a = 0);
    module.def(
        "memory_copy",
        [](const Bytes& src, const MutableBytes& dst, int threads) {
            require_threads(threads);
            require(src.size() == dst.size(),
                    "dst has " + std::to_string(dst.size()) + " bytes, expected " + std::to_string(src.size()));
            const nb::gil_scoped_release released;
            volprep::memory_copy(src.data(), static_cast<int64_t>(src.size()), dst.data(), threads);
        },
        "src"_array, "dst"_array, "threads"_a = 0);
});

}  // namespace volprep::bind::machine
