// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "numpy_columns.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

template <typename Value>
using Values = py::array_t<Value, py::array::c_style | py::array::forcecast>;

/// `argument` as an array whose dtype is one of numpy's `kinds`; errors call them `words`.
py::array array_of(const ArrayLike& argument, const char* name, std::string_view kinds,
                   const char* words) {
  const auto numpy = py::module_::import("numpy");
  py::array array = numpy.attr("asarray")(argument);
  // Of an empty list, the element type says nothing.
  if (array.size() == 0) return numpy.attr("empty")(array.attr("shape"), "i8");
  if (kinds.find(array.dtype().kind()) == std::string_view::npos) {
    throw py::type_error(fmt::format("{} has dtype {}, but must be {}.", name,
                                     std::string(py::str(array.dtype())), words));
  }
  return array;
}

[[noreturn]] void throw_bad_value(const py::array& array, py::ssize_t index, const char* name,
                                  const char* words) {
  const py::ssize_t row = index / (array.size() / array.shape(0));
  const std::string value = py::str(array.attr("flat")[py::int_(index)]);
  throw py::value_error(fmt::format("{}, row {}: {} is not {}.", name, row, value, words));
}

template <typename Value>
std::vector<Value> column_of(const Values<Value>& values, const char* name) {
  if (values.ndim() == 1) return std::vector<Value>(values.data(), values.data() + values.size());
  throw py::value_error(fmt::format("{} has shape {}, but must have one value a row.", name,
                                    literal(values.attr("shape"))));
}

}  // namespace

FrameTable to_frame_table(const ArrayLike& argument, const char* name) {
  const py::array array = array_of(argument, name, "iu", "integers");
  const Values<std::int64_t> values(array);
  for (py::ssize_t i = 0; i < values.size(); ++i) {
    const std::int64_t value = values.data()[i];
    if (value < 0 || value > std::numeric_limits<int>::max()) {
      throw_bad_value(array, i, name, "the number of a frame");
    }
  }
  return FrameTable(values);
}

std::vector<int> to_frames(const ArrayLike& argument, const char* name) {
  return column_of(to_frame_table(argument, name), name);
}

std::vector<double> to_numbers(const ArrayLike& argument, const char* name) {
  const py::array array = array_of(argument, name, "iuf", "numbers");
  auto numbers = column_of(Values<double>(array), name);
  for (std::size_t row = 0; row < numbers.size(); ++row) {
    if (std::isfinite(numbers[row])) continue;
    throw_bad_value(array, static_cast<py::ssize_t>(row), name, "a finite number");
  }
  return numbers;
}

std::vector<bool> to_flags(const ArrayLike& argument, const char* name) {
  const py::array array = array_of(argument, name, "biu", "bool, or integers 0 and 1");
  const auto values = column_of(Values<std::int64_t>(array), name);
  std::vector<bool> flags;
  flags.reserve(values.size());
  for (const std::int64_t value : values) {
    if (value != 0 && value != 1) {
      throw_bad_value(array, static_cast<py::ssize_t>(flags.size()), name, "0 or 1");
    }
    flags.push_back(value == 1);
  }
  return flags;
}

}  // namespace loopbit::python
