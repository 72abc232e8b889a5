// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include <opencv2/core.hpp>
#include <pybind11/numpy.h>

namespace loopbit::python {

/// An argument that must be an image; to_image() raises the error if it is not.
class ImageArgument : public pybind11::object {
 public:
  static bool accept(PyObject* object) { return object != nullptr; }
  PYBIND11_OBJECT_DEFAULT(ImageArgument, pybind11::object, accept)
};

/// The pixels of a numpy array of shape (h, w), (h, w, 3) or (h, w, 4), uint8 or uint16, as BGR or
/// BGRA. If each row is contiguous they are shared, not copied, and valid as long as the array that
/// `argument` then holds. Throws TypeError for another type and ValueError for another shape; the
/// messages call the argument `name`.
cv::Mat to_image(ImageArgument& argument, const char* name);

/// The same memory as an array, without a copy; it keeps `image` alive. None if empty.
pybind11::object to_array(const cv::Mat& image);

/// Shape (n, 3), nan for missing values.
pybind11::array_t<double> to_array(const std::vector<std::optional<cv::Vec3d>>& positions_m);

/// An array over memory of `owner`, without a copy.
template <typename Value>
pybind11::array view_of(const Value* values, std::vector<pybind11::ssize_t> shape,
                        pybind11::handle owner, bool writeable = false) {
  pybind11::array view(pybind11::dtype::of<Value>(), std::move(shape), values, owner);
  if (!writeable) view.attr("setflags")(pybind11::arg("write") = false);
  return view;
}

/// An array that owns `values`, without a copy.
template <typename Value>
pybind11::array take(std::vector<Value> values) {
  auto* owned = new std::vector<Value>(std::move(values));
  const pybind11::capsule owner(
      owned, [](void* pointer) { delete static_cast<std::vector<Value>*>(pointer); });
  const auto size = static_cast<pybind11::ssize_t>(owned->size());
  return view_of(owned->data(), {size}, owner, true);
}

}  // namespace loopbit::python

namespace pybind11::detail {

template <>
struct handle_type_name<loopbit::python::ImageArgument> {
  static constexpr auto name = const_name("numpy.ndarray");  // NOLINT: pybind11's name for it
};

}  // namespace pybind11::detail
