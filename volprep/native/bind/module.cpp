// The module volprep.kernels._native: one line for each binding file.
#include "bind.hpp"

NB_MODULE(_native, module) {
    module.doc() = "Native kernels of volprep. Callers allocate; sizes are checked; the GIL is released.";
    volprep::bind::bandwidth(module);
    volprep::bind::block_minmax(module);
    volprep::bind::block_surface(module);
    volprep::bind::box_reduce(module);
    volprep::bind::column_light(module);
    volprep::bind::distances(module);
    volprep::bind::extrema_reduce(module);
    volprep::bind::feature_reduce(module);
    volprep::bind::fit_level(module);
    volprep::bind::fit_values(module);
    volprep::bind::joint_histogram(module);
    volprep::bind::label_coverage(module);
    volprep::bind::laplacian_histogram(module);
    volprep::bind::light_fit(module);
    volprep::bind::light_samples(module);
    volprep::bind::linear_reduce(module);
    volprep::bind::lit_level(module);
    volprep::bind::median_reduce(module);
    volprep::bind::mixed_light(module);
    volprep::bind::mode_reduce(module);
    volprep::bind::nearest_reduce(module);
    volprep::bind::normals(module);
    volprep::bind::oracle(module);
    volprep::bind::oracle_labels(module);
    volprep::bind::oracle_projection(module);
    volprep::bind::oracle_refined(module);
    volprep::bind::oracle_sum(module);
    volprep::bind::oracle_surface(module);
    volprep::bind::pack_tiles(module);
    volprep::bind::patch_samples(module);
    volprep::bind::path_tracer(module);
    volprep::bind::preintegrate(module);
    volprep::bind::quantize(module);
    volprep::bind::ray_light(module);
    volprep::bind::ray_samples(module);
    volprep::bind::refine_level(module);
    volprep::bind::rgba_reduce(module);
    volprep::bind::slice_ranges(module);
    volprep::bind::straight_light(module);
    volprep::bind::threads(module);
    volprep::bind::value_range(module);
}
