// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/camera_file.hpp"
#include "loopbit/error.hpp"
#include "loopbit/folder_watch.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_server.hpp"
#include "loopbit/printable.hpp"
#include "loopbit/record_run.hpp"
#include "loopbit/recordings.hpp"
#include "loopbit/relative_pose.hpp"
#include "loopbit/sharded_map.hpp"

#include "commands.hpp"
#include "map_output.hpp"
#include "process.hpp"
#include "session.hpp"

namespace loopbit::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kWatchPause{50};

struct QueryFlags {
  std::string map;
  std::vector<std::string> images;
  std::string topic;
  std::string mask;
  std::string camera;
  std::string watch;
  std::size_t places = 3;
  std::string place_images;
  std::size_t map_cache_mb = kMapCache_mb;
  std::optional<std::int64_t> epoch;
  std::vector<std::string> settings;
  int max_megapixels = kMaxMegapixels;
  bool json = false;
};

/// The map that is asked: one, or several that have its sessions together.
class AskedMap {
 public:
  explicit AskedMap(const QueryFlags& flags) {
    const std::vector<std::string> addresses = addresses_in(flags.map);
    if (addresses.size() == 1) {
      map_ = std::make_shared<MapReader>(flags.map, flags.map_cache_mb);
      if (flags.epoch) map_->set_epoch(*flags.epoch);
    } else if (flags.epoch || !flags.place_images.empty()) {
      throw Error(ErrorKind::option, "--epoch and --place-images ask one map; give one address.");
    } else {
      shards_ = std::make_shared<ShardedMap>(addresses, flags.map_cache_mb);
    }
  }

  [[nodiscard]] std::shared_ptr<MapStorage> storage() const {
    return shards_ ? std::shared_ptr<MapStorage>(shards_) : map_;
  }
  [[nodiscard]] LoopDetectorOptions options() const {
    return shards_ ? shards_->options() : map_->options();
  }
  [[nodiscard]] std::string path() const { return shards_ ? shards_->path() : map_->path(); }

  /// Of a single map.
  [[nodiscard]] MapReader& reader() const { return *map_; }

  void warn() const {
    if (shards_) return warn_of_damage(shards_->path(), shards_->damage());
    warn_of_damage(*map_);
  }

  /// Of several maps, those that do not answer. Says on stderr why, once.
  [[nodiscard]] std::vector<std::string> not_asked() const {
    if (!shards_) return {};
    for (const std::string& notice : shards_->take_notices()) {
      tell(fmt::format("loopbit: {}\n", notice));
    }
    return shards_->not_asked();
  }

 private:
  std::shared_ptr<MapReader> map_;  ///< either this or the other
  std::shared_ptr<ShardedMap> shards_;
};

LoopDetectorOptions detector_options(const AskedMap& map, const QueryFlags& flags) {
  LoopDetectorOptions options = map.options();
  for (const std::string& setting : flags.settings) {
    const auto [name, value] = split_setting(setting);
    if (name.starts_with("binary_content.") || name.starts_with("surf.")) {
      throw Error(ErrorKind::option,
                  fmt::format("{} is fixed by '{}', which was made with it; make another "
                              "map with 'loopbit run --map'.",
                              name, map.path()));
    }
    if (name.starts_with("exclusion.")) {
      throw Error(ErrorKind::option,
                  fmt::format("{} has no effect on a query: all places of '{}' are candidates; "
                              "leave it out.",
                              name, map.path()));
    }
    set_option(options, name, value);
  }
  validate(options);
  return options;
}

/// A place that is shown.
struct ShownPlace {
  RankedPlace ranked;
  std::string image = {};  ///< its file; empty if there is none
};

void print_row(const std::string& image, std::string_view status, const ShownPlace& shown) {
  const RankedPlace& place = shown.ranked;
  fmt::print("{:<24}  {:<16}  {:>7}  {:>7}  {:>7.4f}  {:>10.3f}  {:>7}{}{}\n", image, status,
             place.place.session, place.place.frame, place.score, place.similarity, place.inliers,
             shown.image.empty() ? "" : "  ", printable(shown.image));
}

/// What a map says of an image.
struct Answer {
  Status status = Status::unreadable;
  std::int64_t epoch = 0;  ///< see Detection
  std::vector<ShownPlace> places = {};
  std::optional<RelativePose> pose =
      std::nullopt;                         ///< of the image, in the frame of the first place
  std::vector<std::string> not_asked = {};  ///< of several maps, those that do not answer
};

void print_pose(const RelativePose& pose) {
  fmt::print("{:<24}  relative pose: {}, {}", "", to_string(pose.status), to_string(pose.known));
  if (pose.known != PoseKnown::nothing) fmt::print(", x y z qx qy qz qw {}", to_tum_pose(pose));
  fmt::print("\n");
}

void print_rows(const std::string& name, const Answer& answer) {
  const std::string image = printable(name);
  const auto& places = answer.places;
  if (places.empty()) fmt::print("{:<24}  {}\n", image, to_string(answer.status));
  for (std::size_t i = 0; i < places.size(); ++i) {
    print_row(i == 0 ? image : "", i == 0 ? to_string(answer.status) : "", places[i]);
    if (i == 0 && answer.pose) print_pose(*answer.pose);
  }
  for (const std::string& map : answer.not_asked) {
    fmt::print("{:<24}  not asked: {}\n", "", printable(map));
  }
}

template <int rows, int columns>
nlohmann::ordered_json rows_of(const cv::Matx<double, rows, columns>& matrix) {
  auto result = nlohmann::ordered_json::array();
  for (int row = 0; row < rows; ++row) {
    result.push_back(std::vector<double>(matrix.val + std::ptrdiff_t{row} * columns,
                                         matrix.val + std::ptrdiff_t{row + 1} * columns));
  }
  return result;
}

nlohmann::ordered_json json_of(const RelativePose& pose) {
  nlohmann::ordered_json json{{"status", to_string(pose.status)},
                              {"known", to_string(pose.known)},
                              {"matches", pose.matches},
                              {"inliers", pose.inliers.size()}};
  if (pose.known == PoseKnown::nothing) return json;
  json["rms_px"] = pose.rms_px;
  json["T_match_query"] = rows_of(pose.T_match_query);
  json["covariance"] = rows_of(pose.covariance);
  return json;
}

/// One line an image, so that a program can read them as they come.
void print_line(const std::string& image, const Answer& answer) {
  nlohmann::ordered_json json{{"image", image},
                              {"status", to_string(answer.status)},
                              {"places", nlohmann::ordered_json::array()}};
  if (answer.epoch > 0) json["epoch"] = answer.epoch;
  for (const auto& [place, file] : answer.places) {
    json["places"].push_back({{"session", place.place.session},
                              {"frame", place.place.frame},
                              {"score", place.score},
                              {"similarity", place.similarity},
                              {"matches", place.matches},
                              {"inliers", place.inliers}});
    if (!file.empty()) json["places"].back()["image"] = file;
  }
  if (answer.pose) json["relative_pose"] = json_of(*answer.pose);
  if (!answer.not_asked.empty()) json["not_asked"] = answer.not_asked;
  print_document(json, -1);
}

/// Asks a map about images, and prints its answers.
class Relocalizer {
 public:
  explicit Relocalizer(const QueryFlags& flags)
      : flags_(flags), map_(flags), detector_(detector_options(map_, flags), map_.storage()) {
    if (!flags.mask.empty()) detector_.set_mask(read_mask(flags.mask));
    if (!flags.camera.empty()) camera_ = read_camera(flags.camera);
    // As in a run: through other lenses it finds no more than without.
    if (camera_ && camera_->lens == Lens::equidistant) detector_.set_camera(camera_);
    if (!flags.place_images.empty()) place_images_.emplace(map_.reader(), flags.place_images);
    if (!flags.json) {
      fmt::print("{:<24}  {:<16}  {:>7}  {:>7}  {:>7}  {:>10}  {:>7}\n", "image", "status",
                 "session", "frame", "score", "similarity", "inliers");
    }
  }

  /// All images of `input`, which is called `name`: an image by that, others by what they are
  /// called in it.
  void ask(const std::string& input, const std::string& name) {
    try {
      const auto source = open_input(input, flags_.topic, flags_.max_megapixels);
      const std::string own_name = fs::path(input).filename().string();
      for (Frame frame; source->next(frame);) {
        frame.name = frame.name == own_name ? name : (fs::path(name) / frame.name).string();
        answer(frame);
      }
      if (const std::string why = source->early_end(); !why.empty()) {
        tell(fmt::format("loopbit: {}\n", why));
      }
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::input) throw;
      answer({name, {}, {}, error.what()});
    }
    flush_stdout();
  }

  [[nodiscard]] bool any_readable() const { return any_readable_; }
  [[nodiscard]] const AskedMap& map() const { return map_; }

 private:
  void answer(const Frame& frame) {
    Answer answer;
    PreparedImage image;
    std::vector<RankedPlace> places;
    try {
      if (!frame.error.empty()) throw Error(ErrorKind::input, frame.error);
      if (camera_) check_size(*camera_, fmt::format("'{}'", flags_.camera), frame.image.size());
      image = detector_.prepare(frame.image);
      const Detection detection = detector_.query(image, std::nullopt, &places);
      answer.status = detection.status;
      answer.epoch = detection.epoch;
      any_readable_ = true;
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::input) throw;
      tell(fmt::format("loopbit: '{}': {}\n", frame.name, error.what()));
    }
    answer.not_asked = map_.not_asked();
    if (camera_ && answer.status == Status::loop) {
      answer.pose = pose_of(image.features, places.front());
    }
    if (places.size() > flags_.places) places.resize(flags_.places);
    for (const RankedPlace& place : places) {
      answer.places.push_back({place, place_images_ ? place_images_->file_of(place.place) : ""});
    }
    (flags_.json ? print_line : print_rows)(frame.name, answer);
  }

  /// None if the place is of images of another size.
  std::optional<RelativePose> pose_of(const Features& query, const RankedPlace& place) {
    const Features match = detector_.features_of(place.place);
    if (query.working_size_px != match.working_size_px) return std::nullopt;
    return estimator_.estimate({.query = {&query, &*camera_}, .match = {&match, &*camera_}});
  }

  const QueryFlags& flags_;
  AskedMap map_;
  LoopDetector detector_;
  std::optional<CameraModel> camera_;
  RelativePoseEstimator estimator_;
  std::optional<PlaceImages> place_images_;
  bool any_readable_ = false;
};

int query_command(const QueryFlags& flags) {
  if (flags.images.empty() == flags.watch.empty()) {
    throw Error(ErrorKind::option, "A query needs either images or --watch DIR; give one of them.");
  }
  Relocalizer relocalizer(flags);
  for (const std::string& image : flags.images) relocalizer.ask(image, image);
  if (!flags.watch.empty()) {
    const auto& stop = stop_on_signal();
    FolderWatch watch(flags.watch);
    while (!stop) {
      for (const std::string& image : watch.arrived()) {
        relocalizer.ask(image, fs::path(image).filename().string());
      }
      std::this_thread::sleep_for(kWatchPause);
    }
  }
  relocalizer.map().warn();
  if (!relocalizer.map().not_asked().empty()) return bad_input;
  return flags.images.empty() || relocalizer.any_readable() ? success : bad_input;
}

}  // namespace

void add_query(CLI::App& app, int& exit_code) {
  auto flags = std::make_shared<QueryFlags>();
  CLI::App* command =
      app.add_subcommand("query", "Find the places of a map that single images show");
  command
      ->add_option(
          "MAP", flags->map,
          "A map written by 'loopbit run --map', or its address; several addresses, separated by "
          "spaces, are asked as one map")
      ->required();
  command->add_option("IMAGE", flags->images,
                      "Images, or anything else that 'loopbit run' accepts; each image is a "
                      "separate query");
  command
      ->add_option("--watch", flags->watch,
                   "Query each image of a folder, and new ones as they arrive, until Ctrl-C")
      ->type_name("DIR");
  command->add_option("--places", flags->places, "Number of places to show per image, best first")
      ->type_name("N")
      ->capture_default_str()
      ->check(whole_number(1, 1000));
  command
      ->add_option("--place-images", flags->place_images,
                   "A new folder for the images of the places shown, if the map has any")
      ->type_name("DIR");
  command
      ->add_option("--epoch", flags->epoch,
                   "Answer as of this epoch of a map on a server: without later commits")
      ->type_name("N");
  add_map_cache_flag(*command, flags->map_cache_mb);
  add_image_flag(*command, flags->max_megapixels);
  add_topic_flag(*command, flags->topic);
  add_mask_flag(*command, flags->mask);
  command
      ->add_option(
          "--camera", flags->camera,
          "Calibration of the images and those of the map (as for 'loopbit run'): each "
          "recognised image gets its relative pose, and a fisheye is recognised more often")
      ->type_name("FILE");
  command->add_flag("--json", flags->json, "Print one JSON object per image, one per line");
  command
      ->add_option("--set", flags->settings,
                   "One setting of retrieval, verification or decision; may be repeated")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command->callback([flags, &exit_code] { exit_code = query_command(*flags); });
}

}  // namespace loopbit::cli
