#include <omp.h>

#include "bind.hpp"

namespace volprep::bind {

void threads(nb::module_& module) {
    module.def(
        "max_threads", []() { return omp_get_max_threads(); },
        "Number of threads that a kernel uses when it is asked for 0.");
}

}  // namespace volprep::bind
