#include <omp.h>

#include "bind.hpp"

namespace volprep::bind::machine {

const Definitions definitions([](nb::module_& module) {
    module.def("max_threads", []() { return omp_get_max_threads(); });
});

}  // namespace volprep::bind::machine
