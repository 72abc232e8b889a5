// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <opencv2/core/utils/logger.hpp>
#include <pybind11/pybind11.h>

#ifdef LOOPBIT_HAS_FLEET
#include "loopbit/fleet_map.hpp"
#endif
#include "loopbit/instruction_set.hpp"
#include "loopbit/version.hpp"

#include "bindings.hpp"

PYBIND11_MODULE(_loopbit, module) {
  namespace python = loopbit::python;
  module.doc() = "The compiled part of loopbit; import loopbit instead.";
  // Types belong to the package, so that signatures and pickles name it.
  const pybind11::object own_name = module.attr("__name__");
  module.attr("__name__") = "loopbit";
  module.attr("__version__") = loopbit::kVersion;
  // loopbit reports bad images itself.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
#ifdef LOOPBIT_HAS_FLEET
  loopbit::use_fleet_maps();
#endif
  python::bind_errors(module);
  module.def(
      "active_kernel", [] { return to_string(loopbit::active_instruction_set()); },
      "The instruction set of the inner loops: scalar, avx2, avx512 or, on Arm, dotprod. "
      "LOOPBIT_KERNEL forces one.");
  python::bind_options(module);
  python::bind_content(module);
  python::bind_features(module);
  python::bind_relative_poses(module);
  python::bind_graph(module);
  python::bind_place_index(module);
  python::bind_map(module);
  python::bind_map_tools(module);
  python::bind_detector(module);
  python::bind_data(module);
  python::bind_evaluation(module);
  python::bind_run(module);
  python::bind_report(module);
  module.attr("__name__") = own_name;
}
