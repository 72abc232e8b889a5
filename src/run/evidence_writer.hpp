// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "loopbit/evidence_file.hpp"

namespace loopbit {

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

  /// Returns what it stores.
  StoredEvidence add(PlaceId frame, const cv::Mat& image, const Evidence& evidence);

  /// Saves the remaining frames.
  void finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit
