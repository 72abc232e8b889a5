// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/surf.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/gray_image.hpp"
#include "loopbit/image_shrinker.hpp"
#include "loopbit/kernels_for.hpp"

#include "hessian_pyramid.hpp"
#include "integral_image.hpp"
#include "patch.hpp"
#include "surf_kernels.hpp"

namespace loopbit {
namespace {

/// In squared grey levels. Rounding pixels to whole grey levels gives a flat area responses with a
/// deviation of 0.0005, in the smallest filters that find blobs (15 x 15 px). This is twenty times
/// as much: in fog, blobs may be hardly stronger.
constexpr float kMinResponse = 0.01F;
/// Down to this factor, linear interpolation takes every pixel into account; it is much faster than
/// averaging areas.
constexpr double kLeastLinearFactor = 0.5;
/// The grid's cells are about this wide and high, at least one.
constexpr int kGridCellPx = 80;
/// A cell may hold this many times its share of the budget.
constexpr int kMaxShares = 3;

/// Where the middle of a scaled pixel lies between the middles of two pixels, along one axis;
/// within the image.
struct Between {
  Between(int scaled, int scaled_size, int size) {
    const double at = (scaled + 0.5) * size / scaled_size - 0.5;
    const double within = std::clamp(at, 0.0, size - 1.0);
    first = static_cast<int>(within);
    // Rounded without a call of lround().
    next_weight = (static_cast<std::int32_t>((within - first) * 512) + 1) / 2;
  }

  int first = 0;
  std::int32_t next_weight = 0;  ///< 0 to 256
};

struct Blob {
  Maximum maximum;
  Keypoint keypoint;
  bool bright = false;
};

bool stronger(const Maximum& a, const Maximum& b) {
  return std::tuple(-a.response, a.octave, a.y, a.x, a.interval) <
         std::tuple(-b.response, b.octave, b.y, b.x, b.interval);
}

/// Keeps the first `most` items in the order of `is_before`, themselves in any order.
template <typename Item, typename IsBefore>
void keep_first(std::vector<Item>& items, std::size_t most, const IsBefore& is_before) {
  if (items.size() <= most) return;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(most), items.end(),
                   is_before);
  items.resize(most);
}

void check_mask(const cv::Mat1b& mask, cv::Size size_px) {
  if (mask.empty() || mask.size() == size_px) return;
  throw Error(ErrorKind::input,
              fmt::format("The image has {} x {} pixels, but the mask has {} x {}; give a mask of "
                          "the same size.",
                          size_px.width, size_px.height, mask.cols, mask.rows));
}

}  // namespace

class SurfExtractor::Impl {
 public:
  Impl(const SurfOptions& options, InstructionSet instruction_set)
      : options_(options),
        kernels_(kernels_for<SurfKernels>(instruction_set)),
        shrinker_(instruction_set) {
    validate(options, "surf");
  }

  void extract(const cv::Mat1b& gray, Features& features, const cv::Mat1b& mask) {
    check_size(gray);
    check_mask(mask, gray.size());
    integral_.load(smoothed(working_image(gray)), kernels_);
    pyramid_.build(integral_, kernels_);
    maxima_.clear();
    pyramid_.find_maxima(kMinResponse, kernels_, maxima_);
    if (!mask.empty()) {
      std::erase_if(maxima_, [&](const Maximum& m) {
        const int step = HessianPyramid::step_px(m.octave);
        return is_masked(mask, m.x * step, m.y * step);
      });
    }
    spread();
    locate(mask);
    describe(features);
  }

 private:
  const cv::Mat1b& working_image(const cv::Mat1b& gray) {
    const double area = static_cast<double>(gray.cols) * gray.rows;
    const double factor =
        std::min(std::sqrt(options_.working_area_px / area),
                 static_cast<double>(kMaxWorkingSide_px) / std::max(gray.cols, gray.rows));
    const cv::Size size(std::max(1, cvRound(gray.cols * factor)),
                        std::max(1, cvRound(gray.rows * factor)));
    if (size == gray.size()) return gray;
    if (factor < kLeastLinearFactor) {
      shrinker_.shrink(gray, size, working_);
    } else {
      interpolate(gray, size);
    }
    return working_;
  }

  /// Boxes are square, so that they find other blobs where an image is turned; of a smooth image,
  /// less so. Three means of 3 pixels along either axis are as a Gaussian of 1.4 px.
  const cv::Mat1b& smoothed(const cv::Mat1b& working) {
    if (options_.upright) return working;
    constexpr int kReach = 3;
    constexpr unsigned kWeights = 27 * 27;
    const auto weighted = [](unsigned a, unsigned b, unsigned c, unsigned d, unsigned e, unsigned f,
                             unsigned g) { return a + 3 * b + 6 * c + 7 * d + 6 * e + 3 * f + g; };
    const int width = working.cols;
    smoothed_.create(working.size());
    down_sums_.resize(static_cast<std::size_t>(width) + 2 * std::size_t{kReach});
    unsigned* sums = down_sums_.data() + kReach;
    for (int y = 0; y < working.rows; ++y) {
      const auto row = [&](int k) { return working[std::clamp(y + k, 0, working.rows - 1)]; };
      const std::array r{row(-3), row(-2), row(-1), row(0), row(1), row(2), row(3)};
      for (int x = 0; x < width; ++x) {
        sums[x] = weighted(r[0][x], r[1][x], r[2][x], r[3][x], r[4][x], r[5][x], r[6][x]);
      }
      std::fill_n(sums - kReach, kReach, sums[0]);
      std::fill_n(sums + width, kReach, sums[width - 1]);
      for (int x = 0; x < width; ++x) {
        const unsigned* s = sums + x;
        const unsigned sum = weighted(s[-3], s[-2], s[-1], s[0], s[1], s[2], s[3]);
        smoothed_(y, x) = static_cast<std::uint8_t>((sum + kWeights / 2) / kWeights);
      }
    }
    return smoothed_;
  }

  /// Linearly, as OpenCV's INTER_LINEAR_EXACT and in half the time.
  void interpolate(const cv::Mat1b& gray, cv::Size size) {
    working_.create(size);
    const auto width = static_cast<std::size_t>(size.width);
    columns_.resize(width);
    right_weights_.resize(width);
    for (int x = 0; x < size.width; ++x) {
      const Between at(x, size.width, gray.cols);
      columns_[static_cast<std::size_t>(x)] = at.first;
      right_weights_[static_cast<std::size_t>(x)] = at.next_weight;
    }
    blended_.resize(static_cast<std::size_t>(gray.cols) + 1);
    pairs_.resize(blended_.size());
    LinearRow from{.width = static_cast<std::uint32_t>(gray.cols),
                   .columns = columns_.data(),
                   .right_weights = right_weights_.data()};
    for (int y = 0; y < size.height; ++y) {
      const Between at(y, size.height, gray.rows);
      from.upper = gray[at.first];
      from.lower = gray[std::min(at.first + 1, gray.rows - 1)];
      from.lower_weight = at.next_weight;
      kernels_.linear_row(from, width, blended_.data(), pairs_.data(), working_[y]);
    }
  }

  /// Keeps the strongest maxima of each cell of a grid.
  void spread() {
    const cv::Size size = integral_.size_px();
    const int columns = std::max(1, size.width / kGridCellPx);
    const int rows = std::max(1, size.height / kGridCellPx);
    const auto cell_of = [&](const Maximum& m) {
      const int step = HessianPyramid::step_px(m.octave);
      const int row = m.y * step * rows / size.height;
      const int cell = row * columns + m.x * step * columns / size.width;
      return static_cast<std::size_t>(cell);
    };
    const auto num_cells = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    const std::size_t limit =
        kMaxShares * static_cast<std::size_t>(options_.max_keypoints) / num_cells + 1;
    cells_.resize(std::max(cells_.size(), num_cells));
    for (auto& cell : cells_) cell.clear();
    for (const Maximum& m : maxima_) cells_[cell_of(m)].push_back(m);
    maxima_.clear();
    for (auto& cell : cells_) {
      keep_first(cell, limit, stronger);
      maxima_.insert(maxima_.end(), cell.begin(), cell.end());
    }
  }

  [[nodiscard]] bool fits(const BlobCenter& at) const {
    const double reach = at.scale * kPatchReachScales * (options_.upright ? 1.0 : std::sqrt(2.0));
    const cv::Size size = integral_.size_px();
    return at.x_px >= reach && at.y_px >= reach && at.x_px + reach <= size.width - 1 &&
           at.y_px + reach <= size.height - 1;
  }

  /// Whether `mask` excludes a point of the working image.
  [[nodiscard]] bool is_masked(const cv::Mat1b& mask, double x_px, double y_px) const {
    const cv::Size size = integral_.size_px();
    const int x = static_cast<int>((x_px + 0.5) * mask.cols / size.width);
    const int y = static_cast<int>((y_px + 0.5) * mask.rows / size.height);
    return mask(std::clamp(y, 0, mask.rows - 1), std::clamp(x, 0, mask.cols - 1)) == 0;
  }

  /// The strongest blobs whose patches lie within the image, dark ones first.
  void locate(const cv::Mat1b& mask) {
    blobs_.clear();
    for (const Maximum& m : maxima_) {
      const auto at = pyramid_.refined(m);
      if (!at || !fits(*at)) continue;
      if (!mask.empty() && is_masked(mask, at->x_px, at->y_px)) continue;
      blobs_.push_back({m,
                        {static_cast<float>(at->x_px), static_cast<float>(at->y_px),
                         static_cast<float>(at->scale), 0.0F},
                        false});
    }
    const auto by_strength = [](const Blob& a, const Blob& b) {
      return stronger(a.maximum, b.maximum);
    };
    keep_first(blobs_, static_cast<std::size_t>(options_.max_keypoints), by_strength);
    for (Blob& blob : blobs_) blob.bright = pyramid_.is_bright(blob.maximum);
    std::sort(blobs_.begin(), blobs_.end(), [&](const Blob& a, const Blob& b) {
      return a.bright != b.bright ? b.bright : by_strength(a, b);
    });
  }

  void describe(Features& features) {
    features.working_size_px = integral_.size_px();
    features.num_dark = static_cast<std::size_t>(
        std::count_if(blobs_.begin(), blobs_.end(), [](const Blob& b) { return !b.bright; }));
    features.keypoints.resize(blobs_.size());
    features.descriptors.resize(blobs_.size());
    for (std::size_t i = 0; i < blobs_.size(); ++i) {
      Keypoint& keypoint = features.keypoints[i];
      keypoint = blobs_[i].keypoint;
      if (options_.upright) {
        upright_patch(integral_, keypoint, kernels_, patch_);
      } else {
        keypoint.angle_rad = dominant_angle(integral_, keypoint);
        turned_patch(integral_, keypoint, patch_);
      }
      kernels_.describe(patch_.data(), features.descriptors[i].data());
    }
  }

  SurfOptions options_;
  const SurfKernels& kernels_;
  ImageShrinker shrinker_;
  cv::Mat1b working_;
  cv::Mat1b smoothed_;
  std::vector<unsigned> down_sums_;
  std::vector<std::int32_t> columns_;
  std::vector<std::int32_t> right_weights_;
  std::vector<std::uint16_t> blended_;
  std::vector<std::uint32_t> pairs_;
  IntegralImage integral_;
  HessianPyramid pyramid_;
  std::vector<Maximum> maxima_;
  std::vector<std::vector<Maximum>> cells_;
  std::vector<Blob> blobs_;
  Patch patch_{};
};

SurfExtractor::SurfExtractor(const SurfOptions& options, InstructionSet instruction_set)
    : impl_(std::make_unique<Impl>(options, instruction_set)) {}
SurfExtractor::~SurfExtractor() = default;
SurfExtractor::SurfExtractor(SurfExtractor&&) noexcept = default;
SurfExtractor& SurfExtractor::operator=(SurfExtractor&&) noexcept = default;

void SurfExtractor::extract(const cv::Mat1b& gray, Features& features, const cv::Mat1b& mask) {
  impl_->extract(gray, features, mask);
}

Features extract_surf(const cv::Mat1b& gray, const SurfOptions& options) {
  Features features;
  SurfExtractor(options).extract(gray, features);
  return features;
}

}  // namespace loopbit
