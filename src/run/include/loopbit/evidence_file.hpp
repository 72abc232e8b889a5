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

/// The picture of a frame and the evidence of its decision, stored for people.
struct StoredEvidence {
  std::vector<unsigned char> picture_jpeg;  ///< see picture_jpeg()
  std::vector<unsigned char> saliency_png;  ///< 64 x 64, 8 bits; 255 = the map's largest value
  BinaryContent content;
  std::vector<PointPair> inliers;
};

/// Writes evidence.db, a SQLite file with one row per frame; see docs/run_folder.md. After a crash
/// it has all but the last 32 frames. Throws Error (kind output). About 10 KB and 1 ms per frame.
class EvidenceWriter {
 public:
  explicit EvidenceWriter(const std::string& path);
  /// Saves like finish(), but ignores its error, so that a run that failed can be viewed.
  ~EvidenceWriter();
  EvidenceWriter(const EvidenceWriter&) = delete;
  EvidenceWriter& operator=(const EvidenceWriter&) = delete;
  EvidenceWriter(EvidenceWriter&&) = delete;
  EvidenceWriter& operator=(EvidenceWriter&&) = delete;

  void add(PlaceId frame, const cv::Mat& image, const Evidence& evidence);

  /// Saves the remaining frames.
  void finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
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
