// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

// What examples/ros2 uses of ROS 2, so that Debian alone can compile and run it. spin() gives the
// node the images of the folder in argv[1], and messages are printed.
#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <string>

#include <loopbit/image_source.hpp>

#include "sensor_msgs/msg/image.hpp"

#define RCLCPP_WARN(logger, ...) ((void)(logger), (void)std::fprintf(stderr, __VA_ARGS__))

namespace rclcpp {

inline std::string images;
inline std::function<void(const sensor_msgs::msg::Image::ConstSharedPtr&)> callback;

class SensorDataQoS {
 public:
  SensorDataQoS& keep_last(int /*depth*/) { return *this; }
};

template <typename Message>
class Publisher {
 public:
  using SharedPtr = std::shared_ptr<Publisher>;
  void publish(const Message& message) { std::cout << message.data << '\n'; }
};

template <typename Message>
class Subscription {
 public:
  using SharedPtr = std::shared_ptr<Subscription>;
};

class Node {
 public:
  explicit Node(const std::string& /*name*/) {}
  template <typename Message>
  auto create_publisher(const std::string& /*topic*/, int /*depth*/) {
    return std::make_shared<Publisher<Message>>();
  }
  template <typename Message, typename Callback>
  auto create_subscription(const std::string& /*topic*/, const SensorDataQoS& /*qos*/,
                           Callback called) {
    callback = called;
    return std::make_shared<Subscription<Message>>();
  }
  [[nodiscard]] int get_logger() const { return 0; }
};

inline void init(int argc, char** argv) { images = argc > 1 ? argv[1] : ""; }
inline void shutdown() {}

inline void spin(const std::shared_ptr<Node>& /*node*/) {
  const auto source = loopbit::open_source(images);
  loopbit::Frame frame;
  for (int second = 0; source->next(frame); ++second) {
    auto message = std::make_shared<sensor_msgs::msg::Image>();
    message->header.stamp.sec = second;
    // One that cannot be read is among them.
    if (second != 1) message->image = frame.image;
    callback(message);
  }
}

}  // namespace rclcpp
