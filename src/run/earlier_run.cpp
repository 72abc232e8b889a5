// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "earlier_run.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "loopbit/database.hpp"
#include "loopbit/error.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/read_file.hpp"
#include "loopbit/run_record.hpp"
#include "loopbit/write_file.hpp"

#include "run_files.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

/// All that a run may leave; a run that replaces another may not leave its files beside its own.
/// Last those that tell a run from a data set, so that a run half removed is still one.
std::vector<std::string> files_of_a_run() {
  std::vector<std::string> names{
      kTruthFile,     kNotFalseFile,       kIgnoreFile,       kUnknownFile, kPositionsFile,
      kPosesFile,     kPoseGraphFile,      kMatchedPosesFile, kCameraFile,  kTrajectoryFile,
      kCorrectedFile, kCorrectedKittiFile, kJudgedLoopsFile,  kGraphFile,   kLateLoopsFile,
      kReportFile,    kEpochsFile};
  for (const char* suffix : kDatabaseSuffixes) {
    names.push_back(std::string(kEvidenceFile) + suffix);
  }
  names.insert(names.end(), {kRecordFile, kLoopsFile});
  return names;
}

/// Of the files of a run those that are in `folder`.
std::vector<fs::path> run_files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const std::string& name : files_of_a_run()) {
    if (is_there(folder / name)) files.push_back(folder / name);
  }
  return files;
}

/// Throws Error if one of `files`, in `folder` or below, may not be replaced.
void check_replaceable(const fs::path& folder, const std::vector<fs::path>& files, bool overwrite,
                       const std::vector<std::string>& inputs) {
  if (files.empty()) return;
  const fs::path last = files.back().filename();
  if (last != kRecordFile && last != kLoopsFile) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' holds no earlier run, but a file {} that a run might replace; "
                            "name another folder.",
                            folder.string(), last.string()));
  }
  if (!overwrite) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' holds an earlier run ({}); name another folder, or add "
                            "--overwrite to replace it.",
                            folder.string(), files.back().lexically_relative(folder).string()));
  }
  for (const fs::path& file : files) {
    for (const std::string& input : inputs) {
      std::error_code error;
      if (!fs::equivalent(file, input, error)) continue;
      throw Error(ErrorKind::output,
                  fmt::format("'{}' is read by this run, which would replace it; name another "
                              "folder.",
                              input));
    }
  }
}

/// Whether the run in `folder` came to its end, which an interrupt is, too.
bool has_ended(const fs::path& folder) {
  const std::string file = (folder / kRecordFile).string();
  try {
    return run_record_from_json(read_text(file), file).has_ended();
  } catch (const Error&) {  // no record
    return false;
  }
}

/// Removes the files of a run.
void remove_run(const fs::path& folder) {
  std::error_code error;
  for (const fs::path& file : run_files_in(folder)) {
    if (!fs::remove(file, error)) throw cannot_write(file.string(), error.value());
  }
}

/// Moves the files of a run, which takes no space.
void move_run(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to, error);
  if (error) throw cannot_write(to.string(), error.value());
  for (const fs::path& file : run_files_in(from)) {
    fs::rename(file, to / file.filename(), error);
    if (error) throw cannot_write(file.string(), error.value());
  }
}

void rename_folder(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) throw cannot_write(to.string(), error.value());
}

}  // namespace

bool is_run_file(const std::string& name) {
  const std::vector<std::string> names = files_of_a_run();
  return std::ranges::find(names, name) != names.end();
}

EarlierRun::EarlierRun(fs::path folder, bool overwrite, const std::vector<std::string>& inputs)
    : folder_(std::move(folder)),
      aside_(folder_ / kEarlierFolder),
      part_(folder_ / (std::string(kEarlierFolder) + ".part")) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw cannot_write(folder_.string(), error.value());
  std::vector<fs::path> files;
  for (const fs::path& place : {part_, aside_, folder_}) {
    for (const fs::path& file : run_files_in(place)) files.push_back(file);
  }
  check_replaceable(folder_, files, overwrite, inputs);
  if (files.empty()) return;
  set_aside();
  is_aside_ = true;
}

EarlierRun::~EarlierRun() {
  if (!is_aside_ || !goes_back_) return;
  try {
    put_back();
  } catch (...) {  // it stays aside
  }
}

void EarlierRun::set_aside() {
  const bool half_moved = !run_files_in(part_).empty();  // by a run that was killed
  if (!half_moved && is_there(aside_)) {
    if (!has_ended(folder_)) return remove_run(folder_);
    remove_run(aside_);
  }
  try {
    move_run(folder_, part_);
    rename_folder(part_, aside_);
  } catch (const Error&) {
    move_run(part_, folder_);
    throw;
  }
}

void EarlierRun::put_back() {
  remove_run(folder_);
  rename_folder(aside_, part_);
  move_run(part_, folder_);
  std::error_code ignored;
  fs::remove(part_, ignored);
}

void EarlierRun::remove() {
  if (!std::exchange(is_aside_, false)) return;
  remove_run(aside_);
  std::error_code ignored;
  fs::remove(aside_, ignored);  // unless it holds what is not ours
}

}  // namespace loopbit
