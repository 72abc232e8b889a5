// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/options.hpp"
#include "loopbit/place_index.hpp"
#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

/// The most recent frames, which are never candidates. If `frames` and `seconds` are both 0, the
/// window covers the time in which the camera has had the current view, and as much again. This
/// works without settings for walking, driving, hand-held and standing cameras at any frame rate.
/// docs/method.md describes the one exception: a camera that has stood still since the run began.
struct ExclusionOptions {
  int min_frames = 10;
  int frames = 0;
  double seconds = 0.0;
  int in_view_inliers = 12;

  static constexpr auto fields() {
    using S = ExclusionOptions;
    return std::tuple{
        Field{"min_frames", &S::min_frames, 1, 1'000'000, "smallest size of the window in frames"},
        Field{"frames", &S::frames, 0, 1'000'000'000,
              "fixed window in frames instead of the automatic one; 0 = automatic"},
        Field{"seconds", &S::seconds, 0.0, 1e9,
              "fixed window in seconds instead of the automatic one; 0 = automatic"},
        Field{"in_view_inliers", &S::in_view_inliers, 8, 1000,
              "automatic window: inliers that a frame must share to be still in view"}};
  }
};

/// The rule that accepts a match: score >= min_score. The score is the probability that the match
/// is right, measured against the map itself; see docs/method.md, section 4.
struct DecisionOptions {
  double min_score = 0.98;
  bool count_matches = false;
  double reach_m = 6.0;
  double reach_up_m = 1.0;

  static constexpr auto fields() {
    using S = DecisionOptions;
    return std::tuple{
        Field{"min_score", &S::min_score, 0.0, 1e9,
              "smallest score of an accepted match: the probability that it is right. 0.98 = a "
              "wrong loop costs as much as 49 missed ones. With count_matches: the number of "
              "matches"},
        switch_field("count_matches", &S::count_matches,
                     "the score is the number of matches, without geometry or frames before, as in "
                     "the paper"),
        Field{"reach_m", &S::reach_m, 0.1, 1e6,
              "with odometry: two views of one place are at most this far apart, m"},
        Field{"reach_up_m", &S::reach_up_m, 0.1, 1e6,
              "with odometry: the same up or down in the image; storeys are 3 m apart"}};
  }
};

/// Every setting of a LoopDetector. The defaults are meant for all data.
struct LoopDetectorOptions {
  BinaryContentOptions binary_content;
  RetrievalOptions retrieval;
  SurfOptions surf;
  VerificationOptions verification;
  ExclusionOptions exclusion;
  DecisionOptions decision;
  OdometryDrift odometry;
};

/// Calls visit(name, part) for each part of `options` (const or not), in order.
template <typename Options, typename Visit>
void for_each_section(Options& options, Visit&& visit) {
  visit("binary_content", options.binary_content);
  visit("retrieval", options.retrieval);
  visit("surf", options.surf);
  visit("verification", options.verification);
  visit("exclusion", options.exclusion);
  visit("decision", options.decision);
  visit("odometry", options.odometry);
}

/// The names that preset() knows.
inline constexpr std::array<std::string_view, 2> kPresets{"default", "paper"};

/// `default`: LoopDetectorOptions{}. `paper`: the pipeline of Wang et al. 2019 as published, to
/// compare with: every earlier place beyond a fixed xi and with a near enough centre M is matched
/// with rotated SURF, and their number decides, without geometry or frames before. The paper names
/// no values; those here are ours. Throws Error (kind option) for other names.
LoopDetectorOptions preset(std::string_view name);

/// Throws Error for the first setting out of its range, and where two settings contradict.
void validate(const LoopDetectorOptions& options);

/// Sets one setting by its full name, as in set_option(options, "surf.max_keypoints", "500").
/// Throws Error (kind option) for an unknown name, or a value of the wrong type or out of range.
void set_option(LoopDetectorOptions& options, const std::string& name, const std::string& value);

/// The settings as JSON text: one object per section, one number or truth value per setting.
std::string to_json(const LoopDetectorOptions& options);

/// The defaults changed by what `json` names; `//` comments are allowed. `source` (a file name) is
/// named in errors. Throws Error (kind option) for bad syntax, unknown names and bad values.
LoopDetectorOptions options_from_json(const std::string& json, const std::string& source);

/// options_from_json of a file. Throws Error (kind input) if it cannot be read.
LoopDetectorOptions load_options(const std::string& path);

/// One setting, for help texts and tables.
struct OptionInfo {
  std::string name;           ///< "section.field"
  std::string default_value;  ///< as set_option would take it
  std::string range;          ///< "0.1 to 50", or "true or false"
  std::string help;
};

/// All settings in order.
std::vector<OptionInfo> list_options();

}  // namespace loopbit
