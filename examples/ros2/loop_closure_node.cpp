// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A ROS 2 node: images in, loops out, as JSON in std_msgs/String on ~/loops.
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <cv_bridge/cv_bridge.hpp>
#include <fmt/format.h>
#include <loopbit/error.hpp>
#include <loopbit/loop_detector.hpp>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/image.hpp>
#include <std_msgs/msg/string.hpp>

class LoopClosureNode : public rclcpp::Node {
 public:
  LoopClosureNode() : Node("loop_closure") {
    loops_ = create_publisher<std_msgs::msg::String>("~/loops", 10);
    // An image takes some milliseconds. If the processor is busy with others, older ones are
    // dropped.
    images_ = create_subscription<sensor_msgs::msg::Image>(
        "image", rclcpp::SensorDataQoS().keep_last(5),
        [this](const sensor_msgs::msg::Image::ConstSharedPtr& image) { process(image); });
  }

 private:
  void process(const sensor_msgs::msg::Image::ConstSharedPtr& image) {
    const double time_s = image->header.stamp.sec + 1e-9 * image->header.stamp.nanosec;
    times_s_.push_back(time_s);
    loopbit::Detection found;
    try {
      found = detector_.process(cv_bridge::toCvShare(image, "bgr8")->image, time_s);
    } catch (const std::exception& error) {  // of another encoding, or damaged
      RCLCPP_WARN(get_logger(), "%s", error.what());
      detector_.skip(time_s);  // frames and times_s_ stay in step
      return;
    }
    if (found.status == loopbit::Status::loop && found.match) {
      publish("loop", found.frame, *found.match, found.score);
    }
    // Loops of the images just before, found only now, and loops that are now more likely wrong
    // than right.
    for (const loopbit::LateLoop& loop : found.late_loops) {
      publish("late", loop.frame, *loop.match, loop.score);
    }
    for (const loopbit::LateLoop& loop : found.withdrawn_loops) {
      publish("withdrawn", loop.frame, *loop.match, loop.score);
    }
  }

  void publish(const char* type, loopbit::PlaceId query, loopbit::PlaceId match, double score) {
    const auto time_of = [&](loopbit::PlaceId frame) {
      return times_s_[static_cast<std::size_t>(frame)];
    };
    std_msgs::msg::String message;
    message.data = fmt::format(
        R"({{"type": "{}", "query": {}, "match": {}, "query_time_s": {:.9f}, "match_time_s": {:.9f}, "score": {}}})",
        type, query, match, time_of(query), time_of(match), score);
    loops_->publish(message);
  }

  loopbit::LoopDetector detector_;
  std::vector<double> times_s_;  ///< by frame number
  rclcpp::Publisher<std_msgs::msg::String>::SharedPtr loops_;
  rclcpp::Subscription<sensor_msgs::msg::Image>::SharedPtr images_;
};

int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<LoopClosureNode>());
  rclcpp::shutdown();
}
