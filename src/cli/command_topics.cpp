// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/printable.hpp"
#include "loopbit/recordings.hpp"

#include "commands.hpp"
#include "process.hpp"

namespace loopbit::cli {
namespace {

struct TopicsFlags {
  std::string recording;
  bool json = false;
};

/// Messages per second, over the whole recording; 0 if that has no duration.
double rate_hz(const Topic& topic, const RecordingInfo& info) {
  return info.duration_s > 0 ? static_cast<double>(topic.messages) / info.duration_s : 0.0;
}

void print_topics_json(const RecordingInfo& info) {
  nlohmann::ordered_json json{{"description", info.description},
                              {"duration_s", info.duration_s},
                              {"topics", nlohmann::ordered_json::array()}};
  for (const Topic& topic : info.topics) {
    json["topics"].push_back({{"name", topic.name},
                              {"type", topic.type},
                              {"messages", topic.messages},
                              {"rate_hz", rate_hz(topic, info)},
                              {"has_images", topic.has_images}});
  }
  print_document(json);
}

void print_topics_table(const RecordingInfo& info) {
  std::size_t width = 0;
  for (const Topic& topic : info.topics) {
    width = std::max(width, printable(topic.name).size());
  }
  fmt::print("{}, {:.1f} s\n", printable(info.description), info.duration_s);
  fmt::print("{:>8}  {:>7}  {:<6}  {:<{}}  {}\n", "messages", "Hz", "images", "topic", width,
             "type");
  for (const Topic& topic : info.topics) {
    fmt::print("{:>8}  {:>7.1f}  {:<6}  {:<{}}  {}\n", topic.messages, rate_hz(topic, info),
               topic.has_images ? "yes" : "", printable(topic.name), width, printable(topic.type));
  }
}

void topics_command(const TopicsFlags& flags) {
  const RecordingInfo info = read_recording_info(flags.recording);
  (flags.json ? print_topics_json : print_topics_table)(info);
  if (!info.damage.empty()) tell(fmt::format("loopbit: {}\n", info.damage));
}

}  // namespace

void add_topics(CLI::App& app) {
  auto flags = std::make_shared<TopicsFlags>();
  CLI::App* command = app.add_subcommand("topics", "List the topics of a ROS bag or MCAP file");
  command
      ->add_option("RECORDING", flags->recording,
                   "A file .bag, .db3 or .mcap, or the folder of a ROS 2 bag")
      ->required();
  command->add_flag("--json", flags->json, "Print one JSON object");
  command->callback([flags] { topics_command(*flags); });
}

}  // namespace loopbit::cli
