// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/recordings.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "loopbit/error.hpp"
#include "loopbit/image_file.hpp"
#include "loopbit/printable.hpp"

#include "compression.hpp"
#include "image_message.hpp"
#include "motion_message.hpp"
#include "recorded_motion.hpp"

namespace loopbit {

namespace recordings {
namespace {

namespace fs = std::filesystem;

enum class Format : std::uint8_t { none, ros1_bag, ros2_database, mcap };

Format format_of(const fs::path& file) {
  const std::string extension = images::lower_extension(file);
  if (extension == ".bag" ||
      (extension == ".active" && format_of(file.stem()) == Format::ros1_bag)) {
    return Format::ros1_bag;
  }
  if (extension == ".db3") return Format::ros2_database;
  return extension == ".mcap" ? Format::mcap : Format::none;
}

std::string_view to_string(Format format) {
  switch (format) {
    case Format::ros1_bag:
      return "ROS 1 bag";
    case Format::ros2_database:
      return "ROS 2 bag";
    case Format::mcap:
      return "MCAP file";
    case Format::none:
      break;
  }
  return "";
}

std::unique_ptr<RecordingFile> open_file(const fs::path& file, const std::string& topic) {
  switch (format_of(file)) {
    case Format::ros1_bag:
      return open_ros1_bag(file, topic);
    case Format::ros2_database:
      return open_ros2_database(file, topic);
    case Format::mcap:
    case Format::none:
      break;
  }
  return open_mcap(file, topic);
}

/// The files of a ROS 2 bag in `folder`, in natural order; none if it is no such bag. Its
/// metadata.yaml is not read: a recorder that is killed leaves none.
std::vector<fs::path> files_of_folder(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::directory_iterator entry(folder, error), end; entry != end; entry.increment(error)) {
    if (images::is_image_name(entry->path())) return {};
    const Format format = format_of(entry->path());
    if (format == Format::ros2_database || format == Format::mcap) files.push_back(entry->path());
  }
  std::ranges::sort(files, [](const fs::path& a, const fs::path& b) {
    return images::natural_less(a.filename().string(), b.filename().string());
  });
  return files;
}

/// The files of `input`; none if it is no recording.
std::vector<fs::path> files_of(const fs::path& input) {
  std::error_code error;
  if (fs::is_directory(input, error)) return files_of_folder(input);
  if (format_of(input) == Format::none) return {};
  return {input};
}

std::string description_of(const fs::path& input, const std::vector<fs::path>& files) {
  const fs::path named = input.has_filename() ? input : input.parent_path();
  const bool is_folder = files.front() != input;
  return fmt::format("{} {}", is_folder ? "ROS 2 bag" : to_string(format_of(files.front())),
                     named.filename().string());
}

/// The sentence for what RecordingFile::damage() says; empty if it says nothing.
std::string damage_of(const RecordingFile& file, const fs::path& path) {
  const std::string damage = file.damage();
  if (damage.empty()) return {};
  return fmt::format("Recording '{}' {}: copy it again, unless its recorder was stopped.",
                     path.string(), damage);
}

/// Counts messages, for a file without an index.
Contents count_messages(RecordingFile& file) {
  Contents contents;
  std::map<const Channel*, std::uint64_t> counts;
  for (Message message; file.next(message);) {
    ++counts[message.channel];
    contents.add_times(message.time_ns, message.time_ns);
  }
  for (const auto& [channel, count] : counts) contents.channels.push_back({*channel, count});
  return contents;
}

/// Publishers of one topic are one topic. Where their types differ, the one with images counts.
void add_topics(const std::vector<ChannelCount>& channels, std::map<std::string, Topic>& topics) {
  for (const auto& [channel, messages] : channels) {
    Topic& topic = topics[channel.topic];
    topic.name = channel.topic;
    topic.messages += messages;
    if (topic.type.empty() || is_image(channel)) topic.type = channel.type;
    topic.has_images = topic.has_images || is_image(channel);
  }
}

RecordingInfo read_info(const fs::path& input, const std::vector<fs::path>& files) {
  RecordingInfo info{.description = description_of(input, files), .topics = {}};
  std::map<std::string, Topic> topics;
  Contents times;
  for (const fs::path& path : files) {
    const auto file = open_file(path, "");
    auto contents = file->contents();
    if (!contents) contents = count_messages(*file);
    if (info.damage.empty()) info.damage = damage_of(*file, path);
    add_topics(contents->channels, topics);
    times.add_times(contents->first_ns, contents->last_ns);
  }
  for (auto& [name, topic] : topics) info.topics.push_back(std::move(topic));
  if (times.last_ns > times.first_ns) {
    info.duration_s = static_cast<double>(times.last_ns - times.first_ns) / kSecond_ns;
  }
  return info;
}

[[noreturn]] void throw_bad_topic(ErrorKind kind, const std::string& input,
                                  const std::string& what) {
  throw Error(kind, fmt::format("Recording '{}' {}.", input, what));
}

/// The topic to read.
const Topic& choose_topic(const Recording& recording, const std::string& name) {
  const auto& [input, files, info] = recording;
  const auto is_any = [](const Topic&) { return true; };
  const auto has_images = [](const Topic& t) { return t.has_images && t.messages > 0; };
  if (name.empty()) {
    const auto first = std::ranges::find_if(info.topics, has_images);
    if (first == info.topics.end()) {
      throw_bad_topic(ErrorKind::input, input,
                      fmt::format("has no images; record a topic of the type sensor_msgs Image or "
                                  "CompressedImage. Its topics: {}",
                                  list(info.topics, is_any)));
    }
    if (std::ranges::count_if(info.topics, has_images) == 1) return *first;
    throw_bad_topic(ErrorKind::option, input,
                    fmt::format("has several topics with images; choose one: {}",
                                list(info.topics, has_images)));
  }
  const auto topic = std::ranges::find(info.topics, name, &Topic::name);
  if (topic == info.topics.end()) {
    throw_bad_topic(ErrorKind::option, input,
                    fmt::format("has no topic '{}'. Its topics with images: {}; others: 'loopbit "
                                "topics' lists them",
                                name, list(info.topics, has_images)));
  }
  if (has_images(*topic)) return *topic;
  throw_bad_topic(ErrorKind::option, input,
                  fmt::format("has no images on topic '{}' ({}, {} messages). Its topics with "
                              "images: {}",
                              name, topic->type, topic->messages, list(info.topics, has_images)));
}

/// The bytes of a message; `unpacked` holds them if it was compressed. Throws Error (kind input) if
/// it cannot be unpacked; `thing` begins the sentence.
Bytes unpack(const Message& message, std::vector<unsigned char>& unpacked,
             const std::string& thing) {
  if (message.channel->encoding != Encoding::cdr || !is_zstd(message.data)) return message.data;
  if (decompress_zstd(message.data, kMaxMessageBytes, unpacked)) return unpacked;
  throw Error(ErrorKind::input, thing + " is damaged or too large: leave it out.");
}

/// Sets `frame` to the image of `message`, or to the reason why it has none. `input`: its
/// recording.
void read_frame(const Message& message, const std::string& input, int max_megapixels,
                Frame& frame) {
  std::vector<unsigned char> unpacked;
  Stamp stamp = Stamp::of(message.time_ns);
  frame = Frame{stamp.name(), stamp.in_seconds(), {}, {}};
  const std::string thing = fmt::format("An image of '{}' on {}, recorded at {},", input,
                                        message.channel->topic, stamp.name());
  try {
    const ImageMessage image =
        read_image_message(*message.channel, unpack(message, unpacked, thing), thing);
    if (image.header.stamp.is_set()) stamp = image.header.stamp;
    frame = Frame{stamp.name(), stamp.in_seconds(), {}, {}};
    frame.image = decode(image, max_megapixels, thing);
  } catch (const Error& error) {
    frame.error = error.what();
  }
}

class RecordingSource final : public ImageSource {
 public:
  RecordingSource(const Recording& recording, const Topic& topic, const std::string& odometry_topic,
                  int max_megapixels)
      : input_(recording.input),
        files_(recording.files),
        topic_(topic),
        description_(fmt::format("{}, {}", recording.info.description, topic.name)),
        is_whole_(recording.info.damage.empty()),
        max_megapixels_(max_megapixels) {
    if (odometry_topic.empty()) return;
    motion_.emplace(recording, odometry_topic, topic.name);
    description_ += fmt::format(", odometry {}", odometry_topic);
  }

  bool next(Frame& frame) override {
    Message message;
    if (!next_message(message)) return false;
    read_frame(message, input_, max_megapixels_, frame);
    if (motion_) frame.T_odometry_camera = motion_->at(frame.timestamp_s.value());
    return true;
  }

  bool skip() override {
    Message message;
    return next_message(message);
  }

  [[nodiscard]] std::optional<std::size_t> size() const override {
    if (!is_whole_) return std::nullopt;
    return static_cast<std::size_t>(topic_.messages);
  }

  [[nodiscard]] std::string description() const override { return description_; }

  [[nodiscard]] std::string early_end() const override {
    return position_ == files_.size() ? damage_ : "";
  }

 private:
  bool next_message(Message& message) {
    for (; position_ < files_.size(); ++position_) {
      const fs::path& path = files_[position_];
      if (!file_) file_ = open_file(path, topic_.name);
      while (file_->next(message)) {
        if (is_image(*message.channel)) return true;
      }
      if (damage_.empty()) damage_ = damage_of(*file_, path);
      file_.reset();
    }
    return false;
  }

  std::string input_;
  std::vector<fs::path> files_;
  Topic topic_;
  std::string description_;
  bool is_whole_;
  int max_megapixels_;
  std::optional<RecordedMotion> motion_;
  std::size_t position_ = 0;
  std::unique_ptr<RecordingFile> file_;  ///< the current one, once it is read
  std::string damage_;
};

std::vector<fs::path> required_files(const std::string& input) {
  std::vector<fs::path> files = files_of(input);
  if (!files.empty()) return files;
  throw Error(ErrorKind::input,
              fmt::format("'{}' is not a recording: give a file .bag, .db3 or .mcap, or the folder "
                          "of a ROS 2 bag. Files that end in .zstd have to be unpacked with 'zstd "
                          "-d' before.",
                          input));
}

Recording open(const std::string& input) {
  Recording recording{.input = input, .files = required_files(input), .info = {}};
  recording.info = read_info(input, recording.files);
  return recording;
}

/// The topic of the calibration that belongs to the images of a topic, by ROS' custom: camera_info
/// beside it. That of `/camera/image_raw/compressed` is beside `image_raw`.
const Topic* find_camera_info(const RecordingInfo& info, const std::string& images) {
  std::string folder = images;
  for (int level = 0; level < 2; ++level) {
    folder.erase(std::min(folder.size(), folder.rfind('/')));
    const auto topic = std::ranges::find(info.topics, folder + "/camera_info", &Topic::name);
    if (topic != info.topics.end()) return &*topic;
  }
  return nullptr;
}

}  // namespace

void for_each_message(const Recording& recording, const std::string& topic,
                      const ReadMessage& read) {
  std::vector<unsigned char> unpacked;
  for (const fs::path& path : recording.files) {
    const auto file = open_file(path, topic);
    for (Message message; file->next(message);) {
      const std::string thing =
          fmt::format("A message of '{}' on {}, recorded at {},", recording.input, topic,
                      Stamp::of(message.time_ns).name());
      if (!read(message, unpack(message, unpacked, thing), thing)) return;
    }
  }
}

std::string list(const std::vector<Topic>& topics,
                 const std::function<bool(const Topic&)>& is_listed) {
  constexpr std::size_t kMost = 20;
  std::vector<std::string> named;
  for (const Topic& topic : topics) {
    if (!is_listed(topic)) continue;
    named.push_back(fmt::format("{} ({}, {} messages)", topic.name, topic.type, topic.messages));
  }
  if (named.empty()) return "none";
  const std::size_t more = named.size() - std::min(named.size(), kMost);
  named.resize(named.size() - more);
  return fmt::format("{}{}", fmt::join(named, ", "), more ? fmt::format(" and {} more", more) : "");
}

std::string cut_off_after(std::uint64_t bytes) {
  return fmt::format("is cut off after {} bytes, and its last messages are missing", bytes);
}

std::string damaged_chunks(std::size_t count) {
  if (count == 0) return {};
  return fmt::format("has {}, whose messages are missing", counted(count, "damaged chunk"));
}

}  // namespace recordings

bool is_recording(const std::string& input) { return !recordings::files_of(input).empty(); }

RecordingInfo read_recording_info(const std::string& input) {
  return recordings::read_info(input, recordings::required_files(input));
}

std::unique_ptr<ImageSource> open_recording(const std::string& input, const std::string& topic,
                                            int max_megapixels, const std::string& odometry_topic) {
  images::check_max_megapixels(max_megapixels);
  const recordings::Recording recording = recordings::open(input);
  return std::make_unique<recordings::RecordingSource>(
      recording, recordings::choose_topic(recording, topic), odometry_topic, max_megapixels);
}

std::unique_ptr<ImageSource> open_input(const std::string& input, const std::string& topic,
                                        int max_megapixels, const std::string& odometry_topic) {
  if (is_recording(input)) return open_recording(input, topic, max_megapixels, odometry_topic);
  for (const std::string& name : {topic, odometry_topic}) {
    if (name.empty()) continue;
    throw Error(
        ErrorKind::option,
        fmt::format("'{}' is no recording, so it has no topic '{}'; leave the topic out, or give a "
                    "file .bag, .db3 or .mcap, or the folder of a ROS 2 bag.",
                    input, name));
  }
  return open_source(input, max_megapixels);
}

std::string recorded_camera_info(const std::string& input, const std::string& topic) {
  const recordings::Recording recording = recordings::open(input);
  const std::string images = recordings::choose_topic(recording, topic).name;
  const Topic* const info = recordings::find_camera_info(recording.info, images);
  if (info == nullptr) return {};
  const std::string_view last = std::string_view(images).substr(info->name.rfind('/'));
  const bool is_rectified = last.find("rect") != std::string_view::npos;
  std::string yaml;
  recordings::for_each_message(
      recording, info->name,
      [&](const recordings::Message& message, recordings::Bytes data, const std::string& thing) {
        if (!recordings::is_camera_info(*message.channel)) return true;
        yaml = recordings::read_camera_info(*message.channel, data, is_rectified, thing);
        return false;
      });
  return yaml;
}

}  // namespace loopbit
