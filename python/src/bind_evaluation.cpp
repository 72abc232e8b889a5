// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "loopbit/error.hpp"
#include "loopbit/evaluation.hpp"
#include "loopbit/match_list.hpp"
#include "loopbit/protocol.hpp"
#include "loopbit/scoring.hpp"

#include "bindings.hpp"
#include "numpy_columns.hpp"
#include "numpy_image.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

namespace py = pybind11;

/// Throws ValueError unless a column has one value per row.
void check_rows(std::size_t values, std::size_t rows, const char* name) {
  if (values == rows) return;
  throw py::value_error(
      fmt::format("{} has shape ({},), but must be ({},), as query has.", name, values, rows));
}

MatchList list_of(const ArrayLike& query, const ArrayLike& match,
                  const std::optional<ArrayLike>& score, const std::optional<ArrayLike>& is_loop) {
  const std::vector<int> queries = to_frames(query, "query");
  const std::size_t rows = queries.size();
  const std::vector<int> matches = to_frames(match, "match");
  const auto scores = score ? to_numbers(*score, "score") : std::vector<double>(rows, 1.0);
  const auto flags = is_loop ? to_flags(*is_loop, "is_loop") : std::vector<bool>(rows, true);
  check_rows(matches.size(), rows, "match");
  check_rows(scores.size(), rows, "score");
  check_rows(flags.size(), rows, "is_loop");
  MatchList list;
  list.matches.reserve(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    if (matches[row] >= queries[row]) {
      throw py::value_error(fmt::format("match, row {}: {} is not earlier than query {}.", row,
                                        matches[row], queries[row]));
    }
    list.matches.push_back({.query = queries[row],
                            .match = matches[row],
                            .score = scores[row],
                            .is_loop = flags[row]});
  }
  return list;
}

void bind_matches(py::module_& module) {
  py::class_<MatchList>(module, "MatchList", "The matches of any detector on a sequence.")
      .def(py::init(&list_of), py::arg("query"), py::arg("match"), py::arg("score") = py::none(),
           py::arg("is_loop") = py::none(),
           "One value per match: a frame, an earlier frame, the score (default 1), and whether the "
           "detector accepts the match (default true).")
      .def_property_readonly(
          "matches", [](const MatchList& self) { return take(self.matches); },
          "Structured array of query, match, score and is_loop.")
      .def_property_readonly(
          "times_s", [](const MatchList& self) { return self.times_s; },
          "Seconds or None, one per frame; empty if frames are not listed.")
      .def_property_readonly(
          "elsewhere",
          [](const MatchList& self) -> py::array_t<int> { return take(self.elsewhere); },
          "Queries whose accepted match is in another recording; they are not scored.")
      .def("__len__", [](const MatchList& self) { return self.matches.size(); })
      .def("__repr__", [](const MatchList& self) {
        return fmt::format("MatchList({} matches)", self.matches.size());
      });
  module.def(
      "read_match_list",
      [](const std::filesystem::path& path) { return read_match_list(path.string()); },
      py::arg("path"), py::call_guard<WithoutGil>(),
      "Reads a loops.csv, or any CSV file of query,match[,score].");
}

template <typename Counts>
void bind_shares(py::class_<Counts>& type, const char* recall) {
  type.def_property_readonly("recall", &Counts::recall, recall)
      .def_property_readonly("precision", &Counts::precision,
                             "right / (right + wrong); 1 without loops.")
      .def("__repr__", [](const Counts& self) {
        return fmt::format("right {} of {}, wrong {}: recall {:.4f}, precision {:.4f}", self.right,
                           self.positives, self.wrong, self.recall(), self.precision());
      });
}

void bind_counts(py::module_& module) {
  py::class_<DecisionCounts> decision(module, "DecisionCounts",
                                      "Counts of a detector's decisions, per query.");
  decision
      .def_readonly("positives", &DecisionCounts::positives,
                    "Scored queries with a true earlier place.")
      .def_readonly("right", &DecisionCounts::right)
      .def_readonly("tolerated", &DecisionCounts::tolerated)
      .def_readonly("wrong", &DecisionCounts::wrong)
      .def_readonly("ignored", &DecisionCounts::ignored, "Queries that are not scored.");
  bind_shares(decision, "right / positives; 0 without positives.");
  py::class_<PairCounts> pairs(module, "PairCounts",
                               "Counts of a detector's decisions, per pair of frames.");
  pairs.def_readonly("positives", &PairCounts::positives, "All true pairs of frames.")
      .def_readonly("found", &PairCounts::found, "True pairs that were accepted.")
      .def_readonly("right", &PairCounts::right,
                    "Accepted pairs that are true or within the tolerance of a true pair.")
      .def_readonly("wrong", &PairCounts::wrong);
  bind_shares(pairs, "found / positives; 0 without positives.");
}

void bind_result(py::module_& module) {
  py::class_<Evaluation>(module, "Evaluation", "The score of a detector's matches.")
      .def_readonly("decision", &Evaluation::decision,
                    "Counts per query, with the detector's own decisions.")
      .def_readonly("late", &Evaluation::late,
                    "The same with loops that were found late, and without withdrawn ones.")
      .def_readonly("pairs", &Evaluation::pairs,
                    "Counts per pair, with the detector's own decisions.")
      .def_property_readonly(
          "curve", [](const Evaluation& self) { return take(self.curve); },
          "The precision-recall curve: structured array of score, right, wrong, precision and "
          "recall, one row per distinct score, from the highest.")
      .def_readonly("recall_at_full_precision", &Evaluation::recall_at_full_precision)
      .def_readonly("score_at_full_precision", &Evaluation::score_at_full_precision,
                    "The lowest score with no wrong match at or above it, or None.")
      .def_readonly("average_precision", &Evaluation::average_precision)
      .def_property_readonly(
          "wrong_loops", [](const Evaluation& self) { return take(self.wrong_loops); },
          "Structured array of query, match, score and is_loop.")
      .def_property_readonly(
          "missed", [](const Evaluation& self) -> py::array_t<int> { return take(self.missed); },
          "Revisits without a right loop.")
      .def_property_readonly(
          "protocol", [](const Evaluation& self) { return self.options.protocol; },
          "The name of the protocol, or empty.")
      .def_property_readonly("tolerance_frames",
                             [](const Evaluation& self) { return self.options.tolerance_frames; })
      .def(
          "to_json", [](const Evaluation& self, bool full) { return to_json(self, full); },
          py::arg("full") = true, "The JSON of loopbit eval --json; full adds the lists.")
      .def("__repr__", [](const Evaluation& self) {
        return fmt::format(
            "Evaluation(recall={:.4f}, precision={:.4f}, wrong={}, "
            "recall_at_full_precision={:.4f}, average_precision={:.4f})",
            self.decision.recall(), self.decision.precision(), self.decision.wrong,
            self.recall_at_full_precision, self.average_precision);
      });
}

void bind_protocols(py::module_& module) {
  py::class_<Protocol>(module, "Protocol",
                       "A published scoring protocol. Its name fixes all settings.")
      .def_property_readonly("name", [](const Protocol& self) { return std::string(self.name); })
      .def_property_readonly(
          "help", [](const Protocol& self) { return std::string(self.help); }, "One line.")
      .def_readonly("truth_kind", &Protocol::truth_kind, "The kind of truth that it requires.")
      .def_readonly("tolerance_frames", &Protocol::tolerance_frames)
      .def_property_readonly(
          "poses", [](const Protocol& self) { return self.truth.poses; },
          "The rule by which two poses show the same place.")
      .def_property_readonly(
          "views", [](const Protocol& self) { return self.truth.views; },
          "Rows per frame in a loop matrix.")
      .def("__repr__", [](const Protocol& self) {
        return fmt::format("Protocol('{}': {})", self.name, self.help);
      });
  module.def(
      "protocols", [] { return std::vector<Protocol>(protocols().begin(), protocols().end()); },
      "All known protocols.");
  module.def("find_protocol", &find_protocol, py::arg("name"),
             "The protocol with this name. Raises OptionError if there is none.");
}

/// For the functions of the package that score. They have keywords of the same names.
void bind_scoring(py::module_& module) {
  using File = std::filesystem::path;
  using Released = py::call_guard<WithoutGil>;
  py::class_<ScoringRequest>(module, "_ScoringRequest")
      .def(py::init([](const File& truth, const File& not_false, const File& ignore,
                       const std::string& protocol, std::optional<int> tolerance_frames,
                       const std::optional<PoseTruthOptions>& poses, std::optional<int> views,
                       const std::string& variable) {
             return ScoringRequest{truth.string(),
                                   not_false.string(),
                                   ignore.string(),
                                   protocol,
                                   tolerance_frames,
                                   poses,
                                   views,
                                   variable};
           }),
           py::kw_only(), py::arg("truth") = "", py::arg("not_false") = "", py::arg("ignore") = "",
           py::arg("protocol") = "", whole("tolerance_frames") = py::none(),
           py::arg("poses") = py::none(), whole("views") = py::none(), py::arg("variable") = "")
      .def(
          "read_truth",
          [](const ScoringRequest& self, int every, FrameTimes times_s, bool all_read) {
            check_every(every);
            return self.resolve({every, std::move(times_s), all_read}).truth;
          },
          whole("every"), py::arg("times_s"), py::arg("all_read"), Released());
}

}  // namespace

void bind_evaluation(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(ReportedMatch, query, match, score, is_loop);
  PYBIND11_NUMPY_DTYPE(CurvePoint, score, right, wrong, precision, recall);
  bind_matches(module);
  bind_counts(module);
  bind_result(module);
  bind_protocols(module);
  bind_scoring(module);
}

}  // namespace loopbit::python
