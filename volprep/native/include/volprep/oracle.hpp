// The oracle: ray integrals of a trilinear field, or one of labels, and a piecewise linear transfer function, in
// float64, with a bound.
//
// For each pixel, light I = integral of c tau exp(-integral of tau) along its ray, and opacity 1 - exp(-integral of
// tau). The ray is cut at every plane of voxel centres and wherever the field crosses a control point; on a piece the
// field is a cubic, the optical depth an exact quartic, and the remaining integral is computed by a Gauss rule with a
// proven bound (src/oracle_beam.cpp). Splitting rays this way was described by Weiss and Westermann, "Differentiable
// Direct Volume Rendering and Ray Splitting", EuroVis 2021; the quadrature and its bound are our own derivation.
//
// The bound covers: quadrature; light behind the place where the ray was stopped; and rounding, to first order, with a
// ray that starts at the float64 origin and direction of its pixel. It is larger than the tolerance only where float64
// is too coarse for the question: a tolerance below about 1e-10, a ray inside a plateau that lies exactly on a jump of
// the transfer function, one within a face between two labels, or extinctions above 1e6 per mm.
//
// Of a field that is constant in each voxel, the ray is cut at the faces of voxels, and each piece is exact. Where it
// is lit, c is multiplied by the absolute cosine of ray and normal (src/oracle_lit.cpp).
#pragma once

#include <cstdint>

#include "volprep/gradient.hpp"
#include "volprep/light/stored.hpp"
#include "volprep/oracle/planes.hpp"
#include "volprep/shape.hpp"

namespace volprep {

struct OracleTransfer {
    int64_t count;
    const double* values;              // [count], physical, ascending; equal neighbours make a jump
    const double* colours;             // [count, 3], linear RGB, not negative
    const double* extinctions_per_mm;  // [count], not negative; above 1e9 (and infinite) counts as 1e9
};

// Normals of lit voxels: `vectors`, or directions of gradients if it is null, for labels of the extinction; or, if
// `slope_scale` is not 0, slopes as a shader takes them by forward or central differences of stored values, times
// `slope_scale`. Along axes that are `halved`, central differences use values half a voxel to each side, as on a coarse
// level.
struct OracleNormals {
    GradientKernel kernel;
    const float* vectors;  // [z, y, x, (x, y, z)], as long as they are
    double slope_scale = 0.0;
    bool halved[3] = {false, false, false};  // x, y, z
};

struct OracleVolume {
    Shape3 shape;
    double slope;  // physical = slope * stored + intercept
    double intercept;
    double spacing_mm_xyz[3];
    double extent_mm_xyz[3];       // the box; may be smaller than spacing * voxels
    bool nearest;                  // the field is constant in each voxel, as labels are, not trilinear
    const OracleNormals* normals;  // none where nothing is lit
    oracle::Planes cut{};          // the volume ends at these
};

struct OracleView {
    int64_t height;
    int64_t width;
    const double* box_from_clip;  // [4, 4], clip coordinates to box space, columns are vectors
};

struct OraclePicture {
    OracleView view;
    double* rgba;   // [height, width, 4], premultiplied linear
    double* bound;  // [height, width], of each of the four channels
};

// Voxels must be finite. threads = 0: as many as OpenMP gives. The result does not depend on it.
// Voxel: uint8_t, int16_t, uint16_t, float.
template <typename Voxel>
void render_oracle(const Voxel* voxels, const OracleVolume& volume, const OracleTransfer& transfer, double tolerance,
                   const OraclePicture& picture, int threads) noexcept;

// One value for each ray of a trilinear field, exact but for rounding, with a bound.

struct OracleProjection {
    OracleView view;
    double* value;           // [height, width], physical; NaN where the ray misses the box
    double* bound;           // [height, width], of the value; 0 where the ray misses the box
    double* t_mm = nullptr;  // [height, width], of a maximum: its distance from the near plane
    double tie = 0.0;  // values that differ by at most this are equal for t_mm, which is that of the first of them
};

// For each pixel the greatest physical value along the part of its ray that lies in the box (src/oracle_maximum.cpp).
// Of `volume`, `nearest` and `normals` must not be set. The bound covers rounding, with a ray that starts at the
// float64 origin and direction of its pixel; whether a ray that touches the box in one point misses it is decided in
// float64. Voxels and threads as in render_oracle.
template <typename Voxel>
void render_maximum(const Voxel* voxels, const OracleVolume& volume, const OracleProjection& maximum,
                    int threads) noexcept;

// For each pixel the integral of the physical value over that part, divided by its length (src/oracle_average.cpp).
template <typename Voxel>
void render_average(const Voxel* voxels, const OracleVolume& volume, const OracleProjection& average,
                    int threads) noexcept;

// Where each ray first meets an isosurface of a trilinear field: the first root of the cubics of its cells.

struct OracleSurface {
    OracleView view;
    double isovalue;  // physical
    bool solid;       // a ray that begins at the isovalue or above meets the surface where it enters the box
    double* t_mm;     // [height, width], from the near plane; NaN where the ray meets no surface
    double*
        error_mm;    // [height, width], how far rounding may move it; infinite where it may decide whether there is one
    double* value;   // [height, width], physical, there; NaN where the ray meets no surface
    double* normal;  // [height, width, (x, y, z)], interpolated there; 0 where nothing is lit
    double* normal_mm;                 // [height, width], how much the normal changes per millimetre
    const double* light_mm = nullptr;  // place of a light whose shadows are asked for, or none
    double offset_mm = 0.0;            // matter nearer to a hit than this casts no shadow on it
    double* reaching = nullptr;        // [height, width], 1 where the light reaches the hit, 0 in shadow
};

// For each pixel the first place along the part of its ray in the box where the field goes from below `isovalue` to it
// or above, or back (src/oracle_surface.cpp). Of `volume`, `nearest` must not be set. Voxels and threads as in
// render_oracle.
template <typename Voxel>
void render_surface(const Voxel* voxels, const OracleVolume& volume, const OracleSurface& surface,
                    int threads) noexcept;

// The oracle for several fields, each on a grid and with a transfer function of its own, in one picture: extinctions
// add, and each medium gives its light. I = integral of sum(c_i tau_i) exp(-integral of sum(tau_i)). Outside of its box
// a field is empty.
//
// As for one field (oracle.hpp), the ray is cut at every plane of voxel centres of any field, where it enters and
// leaves their boxes, and wherever any field crosses a control point of its function; on a piece the sum of extinctions
// is a cubic, the optical depth an exact quartic, and the light is integrated by a Gauss rule with a proven bound
// (src/oracle_sum.cpp). Where one medium alone is met, it is what render_oracle finds there. The bound covers the same.
// A medium with normals is lit as alone.

inline constexpr int64_t kMostMedia = 16;

template <typename Voxel>
struct OracleMedium {
    const Voxel* voxels;
    OracleVolume volume;
    const double* own_from_box;  // [3, 4], from the box of the camera to that of the volume; not singular
    OracleTransfer transfer;
};

// count: 1 to kMostMedia. Voxels must be finite. threads = 0: as many as OpenMP gives. The result does not depend on
// it, nor on the order of the media but for rounding. Voxel: uint8_t, int16_t, uint16_t, float.
template <typename Voxel>
void render_oracle_sum(const OracleMedium<Voxel>* media, int64_t count, double tolerance, const OraclePicture& picture,
                       int threads) noexcept;

// Pictures whose light has no proven bound: rays are refined until two halvings of their steps agree.

// A light at a place in box space. Both sides of a surface are lit. With N the normal towards the viewer, L the
// direction to the light, and c the colour of the medium: min(c (ambient + diffuse max(N . L, 0)) + specular
// s^shininess, 1), where s is max(R . V, 0) with L mirrored at N (Phong), or N . H halfway between L and V (Blinn and
// Phong), and 0 where N . L is not above 0. With shadows the diffuse and the specular part are multiplied by T, the
// transmittance between the place and the light; what has no normal is multiplied by ambient + (1 - ambient) T.
struct OracleLight {
    double place_mm[3];
    double ambient;
    double diffuse;
    double specular;
    double shininess;
    bool halfway;
    bool shadows;
};

struct OracleRefined {
    OracleView view;
    double tolerance;          // two halvings in a row change no channel by more
    double low;                // values that count as the intensities 0 and 1 of maximum intensity difference
    double high;               // accumulation; equal where the picture is of emission and absorption
    const OracleLight* light;  // none: from where the viewer is, as in render_oracle
    double* rgba;              // [height, width, 4], premultiplied linear
    double* bound;             // [height, width], the larger of the last two changes: an estimate, no bound
    const light::StoredLight* baked = nullptr;  // multiplies the colours of the medium; none where nothing does
};

// For each pixel emission and absorption, or the limit of maximum intensity difference accumulation with fine steps
// (src/oracle_refined.cpp). `volume.nearest` must not be set; without `volume.normals` nothing is lit. Voxels and
// threads as in render_oracle.
template <typename Voxel>
void render_refined(const Voxel* voxels, const OracleVolume& volume, const OracleTransfer& transfer,
                    const OracleRefined& picture, int threads) noexcept;

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
