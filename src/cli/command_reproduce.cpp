// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/run_folder.hpp"

#include "commands.hpp"
#include "run_list.hpp"
#include "session.hpp"

namespace loopbit::cli {
namespace {

namespace fs = std::filesystem;

/// A row of the tables of Wang et al. 2019: recall in percent at full precision, mean time in ms.
struct PaperRow {
  std::string_view name;    ///< in the table
  std::string_view folder;  ///< below the data, letters and digits only
  double recall_percent;
  double mean_ms;
  std::optional<double> fab_map_percent;
  std::optional<double> dbow2_percent;
};

constexpr std::array kPaper{
    PaperRow{"KITTI 00", "00", 54.9, 130, 32.2, 57.2},
    PaperRow{"KITTI 02", "02", 47.7, 129, 23.4, 38.9},
    PaperRow{"KITTI 05", "05", 62.5, 118, 35.3, 54.0},
    PaperRow{"City Centre", "citycentre", 27.7, 86, std::nullopt, std::nullopt},
    PaperRow{"New College", "newcollege", 20.9, 92, std::nullopt, std::nullopt},
};

/// Where a set's images are, and how to score them.
struct PublicSet {
  std::string images;
  int every = 1;
  int views = 1;  ///< see RunRecord::views
  ScoringRequest truth;
};

struct ReproduceFlags {
  SessionFlags session;
  std::string data;
};

struct ReproducedRow {
  const PaperRow* paper;
  ReportRun run;
};

std::string letters_and_digits(const std::string& name) {
  std::string kept;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0) kept += static_cast<char>(std::tolower(byte));
  }
  return kept;
}

/// The entries of a folder, sorted by name; none if it is no folder.
std::vector<fs::path> entries(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    paths.push_back(entry->path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// The archives of poses and of calibrations make folders for sequences, too.
bool has_images(const std::string& sequence) {
  try {
    (void)open_source(sequence);
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// KITTI odometry as it is unpacked: sequences/NN/image_0 and poses/NN.txt, also below `dataset`.
std::optional<PublicSet> find_kitti(const fs::path& data, std::string_view sequence) {
  for (const char* below : {".", "dataset", "kitti", "KITTI", "kitti/dataset", "KITTI/dataset"}) {
    const fs::path root = (data / below).lexically_normal();
    const fs::path images = root / "sequences" / sequence;
    const fs::path poses = root / "poses" / (std::string(sequence) + ".txt");
    std::error_code error;
    if (!fs::is_directory(images, error) || !fs::is_regular_file(poses, error)) continue;
    if (!has_images(images.string())) continue;
    PublicSet set;
    set.images = images.string();
    set.truth.truth = poses.string();
    set.truth.protocol = "kitti";
    return set;
  }
  return std::nullopt;
}

std::optional<std::size_t> frames_in(const std::string& images) {
  return open_source(images)->size();
}

bool has_rows_for(const ScoringRequest& truth, std::size_t frames) {
  try {
    (void)truth.resolve({.times_s = FrameTimes(frames)});
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Later versions of FAB-MAP's matrices have rows for the left images only.
bool tells_of_left_only(const ScoringRequest& truth, std::size_t images) {
  if (has_rows_for(truth, images)) return false;
  const GroundTruth loops = truth.resolve({}).truth.value();
  return std::ranges::all_of(loops.same_place, [&](const PlaceRun& run) {
    return 2 * static_cast<std::size_t>(run.query) < images;
  });
}

/// A set of FAB-MAP's: a folder Images with left and right images in turn, and beside it a .mat
/// file whose name says "truth".
std::optional<PublicSet> find_fab_map_set(const fs::path& data, std::string_view name) {
  for (const fs::path& folder : entries(data)) {
    if (letters_and_digits(folder.filename().string()) != name) continue;
    PublicSet set;
    std::error_code error;
    for (const fs::path& entry : entries(folder)) {
      const std::string entry_name = letters_and_digits(entry.filename().string());
      if (entry_name == "images" && fs::is_directory(entry, error)) set.images = entry.string();
      const bool is_truth = entry_name.find("truth") != std::string::npos;
      if (is_truth && entry.extension() == ".mat") set.truth.truth = entry.string();
    }
    if (set.images.empty() || set.truth.truth.empty()) continue;
    if (tells_of_left_only(set.truth, frames_in(set.images).value_or(0))) set.every = set.views = 2;
    return set;
  }
  return std::nullopt;
}

std::optional<PublicSet> find_set(const fs::path& data, const PaperRow& row) {
  return row.name.starts_with("KITTI") ? find_kitti(data, row.folder)
                                       : find_fab_map_set(data, row.folder);
}

/// Runs one set into a folder of its own. Returns the exit code.
int run_set(const PublicSet& set, const SessionFlags& flags, const Arguments& arguments) {
  Session session;
  set.truth.check(1, std::nullopt, false);
  session.source = subsample(open_source(set.images), static_cast<std::size_t>(set.every), 0);
  session.input = set.images;
  session.arguments = arguments;
  session.truth_files = {set.truth.truth};
  session.truth_description = set.truth.description();
  session.every = set.every;
  session.views = set.views;
  // Every frame that the truth counts is read.
  session.scoring = [&](const FrameTimes& times_s) {
    return set.truth.resolve({.times_s = times_s});
  };
  session.positions = [&](const FrameTimes& times_s) {
    const std::string file = set.truth.poses_file();
    return file.empty() ? Positions{} : read_positions(file, times_s);
  };
  return run_session(std::move(session), flags);
}

std::string percent(std::optional<double> value) {
  return value ? fmt::format("{:.1f}", *value) : "-";
}

void print_table(const std::vector<ReproducedRow>& rows) {
  fmt::print(
      "\nRecall in percent. loopbit: as decided, and swept to full precision, by query; pairs as "
      "decided.\nPaper: Wang et al. 2019, full precision; its FAB-MAP and DBoW2 beside it. Times "
      "on "
      "different machines.\n\n"
      "             ------------ loopbit ------------   ------- paper -------\n"
      "set          decided  wrong  swept  pairs    ms   recall    ms  FAB-MAP  DBoW2\n");
  for (const auto& [paper, run] : rows) {
    const Evaluation e = evaluate(run.list, *run.truth, run.evaluation);
    const double mean_ms = summarize(run.run->detections, total_ms).mean;
    fmt::print("{:<12} {:7.1f}  {:5}  {:5.1f}  {:5.1f}  {:4.0f}   {:6.1f}  {:4.0f}  {:>7}  {:>5}\n",
               paper->name, 100 * e.decision.recall(), e.decision.wrong,
               100 * e.recall_at_full_precision, 100 * e.pairs.recall(), mean_ms,
               paper->recall_percent, paper->mean_ms, percent(paper->fab_map_percent),
               percent(paper->dbow2_percent));
  }
}

/// Runs what is there; returns the exit code of the first run that did not end well.
int run_sets(const ReproduceFlags& flags, const Arguments& arguments,
             std::vector<ReproducedRow>& rows, std::string& missing) {
  for (const PaperRow& paper : kPaper) {
    const auto set = find_set(flags.data, paper);
    if (!set) {
      missing += fmt::format("\n  {}", paper.name);
      continue;
    }
    SessionFlags session = flags.session;
    session.out =
        (fs::path(flags.session.out) / letters_and_digits(std::string(paper.name))).string();
    fmt::print("\n{}\n", paper.name);
    if (const int exit_code = run_set(*set, session, arguments); exit_code != success)
      return exit_code;
    rows.push_back({&paper, report_run(session.out)});
  }
  return success;
}

int reproduce_command(const ReproduceFlags& flags, const Arguments& arguments) {
  std::vector<ReproducedRow> rows;
  std::string missing;
  int exit_code = success;
  try {
    exit_code = run_sets(flags, arguments, rows, missing);
  } catch (const Error&) {
    if (!rows.empty()) print_table(rows);
    throw;
  }
  if (rows.empty() && exit_code == success) {
    throw Error(ErrorKind::input,
                fmt::format("'{}' holds none of the paper's data sets; see 'loopbit reproduce "
                            "--help' for where they are looked for.",
                            flags.data));
  }
  if (!rows.empty()) print_table(rows);
  if (!missing.empty()) fmt::print("\nNot found, and left out:{}\n", missing);
  return exit_code;
}

}  // namespace

void add_reproduce(CLI::App& app, const Arguments& arguments, int& exit_code) {
  auto flags = std::make_shared<ReproduceFlags>();
  CLI::App* command =
      app.add_subcommand("reproduce", "Reproduce the tables of the paper on the public data sets");
  command->add_option("DATA", flags->data, "The folder with the data sets")->required();
  command->add_option("--out", flags->session.out, "Folder for the runs, one per data set")
      ->type_name("DIR")
      ->required();
  flags->session.add_to(*command);
  command->footer(
      "Expected in DATA, as published:\n"
      "  KITTI odometry 00, 02, 05: sequences/00/image_0 and poses/00.txt, also below dataset,\n"
      "    kitti or KITTI; scored by --protocol kitti\n"
      "  City Centre, New College: a folder CityCentre or NewCollege with Images and a .mat file\n"
      "    whose name says truth; scored by its cells\n"
      "Missing sets are listed and skipped.");
  command->callback(
      [flags, &arguments, &exit_code] { exit_code = reproduce_command(*flags, arguments); });
}

}  // namespace loopbit::cli
