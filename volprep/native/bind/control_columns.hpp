// Control points of transfer functions as rows of numbers.
#pragma once

#include <vector>

#include "oracle_source.hpp"

namespace volprep::bind {

using PointRows = nb::ndarray<const double, nb::shape<-1, 5>, nb::c_contig, nb::device::cpu>;

// The columns of control points, each by itself.
struct Columns {
    std::vector<double> values;
    std::vector<double> colours;
    std::vector<double> extinctions_per_mm;

    explicit Columns(const PointRows& points) {
        for (std::size_t i = 0; i < points.shape(0); ++i) {
            values.push_back(points(i, 0));
            for (std::size_t channel = 1; channel < 4; ++channel) colours.push_back(points(i, channel));
            extinctions_per_mm.push_back(points(i, 4));
        }
    }
    OracleTransfer transfer() const {
        return {static_cast<int64_t>(values.size()), values.data(), colours.data(), extinctions_per_mm.data()};
    }
};

}  // namespace volprep::bind
