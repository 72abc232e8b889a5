// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// SURF, matching and the whole detector against their bounds and dlib's SURF: see
// scripts/bench_surf. One thread, its processor time; both sides of a ratio take turns, and medians
// are compared.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "loopbit/image_source.hpp"
#include "loopbit/kernels_for.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/median.hpp"
#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

#include "hessian_pyramid.hpp"
#include "integral_image.hpp"
#include "measure.hpp"
#include "patch.hpp"
#include "surf_kernels.hpp"
#include "surf_peers.hpp"
#include "surf_quality.hpp"

namespace loopbit::bench {
namespace {

namespace fs = std::filesystem;

double time_ms(const std::function<void()>& action) {
  const double start_ms = thread_ms();
  action();
  return thread_ms() - start_ms;
}

double median_ms(int repeats, const std::function<void()>& action) {
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(repeats));
  for (int i = 0; i < repeats; ++i) times.push_back(time_ms(action));
  return median(times);
}

/// What the machine can do at most, measured here.
struct Machine {
  double bytes_per_ms = 0;   ///< copied within the level 2 cache, read and written
  double cycles_per_ms = 0;  ///< a chain of additions takes one each
};

Machine measure_machine() {
  std::vector<char> from(std::size_t{512} * 1024, 1);
  std::vector<char> to(from.size());
  const double copy_ms = median_ms(99, [&] { std::memcpy(to.data(), from.data(), to.size()); });
  constexpr int kAdditions = 4'000'000;
  const double chain_ms = median_ms(9, [] {
    std::uint64_t sum = 0;
    for (int i = 0; i < kAdditions; ++i) asm volatile("" : "+r"(sum += 1));
  });
  return {2.0 * static_cast<double>(to.size()) / copy_ms, kAdditions / chain_ms};
}

void print_part(const char* name, double ms, double bound_ms, const char* bound) {
  fmt::print("  {:22} {:8.3f} {:10.3f}   {}\n", name, ms, bound_ms, bound);
}

/// The time of each part beside the least it could take.
void print_parts(const cv::Mat1b& image, const Machine& machine) {
  const InstructionSet set = active_instruction_set();
  const auto& kernels = kernels_for<SurfKernels>(set);
  const double pixels = image.size().area();
  const bool wide = set == InstructionSet::avx512;
  const double lanes = wide ? 16 : set == InstructionSet::avx2 ? 8 : 4;
  IntegralImage integral;
  HessianPyramid pyramid;
  std::vector<Maximum> maxima;
  const double integral_ms = median_ms(99, [&] { integral.load(image, kernels); });
  const double pyramid_ms = median_ms(99, [&] { pyramid.build(integral, kernels); });
  const double maxima_ms = median_ms(99, [&] {
    maxima.clear();
    pyramid.find_maxima(1.0F, kernels, maxima);
  });
  const Features features = extract_surf(image, {.working_area_px = image.cols * image.rows});
  Patch patch{};
  Descriptor descriptor{};
  const double patches_ms = median_ms(99, [&] {
    for (const Keypoint& k : features.keypoints) upright_patch(integral, k, kernels, patch);
  });
  const double describe_ms = median_ms(99, [&] {
    for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
      kernels.describe(patch.data(), descriptor.data());
    }
  });
  // 4 new layers at every second pixel, then twice 2 at half the rows: 5.75 quarters of the pixels.
  const double samples = pixels / 4 * 5.75;
  const auto blobs = static_cast<double>(features.keypoints.size());
  fmt::print("Parts at {} x {}, {} keypoints, {} kernels     ms   bound ms   bound by\n",
             image.cols, image.rows, features.keypoints.size(), to_string(set));
  print_part("integral image", integral_ms, pixels / 2 / machine.cycles_per_ms,
             "one addition for two pixels, in a chain");
  print_part("Hessian", pyramid_ms, samples * 30 / lanes / 2 / machine.cycles_per_ms,
             "30 vector loads for a vector of samples, 2 a cycle");
  print_part("maxima", maxima_ms, pixels / 4 * 2 * 13 / lanes / 2 / machine.cycles_per_ms,
             "13 vector loads for a vector of samples, 2 a cycle");
  print_part("patches", patches_ms, blobs * 22 * 22 / 2 / machine.cycles_per_ms,
             "484 corners a keypoint, 2 loads a cycle");
  print_part("descriptors", describe_ms,
             blobs * (26 * 20 * 16 + 64 * 14) / lanes / 2 / machine.cycles_per_ms,
             "operations on floats, 2 vectors a cycle");
  fmt::print("  (level 2 cache: {:.1f} GB/s copied; {:.2f} GHz)\n", machine.bytes_per_ms / 1e6,
             machine.cycles_per_ms / 1e6);
}

/// Median over the images of dlib's time over ours, for as many keypoints.
double surf_speedup(const std::vector<cv::Mat1b>& images) {
  constexpr int kRepeats = 7;
  std::vector<double> own_all;
  std::vector<double> peer_all;
  std::vector<double> ratios;
  for (const cv::Mat1b& image : images) {
    SurfOptions options{.working_area_px = image.cols * image.rows};
    const auto count = [&](const Features& f) { return static_cast<int>(f.keypoints.size()); };
    // As many as the one that finds fewer; it may be a little short of its own budget again.
    options.max_keypoints = std::min(count(extract_surf(image, options)),
                                     count(dlib_surf(image, options.max_keypoints, true)));
    SurfExtractor extractor(options);
    Features features;
    std::vector<double> own;
    std::vector<double> peer;
    for (int i = 0; i < kRepeats; ++i) {
      own.push_back(time_ms([&] { extractor.extract(image, features); }));
      peer.push_back(time_ms([&] { features = dlib_surf(image, options.max_keypoints, true); }));
    }
    own_all.push_back(median(own));
    peer_all.push_back(median(peer));
    ratios.push_back(peer_all.back() / own_all.back());
  }
  const double ratio = median(ratios);
  fmt::print("{} x {}: loopbit {:.3f} ms, dlib {:.3f} ms, {:.1f} times\n", images.front().cols,
             images.front().rows, median(own_all), median(peer_all), ratio);
  return ratio;
}

double match_500_ms(const cv::Mat1b& first, const cv::Mat1b& second) {
  const SurfOptions options{.max_keypoints = 500};
  const Features query = extract_surf(first, options);
  const Features place = extract_surf(second, options);
  double best_ms = 0;
  for (const InstructionSet set : available_instruction_sets()) {
    Verifier verifier({}, set);
    Verification result;
    best_ms = median_ms(199, [&] { verifier.match(query, place, result); });
    fmt::print("{} x {} descriptors, {} kernels: {:.4f} ms, {} matches\n", query.descriptors.size(),
               place.descriptors.size(), to_string(set), best_ms, result.matches.size());
  }
  return best_ms;
}

std::vector<cv::Mat> read_all(const fs::path& folder) {
  std::vector<cv::Mat> images;
  const auto source = open_source(folder.string());
  for (Frame frame; source->next(frame);) images.push_back(frame.image.clone());
  return images;
}

/// Mean time a frame of the whole detector, images decoded before: the median of several runs.
double detector_mean_ms(const fs::path& folder) {
  constexpr int kRuns = 5;
  const auto images = read_all(folder);
  std::vector<double> means;
  std::vector<double> all;
  for (int run = 0; run < kRuns; ++run) {
    LoopDetector detector;
    std::vector<double> frames;
    frames.reserve(images.size());
    for (const cv::Mat& image : images) frames.push_back(time_ms([&] { detector.process(image); }));
    double sum = 0;
    for (const double frame : frames) sum += frame;
    means.push_back(sum / static_cast<double>(frames.size()));
    all.insert(all.end(), frames.begin(), frames.end());
  }
  std::sort(all.begin(), all.end());
  fmt::print("{}: mean {:.2f} ms per frame, p99 {:.2f} ms\n",
             folder.parent_path().filename().string(), median(means), all[all.size() * 99 / 100]);
  return median(means);
}

cv::Mat1b resized(const cv::Mat& image, cv::Size size) {
  cv::Mat gray = image;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  cv::resize(gray, gray, size, 0, 0, cv::INTER_AREA);
  return gray;
}

int main(const fs::path& data) {
  cv::setNumThreads(1);
  std::vector<cv::Mat1b> full;
  std::vector<cv::Mat1b> working;
  const auto drive = read_all(data / "kitti03/images");
  for (std::size_t i = 0; i < drive.size(); i += 40) full.emplace_back(drive[i]);
  for (const char* folder : {"euroc_room/images", "corridor_loop/images"}) {
    const auto images = read_all(data / folder);
    for (std::size_t i = 0; i < images.size(); i += 20) {
      working.push_back(resized(images[i], {640, 480}));
    }
  }
  const Machine machine = measure_machine();
  print_parts(full.front(), machine);
  print_parts(working.front(), machine);
  const double speedup_full = surf_speedup(full);
  const double speedup_working = surf_speedup(working);
  const auto read = [&](const char* name) {
    return cv::Mat1b(cv::imread((data / name).string(), cv::IMREAD_GRAYSCALE));
  };
  const double match_ms =
      match_500_ms(read("euroc_pairs/left_img_0.png"), read("euroc_pairs/right_img_0.png"));
  const double kitti_ms = detector_mean_ms(data / "kitti03/images");
  const double corridor_ms = detector_mean_ms(data / "corridor_loop/images");
  print_quality(data);
  fmt::print(
      "surf_speedup_full={:.1f} surf_speedup_working={:.1f} match_500_ms={:.4f} "
      "kitti03_mean_ms={:.2f} corridor_loop_mean_ms={:.2f}\n",
      speedup_full, speedup_working, match_ms, kitti_ms, corridor_ms);
  return 0;
}

}  // namespace
}  // namespace loopbit::bench

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "bench_surf: give the folder of real images.\n");
    return 2;
  }
  return loopbit::bench::main(argv[1]);
}
