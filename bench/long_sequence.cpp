// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "long_sequence.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>
#include <opencv2/imgproc.hpp>

#include "loopbit/gray_image.hpp"
#include "loopbit/image_source.hpp"

namespace loopbit::bench {
namespace {

constexpr std::size_t kSegment = 100;  ///< key frames
constexpr int kTownKeyFrames = 1'500;
constexpr std::size_t kFields = 64;
constexpr float kLapDifference = 0.3F;
constexpr float kFlicker = 0.08F;

/// A well-mixed 64-bit number (Steele, Lea, Flood, "Fast splittable pseudorandom number
/// generators", 2014).
std::uint64_t mixed(std::uint64_t value) {
  value += 0x9E3779B97F4A7C15U;
  value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9U;
  value = (value ^ (value >> 27U)) * 0x94D049BB133111EBU;
  return value ^ (value >> 31U);
}

cv::Mat1f as_map(Saliency& saliency) { return {kContentSide, kContentSide, saliency.data()}; }

BinaryContent content_of(Saliency saliency) {
  return binarize(as_map(saliency), BinaryContentOptions{}.gamma);
}

Saliency saliency_of(const cv::Mat& image) {
  const cv::Mat1f map = saliency_map(gray_image(image));
  const auto mean = static_cast<float>(cv::mean(map)[0]);
  Saliency saliency{};
  std::transform(map.begin(), map.end(), saliency.begin(),
                 [&](float value) { return mean > 0 ? value / mean : 1.0F; });
  return saliency;
}

std::vector<Saliency> smooth_fields() {
  std::vector<Saliency> fields(kFields);
  cv::RNG random(2019);
  for (Saliency& field : fields) {
    cv::Mat1f map = as_map(field);
    random.fill(map, cv::RNG::NORMAL, 0.0, 1.0);
    cv::GaussianBlur(map, map, {}, BinaryContentOptions{}.blur_sigma_px, 0, cv::BORDER_REFLECT_101);
    cv::Scalar mean;
    cv::Scalar deviation;
    cv::meanStdDev(map, mean, deviation);
    map = (map - mean[0]) / deviation[0];
  }
  return fields;
}

/// Multiplies by one of the fields to the power of `strength`, which one by `key`.
void disturb(Saliency& saliency, const std::vector<Saliency>& fields, std::uint64_t key,
             float strength) {
  const Saliency& field = fields[mixed(key) % fields.size()];
  const std::size_t shift = (mixed(key) >> 32U) % saliency.size();
  const auto multiply = [&](std::size_t begin, std::size_t end, const float* from) {
    for (std::size_t i = begin; i < end; ++i) {
      const float e = strength * from[i - begin];
      saliency[i] *= 1.0F + e + 0.5F * e * e;
    }
  };
  multiply(0, saliency.size() - shift, field.data() + shift);
  multiply(saliency.size() - shift, saliency.size(), field.data());
}

std::shared_ptr<const World> make_town(int seed) {
  WorldOptions options;
  options.seed = seed;
  options.frames = 2 * kTownKeyFrames;
  options.laps = 2.0;
  // The content has 64 x 64 pixels: it is nearly that of a larger picture.
  options.width_px = 160;
  options.height_px = 120;
  return std::make_shared<const World>(options);
}

}  // namespace

LongSequence::LongSequence(const std::string& data, const std::vector<std::string>& real,
                           int first_seed, int towns)
    : fields_(smooth_fields()) {
  for (int seed = first_seed; seed < first_seed + towns; ++seed) {
    Source source{{}, make_town(seed)};
    source.key_frames.reserve(kTownKeyFrames);
    for (int i = 0; i < kTownKeyFrames; ++i) {
      source.key_frames.push_back(saliency_of(source.town->render(i)));
    }
    sources_.push_back(std::move(source));
  }
  for (const std::string& name : real) {
    if (data.empty()) break;
    Source source{{}, nullptr};
    const auto images = open_source(fmt::format("{}/{}/images", data, name));
    for (Frame frame; images->next(frame);) source.key_frames.push_back(saliency_of(frame.image));
    sources_.push_back(std::move(source));
  }
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    auto& segments = sources_[i].town ? town_segments_ : real_segments_;
    for (std::size_t first = 0; first + kSegment <= sources_[i].key_frames.size();
         first += kSegment) {
      segments.push_back({i, first});
    }
  }
  if (real_segments_.empty()) real_segments_ = town_segments_;
}

LongSequence::Position LongSequence::position(std::size_t number) const {
  const std::size_t turn = number / kSegment;
  const auto& segments = turn % 2 == 0 ? town_segments_ : real_segments_;
  const Segment& segment = segments[turn / 2 % segments.size()];
  return {&sources_[segment.source], segment.first + number % kSegment, turn / 2 / segments.size()};
}

Saliency LongSequence::in_its_lap(std::size_t number) const {
  const Position position = this->position(number);
  Saliency saliency = position.source->key_frames[position.at];
  if (position.lap % 2 == 1) {
    cv::Mat1f map = as_map(saliency);
    cv::flip(map, map, 1);
  }
  disturb(saliency, fields_, number, kLapDifference);
  return saliency;
}

BinaryContent LongSequence::next() {
  const std::size_t key_frame = frame_ / kFramesPerKeyFrame;
  const std::size_t step = frame_ % kFramesPerKeyFrame;
  if (step == 0) {
    // A segment ends where its last key frame stands still.
    const bool is_last = (key_frame + 1) % kSegment == 0;
    from_ = frame_ == 0 || key_frame % kSegment == 0 ? in_its_lap(key_frame) : to_;
    to_ = is_last ? from_ : in_its_lap(key_frame + 1);
  }
  const float weight = static_cast<float>(step) / kFramesPerKeyFrame;
  Saliency between;
  for (std::size_t i = 0; i < between.size(); ++i) {
    between[i] = from_[i] + weight * (to_[i] - from_[i]);
  }
  disturb(between, fields_, ~std::uint64_t{frame_++}, kFlicker);
  return content_of(between);
}

BinaryContent LongSequence::revisit(std::size_t number) const {
  const Position position = this->position(number);
  if (position.source->town && position.lap % 2 == 0) {
    const int second_lap = kTownKeyFrames + static_cast<int>(position.at);
    return content_of(saliency_of(position.source->town->render(second_lap)));
  }
  Saliency saliency = in_its_lap(number);
  disturb(saliency, fields_, mixed(number), kLapDifference);
  return shift_columns(content_of(saliency), static_cast<int>(number % 5) - 2);
}

BinaryContent LongSequence::key_frame_of_lap(std::size_t number) const {
  return content_of(in_its_lap(number));
}

BinaryContent LongSequence::key_frame(std::size_t number) const {
  const Position position = this->position(number);
  return content_of(position.source->key_frames[position.at]);
}

}  // namespace loopbit::bench
