// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "surf_quality.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

#include "orb_matching.hpp"
#include "surf_peers.hpp"

namespace loopbit::bench {
namespace {

namespace fs = std::filesystem;

/// What one method makes of two images.
struct Outcome {
  std::vector<cv::Point2f> first;
  std::vector<cv::Point2f> second;
  std::size_t inliers = 0;
};
using Method = std::function<Outcome(const cv::Mat1b&, const cv::Mat1b&, bool upright)>;

cv::Mat1b read(const fs::path& path) { return cv::imread(path.string(), cv::IMREAD_GRAYSCALE); }

std::vector<cv::Point2f> points_of(const Features& features) {
  std::vector<cv::Point2f> points;
  for (const Keypoint& keypoint : features.keypoints) {
    points.emplace_back(keypoint.x_px, keypoint.y_px);
  }
  return points;
}

Outcome compare(const Features& a, const Features& b) {
  return {points_of(a), points_of(b), verify(a, b).inliers.size()};
}

Method ours(int max_keypoints) {
  return [max_keypoints](const cv::Mat1b& a, const cv::Mat1b& b, bool upright) {
    const SurfOptions options{.max_keypoints = max_keypoints, .upright = upright};
    return compare(extract_surf(a, options), extract_surf(b, options));
  };
}

Outcome dlibs(const cv::Mat1b& a, const cv::Mat1b& b, bool upright) {
  const int budget = SurfOptions().max_keypoints;
  return compare(dlib_surf(a, budget, upright), dlib_surf(b, budget, upright));
}

Outcome orbs(const cv::Mat1b& a, const cv::Mat1b& b, bool /*upright*/) {
  const OrbFeatures of_a = orb(a);
  const OrbFeatures of_b = orb(b);
  return {points_of(of_a.positions), points_of(of_b.positions), orb_inliers(of_a, of_b).size()};
}

struct Case {
  std::string name;
  std::vector<std::pair<fs::path, fs::path>> pairs{};
  bool upright = true;
  std::optional<cv::Matx33d> homography = std::nullopt;  ///< first to second, pixels of the files
};

cv::Matx33d read_homography(const fs::path& path) {
  cv::Matx33d h;
  std::ifstream file(path);
  for (double& value : h.val) file >> value;
  return h;
}

std::vector<Case> cases(const fs::path& data) {
  std::vector<Case> all;
  for (int k = 2; k <= 6; ++k) {
    all.push_back({fmt::format("graf 1-{}", k),
                   {{data / "graf/img1.png", data / fmt::format("graf/img{}.png", k)}},
                   false,
                   read_homography(data / fmt::format("graf/H1to{}p", k))});
  }
  Case stereo{.name = "kitti00_stereo"};
  for (const char* frame : {"000000", "001000", "002000"}) {
    stereo.pairs.emplace_back(data / fmt::format("kitti00_stereo/{}_live.png", frame),
                              data / fmt::format("kitti00_stereo/{}_memory.png", frame));
  }
  all.push_back(stereo);
  Case euroc{.name = "euroc_pairs, stereo"};
  for (int i = 0; i < 4; ++i) {
    euroc.pairs.emplace_back(data / fmt::format("euroc_pairs/left_img_{}.png", i),
                             data / fmt::format("euroc_pairs/right_img_{}.png", i));
  }
  all.push_back(euroc);
  all.push_back(
      {.name = "euroc_pairs, large change of view",
       .pairs = {{data / "euroc_pairs/left_img_0.png", data / "euroc_pairs/left_img_1.png"},
                 {data / "euroc_pairs/left_img_2.png", data / "euroc_pairs/left_img_3.png"}}});
  std::vector<fs::path> drive;
  for (const auto& entry : fs::directory_iterator(data / "kitti03/images")) {
    drive.push_back(entry.path());
  }
  std::sort(drive.begin(), drive.end());
  for (const std::size_t gap : {2U, 5U, 10U}) {
    Case apart{.name = fmt::format("kitti03, {} frames apart", gap)};
    for (std::size_t i = 0; i + gap < drive.size(); i += 20) {
      apart.pairs.emplace_back(drive[i], drive[i + gap]);
    }
    all.push_back(apart);
  }
  return all;
}

/// See print_quality.
double repeatability(const Outcome& outcome, const cv::Matx33d& h, cv::Size size) {
  const auto mapped = [](const cv::Matx33d& m, cv::Point2f p) {
    const cv::Vec3d v = m * cv::Vec3d(p.x, p.y, 1);
    return cv::Point2f(static_cast<float>(v[0] / v[2]), static_cast<float>(v[1] / v[2]));
  };
  const cv::Rect2f frame({0, 0}, cv::Size2f(size));
  std::vector<cv::Point2f> first;
  for (const cv::Point2f& p : outcome.first) {
    if (const auto q = mapped(h, p); frame.contains(q)) first.push_back(q);
  }
  std::vector<cv::Point2f> second;
  const cv::Matx33d back = h.inv();
  for (const cv::Point2f& p : outcome.second) {
    if (frame.contains(mapped(back, p))) second.push_back(p);
  }
  const std::size_t fewer = std::min(first.size(), second.size());
  std::size_t met = 0;
  for (const cv::Point2f& p : first) {
    const auto nearest = std::min_element(second.begin(), second.end(), [&](auto a, auto b) {
      return cv::norm(a - p) < cv::norm(b - p);
    });
    if (nearest == second.end() || cv::norm(*nearest - p) > 2.0) continue;
    second.erase(nearest);
    ++met;
  }
  return fewer == 0 ? 0.0 : static_cast<double>(met) / static_cast<double>(fewer);
}

std::string measure(const Case& pairs, const Method& method) {
  double inliers = 0;
  double repeated = 0;
  for (const auto& [a, b] : pairs.pairs) {
    const cv::Mat1b image = read(a);
    const cv::Mat1b first = working_image(image);
    const Outcome outcome = method(first, working_image(read(b)), pairs.upright);
    inliers += static_cast<double>(outcome.inliers);
    if (pairs.homography) {
      const double factor = static_cast<double>(first.cols) / image.cols;
      const cv::Matx33d scale = cv::Matx33d::diag({factor, factor, 1.0});
      repeated = repeatability(outcome, scale * *pairs.homography * scale.inv(), first.size());
    }
  }
  const std::string mean = fmt::format("{:.1f}", inliers / static_cast<double>(pairs.pairs.size()));
  return pairs.homography ? fmt::format("{} ({:.3f})", mean, repeated) : mean;
}

}  // namespace

void print_quality(const fs::path& data) {
  const int budget = SurfOptions().max_keypoints;
  const auto headed = [](const char* name, int keypoints) {
    return fmt::format("{} {}", name, keypoints);
  };
  constexpr const char* kRow = "{:32} {:>14} {:>14} {:>14} {:>14}\n";
  fmt::print("\nMean inliers (repeatability) by pair and number of keypoints\n");
  fmt::print(kRow, "pairs", headed("loopbit", budget), headed("dlib", budget),
             headed("loopbit", kOrbKeypoints), headed("ORB", kOrbKeypoints));
  for (const Case& pairs : cases(data)) {
    fmt::print(kRow, pairs.name, measure(pairs, ours(budget)), measure(pairs, dlibs),
               measure(pairs, ours(kOrbKeypoints)), measure(pairs, orbs));
  }
}

}  // namespace loopbit::bench
