// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "numpy_image.hpp"

#include <cmath>
#include <string>

#include <fmt/format.h>

#include "loopbit/gray_image.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

std::string text(const py::handle& object) { return py::str(object); }

int depth_of(const py::array& array, const char* name) {
  const py::dtype dtype = array.dtype();
  if (dtype.kind() == 'u' && dtype.itemsize() == 1) return CV_8U;
  if (dtype.kind() == 'u' && dtype.itemsize() == 2 && dtype.byteorder() == '=') return CV_16U;
  throw py::type_error(
      fmt::format("{} has dtype {}, but must be uint8 or uint16.", name, text(dtype)));
}

int channels_of(const py::array& array, const char* name) {
  const int channels = array.ndim() == 3 ? static_cast<int>(array.shape(2)) : 1;
  const bool has_shape =
      array.ndim() == 2 || (array.ndim() == 3 && (channels == 3 || channels == 4));
  constexpr py::ssize_t kMaxSide_px = 1 << 20;
  if (has_shape && array.shape(0) <= kMaxSide_px && array.shape(1) <= kMaxSide_px) {
    return array.ndim() == 3 ? channels : 1;
  }
  throw py::value_error(
      fmt::format("{} has shape {}, but must be (h, w), (h, w, 3) or (h, w, 4), at most {} a side.",
                  name, text(array.attr("shape")), kMaxSide_px));
}

/// Whether each row is contiguous and rows do not overlap, as cv::Mat requires.
bool has_whole_rows(const py::array& array) {
  const py::ssize_t pixel =
      array.ndim() == 3 ? array.shape(2) * array.itemsize() : array.itemsize();
  const bool packed =
      array.strides(1) == pixel && (array.ndim() == 2 || array.strides(2) == array.itemsize());
  return packed && array.strides(0) >= pixel * array.shape(1) &&
         array.strides(0) % array.itemsize() == 0;
}

}  // namespace

cv::Mat to_image(ImageArgument& argument, const char* name) {
  if (!py::isinstance<py::array>(argument)) {
    throw py::type_error(fmt::format("{} is a {}, but must be a numpy.ndarray of uint8 or uint16.",
                                     name, text(py::type::of(argument).attr("__name__"))));
  }
  auto array = py::reinterpret_borrow<py::array>(argument);
  const int depth = depth_of(array, name);
  const int channels = channels_of(array, name);
  const auto height = static_cast<int>(array.shape(0));
  const auto width = static_cast<int>(array.shape(1));
  if (height < kMinImageSidePx || width < kMinImageSidePx) {
    throw py::value_error(fmt::format("{} has {} x {} pixels, but must have at least {} x {}.",
                                      name, width, height, kMinImageSidePx, kMinImageSidePx));
  }
  if (!has_whole_rows(array)) {
    array = py::module_::import("numpy").attr("ascontiguousarray")(array);
    argument = py::reinterpret_borrow<ImageArgument>(array);
  }
  // cv::Mat has no constructor for read-only memory; nothing here writes to it.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast)
  return {height, width, CV_MAKETYPE(depth, channels), const_cast<void*>(array.data()),
          static_cast<std::size_t>(array.strides(0))};
}

py::object to_array(const cv::Mat& image) {
  if (image.empty()) return py::none();
  const char* type = image.depth() == CV_8U    ? "uint8"
                     : image.depth() == CV_16U ? "uint16"
                                               : "float32";
  const auto item = static_cast<py::ssize_t>(image.elemSize1());
  std::vector<py::ssize_t> shape{image.rows, image.cols};
  std::vector<py::ssize_t> strides{static_cast<py::ssize_t>(image.step[0]),
                                   static_cast<py::ssize_t>(image.elemSize())};
  if (image.channels() > 1) {
    shape.push_back(image.channels());
    strides.push_back(item);
  }
  const py::capsule owner(new cv::Mat(image),
                          [](void* pointer) { delete static_cast<cv::Mat*>(pointer); });
  return py::array(py::dtype(type), shape, strides, image.data, owner);
}

py::array_t<double> to_array(const std::vector<std::optional<cv::Vec3d>>& positions_m) {
  py::array_t<double> rows({static_cast<py::ssize_t>(positions_m.size()), py::ssize_t{3}});
  double* next = rows.mutable_data();
  for (const auto& position_m : positions_m) {
    for (int axis = 0; axis < 3; ++axis) *next++ = position_m ? (*position_m)[axis] : std::nan("");
  }
  return rows;
}

}  // namespace loopbit::python
