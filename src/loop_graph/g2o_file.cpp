// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/g2o_file.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/read_file.hpp"
#include "loopbit/text_rows.hpp"
#include "loopbit/write_file.hpp"

#include "graph_impl.hpp"

namespace loopbit {
namespace {

using graph::Edge;
using graph::Matrix6d;
using graph::Pose;

constexpr std::string_view kVertex = "VERTEX_SE3:QUAT";
constexpr std::string_view kEdge = "EDGE_SE3:QUAT";
constexpr std::size_t kPoseNumbers = 7;
constexpr std::size_t kEdgeNumbers = 2 + kPoseNumbers + 21;

/// g2o's information is of half a rotation vector. Powers of 2, so that nothing is rounded.
double unit(int row, int column) { return (row < 3 ? 1 : 2) * (column < 3 ? 1 : 2); }

std::string numbers_of(const Pose& pose) {
  std::string text;
  for (const double number : pose) text += fmt::format(" {}", number + 0.0);  // not -0
  return text;
}

/// The ends, the pose and the information; if `only_rotation`, without that of the translation.
std::string numbers_of(const Edge& edge, bool only_rotation) {
  std::string text = fmt::format("{} {}{}", edge.from, edge.to, numbers_of(edge.measured));
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      const bool is_left_out = only_rotation && row < 3;
      text += fmt::format(
          " {}", is_left_out ? 0.0 : edge.information(row, column) * unit(row, column) + 0.0);
    }
  }
  return text;
}

template <typename Enum, std::size_t size>
std::optional<Enum> named(const std::array<Enum, size>& all, std::string_view name) {
  for (const Enum value : all) {
    if (to_string(value) == name) return value;
  }
  return std::nullopt;
}

constexpr std::array kAllKnown{PoseKnown::nothing, PoseKnown::rotation, PoseKnown::direction,
                               PoseKnown::metric};

/// What the comment before a loop says.
struct LoopNote {
  LoopVerdict verdict = LoopVerdict::undecided;
  std::optional<Edge> edge;  ///< if the edge itself says less
};

}  // namespace

/// May read and write all of a graph.
class G2oFile {
 public:
  static std::string text_of(const LoopGraph& graph) {
    const LoopGraph::Impl& impl = *graph.impl_;
    std::string text;
    for (std::size_t i = 0; i < impl.poses().size(); ++i) {
      text += fmt::format("{} {}{}\n", kVertex, i, numbers_of(impl.poses()[i]));
    }
    for (const auto& keyframe : impl.keyframes()) {
      if (keyframe.odometry) {
        text += fmt::format("{} {}\n", kEdge, numbers_of(*keyframe.odometry, false));
      }
    }
    for (std::size_t i = 0; i < impl.loops().size(); ++i) {
      const JudgedLoop& loop = impl.loops()[i];
      const Edge& edge = impl.edges()[i];
      const bool is_metric = edge.known == PoseKnown::metric;
      text += fmt::format("# loop {} {}", to_string(loop.verdict), to_string(edge.known));
      text += is_metric ? "\n" : fmt::format(" {}\n", numbers_of(edge, false));
      text += fmt::format("{}{} {}\n", loop.verdict == LoopVerdict::kept ? "" : "#", kEdge,
                          numbers_of(edge, !is_metric));
    }
    return text;
  }

  G2oFile(std::string path, const LoopGraphOptions& options)
      : path_(std::move(path)), graph_(options) {}

  LoopGraph read() {
    const std::string text = read_text(path_);
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      row_ = {row_.line + 1,
              std::string(trimmed(std::string_view(text).substr(begin, end - begin)))};
      begin = end + 1;
      read_row();
    }
    build();
    return std::move(graph_);
  }

 private:
  struct Loop {
    Edge edge;
    LoopVerdict verdict;
  };

  void read_row() {
    std::vector<std::string_view> cells;
    split_cells(row_.text, cells);
    if (row_.text.empty() || cells[0] == "FIX") return;
    if (cells[0] == "#" && cells.size() >= 4 && cells[1] == "loop") return read_note(cells);
    if (cells[0].starts_with('#') && cells[0].substr(1) != kEdge) return;
    if (cells[0] == kVertex) return read_vertex(cells);
    if (cells[0] == kEdge || cells[0].starts_with('#')) return read_edge(cells);
    throw_bad_row(path_, row_, "VERTEX_SE3:QUAT, EDGE_SE3:QUAT, FIX or a comment");
  }

  void read_note(const std::vector<std::string_view>& cells) {
    const auto verdict = named(kAllLoopVerdicts, cells[2]);
    const auto known = named(kAllKnown, cells[3]);
    if (!verdict || !known)
      throw_bad_row(path_, row_, "# loop VERDICT KNOWN, as loopbit writes it");
    note_ = LoopNote{*verdict, std::nullopt};
    if (cells.size() == 4) return;
    note_->edge = parse_edge(std::span(cells).subspan(4));
    note_->edge->known = *known;
  }

  void read_vertex(const std::vector<std::string_view>& cells) {
    const auto id = cells.size() == 2 + kPoseNumbers ? parse_frame(cells[1]) : std::nullopt;
    const auto pose = id ? parse_pose(std::span(cells).subspan(2)) : std::nullopt;
    if (!pose) throw_bad_row(path_, row_, "VERTEX_SE3:QUAT id x y z qx qy qz qw");
    poses_[*id] = *pose;
  }

  void read_edge(const std::vector<std::string_view>& cells) {
    const Edge edge = parse_edge(std::span(cells).subspan(1));
    if (note_) {
      loops_.push_back({note_->edge.value_or(edge), note_->verdict});
      note_.reset();
    } else if (edge.to == edge.from + 1 && !odometry_.contains(edge.to)) {
      odometry_[edge.to] = edge;
    } else {
      loops_.push_back({edge, LoopVerdict::undecided});
    }
  }

  static std::optional<Pose> parse_pose(std::span<const std::string_view> cells) {
    constexpr double kMaxError = 1e-3;
    Pose pose{};
    for (std::size_t i = 0; i < kPoseNumbers; ++i) {
      const auto number = parse_number<double>(cells[i]);
      if (!number) return std::nullopt;
      pose[i] = *number;
    }
    const Eigen::Vector4d q(pose.data() + 3);
    if (!(std::abs(q.norm() - 1) < kMaxError)) return std::nullopt;
    // What is of length 1 stays as it is.
    if (std::abs(q.norm() - 1) > 1e-14) {
      for (std::size_t i = 3; i < kPoseNumbers; ++i) pose[i] /= q.norm();
    }
    return pose;
  }

  [[nodiscard]] Edge parse_edge(std::span<const std::string_view> cells) const {
    static constexpr auto kRule = "EDGE_SE3:QUAT from to x y z qx qy qz qw and 21 numbers";
    if (cells.size() != kEdgeNumbers) throw_bad_row(path_, row_, kRule);
    const auto from = parse_frame(cells[0]);
    const auto to = parse_frame(cells[1]);
    const auto pose = parse_pose(cells.subspan(2));
    if (!from || !to || *from == *to || !pose) throw_bad_row(path_, row_, kRule);
    Edge edge{*from, *to, PoseKnown::metric, *pose};
    std::size_t next = 2 + kPoseNumbers;
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        const auto number = parse_number<double>(cells[next++]);
        if (!number) throw_bad_row(path_, row_, kRule);
        edge.information(row, column) = *number / unit(row, column);
        edge.information(column, row) = edge.information(row, column);
      }
    }
    if (edge.information.topRows<3>().isZero(0)) {
      edge.known = edge.information.isZero(0) ? PoseKnown::nothing : PoseKnown::rotation;
    }
    return edge;
  }

  void build() {
    if (poses_.empty() || poses_.rbegin()->first + 1 != static_cast<int>(poses_.size())) {
      throw Error(ErrorKind::input,
                  fmt::format("'{}' has {} vertices that are not numbered from 0 without gaps: "
                              "number them in the order of the trajectory.",
                              path_, poses_.size()));
    }
    LoopGraph::Impl& impl = *graph_.impl_;
    for (const auto& [id, pose] : poses_) {
      const auto found = odometry_.find(id);
      if (found != odometry_.end()) check(found->second);
      impl.add_keyframe(found == odometry_.end() ? std::nullopt : std::optional(found->second));
      impl.set_pose(id, pose);
    }
    for (const Loop& loop : loops_) {
      check(loop.edge);
      const LoopEdge shown{loop.edge.from, loop.edge.to, loop.edge.known,
                           graph::matrix_of(loop.edge.measured), covariance_of(loop.edge)};
      impl.set_verdict(impl.add_loop(shown, loop.edge), loop.verdict);
    }
    impl.measure_chi2();
  }

  void check(const Edge& edge) const {
    const bool exist = std::max(edge.from, edge.to) < static_cast<int>(poses_.size());
    const bool is_whole =
        edge.known != PoseKnown::metric || graph::Factors(edge.information).are_positive();
    if (exist && is_whole) return;
    throw Error(ErrorKind::input,
                fmt::format("'{}': the edge from {} to {} {}", path_, edge.from, edge.to,
                            exist ? "has an information matrix that is not positive definite."
                                  : "has an end that is no vertex."));
  }

  /// Of what is known.
  static cv::Matx66d covariance_of(const Edge& edge) {
    cv::Matx66d covariance;
    cv::invert(graph::cv_of(edge.information), covariance, cv::DECOMP_SVD);
    return covariance;
  }

  std::string path_;
  LoopGraph graph_;
  TextRow row_{};
  std::optional<LoopNote> note_;
  std::map<int, Pose> poses_;
  std::map<int, Edge> odometry_;  ///< by the keyframe where it ends
  std::vector<Loop> loops_;
};

void write_g2o(const std::string& path, const LoopGraph& graph) {
  write_file(path, G2oFile::text_of(graph));
}

LoopGraph read_g2o(const std::string& path, const LoopGraphOptions& options) {
  return G2oFile(path, options).read();
}

}  // namespace loopbit
