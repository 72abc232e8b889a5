// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "pictures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <span>

#include "loopbit/base64.hpp"

namespace loopbit::report {
namespace {

using Json = nlohmann::ordered_json;

template <typename T>
std::string base64_of(std::span<const T> values) {
  return base64({reinterpret_cast<const unsigned char*>(values.data()), values.size_bytes()});
}

/// 0 to n - 1 in bit-reversed order, so that every prefix of the list is spread evenly (van der
/// Corput 1935).
std::vector<std::size_t> spread_order(std::size_t n) {
  const auto reversed = [](std::uint32_t x) {
    std::uint32_t y = 0;
    for (int bit = 0; bit < 32; ++bit) y |= (x >> bit & 1U) << (31 - bit);
    return y;
  };
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return reversed(static_cast<std::uint32_t>(a)) < reversed(static_cast<std::uint32_t>(b));
  });
  return order;
}

bool is_loop(const FrameView& view) { return std::isfinite(view.loop_score); }

/// The frames with the lowest scores among the loops of this run.
std::vector<const FrameView*> weakest_loops(const std::vector<FrameView>& frames) {
  constexpr std::size_t kWeakest = 100;
  std::vector<const FrameView*> loops;
  for (const FrameView& view : frames) {
    if (is_loop(view)) loops.push_back(&view);
  }
  std::stable_sort(loops.begin(), loops.end(), [](const FrameView* a, const FrameView* b) {
    return a->loop_score < b->loop_score;
  });
  loops.resize(std::min(loops.size(), kWeakest));
  return loops;
}

/// Every frame once: verdicts take turns, frames of a verdict spread evenly over the run.
std::vector<const FrameView*> by_turns(const std::vector<FrameView>& frames) {
  std::map<std::string, std::vector<const FrameView*>> groups;
  for (const FrameView& view : frames) groups[view.verdict].push_back(&view);
  std::size_t longest = 0;
  std::vector<std::vector<const FrameView*>> queues;
  for (const auto& [verdict, group] : groups) {
    auto& queue = queues.emplace_back();
    queue.reserve(group.size());
    for (const std::size_t i : spread_order(group.size())) queue.push_back(group[i]);
    longest = std::max(longest, group.size());
  }
  std::vector<const FrameView*> order;
  order.reserve(frames.size());
  for (std::size_t turn = 0; turn < longest; ++turn) {
    for (const auto& queue : queues) {
      if (turn < queue.size()) order.push_back(queue[turn]);
    }
  }
  return order;
}

/// The frames in order of priority for a picture; the first ones come again later.
std::vector<const FrameView*> by_priority(const std::vector<FrameView>& frames) {
  std::vector<const FrameView*> order;
  if (frames.empty()) return order;
  order.push_back(&frames[static_cast<std::size_t>(first_frame(frames))]);
  for (const FrameView& view : frames) {
    if (view.verdict == "wrong") order.push_back(&view);
  }
  for (const auto& others : {weakest_loops(frames), by_turns(frames)}) {
    order.insert(order.end(), others.begin(), others.end());
  }
  return order;
}

std::size_t size_of(const Json& picture) {
  constexpr std::size_t kNames = 70;  // keys, quotes and commas
  std::size_t bytes = kNames;
  for (const auto& [key, value] : picture.items())
    bytes += value.get_ref<const std::string&>().size();
  return bytes;
}

}  // namespace

Json picture(const StoredEvidence& evidence) {
  return {{"jpeg", base64(evidence.picture_jpeg)},
          {"saliency", base64(evidence.saliency_png)},
          {"content", base64_of(std::span<const std::uint64_t>(evidence.content.rows))},
          {"inliers", base64_of(std::span<const PointPair>(evidence.inliers))}};
}

int first_frame(const std::vector<FrameView>& frames) {
  const auto first = [&](const char* verdict) {
    return std::find_if(frames.begin(), frames.end(),
                        [&](const FrameView& view) { return view.verdict == verdict; });
  };
  if (const auto wrong = first("wrong"); wrong != frames.end()) return wrong->frame;
  const auto best = std::max_element(
      frames.begin(), frames.end(),
      [](const FrameView& a, const FrameView& b) { return a.loop_score < b.loop_score; });
  if (best != frames.end() && is_loop(*best)) return best->frame;
  const auto missed = first("missed");
  return missed == frames.end() ? 0 : missed->frame;
}

Json pictures(const std::vector<FrameView>& frames, const EvidenceReader& evidence,
              std::size_t max_bytes) {
  Json chosen = Json::object();
  std::map<int, Json> by_frame;
  std::size_t bytes = 0;
  const auto add = [&](int frame) {
    if (by_frame.contains(frame)) return true;
    StoredEvidence stored;
    if (!evidence.read(frame, stored)) return true;
    Json json = picture(stored);
    if (bytes + size_of(json) > max_bytes) return false;
    bytes += size_of(json);
    by_frame.emplace(frame, std::move(json));
    return true;
  };
  const auto add_with_partners = [&](const FrameView& view) {
    return add(view.frame) && std::all_of(view.partners.begin(), view.partners.end(), add);
  };
  for (const FrameView* view : by_priority(frames)) {
    if (!add_with_partners(*view)) break;
  }
  for (auto& [frame, json] : by_frame) chosen[std::to_string(frame)] = std::move(json);
  return chosen;
}

}  // namespace loopbit::report
