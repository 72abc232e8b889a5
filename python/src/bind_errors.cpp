// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <exception>
#include <string>
#include <utility>

#include "loopbit/error.hpp"
#include "loopbit/printable.hpp"

#include "bindings.hpp"
#include "text.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

// One type per ErrorKind. They live as long as the process, because the interpreter may raise them
// until it ends.
struct ErrorTypes {
  PyObject* option = nullptr;
  PyObject* input = nullptr;
  PyObject* output = nullptr;
};

ErrorTypes& error_types() {
  static ErrorTypes types;
  return types;
}

PyObject* add_error(py::module_& module, const char* name, const py::tuple& bases,
                    const char* doc) {
  const std::string full_name = std::string("loopbit.") + name;
  PyObject* type = PyErr_NewExceptionWithDoc(full_name.c_str(), doc, bases.ptr(), nullptr);
  if (!type) throw py::error_already_set();
  module.add_object(name, type);
  return type;
}

PyObject* type_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::option:
      return error_types().option;
    case ErrorKind::input:
      return error_types().input;
    case ErrorKind::output:
      return error_types().output;
  }
  return error_types().option;
}

}  // namespace

void bind_errors(py::module_& module) {
  const py::handle base = add_error(
      module, "Error", py::make_tuple(py::handle(PyExc_Exception)),
      "The base of all errors that loopbit raises. The message names the thing, its value and the "
      "remedy.");
  error_types() = {
      add_error(module, "OptionError", py::make_tuple(base, py::handle(PyExc_ValueError)),
                "An option or argument has an invalid value."),
      add_error(module, "InputError", py::make_tuple(base, py::handle(PyExc_ValueError)),
                "An input is missing, damaged or of the wrong kind."),
      add_error(module, "OutputError", py::make_tuple(base, py::handle(PyExc_OSError)),
                "An output could not be written.")};
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(std::move(thrown));
    } catch (const Error& error) {
      PyErr_SetObject(type_of(error.kind()), py::cast(Text{printable(error.what())}).ptr());
    }
  });
}

}  // namespace loopbit::python
