// The module volprep.kernels._native. Its signatures and documentation are in volprep/kernels/_native.pyi.
#include "bind.hpp"

NB_MODULE(_native, module) { volprep::bind::Definitions::add_all(module); }
