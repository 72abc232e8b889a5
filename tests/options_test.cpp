// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/options.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "loopbit/loop_detector_options.hpp"

#include "test_support.hpp"

namespace loopbit::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The struct and its list of fields

/// Stands for a value of any type, to count the members of an aggregate.
struct Anything {
  template <typename Value>
  operator Value() const;  // NOLINT(google-explicit-constructor)
};

/// How many members the aggregate has: as many as it can be initialised with.
template <typename Struct, typename... Values>
constexpr std::size_t count_members() {
  if constexpr (requires { Struct{Values{}..., Anything{}}; }) {
    return count_members<Struct, Values..., Anything>();
  } else {
    return sizeof...(Values);
  }
}

template <typename Struct>
constexpr bool lists_all_fields() {
  return std::tuple_size_v<decltype(Struct::fields())> == count_members<Struct>();
}

struct ThreeMembers {
  int a = 0;
  double b = 0;
  bool c = false;
};

static_assert(count_members<ThreeMembers>() == 3);
static_assert(lists_all_fields<BinaryContentOptions>());
static_assert(lists_all_fields<RetrievalOptions>());
static_assert(lists_all_fields<SurfOptions>());
static_assert(lists_all_fields<VerificationOptions>());
static_assert(lists_all_fields<ExclusionOptions>());
static_assert(lists_all_fields<DecisionOptions>());

std::vector<std::string> section_names() {
  std::vector<std::string> names;
  const LoopDetectorOptions options;
  for_each_section(options, [&](std::string_view name, const auto&) { names.emplace_back(name); });
  return names;
}

TEST(OptionFields, EverySectionIsVisited) {
  EXPECT_EQ(section_names(),
            (std::vector<std::string>{"binary_content", "retrieval", "surf", "verification",
                                      "exclusion", "decision", "odometry"}));
  EXPECT_EQ(section_names().size(), count_members<LoopDetectorOptions>());
}

/// Each field names the member in its place: where the fields are set to numbers by their names,
/// an aggregate's members have them in order.
TEST(OptionFields, AreInTheOrderOfTheMembers) {
  RetrievalOptions retrieval;
  int value = 1;
  for_each_field<RetrievalOptions>([&](const auto& field) {
    retrieval.*field.member = static_cast<std::remove_cvref_t<decltype(field.min)>>(value++);
  });
  EXPECT_EQ(retrieval.max_candidates, 1);
  EXPECT_EQ(retrieval.min_similarity, 2);
  EXPECT_EQ(retrieval.shift_tolerance_columns, 3);
  EXPECT_EQ(retrieval.min_spacing, 4);
}

TEST(OptionFields, HaveANameOfTheirOwnAHelpTextAndARange) {
  const LoopDetectorOptions options;
  for_each_section(options, [](std::string_view section, const auto& part) {
    using Part = std::remove_cvref_t<decltype(part)>;
    std::set<std::string_view> names;
    for_each_field<Part>([&](const auto& field) {
      EXPECT_TRUE(names.insert(field.name).second) << section << '.' << field.name;
      EXPECT_GT(field.help.size(), 10U) << section << '.' << field.name;
      EXPECT_LT(field.min, field.max) << section << '.' << field.name;
    });
  });
}

TEST(OptionFields, DefaultsAreValid) { EXPECT_NO_THROW(validate(LoopDetectorOptions{})); }

// Validation

TEST(Validation, NamesFieldValueAndRange) {
  expect_error(ErrorKind::option, {"binary_content.gamma is 0.5, but must be between 1.1 and 16."},
               [] { validate(BinaryContentOptions{.gamma = 0.5}, "binary_content"); });
  expect_error(ErrorKind::option, {"exclusion.frames is -1, but must be between 0 and 1000000000."},
               [] { validate(ExclusionOptions{.frames = -1}, "exclusion"); });
}

/// Both ends of the field's range are allowed, and what lies beyond is not.
template <typename Struct, typename Value>
void expect_range_holds(const Field<Struct, Value>& field) {
  SCOPED_TRACE(field.name);
  const auto check = [&](Value value) {
    Struct options;
    options.*field.member = value;
    validate(options, "section");
  };
  const auto beyond = static_cast<Value>(std::is_same_v<Value, int> ? 1 : 1e-6);
  EXPECT_NO_THROW(check(field.min));
  EXPECT_NO_THROW(check(field.max));
  expect_error(ErrorKind::option, {field.name}, [&] { check(field.min - beyond); });
  expect_error(ErrorKind::option, {field.name}, [&] { check(field.max + beyond); });
}

template <typename Struct>
void expect_range_holds(const Field<Struct, bool>&) {}

template <typename Struct>
void expect_ranges_hold() {
  for_each_field<Struct>([](const auto& field) { expect_range_holds(field); });
}

TEST(Validation, HoldsForEachFieldOfEachSection) {
  expect_ranges_hold<BinaryContentOptions>();
  expect_ranges_hold<RetrievalOptions>();
  expect_ranges_hold<SurfOptions>();
  expect_ranges_hold<VerificationOptions>();
  expect_ranges_hold<ExclusionOptions>();
  expect_ranges_hold<DecisionOptions>();
}

TEST(Validation, RefusesWhatIsNoNumber) {
  expect_error(ErrorKind::option, {"verification.max_ratio is nan, but must be between 0.1 and 1."},
               [] { validate(VerificationOptions{.max_ratio = kNan}, "verification"); });
  expect_error(ErrorKind::option, {"decision.min_score is inf"},
               [] { validate(DecisionOptions{.min_score = INFINITY}, "decision"); });
}

TEST(Validation, OfAllSectionsNamesTheSection) {
  LoopDetectorOptions options;
  options.surf.max_keypoints = 1;
  expect_error(ErrorKind::option, {"surf.max_keypoints is 1"}, [&] { validate(options); });
  options = {};
  options.decision.min_score = -1;
  expect_error(ErrorKind::option, {"decision.min_score is -1"}, [&] { validate(options); });
}

TEST(Validation, TheScoreIsAProbabilityOrANumberOfMatches) {
  LoopDetectorOptions options;
  options.decision.min_score = 1;
  EXPECT_NO_THROW(validate(options));
  options.decision.min_score = 30;
  expect_error(ErrorKind::option, {"decision.min_score is 30", "count_matches=false", "at most 1"},
               [&] { validate(options); });
  options.decision.count_matches = true;
  EXPECT_NO_THROW(validate(options));
  options.decision.min_score = 0.98;
  expect_error(ErrorKind::option,
               {"decision.min_score is 0.98", "count_matches=true", "at least 1"},
               [&] { validate(options); });
}

TEST(Validation, ExclusionIsFixedByFramesOrBySeconds) {
  LoopDetectorOptions options;
  options.exclusion.frames = 30;
  EXPECT_NO_THROW(validate(options));
  options.exclusion.seconds = 2.5;
  expect_error(ErrorKind::option, {"exclusion.frames is 30", "exclusion.seconds is 2.5", "0"},
               [&] { validate(options); });
  options.exclusion.frames = 0;
  EXPECT_NO_THROW(validate(options));
}

// Settings by name

TEST(SetOption, TakesEveryListedDefault) {
  LoopDetectorOptions options;
  for (const OptionInfo& info : list_options()) {
    EXPECT_NO_THROW(set_option(options, info.name, info.default_value)) << info.name;
  }
  EXPECT_EQ(to_json(options), to_json({}));
}

TEST(SetOption, ChangesTheOneThatIsNamed) {
  LoopDetectorOptions options;
  set_option(options, "surf.max_keypoints", "500");
  set_option(options, "surf.upright", "false");
  set_option(options, "retrieval.min_similarity", "0.125");
  set_option(options, "exclusion.seconds", "1e3");
  EXPECT_EQ(options.surf.max_keypoints, 500);
  EXPECT_FALSE(options.surf.upright);
  EXPECT_EQ(options.retrieval.min_similarity, 0.125);
  EXPECT_EQ(options.exclusion.seconds, 1000.0);
  options.surf = {};
  options.retrieval = {};
  options.exclusion = {};
  EXPECT_EQ(to_json(options), to_json({}));
}

TEST(SetOption, UnknownNamesAreErrorsThatListTheKnown) {
  LoopDetectorOptions options;
  for (const char* name : {"surf.max_keypoint", "max_keypoints", "", "surf.", "surf",
                           "SURF.max_keypoints", "surf.max_keypoints ", "surf..max_keypoints",
                           "surf.max_keypoints.x", ".max_keypoints", "."}) {
    expect_error(ErrorKind::option,
                 {"'" + std::string(name) + "'", "surf.max_keypoints", "decision.min_score"},
                 [&] { set_option(options, name, "100"); });
  }
}

TEST(SetOption, ValuesOfTheWrongTypeAreErrors) {
  LoopDetectorOptions options;
  for (const char* value : {"", "many", "500.5", "500 ", " 500", "5e2", "true", "0x200"}) {
    expect_error(ErrorKind::option,
                 {"surf.max_keypoints", "'" + std::string(value) + "'", "whole number"},
                 [&] { set_option(options, "surf.max_keypoints", value); });
  }
  for (const char* value : {"", "much", "0.5px", "false", "0,5"}) {
    expect_error(ErrorKind::option, {"binary_content.gamma", "a number"},
                 [&] { set_option(options, "binary_content.gamma", value); });
  }
  for (const char* value : {"", "1", "yes", "True"}) {
    expect_error(ErrorKind::option, {"surf.upright", "true or false"},
                 [&] { set_option(options, "surf.upright", value); });
  }
  EXPECT_EQ(to_json(options), to_json({}));
}

TEST(SetOption, ValuesOutOfRangeAreErrors) {
  LoopDetectorOptions options;
  expect_error(ErrorKind::option, {"surf.max_keypoints is 49", "50 and 10000"},
               [&] { set_option(options, "surf.max_keypoints", "49"); });
  expect_error(ErrorKind::option, {"binary_content.gamma is nan", "1.1 and 16"},
               [&] { set_option(options, "binary_content.gamma", "nan"); });
  expect_error(ErrorKind::option, {"binary_content.gamma is inf", "1.1 and 16"},
               [&] { set_option(options, "binary_content.gamma", "inf"); });
}

TEST(SetOption, RefusedValueLeavesTheSettingAsItWas) {
  LoopDetectorOptions options;
  EXPECT_THROW(set_option(options, "surf.max_keypoints", "49"), Error);
  EXPECT_THROW(set_option(options, "binary_content.gamma", "nan"), Error);
  EXPECT_EQ(to_json(options), to_json({}));
}

TEST(ListOptions, TellsNameDefaultRangeAndMeaning) {
  const auto list = list_options();
  std::size_t fields = 0;
  const LoopDetectorOptions options;
  for_each_section(options, [&](std::string_view, const auto& part) {
    fields += std::tuple_size_v<decltype(std::remove_cvref_t<decltype(part)>::fields())>;
  });
  EXPECT_EQ(list.size(), fields);
  const auto find = [&](std::string_view name) {
    return *std::find_if(list.begin(), list.end(),
                         [&](const OptionInfo& info) { return info.name == name; });
  };
  EXPECT_EQ(find("surf.upright").default_value, "true");
  EXPECT_EQ(find("surf.upright").range, "true or false");
  EXPECT_EQ(find("verification.max_epipolar_error_px").range, "0.1 to 50");
  EXPECT_NE(find("exclusion.seconds").help.find("seconds"), std::string::npos);
}

// Presets

TEST(Presets, AreValid) {
  for (const std::string_view name : kPresets) EXPECT_NO_THROW(validate(preset(name))) << name;
  EXPECT_EQ(to_json(preset("default")), to_json({}));
  EXPECT_TRUE(preset("paper").decision.count_matches);
}

TEST(Presets, UnknownNameIsToldTheKnownOnes) {
  expect_error(ErrorKind::option, {"'papers'", "default paper"},
               [] { static_cast<void>(preset("papers")); });
}

// JSON

/// Every setting differs from its default.
LoopDetectorOptions changed_options() {
  LoopDetectorOptions options;
  options.binary_content = {.gamma = 2.1, .blur_sigma_px = 1.0 / 3.0, .residual_radius_px = 2};
  options.binary_content.blur_sigma_px += 1;
  options.retrieval = {7, 0.1, 2, 9};
  options.surf = {8000, 123, false};
  options.verification = {40, 3, 0.75, 11, 1.3, 4.5};
  options.exclusion = {5, 40, 0.0, 17};
  options.decision = {87.5, true};
  return options;
}

TEST(OptionsJson, HoldsChangedValues) {
  const LoopDetectorOptions options = changed_options();
  const LoopDetectorOptions read = options_from_json(to_json(options), "test");
  EXPECT_EQ(to_json(read), to_json(options));
  EXPECT_EQ(read.binary_content.blur_sigma_px, options.binary_content.blur_sigma_px);
  EXPECT_EQ(read.retrieval.min_spacing, 9);
  EXPECT_FALSE(read.surf.upright);
  EXPECT_EQ(read.verification.max_ratio, 0.75);
  EXPECT_EQ(read.exclusion.frames, 40);
  EXPECT_EQ(read.decision.min_score, 87.5);
  EXPECT_TRUE(read.decision.count_matches);
}

TEST(OptionsJson, WhatIsNotNamedKeepsItsDefault) {
  EXPECT_EQ(to_json(options_from_json("{}", "test")), to_json({}));
  const auto options = options_from_json(R"({"surf": {"max_keypoints": 99}, "decision": {}})", "t");
  EXPECT_EQ(options.surf.max_keypoints, 99);
  LoopDetectorOptions expected;
  expected.surf.max_keypoints = 99;
  EXPECT_EQ(to_json(options), to_json(expected));
}

TEST(OptionsJson, CommentsAreAllowed) {
  const auto options = options_from_json(R"(// a file
    {"surf": { // features
      "max_keypoints": 99 // fewer
    }})",
                                         "test");
  EXPECT_EQ(options.surf.max_keypoints, 99);
}

TEST(OptionsJson, WholeNumbersAreNumbersToo) {
  EXPECT_EQ(options_from_json(R"({"decision": {"min_score": 1}})", "t").decision.min_score, 1.0);
}

void expect_json_error(const std::string& json, std::initializer_list<std::string_view> parts) {
  SCOPED_TRACE(json);
  expect_error(ErrorKind::option, parts, [&] { options_from_json(json, "robot.json"); });
}

TEST(OptionsJson, ErrorsNameTheSource) {
  expect_json_error(R"({"surf": {"max_keypoints": 1}})",
                    {"robot.json", "surf.max_keypoints is 1", "50 and 10000"});
  expect_json_error(R"({"surf": {"max_keypoint": 100}})", {"robot.json", "'surf.max_keypoint'"});
  expect_json_error(R"({"sift": {"max_keypoints": 100}})", {"robot.json", "sift"});
  expect_json_error(R"({"exclusion": {"frames": 5, "seconds": 5}})",
                    {"robot.json", "exclusion.frames", "exclusion.seconds"});
}

TEST(OptionsJson, WrongTypesAreErrors) {
  expect_json_error(R"({"surf": {"max_keypoints": "100"}})", {"robot.json", "surf.max_keypoints"});
  expect_json_error(R"({"surf": {"max_keypoints": 100.5}})", {"whole number"});
  expect_json_error(R"({"surf": {"max_keypoints": null}})", {"surf.max_keypoints", "null"});
  expect_json_error(R"({"surf": {"max_keypoints": [1]}})", {"surf.max_keypoints"});
  expect_json_error(R"({"surf": {"upright": 1}})", {"surf.upright", "true or false"});
  expect_json_error(R"({"surf": {"max_keypoints": true}})", {"surf.max_keypoints"});
  expect_json_error(R"({"surf": 5})", {"robot.json", "surf", "object"});
  expect_json_error("[]", {"robot.json", "object"});
  expect_json_error("17", {"robot.json", "object"});
}

TEST(OptionsJson, BadSyntaxNamesTheLine) {
  expect_json_error("{\n\"surf\": {\n\"max_keypoints\": }}", {"robot.json", "JSON", "line 3"});
  expect_json_error("", {"robot.json", "JSON"});
  expect_json_error("{\"surf\": {}} x", {"robot.json", "JSON"});
}

class OptionsFile : public ScratchTest {};

TEST_F(OptionsFile, IsRead) {
  const auto options = load_options(write("a.json", to_json(changed_options())));
  EXPECT_EQ(to_json(options), to_json(changed_options()));
}

TEST_F(OptionsFile, IsNamedInErrors) {
  const std::string file = write("bad.json", R"({"surf": {"max_keypoints": 1}})");
  expect_error(ErrorKind::option, {file, "surf.max_keypoints"}, [&] { load_options(file); });
}

TEST_F(OptionsFile, ThatCannotBeReadIsAnInputError) {
  expect_error(ErrorKind::input, {path("none.json")}, [&] { load_options(path("none.json")); });
  expect_error(ErrorKind::input, {path("")}, [&] { load_options(path("")); });
}

TEST_F(OptionsFile, ThatIsNoTextOrTooLongIsAnInputError) {
  expect_error(ErrorKind::input, {"/dev/zero", "device"}, [] { load_options("/dev/zero"); });
  const std::string file = write("nul.json", std::string("{\"surf\": {}}\0", 13));
  expect_error(ErrorKind::input, {file, "NUL"}, [&] { load_options(file); });
  const std::string long_one = write("long.json", std::string((1U << 20U) + 1, ' '));
  expect_error(ErrorKind::input, {long_one, "more than"}, [&] { load_options(long_one); });
}

TEST_F(OptionsFile, ThatIsEmptyIsBadSyntax) {
  const std::string file = write("empty.json", "");
  expect_error(ErrorKind::option, {file, "JSON"}, [&] { load_options(file); });
}

TEST(OptionsFromJson, NumbersBeyondAnyRangeAreNamed) {
  expect_error(ErrorKind::option, {"a.json"},
               [] { options_from_json(R"({"surf": {"max_keypoints": 1e999}})", "a.json"); });
}

TEST(OptionsFromJson, UnknownSectionsAreRefusedEvenIfEmpty) {
  expect_error(ErrorKind::option, {"a.json", "'sruf'", "surf", "decision"},
               [] { options_from_json(R"({"sruf": {}})", "a.json"); });
}

TEST(OptionsFromJson, DeeplyNestedOnesAreRefused) {
  const std::string open(200'000, '[');
  const std::string close(200'000, ']');
  expect_error(ErrorKind::option, {"a.json", "nested"},
               [&] { options_from_json(R"({"surf": )" + open + close + "}", "a.json"); });
}

TEST(OptionsFromJson, WhatStandsTwiceIsRefused) {
  for (const std::string json : {R"({"surf": {"max_keypoints": 100}, "surf": {"upright": false}})",
                                 R"({"surf": {"upright": true, "surf": 1, "upright": false}})"}) {
    const std::string name = json.find("max") != std::string::npos ? "'surf'" : "'upright'";
    expect_error(ErrorKind::option, {"a.json", name, "twice"},
                 [&] { options_from_json(json, "a.json"); });
  }
  const std::string once =
      R"({"surf": {"max_keypoints": 100}, "verification": {"max_ratio": 0.7}})";
  EXPECT_EQ(options_from_json(once, "a.json").surf.max_keypoints, 100);
}

TEST(SetOption, ARefusedValueChangesNothing) {
  LoopDetectorOptions options;
  EXPECT_THROW(set_option(options, "surf.max_keypoints", "49"), Error);
  EXPECT_EQ(to_json(options), to_json({}));
}

}  // namespace
}  // namespace loopbit::test
