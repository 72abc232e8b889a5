// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/error.hpp"
#include "loopbit/map_server.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/printable.hpp"

#include "commands.hpp"
#include "map_output.hpp"
#include "process.hpp"
#include "progress.hpp"

namespace loopbit::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Of each session, how many places, or loops with a query in it, there are.
using Counts = std::map<int, std::int64_t>;

Counts places_of(MapReader& map) {
  Counts counts;
  map.for_each_place([&](const MapPlace& place) { ++counts[place.at.session]; });
  return counts;
}

Counts loops_of(MapReader& map) {
  Counts counts;
  for (const MapLoop& loop : map.loops()) ++counts[loop.query.session];
  return counts;
}

std::int64_t sum(const Counts& counts) {
  std::int64_t sum = 0;
  for (const auto& [session, count] : counts) sum += count;
  return sum;
}

std::int64_t num_unlinked(const MapReader& map) {
  return std::ranges::count(map.sessions(), false, &MapSession::linked);
}

void tell_unlinked(const MapReader& map) {
  if (num_unlinked(map) == 0) return;
  fmt::print("next       loopbit map link {} finds the loops between sessions that never met\n",
             printable(map.path()));
}

/// Calls `show` for each map in `path`. Of several, those that cannot be read are named and left
/// out. Returns the exit code.
int for_each_map(const std::string& path, const std::function<void(const std::string&)>& show) {
  const std::vector<std::string> all = addresses_in(path);
  int exit_code = success;
  for (const std::string& one : all) {
    try {
      show(one);
    } catch (const Error& error) {
      if (all.size() == 1 || error.kind() != ErrorKind::input) throw;
      tell(fmt::format("loopbit: {}\n", error.what()));
      exit_code = bad_input;
    }
  }
  return exit_code;
}

/// Prints a summary of one map, or adds it to `json` unless that is null.
void show_info(const std::string& path, Json* json) {
  MapReader map(path);
  const std::int64_t places = sum(places_of(map));
  const std::int64_t loops = sum(loops_of(map));
  const std::size_t rejected = map.rejected_loops().size();
  const std::size_t odometry = map.odometry().size();
  const std::size_t poses = map.loop_poses().size();
  const MapImages images = map.images();
  const std::int64_t bytes = map.bytes();
  if (json) {
    Json info{{"path", map.path()},
              {"bytes", bytes},
              {"sessions", map.sessions().size()},
              {"places", places},
              {"loops", loops},
              {"rejected_loops", rejected},
              {"odometry_frames", odometry},
              {"relative_poses", poses},
              {"unlinked_sessions", num_unlinked(map)},
              {"images", images.number},
              {"image_bytes", images.bytes},
              {"options", nullptr}};
    if (!map.sessions().empty()) info["options"] = Json::parse(to_json(map.options()));
    json->push_back(std::move(info));
  } else {
    fmt::print("map        {}, {:.1f} MB", printable(map.path()), static_cast<double>(bytes) / 1e6);
    if (places > 0)
      fmt::print(", {:.1f} KB per place",
                 static_cast<double>(bytes) / 1e3 / static_cast<double>(places));
    fmt::print("\nsessions   {}\nplaces     {}\nloops      {}\n", map.sessions().size(), places,
               loops);
    if (rejected > 0) fmt::print("rejected   {}\n", counted(rejected, "loop"));
    if (odometry > 0) fmt::print("odometry   {}\n", counted(odometry, "frame"));
    if (poses > 0) fmt::print("poses      {}\n", counted(poses, "loop"));
    if (images.number > 0) {
      fmt::print("images     {}, {:.1f} MB\n", images.number,
                 static_cast<double>(images.bytes) / 1e6);
    }
    for (const MapSession& session : map.sessions()) {
      fmt::print("  {:>9} {} ({}, {})\n", session.session, printable(session.name), session.started,
                 counted(session.frames, "frame"));
    }
    tell_unlinked(map);
  }
  warn_of_damage(map);
}

int info_command(const std::string& path, bool json) {
  Json all = Json::array();
  const int exit_code =
      for_each_map(path, [&](const std::string& one) { show_info(one, json ? &all : nullptr); });
  if (json) print_document(addresses_in(path).size() == 1 ? all.front() : all);
  return exit_code;
}

/// Prints the sessions of one map, or adds them to `json` unless that is null.
void show_sessions(const std::string& path, Json* json, bool& has_heading) {
  MapReader map(path);
  Counts places = places_of(map);
  Counts loops = loops_of(map);
  if (!json && !std::exchange(has_heading, true)) {
    fmt::print("{:>7}  {:<20}  {:>9}  {:>9}  {:>9}  {:<32}  {}\n", "session", "started", "frames",
               "places", "loops", "uid", "name");
  }
  for (const MapSession& s : map.sessions()) {
    if (json) {
      json->push_back({{"session", s.session},
                       {"name", s.name},
                       {"started", s.started},
                       {"frames", s.frames},
                       {"places", places[s.session]},
                       {"loops", loops[s.session]},
                       {"linked", s.linked},
                       {"uid", s.uid},
                       {"loopbit", s.loopbit}});
    } else {
      fmt::print("{:>7}  {:<20}  {:>9}  {:>9}  {:>9}  {:<32}  {}\n", s.session, s.started, s.frames,
                 places[s.session], loops[s.session], s.uid, printable(s.name));
    }
  }
  warn_of_damage(map);
}

int list_command(const std::string& path, bool json) {
  Json all = Json::array();
  bool has_heading = false;
  const int exit_code = for_each_map(path, [&](const std::string& one) {
    show_sessions(one, json ? &all : nullptr, has_heading);
  });
  if (json) print_document(all);
  return exit_code;
}

void merge_command(const std::string& into, const std::vector<std::string>& others) {
  for (const std::string& other : others) {
    const MergeCounts counts = merge_map(into, other);
    fmt::print("merged     {}: {}, {}, {}", printable(without_secrets(other)),
               counted(counts.sessions, "session"), counted(counts.places, "place"),
               counted(counts.loops, "loop"));
    if (counts.continued > 0) {
      fmt::print("; the rest of {}", counted(counts.continued, "session"));
    }
    if (counts.known > 0) fmt::print("; already there: {}", counted(counts.known, "session"));
    fmt::print("\n");
  }
  tell_unlinked(MapReader(into));
}

void move_command(const std::string& from, const std::string& to,
                  const std::vector<int>& sessions) {
  const MoveCounts counts = move_sessions(from, to, sessions);
  fmt::print("moved      {}, {}", counted(counts.sessions, "session"),
             counted(counts.places, "place"));
  if (counts.known > 0) fmt::print("; already there: {}", counted(counts.known, "session"));
  fmt::print("\n");
  tell_unlinked(MapReader(to));
}

int link_command(const std::string& path) {
  const auto& stop = stop_on_signal();
  std::optional<Progress> progress;
  std::int64_t loops = 0;
  const LinkCounts counts = link_map(path, std::nullopt, [&](const LinkCounts& now) {
    if (!progress) progress.emplace(static_cast<std::size_t>(now.total_places), Progress::Style());
    progress->advance(now.loops > loops);
    loops = now.loops;
    return !stop;
  });
  progress.reset();
  if (counts.total_places == 0) {
    fmt::print("linked     all sessions were compared with the earlier ones before\n");
    return success;
  }
  fmt::print("linked     {}, {}: {}\n", counted(counts.sessions, "session"),
             counted(counts.places, "place"), counted(counts.loops, "new loop"));
  if (counts.places == counts.total_places) return success;
  tell("loopbit: Stopped. What is linked is saved; the same command does the rest.\n");
  return interrupted;
}

const std::map<std::string, ExportFormat>& export_formats() {
  static const std::map<std::string, ExportFormat> formats{
      {"csv", ExportFormat::csv}, {"json", ExportFormat::json}, {"g2o", ExportFormat::g2o}};
  return formats;
}

void export_command(const std::string& path, ExportFormat format, const std::string& out) {
  MapReader map(path);
  print_or_write(export_loops(map, format), out);
  warn_of_damage(map);
}

void images_command(const std::string& path, const std::string& folder) {
  MapReader map(path);
  PlaceImages images(map, folder);
  fmt::print("images     {} in {}\n", images.write_all(), printable(folder));
  warn_of_damage(map);
}

int check_one(const std::string& path, const std::string& recover) {
  const MapCheck check = recover.empty() ? check_map(path) : recover_map(path, recover);
  for (const std::string& clause : check.damage) fmt::print("damaged    {}\n", clause);
  fmt::print("whole      {}, {}, {}, {}\n", counted(check.sessions, "session"),
             counted(check.places, "place"), counted(check.loops, "loop"),
             counted(check.images, "image"));
  if (!recover.empty()) {
    fmt::print("written    {}\n", recover);
    return success;
  }
  if (!check.damage.empty()) {
    fmt::print("remedy     loopbit map check {} --recover NEW.db copies all undamaged rows\n",
               without_secrets(path));
  }
  return check.damage.empty() ? success : bad_input;
}

int check_command(const std::string& path, const std::string& recover) {
  if (!recover.empty()) return check_one(path, recover);
  int damaged = success;
  const bool are_several = addresses_in(path).size() > 1;
  const int missing = for_each_map(path, [&](const std::string& one) {
    if (are_several) fmt::print("map        {}\n", printable(without_secrets(one)));
    damaged = std::max(damaged, check_one(one, recover));
  });
  return std::max(damaged, missing);
}

void create_command(const std::string& address, int first_session) {
  const bool is_new = create_map(address, first_session);
  fmt::print("{}    {}\n", is_new ? "created" : "exists ", printable(without_secrets(address)));
}

void compact_command(const std::string& path, const CompactOptions& options) {
  if (options.drop_sessions.empty() && options.max_places == 0 && !options.drop_images) {
    throw Error(
        ErrorKind::option,
        "There is nothing to compact; add --drop SESSION, --budget PLACES, --drop-images, or "
        "several of them.");
  }
  const CompactCounts counts = compact_map(path, options);
  fmt::print("places     {} of {} kept\n", counts.places_after, counts.places_before);
  fmt::print("size       {:.1f} MB, before {:.1f} MB\n",
             static_cast<double>(counts.bytes_after) / 1e6,
             static_cast<double>(counts.bytes_before) / 1e6);
  if (is_map_address(path)) {
    fmt::print(
        "note       new places use the space that is free; VACUUM FULL returns it to the disk\n");
  }
}

struct MapFlags {
  std::string map;
  bool json = false;
  std::vector<std::string> others;
  std::string to;
  std::vector<int> sessions;
  std::string format = "csv";
  std::string out;
  std::string recover;
  int first_session = 1;
  CompactOptions compact;
};

using Flags = std::shared_ptr<MapFlags>;

CLI::App* add_command(CLI::App& map, const Flags& flags, const char* name, const char* what,
                      const char* which = "A map written by 'loopbit run --map', or its address") {
  CLI::App* command = map.add_subcommand(name, what);
  command->add_option("MAP", flags->map, which)->required();
  return command;
}

constexpr const char* kOneOrSeveral =
    "A map written by 'loopbit run --map', or its address, or several addresses in one argument";

void add_readers(CLI::App& map, const Flags& flags, int& exit_code) {
  CLI::App* info = add_command(map, flags, "info", "Print a summary of a map", kOneOrSeveral);
  info->add_flag("--json", flags->json, "Print JSON");
  info->callback([flags, &exit_code] { exit_code = info_command(flags->map, flags->json); });

  CLI::App* list = add_command(map, flags, "list", "List the sessions of a map", kOneOrSeveral);
  list->add_flag("--json", flags->json, "Print JSON");
  list->callback([flags, &exit_code] { exit_code = list_command(flags->map, flags->json); });

  CLI::App* export_loops = add_command(map, flags, "export", "Export the loops");
  export_loops->add_option("--format", flags->format, "csv (default), json or g2o")
      ->type_name("FORMAT")
      ->check(CLI::IsMember(export_formats()));
  export_loops->add_option("--out", flags->out, "Output file; default: standard output")
      ->type_name("FILE");
  export_loops->callback([export_loops, flags] {
    protect_inputs(*export_loops, {"--out"});
    export_command(flags->map, export_formats().at(flags->format), flags->out);
  });

  CLI::App* images =
      add_command(map, flags, "images", "Write the images stored by 'loopbit run --keep-images'");
  images
      ->add_option("--out", flags->out,
                   "A new folder; it gets a file SESSION_FRAME.jpg per place with an image")
      ->type_name("DIR")
      ->required();
  images->callback([flags] { images_command(flags->map, flags->out); });

  CLI::App* check =
      add_command(map, flags, "check", "Read every byte, and list the damage", kOneOrSeveral);
  check->add_option("--recover", flags->recover, "Copy all undamaged rows to a new map")
      ->type_name("NEW.db");
  check->callback([flags, &exit_code] { exit_code = check_command(flags->map, flags->recover); });
}

void add_writers(CLI::App& map, const Flags& flags, int& exit_code) {
  CLI::App* create = map.add_subcommand(
      "create", "Make an empty map, and the roles that use it, in a PostgreSQL database");
  create->add_option("ADDRESS", flags->map, "Such as postgresql://owner@host/town")->required();
  create
      ->add_option("--first-session", flags->first_session,
                   "The number of its first session: maps that are asked together need sessions of "
                   "different numbers")
      ->type_name("N")
      ->capture_default_str()
      ->check(whole_number(1, 2'000'000'000));
  create->callback([flags] { create_command(flags->map, flags->first_session); });

  CLI::App* merge = add_command(map, flags, "merge", "Add the sessions of other maps to a map");
  merge
      ->add_option("OTHER", flags->others,
                   "Maps to add, such as the queue.db of a run; of sessions that MAP already has, "
                   "only what it lacks")
      ->required();
  merge->callback([flags] { merge_command(flags->map, flags->others); });

  CLI::App* move =
      add_command(map, flags, "move", "Move sessions from one PostgreSQL server to another",
                  "The address of the map that has them");
  move->add_option("TO", flags->to, "The address of the map that gets them")->required();
  move->add_option("--session", flags->sessions, "A session to move; may be repeated")
      ->type_name("SESSION")
      ->allow_extra_args(false)
      ->required()
      ->check(whole_number(1, 2'000'000'000));
  move->callback([flags] { move_command(flags->map, flags->to, flags->sessions); });

  CLI::App* link = add_command(map, flags, "link",
                               "Find the loops between sessions that never met, such as those of "
                               "merged maps; needs no images");
  link->callback([flags, &exit_code] { exit_code = link_command(flags->map); });

  CLI::App* compact =
      add_command(map, flags, "compact", "Drop sessions, redundant places or images");
  compact->add_option("--drop", flags->compact.drop_sessions, "A session to drop; may be repeated")
      ->type_name("SESSION")
      ->allow_extra_args(false)
      ->check(whole_number(1, 2'000'000'000));
  compact
      ->add_option("--budget", flags->compact.max_places,
                   "Keep at most this many places; the most redundant are dropped first")
      ->type_name("PLACES")
      ->check(whole_number(1, 2'000'000'000));
  compact->add_flag("--drop-images", flags->compact.drop_images, "Drop the images of places");
  compact->callback([flags] { compact_command(flags->map, flags->compact); });
}

}  // namespace

void add_map(CLI::App& app, int& exit_code) {
  auto flags = std::make_shared<MapFlags>();
  CLI::App* map = app.add_subcommand("map", "Inspect, check, merge, link and shrink maps");
  map->require_subcommand(1);
  add_readers(*map, flags, exit_code);
  add_writers(*map, flags, exit_code);
}

}  // namespace loopbit::cli
