// The module volprep._native: one line for each binding file.
#include "bind.hpp"

NB_MODULE(_native, module) {
    module.doc() = "Native kernels of volprep. Callers allocate; sizes are checked; the GIL is released.";
    volprep::bind::threads(module);
}
