// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/evidence.hpp"
#include "loopbit/place_index.hpp"

namespace loopbit {

/// Frames that are saved together: as many of the latest ones may not be in the file yet.
inline constexpr int kFramesPerTransaction = 32;

/// The picture of a frame and the evidence of its decision, stored for people.
struct StoredEvidence {
  std::vector<unsigned char> picture_jpeg;  ///< see picture_jpeg()
  std::vector<unsigned char> saliency_png;  ///< 64 x 64, 8 bits; 255 = the map's largest value
  BinaryContent content;
  std::vector<PointPair> inliers;
};

/// Reads evidence.db. Throws Error (kind input) if it is damaged.
class EvidenceReader {
 public:
  explicit EvidenceReader(const std::string& path);
  ~EvidenceReader();
  EvidenceReader(const EvidenceReader&) = delete;
  EvidenceReader& operator=(const EvidenceReader&) = delete;
  EvidenceReader(EvidenceReader&&) noexcept;
  EvidenceReader& operator=(EvidenceReader&&) noexcept;

  /// False if there is no evidence for `frame`.
  bool read(PlaceId frame, StoredEvidence& evidence) const;

  /// Calls back with each frame's content, in order.
  void for_each_content(const std::function<void(PlaceId, const BinaryContent&)>& visit) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit
