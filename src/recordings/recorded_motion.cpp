// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "recorded_motion.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "image_message.hpp"
#include "motion_message.hpp"

namespace loopbit::recordings {
namespace {

using TimedPose = std::pair<double, cv::Matx44d>;

constexpr double kMaxDelay_s = 0.05;

/// Where a frame is in its parent.
struct Edge {
  std::string parent;
  cv::Matx44d T_parent_child;  ///< at first
  bool moves = false;
  bool is_odometry = false;  ///< of the topic of odometry
};

/// By child.
using Tree = std::map<std::string, Edge>;

[[noreturn]] void fail(ErrorKind kind, const Recording& recording, const std::string& what) {
  throw Error(kind, fmt::format("Recording '{}' {}.", recording.input, what));
}

void check_topic(const Recording& recording, const std::string& name) {
  const auto is_odometry = [](const Topic& topic) {
    return is_motion({topic.name, topic.type, Encoding::cdr}) && topic.messages > 0;
  };
  const auto& topics = recording.info.topics;
  const auto topic = std::ranges::find(topics, name, &Topic::name);
  if (topic != topics.end() && is_odometry(*topic)) return;
  fail(ErrorKind::option, recording,
       fmt::format("has no odometry on topic '{}'. Its topics with poses or transforms: {}", name,
                   list(topics, is_odometry)));
}

/// The first image's.
Header first_header(const Recording& recording, const std::string& topic) {
  Header header;
  for_each_message(recording, topic,
                   [&](const Message& message, Bytes data, const std::string& thing) {
                     if (!is_image(*message.channel)) return true;
                     header = read_image_message(*message.channel, data, thing).header;
                     return false;
                   });
  return header;
}

/// Calls `add` for each transform of a topic. A pose without a child is that of `camera`.
void for_each_transform(const Recording& recording, const std::string& topic,
                        const std::string& camera,
                        const std::function<void(const TimedTransform&)>& add) {
  for_each_message(recording, topic,
                   [&](const Message& message, Bytes data, const std::string& thing) {
                     if (!is_motion(*message.channel)) return true;
                     for (auto& transform : read_transforms(*message.channel, data, thing)) {
                       if (transform.child.empty()) transform.child = camera;
                       add(transform);
                     }
                     return true;
                   });
}

void add_edges(const Recording& recording, const std::string& topic, const std::string& camera,
               bool is_odometry, Tree& tree) {
  for_each_transform(recording, topic, camera, [&](const TimedTransform& transform) {
    const Edge added{transform.parent, transform.T_parent_child, false, is_odometry};
    const auto [at, is_new] = tree.try_emplace(transform.child, added);
    Edge& edge = at->second;
    if (is_new) return;
    if (edge.is_odometry != is_odometry || edge.parent != transform.parent) {
      edge = added;
    } else {
      edge.moves = edge.moves || edge.T_parent_child != transform.T_parent_child;
    }
  });
}

/// All frames that are known, those of the odometry last, so that they count.
Tree read_tree(const Recording& recording, const std::string& odometry_topic,
               const std::string& camera) {
  Tree tree;
  for (const char* topic : {"/tf", "/tf_static"}) {
    const bool is_there = std::ranges::count(recording.info.topics, topic, &Topic::name) > 0;
    if (is_there && topic != odometry_topic) add_edges(recording, topic, camera, false, tree);
  }
  add_edges(recording, odometry_topic, camera, true, tree);
  return tree;
}

/// The frames from the camera up to the child of the uppermost edge of the odometry. Empty if none
/// is above the camera.
std::vector<std::string> chain_of(const Tree& tree, const std::string& camera) {
  std::vector<std::string> chain;
  std::size_t used = 0;
  for (auto at = tree.find(camera); at != tree.end() && at->first != "odom";
       at = tree.find(at->second.parent)) {
    if (std::ranges::count(chain, at->first) > 0) break;  // in a circle
    chain.push_back(at->first);
    if (at->second.is_odometry) used = chain.size();
  }
  chain.resize(used);
  return chain;
}

[[noreturn]] void fail_unlinked(const Recording& recording, const std::string& odometry_topic,
                                const Tree& tree, const std::string& camera) {
  const auto odometry =
      std::ranges::find_if(tree, [](const auto& edge) { return edge.second.is_odometry; });
  fail(ErrorKind::input, recording,
       fmt::format("does not say where the camera is on the robot: no transform on /tf_static or "
                   "/tf leads from '{}', the frame of the images, to '{}', the frame of {}; record "
                   "them, or give the poses of the camera in a file",
                   camera, odometry == tree.end() ? "" : odometry->first, odometry_topic));
}

/// The transforms of the odometry along the chain, by child, in order of time.
std::map<std::string, std::vector<TimedPose>> read_steps(const Recording& recording,
                                                         const std::string& odometry_topic,
                                                         const Tree& tree,
                                                         const std::vector<std::string>& chain,
                                                         const std::string& camera) {
  std::map<std::string, std::vector<TimedPose>> steps;
  for (const std::string& child : chain) {
    if (tree.at(child).is_odometry) steps[child];
  }
  for_each_transform(recording, odometry_topic, camera, [&](const TimedTransform& transform) {
    const auto step = steps.find(transform.child);
    if (step == steps.end() || tree.at(transform.child).parent != transform.parent) return;
    step->second.emplace_back(transform.time_s, transform.T_parent_child);
  });
  for (auto& [child, poses] : steps) std::ranges::stable_sort(poses, {}, &TimedPose::first);
  return steps;
}

const TimedPose& nearest(const std::vector<TimedPose>& poses, double time_s) {
  auto after = std::ranges::lower_bound(poses, time_s, {}, &TimedPose::first);
  if (after == poses.end()) return poses.back();
  if (after == poses.begin()) return *after;
  const auto before = std::prev(after);
  return time_s - before->first <= after->first - time_s ? *before : *after;
}

}  // namespace

RecordedMotion::RecordedMotion(const Recording& recording, const std::string& odometry_topic,
                               const std::string& topic) {
  check_topic(recording, odometry_topic);
  const Header image = first_header(recording, topic);
  const std::string camera = without_slash(image.frame_id);
  const Tree tree = read_tree(recording, odometry_topic, camera);
  const std::vector<std::string> chain = chain_of(tree, camera);
  if (chain.empty()) fail_unlinked(recording, odometry_topic, tree, camera);
  for (const std::string& child : chain) {
    const Edge& edge = tree.at(child);
    if (edge.is_odometry || !edge.moves) continue;
    fail(ErrorKind::input, recording,
         fmt::format(
             "has a camera that moves on the robot: '{}' moves in '{}' on /tf; choose /tf as "
             "topic of the odometry",
             child, edge.parent));
  }
  const auto steps = read_steps(recording, odometry_topic, tree, chain, camera);
  for (const auto& [time_s, unused] : steps.at(chain.back())) {
    cv::Matx44d pose = cv::Matx44d::eye();
    for (const std::string& child : chain) {
      const Edge& edge = tree.at(child);
      pose =
          (edge.is_odometry ? nearest(steps.at(child), time_s).second : edge.T_parent_child) * pose;
    }
    poses_.emplace_back(time_s, pose);
  }
  const double begin_s = image.stamp.in_seconds();
  if (begin_s <= last_s() + kMaxDelay_s) return;
  fail(ErrorKind::input, recording,
       fmt::format("has odometry on {} that ends at {:.6f} s, but its images begin at {:.6f} s: "
                   "choose another topic, with times by the same clock",
                   odometry_topic, last_s(), begin_s));
}

std::optional<cv::Matx44d> RecordedMotion::at(double time_s) const {
  const TimedPose& pose = nearest(poses_, time_s);
  if (std::abs(pose.first - time_s) > kMaxDelay_s) return std::nullopt;
  return pose.second;
}

}  // namespace loopbit::recordings
