// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// How exact relative poses are: see scripts/bench_poses.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>

#include "loopbit/camera_file.hpp"
#include "loopbit/gray_image.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/relative_pose.hpp"
#include "loopbit/world.hpp"

#include "measure.hpp"
#include "orb_matching.hpp"

namespace {

namespace fs = std::filesystem;

using loopbit::CameraModel;
using loopbit::Features;
using loopbit::NearbyView;
using loopbit::PoseKnown;
using loopbit::PoseRequest;
using loopbit::PoseStatus;
using loopbit::RelativePose;
using loopbit::RelativePoseEstimator;
using loopbit::World;
using loopbit::WorldOptions;
using loopbit::bench::thread_ms;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kStereo_m = 0.3;
/// Pairs with fewer are no loops.
constexpr std::size_t kLoopInliers = 25;

CameraModel resolution(CameraModel camera, cv::Size size_px) {
  camera.size_px = size_px;
  return camera;
}

cv::Matx33d rotation_of(const cv::Matx44d& pose) { return pose.get_minor<3, 3>(0, 0); }
cv::Vec3d translation_of(const cv::Matx44d& pose) { return {pose(0, 3), pose(1, 3), pose(2, 3)}; }

cv::Vec3d rotation_vector(const cv::Matx33d& rotation) {
  cv::Vec3d vector;
  cv::Rodrigues(rotation, vector);
  return vector;
}

double angle_deg(const cv::Vec3d& a, const cv::Vec3d& b) {
  return std::atan2(cv::norm(a.cross(b)), a.dot(b)) * kDegrees;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// What came of one way to estimate poses.
struct Errors {
  std::vector<double> rotation_deg;
  std::vector<double> direction_deg;  ///< where the baseline exceeds 0.5 m
  std::vector<double> metric_m;
  std::vector<double> metric_percent;  ///< of the distance, where that exceeds 0.5 m
  std::vector<double> nees_ratio;      ///< per degree of freedom
  std::vector<double> time_ms;
  std::map<std::string, int> outcomes;
  int loops = 0;

  void add(const RelativePose& pose, const cv::Matx44d& truth);
  void print(const std::string& name) const;
};

/// The squared error in units of the covariance, per degree of freedom.
double nees_ratio(const RelativePose& pose, const cv::Matx44d& truth) {
  cv::Matx44d exact = truth;
  int freedom = 6;
  const double length = cv::norm(translation_of(truth));
  if (pose.known == PoseKnown::direction) {
    freedom = 5;
    for (int row = 0; row < 3; ++row) exact(row, 3) /= length;
  } else if (pose.known == PoseKnown::rotation) {
    freedom = 3;
    for (int row = 0; row < 3; ++row) exact(row, 3) = pose.T_match_query(row, 3);
  }
  const cv::Matx44d error = pose.T_match_query.inv() * exact;
  const cv::Vec3d p = translation_of(error);
  const cv::Vec3d r = rotation_vector(rotation_of(error));
  const cv::Vec6d all(p[0], p[1], p[2], r[0], r[1], r[2]);
  // Rank 5 or 3 where the rest is not known.
  cv::Vec6d values;
  cv::Matx66d vectors;
  cv::eigen(pose.covariance, values, vectors);
  double sum = 0;
  for (int i = 0; i < freedom; ++i) {
    double along = 0;
    for (int k = 0; k < 6; ++k) along += vectors(i, k) * all[k];
    sum += along * along / std::max(values[i], 1e-18);
  }
  return sum / freedom;
}

void Errors::add(const RelativePose& pose, const cv::Matx44d& truth) {
  ++loops;
  ++outcomes[fmt::format("{}/{}", to_string(pose.status), to_string(pose.known))];
  if (pose.known == PoseKnown::nothing) return;
  rotation_deg.push_back(
      cv::norm(rotation_vector(rotation_of(pose.T_match_query).t() * rotation_of(truth))) *
      kDegrees);
  const cv::Vec3d moved = translation_of(truth);
  const cv::Vec3d found = translation_of(pose.T_match_query);
  if (pose.known >= PoseKnown::direction && cv::norm(moved) > 0.5) {
    direction_deg.push_back(angle_deg(found, moved));
  }
  if (pose.known == PoseKnown::metric) {
    metric_m.push_back(cv::norm(found - moved));
    if (cv::norm(moved) > 0.5) {
      metric_percent.push_back(100 * cv::norm(found - moved) / cv::norm(moved));
    }
  }
  nees_ratio.push_back(::nees_ratio(pose, truth));
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? std::nan("") : sum / static_cast<double>(values.size());
}

void Errors::print(const std::string& name) const {
  fmt::print("{:<26} loops {:4}  rotation {:.3f} {:.3f} deg  direction {:.2f} {:.2f} deg", name,
             loops, quantile(rotation_deg, 0.5), quantile(rotation_deg, 0.9),
             quantile(direction_deg, 0.5), quantile(direction_deg, 0.9));
  if (!metric_m.empty()) {
    fmt::print("  metric {:.3f} {:.3f} m {:.2f} {:.2f} %", quantile(metric_m, 0.5),
               quantile(metric_m, 0.9), quantile(metric_percent, 0.5),
               quantile(metric_percent, 0.9));
  }
  fmt::print("  nees {:.2f} (median {:.2f})  {:.2f} ms ", mean(nees_ratio),
             quantile(nees_ratio, 0.5), quantile(time_ms, 0.5));
  for (const auto& [outcome, count] : outcomes) fmt::print(" {} {}", outcome, count);
  fmt::print("\n");
  std::fflush(stdout);
}

RelativePose timed(RelativePoseEstimator& estimator, const PoseRequest& request, Errors& errors) {
  const double start_ms = thread_ms();
  RelativePose pose = estimator.estimate(request);
  errors.time_ms.push_back(thread_ms() - start_ms);
  return pose;
}

/// Poses of the OpenCV baseline: ORB and findEssentialMat with RANSAC.
RelativePose baseline_pose(const loopbit::bench::OrbFeatures& query,
                           const loopbit::bench::OrbFeatures& match, const CameraModel& camera,
                           const std::vector<loopbit::Match>& matches) {
  RelativePose pose;
  std::vector<cv::Point2d> a;
  std::vector<cv::Point2d> b;
  const auto on_plane = [&](const Features& features, int index) {
    const auto& at = features.keypoints[static_cast<std::size_t>(index)];
    const auto ray =
        unproject(camera, {static_cast<double>(at.x_px), static_cast<double>(at.y_px)});
    return ray ? cv::Point2d((*ray)[0] / (*ray)[2], (*ray)[1] / (*ray)[2]) : cv::Point2d();
  };
  for (const loopbit::Match& each : matches) {
    a.push_back(on_plane(query.positions, each.query));
    b.push_back(on_plane(match.positions, each.place));
  }
  if (a.size() < 8) return pose;
  cv::Mat mask;
  const double focal_px = camera.fx;
  const cv::Mat essential =
      cv::findEssentialMat(a, b, cv::Matx33d::eye(), cv::RANSAC, 0.999, 1.0 / focal_px, mask);
  if (essential.rows != 3) return pose;
  cv::Mat rotation;
  cv::Mat translation;
  const int inliers =
      cv::recoverPose(essential, a, b, cv::Matx33d::eye(), rotation, translation, mask);
  if (inliers < 15) return pose;
  pose.status = PoseStatus::measured;
  pose.known = PoseKnown::direction;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      pose.T_match_query(row, column) = rotation.at<double>(row, column);
    }
    pose.T_match_query(row, 3) = translation.at<double>(row);
  }
  pose.covariance = cv::Matx66d::eye();
  return pose;
}

struct WorldErrors {
  Errors monocular;
  Errors odometry;
  Errors stereo;
  Errors depth;
  Errors baseline;
};

/// The matches of a pair of images, or none if it is no loop.
std::vector<loopbit::Match> matches_of_loop(const PoseRequest& request) {
  const Features& query = *request.query.features;
  const Features& match = *request.match.features;
  auto matches = loopbit::match_features(query, match, loopbit::RelativePoseOptions().max_ratio);
  const double error_px = loopbit::VerificationOptions().max_epipolar_error_px;
  if (loopbit::epipolar_inliers(query, match, matches, error_px).size() < kLoopInliers) {
    matches.clear();
  }
  return matches;
}

/// Loops of one drive: revisits by ground truth, the nearest place of each.
void bench_drive(const WorldOptions& options, int every, bool is_plain, WorldErrors& errors) {
  const World world(options);
  loopbit::SurfExtractor surf;
  RelativePoseEstimator estimator;
  std::map<int, Features> features;
  const auto features_of = [&](int frame) -> const Features& {
    const auto [at, is_new] = features.try_emplace(frame);
    if (is_new) surf.extract(loopbit::gray_image(world.render(frame)), at->second);
    return at->second;
  };
  const auto relative = [&](int target, int source) {
    return world.T_world_camera(target).inv() * world.T_world_camera(source);
  };
  int last = -every;
  for (const loopbit::PlaceRun& run : world.same_place()) {
    if (run.query - last < every || world.blank(run.query)) continue;
    last = run.query;
    // Not the nearest: of the places from first to last, by the query's number.
    const int span = run.last - run.first + 1;
    const int match = run.first + (run.query * 7) % span;
    const CameraModel query_camera = world.camera(run.query);
    const CameraModel match_camera = world.camera(match);
    const cv::Matx44d truth = relative(match, run.query);
    PoseRequest request{.query = {&features_of(run.query), &query_camera},
                        .match = {&features_of(match), &match_camera},
                        .matches = {}};
    const auto matches = matches_of_loop(request);
    if (matches.empty()) continue;
    request.matches = matches;
    errors.monocular.add(timed(estimator, request, errors.monocular), truth);
    // Odometry: the frames before and after the match.
    const int before = std::max(0, match - 1);
    const int after = std::min(options.frames - 1, match + 1);
    const CameraModel before_camera = world.camera(before);
    const CameraModel after_camera = world.camera(after);
    const std::vector<NearbyView> beside{
        {{&features_of(before), &before_camera}, relative(match, before)},
        {{&features_of(after), &after_camera}, relative(match, after)}};
    PoseRequest odometry = request;
    odometry.beside = beside;
    errors.odometry.add(timed(estimator, odometry, errors.odometry), truth);
    Features right;
    surf.extract(loopbit::gray_image(world.render(match, kStereo_m)), right);
    cv::Matx44d T_match_right = cv::Matx44d::eye();
    T_match_right(0, 3) = kStereo_m;
    const std::vector<NearbyView> pair{{{&right, &match_camera}, T_match_right}};
    PoseRequest stereo = request;
    stereo.beside = pair;
    errors.stereo.add(timed(estimator, stereo, errors.stereo), truth);
    const cv::Mat1f depth_m = world.depth_m(match);
    PoseRequest depth = request;
    depth.match_depth_m = &depth_m;
    errors.depth.add(timed(estimator, depth, errors.depth), truth);
    if (is_plain) {
      const auto a = loopbit::bench::orb(loopbit::gray_image(world.render(run.query)));
      const auto b = loopbit::bench::orb(loopbit::gray_image(world.render(match)));
      const double start_ms = thread_ms();
      const RelativePose plain =
          baseline_pose(a, b, match_camera, loopbit::bench::orb_inliers(a, b));
      errors.baseline.time_ms.push_back(thread_ms() - start_ms);
      errors.baseline.add(plain, truth);
    }
    while (features.size() > 64) features.erase(features.begin());
  }
}

/// A recorded sequence with the pose of each image.
struct Sequence {
  fs::path folder;
  std::string order;  ///< a list of the images; empty = all in the folder
  std::string truth;
  CameraModel camera;
};

struct SequenceErrors {
  Errors monocular;
  Errors odometry;
};

std::vector<cv::Matx44d> read_matrices(const fs::path& file) {
  std::ifstream stream(file);
  std::vector<cv::Matx44d> poses;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream row(line);
    cv::Matx44d pose = cv::Matx44d::eye();
    for (int i = 0; i < 12; ++i) row >> pose.val[i];
    if (row) poses.push_back(pose);
  }
  return poses;
}

std::vector<std::string> image_names(const Sequence& sequence) {
  std::vector<std::string> names;
  if (sequence.order.empty()) {
    for (const auto& entry : fs::directory_iterator(sequence.folder / "images")) {
      names.push_back("images/" + entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  std::ifstream stream(sequence.folder / sequence.order);
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty() && line[0] != '#') {
      names.push_back("images/" + fs::path(line).filename().string());
    }
  }
  return names;
}

/// The pose of each image: rows of poses.txt belong to the images in the order of their names.
std::vector<cv::Matx44d> poses_of(const Sequence& sequence, const std::vector<std::string>& names) {
  const auto rows = read_matrices(sequence.folder / "poses.txt");
  std::vector<std::string> sorted = names;
  std::sort(sorted.begin(), sorted.end());
  std::vector<cv::Matx44d> poses;
  for (const std::string& name : names) {
    const auto at = std::lower_bound(sorted.begin(), sorted.end(), name) - sorted.begin();
    poses.push_back(rows.at(static_cast<std::size_t>(at)));
  }
  return poses;
}

/// True revisits of a recorded sequence: of each run of places its middle.
SequenceErrors bench_sequence(const Sequence& sequence) {
  const auto names = image_names(sequence);
  const auto poses = poses_of(sequence, names);
  std::vector<Features> features;
  for (const std::string& name : names) {
    features.push_back(loopbit::extract_surf(
        loopbit::gray_image(cv::imread((sequence.folder / name).string(), cv::IMREAD_UNCHANGED))));
  }
  const auto at = [](int frame) { return static_cast<std::size_t>(frame); };
  SequenceErrors errors;
  RelativePoseEstimator estimator;
  for (const loopbit::PlaceRun& run :
       loopbit::read_place_runs((sequence.folder / sequence.truth).string())) {
    const int match = (run.first + run.last) / 2;
    PoseRequest request{.query = {&features[at(run.query)], &sequence.camera},
                        .match = {&features[at(match)], &sequence.camera},
                        .matches = {}};
    const auto matches = matches_of_loop(request);
    if (matches.empty()) continue;
    request.matches = matches;
    const cv::Matx44d truth = poses[at(match)].inv() * poses[at(run.query)];
    errors.monocular.add(timed(estimator, request, errors.monocular), truth);
    std::vector<NearbyView> beside;
    for (const int frame : {match - 1, match + 1}) {
      if (frame < 0 || at(frame) >= names.size()) continue;
      beside.push_back(
          {{&features[at(frame)], &sequence.camera}, poses[at(match)].inv() * poses[at(frame)]});
    }
    request.beside = beside;
    errors.odometry.add(timed(estimator, request, errors.odometry), truth);
  }
  return errors;
}

SequenceErrors bench_recorded(const char* name, const Sequence& sequence) {
  SequenceErrors errors = bench_sequence(sequence);
  errors.monocular.print(fmt::format("{} monocular", name));
  errors.odometry.print(fmt::format("{} odometry", name));
  return errors;
}

/// What a detector finds in drives through a fisheye lens.
struct FisheyeLoops {
  int revisits = 0;
  int found = 0;
  int wrong = 0;
};

bool is_listed(const std::vector<loopbit::PlaceRun>& runs, const loopbit::Detection& detection) {
  return std::any_of(runs.begin(), runs.end(), [&](const loopbit::PlaceRun& run) {
    return run.query == detection.frame && run.first <= *detection.match &&
           *detection.match <= run.last;
  });
}

void count_loops(const World& world, const std::vector<cv::Mat>& images,
                 const std::optional<CameraModel>& camera, FisheyeLoops& loops) {
  std::set<int> revisits;
  for (const loopbit::PlaceRun& run : world.same_place()) revisits.insert(run.query);
  const std::vector<loopbit::PlaceRun> near = world.near_place();
  loops.revisits += static_cast<int>(revisits.size());
  loopbit::LoopDetector detector;
  detector.set_camera(camera);
  for (const cv::Mat& image : images) {
    const loopbit::Detection detection = detector.process(image);
    if (detection.status != loopbit::Status::loop) continue;
    if (!is_listed(near, detection)) ++loops.wrong;
    if (is_listed(near, detection) && revisits.contains(detection.frame)) ++loops.found;
  }
}

/// Drives 3 m beside the first lap in other light; prints and returns the recall without and with
/// the camera.
std::pair<double, double> bench_fisheye(int drives) {
  FisheyeLoops without;
  FisheyeLoops with;
  for (int drive = 0; drive < drives; ++drive) {
    WorldOptions options;
    options.seed = 1 + drive;
    options.frames = 300;
    options.fisheye_deg = 150;
    options.lateral_offset_m = 3;
    options.light_change = 1;
    const World world(options);
    std::vector<cv::Mat> images;
    for (int frame = 0; frame < options.frames; ++frame) images.push_back(world.render(frame));
    count_loops(world, images, std::nullopt, without);
    count_loops(world, images, world.camera(0), with);
  }
  const auto recall = [](const FisheyeLoops& loops) {
    return static_cast<double>(loops.found) / loops.revisits;
  };
  fmt::print(
      "fisheye, {} revisits          without a camera {} found, {} wrong  with one {} found, "
      "{} wrong\n",
      with.revisits, without.found, without.wrong, with.found, with.wrong);
  return {recall(without), recall(with)};
}

void bench(int drives, const fs::path& data) {
  WorldErrors errors;
  for (int drive = 0; drive < drives; ++drive) {
    WorldOptions options;
    options.seed = 1 + drive;
    bench_drive(options, 3, drive == 0, errors);
  }
  errors.monocular.print("world monocular");
  errors.odometry.print("world odometry");
  errors.stereo.print("world stereo");
  errors.depth.print("world depth");
  errors.baseline.print("world ORB + OpenCV");
  SequenceErrors two_pass;
  SequenceErrors euroc;
  if (fs::is_directory(data / "kitti03")) {
    const CameraModel kitti{.fx = 721.5377, .fy = 721.5377, .cx = 609.5593, .cy = 172.854};
    two_pass =
        bench_recorded("kitti03 two pass", {data / "kitti03", "two_pass_order.txt",
                                            "two_pass_truth.csv", resolution(kitti, {1242, 375})});
    const CameraModel v1{.lens = loopbit::Lens::radial_tangential,
                         .size_px = {752, 480},
                         .fx = 458.654,
                         .fy = 457.296,
                         .cx = 367.215,
                         .cy = 248.375,
                         .distortion = {-0.28340811, 0.07395907, 0.00019359, 0.0000176187}};
    euroc = bench_recorded("euroc_room", {data / "euroc_room", "", "truth.csv", v1});
    const CameraModel head =
        loopbit::read_camera((data / "office_tour" / "camera-intrinsics.txt").string());
    bench_recorded("office_tour",
                   {data / "office_tour", "", "truth.csv", resolution(head, {540, 360})});
  }
  constexpr int kFisheyeDrives = 3;
  const auto [recall_without, recall_with] = bench_fisheye(std::min(drives, kFisheyeDrives));
  fmt::print(
      "poses world_rotation_deg={:.3f} world_direction_deg={:.2f} metric_percent={:.2f} "
      "nees_ratio={:.2f} nees_median_ratio={:.2f} nees_monocular_ratio={:.2f} "
      "two_pass_rotation_deg={:.3f} "
      "euroc_rotation_deg={:.3f} fisheye_recall_without={:.3f} fisheye_recall_with={:.3f} "
      "pose_ms={:.2f}\n",
      quantile(errors.monocular.rotation_deg, 0.5), quantile(errors.monocular.direction_deg, 0.5),
      quantile(errors.odometry.metric_percent, 0.5), mean(errors.odometry.nees_ratio),
      quantile(errors.odometry.nees_ratio, 0.5), mean(errors.monocular.nees_ratio),
      quantile(two_pass.monocular.rotation_deg, 0.5), quantile(euroc.monocular.rotation_deg, 0.5),
      recall_without, recall_with, quantile(errors.monocular.time_ms, 0.5));
}

}  // namespace

int main(int argc, char** argv) {
  return loopbit::bench::run_main(
      "bench_poses", [&] { bench(argc > 1 ? std::stoi(argv[1]) : 1, argc > 2 ? argv[2] : ""); });
}
