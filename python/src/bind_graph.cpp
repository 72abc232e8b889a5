// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "loopbit/g2o_file.hpp"
#include "loopbit/loop_graph.hpp"

#include "bindings.hpp"
#include "numpy_matrix.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

/// A LoopGraph that several Python threads may share. It serves one at a time and releases the GIL.
class SharedGraph {
 public:
  explicit SharedGraph(LoopGraph graph) : graph_(std::move(graph)) {}

  /// What `use` returns for the graph.
  template <typename Use>
  auto exclusively(const Use& use) {
    const WithoutGil release;
    const std::scoped_lock lock(mutex_);
    return use(graph_);
  }

 private:
  std::mutex mutex_;
  LoopGraph graph_;
};

int add_keyframe(SharedGraph& self, const std::optional<MatrixArgument>& motion,
                 const std::optional<MatrixArgument>& covariance, const OdometryDrift& drift) {
  if (!motion) {
    if (covariance) throw py::value_error("covariance belongs to a motion; give motion, too.");
    return self.exclusively([](LoopGraph& graph) { return graph.add_keyframe(); });
  }
  const cv::Matx44d moved = to_matx<4>(*motion, "motion");
  const cv::Matx66d known =
      covariance ? to_matx<6>(*covariance, "covariance") : drift_covariance(moved, drift);
  return self.exclusively([&](LoopGraph& graph) { return graph.add_keyframe({moved, known}); });
}

int add_loop(SharedGraph& self, int match, int query, const std::optional<RelativePose>& pose,
             const std::optional<MatrixArgument>& T_match_query,
             const std::optional<MatrixArgument>& covariance) {
  if (T_match_query.has_value() != covariance.has_value() || (pose && covariance)) {
    throw py::value_error(
        "A loop has either pose, or T_match_query and covariance, or neither: both cameras see the "
        "same place.");
  }
  LoopEdge loop = loop_edge(match, query, pose.value_or(RelativePose{}));
  if (covariance) {
    loop.known = PoseKnown::metric;
    loop.T_match_query = to_matx<4>(*T_match_query, "T_match_query");
    loop.covariance = to_matx<6>(*covariance, "covariance");
  }
  return self.exclusively([&](LoopGraph& graph) { return graph.add_loop(loop); });
}

py::array_t<double> pose_of(SharedGraph& self, int keyframe) {
  const auto pose = self.exclusively([&](const LoopGraph& graph) {
    const bool exists = keyframe >= 0 && keyframe < graph.size();
    return exists ? std::optional(graph.pose(keyframe)) : std::nullopt;
  });
  if (!pose) throw py::index_error(fmt::format("There is no keyframe {}.", keyframe));
  return square_of(*pose);
}

void bind_judged_loop(py::module_& module) {
  py::enum_<LoopVerdict> verdict(module, "LoopVerdict",
                                 "What a LoopGraph makes of a loop, and by which evidence.");
  for (const LoopVerdict each : kAllLoopVerdicts) verdict.value(to_string(each).data(), each);
  py::class_<JudgedLoop>(module, "JudgedLoop", "A loop with its verdict and the evidence.")
      .def_property_readonly(
          "match", [](const JudgedLoop& self) { return self.edge.match; }, "A keyframe.")
      .def_property_readonly(
          "query", [](const JudgedLoop& self) { return self.edge.query; }, "Another keyframe.")
      .def_property_readonly(
          "known", [](const JudgedLoop& self) { return self.edge.known; },
          "How much of its relative pose is known.")
      .def_readonly("verdict", &JudgedLoop::verdict)
      .def_readonly("odometry_chi2", &JudgedLoop::odometry_chi2,
                    "Squared Mahalanobis distance from what odometry alone says; None if odometry "
                    "does not connect the two keyframes.")
      .def_readonly("compared", &JudgedLoop::compared, "Loops nearby that it was compared with.")
      .def_readonly("agreeing", &JudgedLoop::agreeing, "Those of them that agree with it.")
      .def_readonly("chi2", &JudgedLoop::chi2,
                    "Squared residual in units of its covariance, in the solution.")
      .def_readonly("limit", &JudgedLoop::limit, "The largest chi2 that is not a contradiction.")
      .def("__repr__", [](const JudgedLoop& self) {
        return fmt::format("JudgedLoop(match={}, query={}, {})", self.edge.match, self.edge.query,
                           to_string(self.verdict));
      });
}

void bind_loop_graph(py::module_& module) {
  py::class_<SharedGraph>(
      module, "LoopGraph",
      "A pose graph: keyframes joined by odometry and loops. It tells right loops from wrong ones "
      "and corrects the trajectory.")
      .def(py::init([](const LoopGraphOptions& options) {
             return std::make_unique<SharedGraph>(LoopGraph(options));
           }),
           py::arg_v("options", LoopGraphOptions{}, "LoopGraphOptions()"))
      .def(
          "add_keyframe", &add_keyframe, py::arg("motion") = py::none(),
          py::arg("covariance") = py::none(),
          py::arg_v("drift", OdometryDrift{}, "OdometryOptions()"),
          "Adds a keyframe and returns its number, from 0. motion: 4 x 4, from the keyframe before "
          "to this one: x_before = motion x_this, in metres. covariance: 6 x 6, of a small motion "
          "(x, y, z, rx, ry, rz) in the frame of this one, in metres and radians; without it, "
          "drift says how exact odometry is. Without motion, only loops connect the keyframe to "
          "those before: the first of all, or of another session.")
      .def(
          "add_loop", &add_loop, whole("match"), whole("query"), py::arg("pose") = py::none(),
          py::kw_only(), py::arg("T_match_query") = py::none(), py::arg("covariance") = py::none(),
          "Adds a loop of two keyframes and returns its number, from 0. pose: as relative_pose() "
          "measures it. Instead, T_match_query (4 x 4, in metres) and covariance (6 x 6), with the "
          "conventions of RelativePose. With neither, both cameras see the same place.")
      .def(
          "update",
          [](SharedGraph& self) { self.exclusively([](LoopGraph& graph) { graph.update(); }); },
          "Judges new loops and solves the latest keyframes; the whole graph if loops that agree "
          "with each other contradict the estimate.")
      .def(
          "solve",
          [](SharedGraph& self) { self.exclusively([](LoopGraph& graph) { graph.solve(); }); },
          "Judges all loops anew and solves the whole graph, from odometry on.")
      .def("pose", &pose_of, whole("keyframe"),
           "The pose of a keyframe, 4 x 4: x_world = pose x_keyframe. The first keyframe is the "
           "world, also for keyframes that loops or odometry connect to it.")
      .def_property_readonly(
          "loops",
          [](SharedGraph& self) {
            return self.exclusively([](const LoopGraph& graph) { return graph.loops(); });
          },
          "All loops with their verdicts, by their numbers.")
      .def(
          "cost",
          [](SharedGraph& self) {
            return self.exclusively([](const LoopGraph& graph) { return graph.cost(); });
          },
          "Half the sum of the squared residuals of odometry and kept loops.")
      .def(
          "write_g2o",
          [](SharedGraph& self, const std::filesystem::path& path) {
            self.exclusively([&](const LoopGraph& graph) { write_g2o(path.string(), graph); });
          },
          py::arg("path"),
          "Writes the graph in g2o's text format. Loops that are not kept are comments.")
      .def("__len__", [](SharedGraph& self) {
        return self.exclusively([](const LoopGraph& graph) { return graph.size(); });
      });
  module.def(
      "read_g2o",
      [](const std::filesystem::path& path, const LoopGraphOptions& options) {
        return std::make_unique<SharedGraph>(read_g2o(path.string(), options));
      },
      py::arg("path"), py::arg_v("options", LoopGraphOptions{}, "LoopGraphOptions()"),
      "Reads a graph that LoopGraph.write_g2o() or another program wrote. The first edge from a "
      "vertex to the next one is odometry, and all others are loops.");
}

}  // namespace

void bind_graph(py::module_& module) {
  bind_settings<LoopGraphOptions>(module, "LoopGraphOptions", "graph", "Settings of LoopGraph.");
  bind_judged_loop(module);
  bind_loop_graph(module);
}

}  // namespace loopbit::python
