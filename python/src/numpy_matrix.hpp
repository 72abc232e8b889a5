// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <pybind11/numpy.h>

#include "settings.hpp"

namespace loopbit::python {

/// An argument that is a matrix.
using MatrixArgument =
    pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// Throws ValueError for another shape; the message calls the argument `name`.
template <int kSize>
cv::Matx<double, kSize, kSize> to_matx(const MatrixArgument& array, const char* name) {
  if (array.ndim() != 2 || array.shape(0) != kSize || array.shape(1) != kSize) {
    throw pybind11::value_error(fmt::format("{} has shape {}, but must be ({}, {}).", name,
                                            literal(array.attr("shape")), kSize, kSize));
  }
  return cv::Matx<double, kSize, kSize>(array.data());
}

/// A copy.
template <int kSize>
pybind11::array_t<double> square_of(const cv::Matx<double, kSize, kSize>& matrix) {
  pybind11::array_t<double> array({kSize, kSize});
  std::copy(std::begin(matrix.val), std::end(matrix.val), array.mutable_data());
  return array;
}

}  // namespace loopbit::python
