// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace loopbit {

/// The run that a new one replaces in its folder. It is set aside in a folder `earlier_run` inside,
/// a run folder as any other, so that nothing that goes wrong with the new run costs it. At any
/// moment, also of a crash, it is whole in one of the two places, or will be after the next run.
class EarlierRun {
 public:
  /// Makes `folder`, and sets the run in it aside. If one is aside that another run failed to
  /// replace, that stays, and what is left of the failed one is removed. Throws Error (kind output)
  /// if there is a run and `overwrite` is not set, if one of its files is among `inputs` or of no
  /// run (a data set has a truth.csv, too), or if the disk refuses; then all is as it was.
  EarlierRun(std::filesystem::path folder, bool overwrite, const std::vector<std::string>& inputs);

  /// Puts the run back in the place of the new one unless told otherwise.
  ~EarlierRun();

  EarlierRun(const EarlierRun&) = delete;
  EarlierRun& operator=(const EarlierRun&) = delete;
  EarlierRun(EarlierRun&&) = delete;
  EarlierRun& operator=(EarlierRun&&) = delete;

  /// The new run has something to keep, too: both stay where they are.
  void leave_aside() { goes_back_ = false; }

  /// The new run has ended.
  void remove();

 private:
  void set_aside();
  void put_back();

  std::filesystem::path folder_;
  std::filesystem::path aside_;
  std::filesystem::path part_;  ///< on the way there, or back
  bool is_aside_ = false;
  bool goes_back_ = true;
};

}  // namespace loopbit
