// The oracle for a scan with labels. Every label has a look: a transfer function over the scan's values, or none.
//
// The weight of a label at a point is the sum of the trilinear weights of the voxels, of the eight around it, that have
// the label. *Mixed*: extinction and emission are sums over labels of weight times what the look has at the scan's
// value. *Crisp*: the look of the label with the greatest weight, at a tie of the smallest label.
//
// As for one field (oracle.hpp) the ray is cut at every plane of voxel centres and where the value crosses a control
// point of a look that is present. Mixed, a piece then has an extinction of degree 6, an exact optical depth of degree
// 7, and a Gauss rule with a proven bound for its light (src/oracle_mixed.cpp). Crisp, the cell is also cut at the
// roots of differences of weights, which are cubics. A cell with one look is what render_oracle finds there.
#pragma once

#include "volprep/oracle.hpp"
#include "volprep/oracle_refined.hpp"

namespace volprep {

inline constexpr int64_t kMostLooks = 4096;
inline constexpr int32_t kHidden = -1;

struct OracleLabels {
    const uint16_t* labels;  // [z, y, x]
    const int32_t* looks;    // [label_count], look of each label, or kHidden
    int64_t label_count;
    const OracleTransfer* transfers;  // of each look
    int64_t look_count;
    bool crisp;
};

// Voxels must be finite, labels below `label_count`. threads = 0: as many as OpenMP gives. The result does not depend
// on it. Voxel: uint8_t, int16_t, uint16_t, float.
template <typename Voxel>
void render_oracle_labels(const Voxel* voxels, const OracleVolume& volume, const OracleLabels& labels, double tolerance,
                          const OraclePicture& picture, int threads) noexcept;

// Light of a scan with labels. Normals are those of the values (OracleVolume.normals, slopes as a shader takes them),
// and in cells whose voxels differ in visible extinction, at the value of the place, also the gradient of its
// logarithm: of the field in which voxels have the weights of quadratic B-splines, with the value held. The
// transmittance of a shadow is exact up to rounding (oracle/labelled_medium.hpp).
struct OracleLabelsLight {
    double border_scale;        // slope of normals for a gradient of 1 per millimetre
    const OracleLight* placed;  // none: from where the viewer is
};

// As render_oracle_labels, lit. Where several looks meet, or with a light at a place, the bound is an estimate.
template <typename Voxel>
void render_oracle_labels_lit(const Voxel* voxels, const OracleVolume& volume, const OracleLabels& labels,
                              const OracleLabelsLight& light, double tolerance, const OraclePicture& picture,
                              int threads) noexcept;

}  // namespace volprep
