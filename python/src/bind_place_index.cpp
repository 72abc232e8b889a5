// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "loopbit/place_index.hpp"

#include "bindings.hpp"
#include "numpy_image.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

}  // namespace

void bind_place_index(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(Candidate, place, similarity);
  py::class_<PlaceIndex>(
      module, "PlaceIndex",
      "Stores the binary contents of all places, and finds those most similar to a query.")
      .def(py::init<>())
      // Keeps the GIL, so that only one thread adds at a time, as the index requires.
      .def("add", &PlaceIndex::add, py::arg("content"), "Adds a place and returns its number.")
      .def("__len__", &PlaceIndex::size)
      .def(
          "content", [](const PlaceIndex& self, PlaceId place) { return self.content(place); },
          whole("place"), "The content of a place. Raises IndexError if there is no such place.")
      .def(
          "query",
          [](const PlaceIndex& self, const BinaryContent& content, std::optional<PlaceId> end,
             const RetrievalOptions& options) {
            std::vector<Candidate> candidates;
            {
              const WithoutGil release;
              candidates = self.query(content, end.value_or(self.size()), options);
            }
            return take(std::move(candidates));
          },
          py::arg("content"), py::arg("end") = py::none(),
          py::arg_v("options", RetrievalOptions{}, "RetrievalOptions()"),
          "The most similar places among those numbered below end (None = all), best first, as a "
          "structured array of place and similarity. The result equals that of a full scan.")
      .def("__repr__", [](const PlaceIndex& self) {
        return fmt::format("PlaceIndex({} places)", self.size());
      });
}

}  // namespace loopbit::python
