// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/sharded_map.hpp"

#include <algorithm>
#include <future>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "loopbit/error.hpp"
#include "loopbit/map_server.hpp"

#include "server_limits.hpp"
#include "session_owners.hpp"

namespace loopbit {

/// A place, with what its shard says of it.
template <typename Known>
struct ShardedMap::Found {
  Origin origin;
  SessionFrame at;
  Known known;
  bool is_copy = false;  ///< it counts at another shard
};

ShardedMap::ShardedMap(const std::vector<std::string>& addresses, std::size_t cache_mb) {
  std::optional<Error> first;
  for (const std::string& address : addresses) {
    shards_.push_back({.shown = without_secrets(address), .reader = nullptr});
    Shard& shard = shards_.back();
    try {
      shard.reader = std::make_unique<MapReader>(address, cache_mb / addresses.size());
      shard.reader->set_time_limit(kMaxAnswer);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::input) throw;
      if (!first) first = error;
      notices_.emplace_back(error.what());
    }
  }
  if (notices_.size() == shards_.size()) throw Error(*first);
  begin();
}

ShardedMap::~ShardedMap() = default;

void ShardedMap::begin() {
  const auto sessions = [this] {
    std::vector<ServerSessions> all;
    for (const Shard& shard : shards_) {
      all.push_back({shard.shown, {}});
      if (shard.reader) all.back().sessions = shard.reader->sessions();
    }
    return all;
  };
  take_snapshots(numbers_of(sessions()), [&] {
    for (Shard& shard : shards_) ask(shard, [&] { shard.reader->begin_snapshot(); });
    return numbers_of(sessions());
  });
  owners_ = owners_of(sessions());
}

bool ShardedMap::is_copy(std::uint32_t shard, int session) const {
  const auto owner = owners_.find(session);
  return owner != owners_.end() && owner->second != shard;
}

LoopDetectorOptions ShardedMap::options() const {
  const MapReader* any = nullptr;
  for (const Shard& shard : shards_) {
    if (!shard.reader) continue;
    any = shard.reader.get();
    if (!any->sessions().empty()) break;
  }
  return any->options();
}

std::string ShardedMap::path() const {
  std::vector<std::string> all;
  for (const Shard& shard : shards_) all.push_back(shard.shown);
  return fmt::format("{}", fmt::join(all, " "));
}

std::vector<std::string> ShardedMap::damage() const {
  std::vector<std::string> all;
  for (const Shard& shard : shards_) {
    if (!shard.reader) continue;
    for (const std::string& clause : shard.reader->damage()) {
      all.push_back(fmt::format("'{}': {}", shard.shown, clause));
    }
  }
  return all;
}

std::vector<std::string> ShardedMap::not_asked() const {
  std::vector<std::string> missing;
  for (const Shard& shard : shards_) {
    if (!shard.reader) missing.push_back(shard.shown);
  }
  return missing;
}

std::vector<std::string> ShardedMap::take_notices() { return std::exchange(notices_, {}); }

template <typename Work>
bool ShardedMap::ask(Shard& shard, const Work& work) {
  if (!shard.reader) return false;
  try {
    work();
    return true;
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::input) throw;
    notices_.emplace_back(error.what());
    shard.reader.reset();
    return false;
  }
}

template <typename Known, typename Read>
std::vector<ShardedMap::Found<Known>> ShardedMap::gather(const Read& read) {
  std::vector<Found<Known>> all;
  for (std::uint32_t number = 0; number < shards_.size(); ++number) {
    Shard& shard = shards_[number];
    const std::size_t before = all.size();
    PlaceId next = 0;
    const bool is_whole = ask(shard, [&] {
      read(*shard.reader, [&](const SessionFrame& at, Known known) {
        all.push_back({{number, next++}, at, std::move(known), is_copy(number, at.session)});
      });
    });
    if (!is_whole) all.resize(before);
    shard.places.assign(all.size() - before, kCopy);
  }
  std::ranges::stable_sort(all, {}, [](const Found<Known>& found) {
    return std::pair(found.at.session, found.at.frame);
  });
  for (const Found<Known>& found : all) {
    if (found.is_copy) continue;
    shards_[found.origin.shard].places[static_cast<std::size_t>(found.origin.place)] =
        static_cast<PlaceId>(places_.size());
    places_.push_back(found.origin);
  }
  return all;
}

void ShardedMap::check_options(const LoopDetectorOptions& options) {
  for (const Shard& shard : shards_) {
    if (shard.reader) shard.reader->check_options(options);
  }
}

PlaceSearch* ShardedMap::place_search() {
  const bool can_all_search = std::ranges::all_of(
      shards_, [](const Shard& shard) { return !shard.reader || shard.reader->place_search(); });
  return can_all_search ? this : nullptr;
}

void ShardedMap::for_each_earlier_place(const MapStorage::Visit& visit) {
  const auto found = gather<BinaryContent>(
      [](MapReader& reader, const auto& add) { reader.for_each_earlier_place(add); });
  for (const auto& [origin, at, content, is_copy] : found) {
    if (!is_copy) visit(at, content);
  }
}

/// A shard compares the first places of a session with those of another session than one map
/// would. Whether these are steps is found here, until both had the same step.
void ShardedMap::for_each_place(double unmoved, const PlaceSearch::Visit& visit) {
  const auto found = gather<bool>([&](MapReader& reader, const auto& add) {
    reader.place_search()->for_each_place(unmoved, add);
  });
  const Origin* last = nullptr;
  std::vector<const Origin*> last_of_shards(shards_.size());
  for (const auto& [origin, at, is_step_of_shard, is_copy] : found) {
    const Origin*& last_of_shard = last_of_shards[origin.shard];
    bool is_step = is_step_of_shard;
    if (last && last != last_of_shard) {
      const BinaryContent seen = content(origin);
      is_step = count(seen) > 0 && similarity(seen, content(*last)) < unmoved;
    }
    if (is_step_of_shard) last_of_shard = &origin;
    if (is_copy) continue;
    if (is_step) last = &origin;
    visit(at, is_step);
  }
}

void ShardedMap::for_each_earlier_loop(const VisitLoop& visit) {
  std::vector<std::pair<SessionFrame, SessionFrame>> loops;
  for (std::uint32_t number = 0; number < shards_.size(); ++number) {
    Shard& shard = shards_[number];
    ask(shard, [&] {
      shard.reader->for_each_earlier_loop(
          [&](const SessionFrame& query, const SessionFrame& match) {
            if (!is_copy(number, query.session)) loops.emplace_back(query, match);
          });
    });
  }
  // As in one map whose sessions were recorded one after the other.
  std::ranges::stable_sort(loops, {}, [](const auto& loop) { return loop.first.session; });
  for (const auto& [query, match] : loops) visit(query, match);
}

ShardedMap::Similar ShardedMap::most_similar(const BinaryContent& content,
                                             int shift_tolerance_columns, std::size_t number) {
  std::vector<std::future<Similar>> answers;
  for (const Shard& shard : shards_) {
    answers.push_back(std::async(std::launch::async, [&content, shift_tolerance_columns, number,
                                                      reader = shard.reader.get()] {
      if (!reader) return Similar{.is_all = true};
      return reader->place_search()->most_similar(content, shift_tolerance_columns, number);
    }));
  }
  Similar all{.is_all = true};
  for (std::size_t i = 0; i < shards_.size(); ++i) {
    Shard& shard = shards_[i];
    ask(shard, [&] {
      const Similar similar = answers[i].get();
      all.is_all = all.is_all && similar.is_all;
      for (const auto& [place, value] : similar.places) {
        const PlaceId ours = shard.places.at(static_cast<std::size_t>(place));
        if (ours != kCopy) all.places.push_back({ours, value});
      }
    });
  }
  std::ranges::sort(all.places, &Candidate::comes_before);
  if (all.places.size() <= number) return all;
  const double least = all.places[number - 1].similarity;
  const auto end = std::ranges::find_if(
      all.places, [&](const Candidate& candidate) { return candidate.similarity < least; });
  all.is_all = all.is_all && end == all.places.end();
  all.places.erase(end, all.places.end());
  return all;
}

BinaryContent ShardedMap::content(PlaceId place) {
  return content(places_.at(static_cast<std::size_t>(place)));
}

BinaryContent ShardedMap::content(const Origin& origin) {
  BinaryContent content;
  Shard& shard = shards_[origin.shard];
  ask(shard, [&] { content = shard.reader->place_search()->content(origin.place); });
  return content;
}

std::shared_ptr<const Features> ShardedMap::features(PlaceId place) {
  const Origin& origin = places_.at(static_cast<std::size_t>(place));
  Shard& shard = shards_[origin.shard];
  std::shared_ptr<const Features> features;
  const bool is_there = ask(shard, [&] { features = shard.reader->features(origin.place); });
  return is_there ? features : std::make_shared<const Features>();
}

void ShardedMap::refuse_change() const {
  throw Error(ErrorKind::option,
              fmt::format("'{}' are several maps, which are only read: give one of them.", path()));
}

void ShardedMap::add(const Detection& /*detection*/, const BinaryContent& /*content*/,
                     std::shared_ptr<const Features> /*features*/, const cv::Mat& /*image*/) {
  refuse_change();
}

void ShardedMap::remove(PlaceId /*place*/) { refuse_change(); }

void ShardedMap::reject(const SessionFrame& /*query*/, const SessionFrame& /*match*/) {
  refuse_change();
}

}  // namespace loopbit
