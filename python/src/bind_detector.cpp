// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "bind_detector.hpp"

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "loopbit/error.hpp"

#include "bindings.hpp"
#include "numpy_image.hpp"
#include "settings.hpp"

namespace loopbit::python {
namespace {

/// A list that query() fills.
class Ranking : public pybind11::list {
 public:
  PYBIND11_OBJECT_DEFAULT(Ranking, pybind11::list, PyList_Check)
};

}  // namespace
}  // namespace loopbit::python

namespace pybind11::detail {

template <>
struct handle_type_name<loopbit::python::Ranking> {
  static constexpr auto name = const_name("list[loopbit.RankedPlace]");  // NOLINT: pybind11's name
};

}  // namespace pybind11::detail

namespace loopbit::python {
namespace {

namespace py = pybind11;

/// Releases the GIL and locks a detector.
struct FreeAndLocked {
  explicit FreeAndLocked(std::recursive_mutex& mutex) : lock(mutex) {}

  WithoutGil release;
  std::scoped_lock<std::recursive_mutex> lock;
};

/// The same while the detector answers or changes.
struct Answering : FreeAndLocked {
  Answering(std::recursive_mutex& mutex, bool& flag) : FreeAndLocked(mutex), is_answering(flag) {
    if (is_answering) {
      throw Error(ErrorKind::option,
                  "The function 'allowed' uses the detector that called it; let it decide by other "
                  "data.");
    }
    is_answering = true;
  }
  ~Answering() { is_answering = false; }
  Answering(const Answering&) = delete;
  Answering& operator=(const Answering&) = delete;
  Answering(Answering&&) = delete;
  Answering& operator=(Answering&&) = delete;

  bool& is_answering;
};

LoopDetectorOptions options_for(const std::optional<LoopDetectorOptions>& options,
                                const SharedMap* map) {
  if (options) return *options;
  const auto of_map = map ? map->options() : std::nullopt;
  return of_map.value_or(LoopDetectorOptions{});
}

std::string detection_text(const Detection& d) {
  std::string text = fmt::format("Detection(frame={}, status={}", d.frame, to_string(d.status));
  if (d.match) text += fmt::format(", match={}", *d.match);
  if (d.earlier_match)
    text += fmt::format(", earlier_match={}", literal(py::cast(*d.earlier_match)));
  if (d.match || d.earlier_match) {
    text += fmt::format(", score={:.4f}, similarity={:.3f}, inliers={}", d.score, d.similarity,
                        d.inliers);
  }
  return text + ")";
}

void bind_status(py::module_& module) {
  py::enum_<Status> status(module, "Status",
                           "The decision for a frame, with one value per reason of rejection.");
  for (const Status each : kAllStatuses) status.value(to_string(each).data(), each);
}

void bind_step_times(py::module_& module) {
  py::class_<StepTimes>(module, "StepTimes", "Wall time of the steps of one detection.")
      .def_readonly("content_ms", &StepTimes::content_ms,
                    "Binary content, including the conversion to grey.")
      .def_readonly("retrieval_ms", &StepTimes::retrieval_ms, "Fast image retrieval.")
      .def_readonly("features_ms", &StepTimes::features_ms, "SURF.")
      .def_readonly("verification_ms", &StepTimes::verification_ms,
                    "Matching, geometry and decision.")
      .def("__repr__", [](const StepTimes& t) {
        return fmt::format(
            "StepTimes(content_ms={:.3f}, retrieval_ms={:.3f}, features_ms={:.3f}, "
            "verification_ms={:.3f})",
            t.content_ms, t.retrieval_ms, t.features_ms, t.verification_ms);
      });
}

void bind_score_terms(py::module_& module) {
  py::class_<ScoreTerms>(
      module, "ScoreTerms",
      "The terms of the log odds of a match, in nats. With their sum S the score "
      "is 1 / (1 + exp(-S)).")
      .def_readonly("votes", &ScoreTerms::votes,
                    "Features of frame and match that moved alike, against other places.")
      .def_readonly("geometry", &ScoreTerms::geometry,
                    "Distinct inliers, against those of wrong places.")
      .def_readonly("path", &ScoreTerms::path,
                    "The frames before, and the steps beside the match in this frame.")
      .def_readonly("rivals", &ScoreTerms::rivals,
                    "Places elsewhere that share the evidence; never above 0.")
      .def_readonly("prior", &ScoreTerms::prior,
                    "That a robot returns to this place of all; never above 0.")
      .def("__repr__", [](const ScoreTerms& t) {
        return fmt::format(
            "ScoreTerms(votes={:.2f}, geometry={:.2f}, path={:.2f}, rivals={:.2f}, prior={:.2f})",
            t.votes, t.geometry, t.path, t.rivals, t.prior);
      });
}

void bind_late_loop(py::module_& module) {
  py::class_<LateLoop>(module, "LateLoop",
                       "A loop of an earlier frame that a later one found, or withdrew.")
      .def_readonly("frame", &LateLoop::frame, "The earlier frame, of this session.")
      .def_readonly("match", &LateLoop::match, "As in Detection.")
      .def_readonly("earlier_match", &LateLoop::earlier_match, "As in Detection.")
      .def_readonly("score", &LateLoop::score,
                    "The probability that it is right, by all frames until now.")
      .def_readonly("similarity", &LateLoop::similarity, "xi of frame and match.")
      .def("__repr__", [](const LateLoop& loop) {
        return fmt::format(
            "LateLoop(frame={}, {}={}, score={:.4f})", loop.frame,
            loop.match ? "match" : "earlier_match",
            loop.match ? fmt::format("{}", *loop.match) : literal(py::cast(loop.earlier_match)),
            loop.score);
      });
}

void bind_detection(py::module_& module) {
  py::class_<Detection>(module, "Detection",
                        "The result for one frame, with the numbers behind the decision.")
      .def_readonly("frame", &Detection::frame, "Number of the frame, from 0.")
      .def_readonly("timestamp_s", &Detection::timestamp_s, "The time passed to process().")
      .def_readonly("status", &Detection::status, "The decision, or the reason of rejection.")
      .def_readonly(
          "match", &Detection::match,
          "The best candidate, accepted or not, if it is a frame of this session; else None.")
      .def_readonly(
          "earlier_match", &Detection::earlier_match,
          "The best candidate if it is a frame of an earlier session of the map; else None.")
      .def_readonly(
          "score", &Detection::score,
          "The probability that the match is right, 0 to 1; a loop from decision.min_score. "
          "The number of matches with decision.count_matches.")
      .def_readonly("terms", &Detection::terms,
                    "The terms of the score's log odds; None without a match or with "
                    "decision.count_matches.")
      .def_readonly("similarity", &Detection::similarity, "xi of frame and match.")
      .def_readonly("matches", &Detection::matches, "Number of one-to-one feature matches.")
      .def_readonly("inliers", &Detection::inliers,
                    "Number of matches that fit one epipolar geometry.")
      .def_readonly("epoch", &Detection::epoch,
                    "Of a map on a server: all that was committed up to this epoch, and nothing "
                    "later, was known of other sessions; 0 for other maps.")
      .def_readonly("times", &Detection::times, "The time of each step.")
      .def_readonly("late_loops", &Detection::late_loops,
                    "Loops of the last few views, which this frame made sure: their frames had "
                    "none. List of LateLoop.")
      .def_readonly("withdrawn_loops", &Detection::withdrawn_loops,
                    "Loops reported before that are more likely wrong than right after this "
                    "frame. List of LateLoop.")
      .def_property_readonly(
          "odometry",
          [](const Detection& self) {
            return self.odometry ? std::optional(square_of(self.odometry->T_odometry_camera))
                                 : std::nullopt;
          },
          "The pose of the camera that was passed to process(), shape (4, 4); None without one.")
      .def_property_readonly("name", text_of(&Detection::name),
                             "The name of the image in its source; empty without a source.")
      .def_property_readonly(
          "is_loop", [](const Detection& self) { return self.status == Status::loop; },
          "Whether the match is accepted.")
      .def("__repr__", &detection_text);
}

void bind_ranked_place(py::module_& module) {
  py::class_<RankedPlace>(module, "RankedPlace",
                          "A candidate of a query, with the numbers behind its rank.")
      .def_readonly("place", &RankedPlace::place,
                    "Session and frame; session 0 is the detector's own.")
      .def_readonly("score", &RankedPlace::score)
      .def_readonly("similarity", &RankedPlace::similarity)
      .def_readonly("matches", &RankedPlace::matches)
      .def_readonly("inliers", &RankedPlace::inliers)
      .def("__repr__", [](const RankedPlace& self) {
        return fmt::format("RankedPlace({}, score={:.4f}, similarity={:.3f}, inliers={})",
                           literal(py::cast(self.place)), self.score, self.similarity,
                           self.inliers);
      });
}

/// SharedDetector::query; fills the list if one is given.
Detection query(const SharedDetector& detector, ImageArgument image,
                std::optional<double> timestamp_s, std::optional<Ranking> ranking,
                Evidence* evidence, const AllowedArgument& allowed) {
  std::vector<RankedPlace> places;
  Detection detection =
      detector.query(std::move(image), timestamp_s, ranking ? &places : nullptr, evidence, allowed);
  if (!ranking) return detection;
  ranking->attr("clear")();
  for (const RankedPlace& place : places) ranking->append(place);
  return detection;
}

/// A row of Evidence.inliers.
struct PointPairRow {
  float query_x, query_y, match_x, match_y;
};

void bind_evidence(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(PointPairRow, query_x, query_y, match_x, match_y);
  py::class_<Evidence>(module, "Evidence",
                       "The evidence of a detection, for display. process() fills it.")
      .def(py::init<>())
      .def_readonly("content", &Evidence::content, "The frame's binary content.")
      .def_property_readonly(
          "saliency", [](const Evidence& self) { return to_array(self.saliency); },
          "The frame's saliency map, float32, shape (64, 64); None before process().")
      .def_property_readonly(
          "inliers",
          [](const Evidence& self) {
            std::vector<PointPairRow> rows;
            rows.reserve(self.inliers.size());
            for (const auto& [query, match] : self.inliers) {
              rows.push_back({query.x, query.y, match.x, match.y});
            }
            return take(std::move(rows));
          },
          "Structured array of query_x, query_y, match_x and match_y, float32, each 0 to 1 of the "
          "image's width or height.")
      .def("__repr__", [](const Evidence& self) {
        return fmt::format("Evidence(inliers={})", self.inliers.size());
      });
}

}  // namespace

namespace {

/// Throws ValueError for a covariance without a pose.
std::optional<OdometryPose> to_odometry(const std::optional<MatrixArgument>& pose,
                                        const std::optional<MatrixArgument>& covariance) {
  if (!pose) {
    if (!covariance) return std::nullopt;
    throw py::value_error("odometry_covariance belongs to odometry; give both, or neither.");
  }
  OdometryPose odometry{to_matx<4>(*pose, "odometry")};
  if (covariance) odometry.covariance = to_matx<6>(*covariance, "odometry_covariance");
  return odometry;
}

}  // namespace

SharedDetector::SharedDetector(const std::optional<LoopDetectorOptions>& options,
                               const std::shared_ptr<SharedMap>& map)
    : detector_(options_for(options, map.get()), map) {}

Detection SharedDetector::process(ImageArgument image, std::optional<double> timestamp_s,
                                  Evidence* evidence, const AllowedArgument& allowed,
                                  const std::optional<MatrixArgument>& odometry,
                                  const std::optional<MatrixArgument>& odometry_covariance) {
  const cv::Mat pixels = to_image(image, "image");
  const Allowed places(allowed);
  const auto pose = to_odometry(odometry, odometry_covariance);
  Detection detection;
  Evidence seen;
  {
    const Answering guard(mutex_, is_answering_);
    detection =
        detector_.process(pixels, timestamp_s, pose, evidence ? &seen : nullptr, places.places());
  }
  // With the GIL, because other threads may read it.
  if (evidence) *evidence = std::move(seen);
  return detection;
}

Detection SharedDetector::query(ImageArgument image, std::optional<double> timestamp_s,
                                std::vector<RankedPlace>* ranking, Evidence* evidence,
                                const AllowedArgument& allowed) const {
  const cv::Mat pixels = to_image(image, "image");
  const Allowed places(allowed);
  Detection detection;
  Evidence seen;
  {
    const Answering guard(mutex_, is_answering_);
    detection =
        detector_.query(pixels, timestamp_s, ranking, evidence ? &seen : nullptr, places.places());
  }
  if (evidence) *evidence = std::move(seen);
  return detection;
}

void SharedDetector::set_mask(const std::optional<ImageArgument>& mask) {
  ImageArgument given = mask.value_or(ImageArgument());
  const cv::Mat pixels = mask ? to_image(given, "mask") : cv::Mat();
  const Answering guard(mutex_, is_answering_);
  detector_.set_mask(pixels);
}

void SharedDetector::set_camera(const std::optional<CameraModel>& camera) {
  const Answering guard(mutex_, is_answering_);
  detector_.set_camera(camera);
}

Detection SharedDetector::skip(std::optional<double> timestamp_s,
                               const std::optional<MatrixArgument>& odometry,
                               const std::optional<MatrixArgument>& odometry_covariance) {
  const auto pose = to_odometry(odometry, odometry_covariance);
  const Answering guard(mutex_, is_answering_);
  return detector_.skip(timestamp_s, pose);
}

void SharedDetector::remove(const PlaceArgument& place) {
  const SessionFrame removed = to_place(place, "place");
  const Answering guard(mutex_, is_answering_);
  detector_.remove(removed);
}

void SharedDetector::reject(const QueryArgument& query, const std::optional<PlaceArgument>& match) {
  if (py::isinstance<Detection>(query) && !match) {
    const Detection loop = query.cast<Detection>();
    const Answering guard(mutex_, is_answering_);
    return detector_.reject(loop);
  }
  const SessionFrame frame = py::isinstance<Detection>(query)
                                 ? SessionFrame{0, query.cast<Detection>().frame}
                                 : to_place(query, "query");
  const SessionFrame wrong = to_place(match ? py::object(*match) : py::none(), "match");
  const Answering guard(mutex_, is_answering_);
  detector_.reject(frame, wrong);
}

Features SharedDetector::features_of(const PlaceArgument& place) const {
  const SessionFrame wanted = to_place(place, "place");
  const Answering guard(mutex_, is_answering_);
  return detector_.features_of(wanted);
}

PlaceId SharedDetector::size() const {
  const FreeAndLocked guard(mutex_);
  return detector_.size();
}

LoopDetectorOptions SharedDetector::options() const {
  const FreeAndLocked guard(mutex_);
  return detector_.options();
}

void bind_detector(py::module_& module) {
  bind_status(module);
  bind_step_times(module);
  bind_score_terms(module);
  bind_late_loop(module);
  bind_detection(module);
  bind_ranked_place(module);
  bind_evidence(module);
  py::class_<SharedDetector>(
      module, "LoopDetector",
      "Detects for each camera image whether the camera has been at this place before. Threads may "
      "share a detector; it serves one at a time, and releases the GIL.")
      .def(py::init<const std::optional<LoopDetectorOptions>&, const std::shared_ptr<SharedMap>&>(),
           py::arg("options") = py::none(), py::arg("map") = py::none(),
           py::call_guard<WithoutGil>(),
           "Without options, uses those of the map, or the defaults. With a map, all places of its "
           "sessions are candidates, whatever the exclusion window. A MapWriter also stores the "
           "processed frames; a MapReader or ShardedMap is only queried. A map serves one "
           "detector. Raises OptionError if the map was made with other settings of binary_content "
           "or surf.")
      .def("process", &SharedDetector::process, py::arg("image"),
           py::arg("timestamp_s") = py::none(), py::arg("evidence") = py::none(),
           py::arg("allowed") = py::none(), py::arg("odometry") = py::none(),
           py::arg("odometry_covariance") = py::none(),
           "Detects a loop, then adds the image as the next place. The image is uint8 or uint16, "
           "(h, w), BGR or BGRA, at least 32 x 32; it is not copied if its rows are contiguous. "
           "timestamp_s must not go back. If evidence is given, it is filled. allowed restricts "
           "the candidates of this frame, for example to those near a position from GPS: a "
           "function of a SessionFrame that returns whether it may be one, or a sequence of "
           "places. An int is a frame of this session, which is session 0. odometry is the pose of "
           "the camera (x right, y down, z forward) in any fixed frame, in metres, shape (4, 4); "
           "odometry_covariance that of the motion (x, y, z, rx, ry, rz) since the last frame with "
           "odometry, shape (6, 6), in the frame of the camera. Without it, the settings of "
           "odometry tell how fast it drifts.")
      .def("query", &query, py::arg("image"), py::arg("timestamp_s") = py::none(),
           py::arg("ranking") = py::none(), py::arg("evidence") = py::none(),
           py::arg("allowed") = py::none(),
           "Returns what process() would return, without adding the image. If ranking is given, it "
           "is filled with all candidates, best first, and every candidate is verified, which "
           "takes longer. Only the first can be a loop. evidence and allowed are those of "
           "process().")
      .def("set_mask", &SharedDetector::set_mask, py::arg("mask"),
           "Excludes part of all images from now on, such as the robot's own body: where mask, "
           "uint8 of shape (h, w), is 0, there is no content and no feature has its centre. Images "
           "must have its size. None excludes nothing.")
      .def("set_camera", &SharedDetector::set_camera, py::arg("camera"),
           "The calibration of all images from now on, see read_cameras(): matches have to agree "
           "with a motion of this camera, also through a fisheye. Images must have its size, which "
           "it has to know. None = not known, as in the beginning.")
      .def("skip", &SharedDetector::skip, py::arg("timestamp_s") = py::none(),
           py::arg("odometry") = py::none(), py::arg("odometry_covariance") = py::none(),
           "Counts a frame without a usable image, so that frame numbers stay aligned. For "
           "odometry see process().")
      .def("remove", &SharedDetector::remove, py::arg("place"),
           "Removes a place, such as a culled key frame, also from the map. It is never a "
           "candidate again and affects no answer. Frames keep their numbers. An int is a frame of "
           "this session.")
      .def("reject", &SharedDetector::reject, py::arg("query"), py::arg("match") = py::none(),
           "Withdraws a loop that turned out to be wrong. Its support for later matches ends, and "
           "frames that show the same view do not match there again. The map records the pair as "
           "rejected. query is a Detection, whose match is rejected, or a frame with its match. An "
           "int is a frame of this session.")
      .def("features_of", &SharedDetector::features_of, py::arg("place"),
           "A copy of the features of a place, such as for relative_pose(). Empty for a frame that "
           "was unreadable or removed. An int is a frame of this session.")
      .def("__len__", &SharedDetector::size)
      .def_property_readonly("options", &SharedDetector::options, "A copy of the settings.")
      .def("__repr__", [](const SharedDetector& self) {
        return fmt::format("LoopDetector({} frames)", self.size());
      });
}

}  // namespace loopbit::python
