// Light gathered along one ray, front to back, with a bound on its own error.
//
// With A = 1 - exp(-T) for the optical depth T so far, the light is the integral of c dA. Two things can be wrong in
// it:
//
// - quadrature: what a piece's Gauss rule misses, weighted with the transmittance in front of it;
// - arithmetic: T is off by at most E (`depth_error`), so that the transmittance exp(-T) is off by exp(-T)(e^E - 1).
//   By parts, an error of A changes the light by (error at the end) * c(end) - integral of (error) dc. So an error of
//   the transmittance costs only where the colour changes. Without this step a bound on a steep opaque wall would be
//   useless: its optical depth is very uncertain, the colour behind its first micrometre is not.
#pragma once

#include "volprep/oracle/cubic.hpp"
#include "volprep/oracle/transfer.hpp"

namespace volprep::oracle {

struct Extinction;
struct Passage;
struct Piece;
struct RayLimits;

struct Beam {
    double colour[3] = {0.0, 0.0, 0.0};  // premultiplied
    double transmittance = 1.0;
    double depth_error = 0.0;
    double colour_error = 0.0;
    double last_colour[3] = {0.0, 0.0, 0.0};  // of the medium that was passed last
    bool stopped = false;                     // the rest is hidden: it goes into the bound

    double transmittance_error() const noexcept;
    // Adds the light of a piece, and takes what the piece absorbs.
    void pass(const Piece& piece, const Extinction& extinction, const RayLimits& limits,
              const Passage& passage) noexcept;
    // The bound on every channel and on alpha. `colour_max` is the largest colour component there is, at least 1.
    double bound(double colour_max) const noexcept;
};

// Constants of one whole ray.
struct RayLimits {
    double tolerance;
    double length_mm;          // of the part inside the box
    double position_error_mm;  // how far rounding may move a point
    double colour_max;
};

// Vectors along the part of a ray in a cell, [-1, 1]: the trilinear interpolation of the normals of eight voxels.
struct CellNormals {
    Cubic axes[3];
    double direction[3];  // of the ray
    double error;         // how far rounding may move a component
};

// A part of a ray in one cell and on one segment of the transfer function: value(y) + base, y in [-1, 1].
struct Piece {
    const Segment* segment;
    Cubic value;
    double base;
    double length_mm;
    double value_error;                    // how far rounding may move the value
    const CellNormals* normals = nullptr;  // none where nothing is lit
    double from = -1.0;                    // where on the cell's part of the ray it begins and ends
    double to = 1.0;

    Piece part(double begin, double end) const noexcept {
        Piece result = *this;
        result.value = value.between(begin, end);
        result.length_mm = length_mm * 0.5 * (end - begin);
        result.from = 0.5 * (from + to) + 0.5 * (to - from) * begin;
        result.to = 0.5 * (from + to) + 0.5 * (to - from) * end;
        return result;
    }
    // The colour of the medium at y, without light.
    double colour(int channel, double y) const noexcept {
        return segment->colour[channel] + segment->colour_slope[channel] * ((base - segment->origin) + value.at(y));
    }
};

// The light of a piece, as if nothing were in front, up to `error`, and the colour at its ends,
// which varies on it by `variation` at most, up and down together.
struct Passage {
    double first[3];
    double last[3];
    double light[3];
    double variation;
    double error;
    double through;  // the part of the light behind it that it lets through
};

// Adds the piece to the beam. Sets `stopped` when less light comes through than a quarter of the tolerance.
void gather(Beam& beam, const Piece& piece, const RayLimits& limits) noexcept;

// The same for a piece with normals, lit from where the viewer is (oracle_lit.cpp).
void gather_lit(Beam& beam, const Piece& piece, const RayLimits& limits) noexcept;

}  // namespace volprep::oracle
