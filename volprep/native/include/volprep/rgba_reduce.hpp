// A coarser level of a volume that is classified already: what light does is averaged, not colours and opacities.
// After the idea of Kraus & Bürger (Interpolating and downsampling RGBA volume data, VMV 2008); the formula is ours.
#pragma once

#include "volprep/shape.hpp"

namespace volprep {

// Distances of voxel centres, in millimetres.
struct Spacing3 {
    double z;
    double y;
    double x;
};

// src is [z, y, x, 4]: linear colour, not premultiplied, and opacity over `reference_mm`; dst has the same meaning,
// with the shape reduced_shape(shape, factors). A voxel that is h long along an axis has transmittance (1 − a)^(h /
// reference). For each axis the light that crosses the block in each of its columns is integrated, and averaged over
// the columns and over both directions: transmittance T and premultiplied colour C. An axis then wants the opacity 1 −
// T^(reference / length of the block) and the colour C / (1 − T); dst is the mean over the axes, colours weighted with
// their opacities. Blocks without any opacity keep the mean of their colours. A block that hangs over the edge behaves
// as if the edge voxel were repeated. uint8_t: 255 is 1, rounded half to even. In double. factors >= 1; threads >= 1.
// T: uint8_t, float.
template <typename T>
void rgba_reduce(const T* src, Shape3 shape, Shape3 factors, const Spacing3& spacing_mm, double reference_mm, T* dst,
                 int threads) noexcept;

}  // namespace volprep
