// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cstdint>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "loopbit/binary_content.hpp"
#include "loopbit/error.hpp"
#include "loopbit/gray_image.hpp"

#include "bindings.hpp"
#include "numpy_image.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

using Rows = py::array_t<std::uint64_t, py::array::c_style>;
using Bits = py::array_t<bool, py::array::c_style | py::array::forcecast>;
using Contents = std::vector<BinaryContent>;

BinaryContent content_of_rows(const Rows& rows) {
  if (rows.ndim() != 1 || rows.shape(0) != kContentSide) {
    throw py::value_error(fmt::format("rows has shape {}, but must be ({},).",
                                      literal(rows.attr("shape")), kContentSide));
  }
  BinaryContent content;
  std::copy_n(rows.data(), kContentSide, content.rows.begin());
  return content;
}

BinaryContent content_of_bits(const Bits& bits) {
  if (bits.ndim() != 2 || bits.shape(0) != kContentSide || bits.shape(1) != kContentSide) {
    throw py::value_error(fmt::format("bits has shape {}, but must be ({}, {}).",
                                      literal(bits.attr("shape")), kContentSide, kContentSide));
  }
  BinaryContent content;
  for (int y = 0; y < kContentSide; ++y) {
    for (int x = 0; x < kContentSide; ++x) {
      content.rows[static_cast<std::size_t>(y)] |= std::uint64_t{bits.at(y, x)} << x;
    }
  }
  return content;
}

py::array_t<bool> bits_of(const BinaryContent& content) {
  py::array_t<bool> bits({kContentSide, kContentSide});
  for (int y = 0; y < kContentSide; ++y) {
    for (int x = 0; x < kContentSide; ++x) {
      bits.mutable_at(y, x) = (content.rows[static_cast<std::size_t>(y)] >> x & 1U) != 0;
    }
  }
  return bits;
}

/// Row i, column j: similarity(queries[i], places[j], shift_tolerance_columns).
void fill_matrix(const Contents& queries, const Contents& places, int shift_tolerance_columns,
                 double* cells) {
  std::vector<int> counts(places.size());
  std::transform(places.begin(), places.end(), counts.begin(), count);
  std::vector<std::uint16_t> overlaps(places.size());
  for (const BinaryContent& query : queries) {
    const Contents shifted = tolerated_shifts(query, shift_tolerance_columns);
    max_overlaps(shifted, places, overlaps);
    const int query_count = count(query);
    for (std::size_t j = 0; j < places.size(); ++j) {
      // Nothing overlaps an empty content, so dividing by 1 gives its 0.
      *cells++ = static_cast<double>(overlaps[j]) / std::max({query_count, counts[j], 1});
    }
  }
}

void check_tolerance(int shift_tolerance_columns) {
  if (shift_tolerance_columns >= 0 && shift_tolerance_columns < kContentSide) return;
  throw Error(ErrorKind::option,
              fmt::format("shift_tolerance_columns is {}, but must be between 0 and {}.",
                          shift_tolerance_columns, kContentSide - 1));
}

double checked_similarity(const BinaryContent& a, const BinaryContent& b,
                          int shift_tolerance_columns) {
  check_tolerance(shift_tolerance_columns);
  return similarity(a, b, shift_tolerance_columns);
}

py::array_t<double> similarity_matrix(const Contents& queries,
                                      const std::optional<Contents>& places,
                                      int shift_tolerance_columns) {
  check_tolerance(shift_tolerance_columns);
  const Contents& others = places ? *places : queries;
  py::array_t<double> matrix({queries.size(), others.size()});
  double* cells = matrix.mutable_data();
  if (matrix.size() > 0) {
    const WithoutGil release;
    fill_matrix(queries, others, shift_tolerance_columns, cells);
  }
  return matrix;
}

void bind_content_type(py::module_& module) {
  py::class_<BinaryContent>(module, "BinaryContent",
                            "The binary content of an image: 64 x 64 bits in 512 bytes.")
      .def(py::init(&content_of_rows), py::arg("rows"),
           "From 64 words, uint64. Row y is rows[y], column x is its bit x.")
      .def_static("from_bits", &content_of_bits, py::arg("bits"),
                  "From an array of shape (64, 64). True sets a pixel.")
      .def_property_readonly(
          "rows",
          [](const py::object& self) -> Rows {
            const auto& content = self.cast<const BinaryContent&>();
            return view_of(content.rows.data(), {kContentSide}, self);
          },
          "64 words, uint64, read-only and not copied.")
      .def("bits", &bits_of, "The pixels, bool, shape (64, 64), y down, x right.")
      .def(
          "__eq__", [](const BinaryContent& a, const BinaryContent& b) { return a == b; },
          py::is_operator())
      .def("__hash__",
           [](const BinaryContent& self) {
             return py::hash(
                 py::bytes(reinterpret_cast<const char*>(self.rows.data()), sizeof self.rows));
           })
      .def("__repr__",
           [](const BinaryContent& self) {
             const cv::Point2d middle = center(self);
             return fmt::format("BinaryContent(count={}, center=({:.1f}, {:.1f}))", count(self),
                                middle.x, middle.y);
           })
      .def(py::pickle(
          [](const py::object& self) { return py::make_tuple(self.attr("rows")); },
          [](const py::tuple& state) { return content_of_rows(state[0].cast<Rows>()); }));
}

void bind_comparison(py::module_& module) {
  module.def("count", &count, py::arg("content"), "|O|: the number of set pixels, 0 to 4096.");
  module.def(
      "center",
      [](const BinaryContent& content) {
        const cv::Point2d middle = center(content);
        return std::pair(middle.x, middle.y);
      },
      py::arg("content"),
      "M(O): the mean (x, y) of the set pixels, each in [0, 63]; (31.5, 31.5) if none is set.");
  module.def("shift_columns", &shift_columns, py::arg("content"), whole("columns"),
             "The content shifted by columns to the right (left if negative).");
  module.def("similarity", &checked_similarity, py::arg("a"), py::arg("b"),
             whole("shift_tolerance_columns") = 0,
             "xi(a, b) = |a & b| / max(|a|, |b|), in [0, 1]: the maximum over shifts of a by even "
             "numbers of columns up to the tolerance, and by the tolerance itself. Wang et al. "
             "2019, section III-B.");
  module.def("similarity_matrix", &similarity_matrix, py::arg("queries"),
             py::arg("places") = py::none(), whole("shift_tolerance_columns") = 0,
             "similarity() of every query (row) with every place (column), float64. Without "
             "places, the queries are compared with each other.");
}

}  // namespace

void bind_content(py::module_& module) {
  bind_content_type(module);
  const auto default_options =
      py::arg_v("options", BinaryContentOptions{}, "BinaryContentOptions()");
  module.def(
      "saliency_map",
      [](ImageArgument image, const BinaryContentOptions& options) -> py::array_t<float> {
        const cv::Mat pixels = to_image(image, "image");
        cv::Mat1f saliency;
        {
          const WithoutGil release;
          saliency = saliency_map(gray_image(pixels), options);
        }
        return to_array(saliency);
      },
      py::arg("image"), default_options,
      "The spectral residual saliency map, float32, shape (64, 64), not normalised; Hou and Zhang, "
      "CVPR 2007. The image is uint8 or uint16, (h, w), BGR or BGRA, at least 32 x 32.");
  module.def(
      "binary_content",
      [](ImageArgument image, const BinaryContentOptions& options) {
        const cv::Mat pixels = to_image(image, "image");
        const WithoutGil release;
        return binary_content(gray_image(pixels), options);
      },
      py::arg("image"), default_options,
      "Step 1 of the method: sets the pixels whose saliency exceeds gamma times the mean. Accepts "
      "the same images as saliency_map().");
  module.def(
      "_pixels_address",
      [](ImageArgument image) {
        return reinterpret_cast<std::uintptr_t>(to_image(image, "image").data);
      },
      py::arg("image"),
      "The address at which the library reads an image. Within the array if it is not copied.");
  bind_comparison(module);
}

}  // namespace loopbit::python
