// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/descriptor.hpp"
#include "loopbit/instruction_set.hpp"
#include "loopbit/options.hpp"

namespace loopbit {

/// A SURF keypoint in pixels of the working image (see SurfOptions::working_area_px).
struct Keypoint {
  float x_px = 0;
  float y_px = 0;
  float scale = 0;      ///< sigma in px; a 9 x 9 box filter has 1.2
  float angle_rad = 0;  ///< 0 for upright features
};

/// Upper limit for the longer side of a working image, which matters for very narrow images.
inline constexpr int kMaxWorkingSide_px = 16384;

/// The features of one image; keypoints[i] belongs to descriptors[i]. Dark blobs come first, then
/// bright ones, each sorted by strength.
struct Features {
  cv::Size working_size_px;
  std::size_t num_dark = 0;
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;

  [[nodiscard]] const Keypoint& keypoint(int index) const {
    return keypoints[static_cast<std::size_t>(index)];
  }
};

struct SurfOptions {
  int working_area_px = 640 * 480;
  int max_keypoints = 600;
  bool upright = true;

  static constexpr auto fields() {
    using S = SurfOptions;
    return std::tuple{
        Field{"working_area_px", &S::working_area_px, 64 * 64, 4096 * 4096,
              "images are scaled to about this many pixels before features are extracted"},
        Field{"max_keypoints", &S::max_keypoints, 50, 10000,
              "number of strongest keypoints kept per image"},
        switch_field("upright", &S::upright,
                     "features do not rotate with the image; for cameras that stay level")};
  }
};

/// Extracts features from images of any size. It keeps its working memory, about 12 bytes per
/// working pixel. For images of a known size it allocates only what `features` needs and what
/// OpenCV needs to resize. Not thread-safe; use one per thread.
class SurfExtractor {
 public:
  /// Throws Error (kind option) if `options` are not valid.
  explicit SurfExtractor(const SurfOptions& options = {},
                         InstructionSet instruction_set = active_instruction_set());
  ~SurfExtractor();
  SurfExtractor(const SurfExtractor&) = delete;
  SurfExtractor& operator=(const SurfExtractor&) = delete;
  SurfExtractor(SurfExtractor&&) noexcept;
  SurfExtractor& operator=(SurfExtractor&&) noexcept;

  /// See extract_surf. Replaces `features`. With a mask, there are none whose centre lies on a
  /// pixel of value 0. Throws Error (kind input) if `mask` has another size than `gray`; empty = no
  /// mask.
  void extract(const cv::Mat1b& gray, Features& features, const cv::Mat1b& mask = {});

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// SURF features of `gray`, 8 bits, at least 32 x 32 pixels. Throws Error (kind input) if it is
/// smaller.
///
/// Bay, Ess, Tuytelaars, Van Gool, "Speeded-Up Robust Features", CVIU 2008. The strongest
/// `max_keypoints` are kept; a grid cell may have at most three times its share of them. Responses
/// within the noise of 8 bits are dropped, so dark images have fewer features. The same image gives
/// the same bits with every instruction set. Cost: see scripts/bench_surf.
Features extract_surf(const cv::Mat1b& gray, const SurfOptions& options = {});

}  // namespace loopbit
