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
  float scale = 0;      ///< sigma in px: a 9 x 9 box filter has 1.2
  float angle_rad = 0;  ///< 0 where features are upright
};

/// However narrow an image is, its longer side is scaled to no more than this.
inline constexpr int kMaxWorkingSide_px = 16384;

/// The features of one image; keypoints[i] belongs to descriptors[i]. Dark blobs come first, then
/// bright ones, each strongest first.
struct Features {
  cv::Size working_size_px;
  std::size_t num_dark = 0;
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
};

struct SurfOptions {
  int working_area_px = 640 * 480;
  int max_keypoints = 600;
  bool upright = true;

  static constexpr auto fields() {
    using S = SurfOptions;
    return std::tuple{
        Field{"working_area_px", &S::working_area_px, 64 * 64, 4096 * 4096,
              "images are scaled up or down to about so many pixels before features are sought"},
        Field{"max_keypoints", &S::max_keypoints, 50, 10000,
              "strongest keypoints kept of an image"},
        switch_field("upright", &S::upright,
                     "features do not turn with the image: for cameras that stay level")};
  }
};

/// Extracts features from image after image of any size. It owns its working memory, about 12 bytes
/// a working pixel, and keeps it: for images of a size it has seen, nothing is allocated but what
/// `features` lacks and what OpenCV needs to resize. Not thread-safe; use one a thread.
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

  /// See extract_surf. Replaces `features`.
  void extract(const cv::Mat1b& gray, Features& features);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// SURF features of `gray`, 8 bits, at least 32 x 32 pixels; throws Error (kind input) if it is
/// smaller.
///
/// Bay, Ess, Tuytelaars, Van Gool, "Speeded-Up Robust Features", CVIU 2008. The budget of keypoints
/// decides: the strongest are kept, of which a cell of a grid may hold three times its share. What
/// 8 bits cannot tell from noise is left out, so dim images have fewer. The same image gives the
/// same bits with every instruction set. Cost: see scripts/bench_surf.
Features extract_surf(const cv::Mat1b& gray, const SurfOptions& options = {});

}  // namespace loopbit
