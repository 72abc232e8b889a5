// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <array>

#include "chance.hpp"
#include "town.hpp"

namespace loopbit::town {
namespace {

constexpr std::array<Color, 9> kPlasters{
    rgb(0.86F, 0.80F, 0.66F), rgb(0.84F, 0.70F, 0.45F), rgb(0.88F, 0.86F, 0.80F),
    rgb(0.80F, 0.58F, 0.46F), rgb(0.62F, 0.70F, 0.76F), rgb(0.66F, 0.74F, 0.60F),
    rgb(0.72F, 0.70F, 0.68F), rgb(0.82F, 0.66F, 0.62F), rgb(0.76F, 0.72F, 0.52F)};
constexpr std::array<Color, 4> kBricks{rgb(0.56F, 0.29F, 0.22F), rgb(0.47F, 0.31F, 0.25F),
                                       rgb(0.66F, 0.42F, 0.28F), rgb(0.67F, 0.58F, 0.42F)};
constexpr std::array<Color, 3> kStones{rgb(0.66F, 0.62F, 0.54F), rgb(0.58F, 0.57F, 0.55F),
                                       rgb(0.73F, 0.66F, 0.54F)};
constexpr std::array<Color, 3> kConcretes{rgb(0.62F, 0.62F, 0.60F), rgb(0.70F, 0.68F, 0.64F),
                                          rgb(0.55F, 0.57F, 0.58F)};
constexpr std::array<Color, 4> kRoofs{rgb(0.55F, 0.27F, 0.20F), rgb(0.30F, 0.30F, 0.33F),
                                      rgb(0.44F, 0.31F, 0.25F), rgb(0.38F, 0.38F, 0.36F)};
constexpr std::array<Color, 8> kPaints{rgb(0.18F, 0.32F, 0.24F), rgb(0.20F, 0.28F, 0.42F),
                                       rgb(0.46F, 0.16F, 0.14F), rgb(0.36F, 0.24F, 0.16F),
                                       rgb(0.52F, 0.52F, 0.50F), rgb(0.80F, 0.78F, 0.72F),
                                       rgb(0.16F, 0.16F, 0.18F), rgb(0.74F, 0.58F, 0.22F)};

template <std::size_t N>
Color choose(const std::array<Color, N>& colors, Random& random) {
  const Color color = colors[static_cast<std::size_t>(random.pick(static_cast<int>(N)))];
  return color * random.between(0.88F, 1.08F);
}

Masonry choose_masonry(Random& random) {
  const float share = random.uniform();
  if (share < 0.45F) return Masonry::plaster;
  if (share < 0.75F) return Masonry::brick;
  return share < 0.9F ? Masonry::stone : Masonry::concrete;
}

Color wall_color(Masonry masonry, Random& random) {
  switch (masonry) {
    case Masonry::brick:
      return choose(kBricks, random);
    case Masonry::stone:
      return choose(kStones, random);
    case Masonry::concrete:
      return choose(kConcretes, random);
    case Masonry::plaster:
      break;
  }
  return choose(kPlasters, random);
}

void choose_heights(HouseStyle& style, double depth_m, Random& random) {
  style.floors = 2 + random.pick(3);
  if (random.chance(0.2F)) --style.floors;
  style.ground_floor_m = random.between(2.9F, 3.6F);
  style.floor_m = random.between(2.6F, 3.1F);
  const auto upper = static_cast<float>(style.floors - 1);
  style.eaves_m = style.ground_floor_m + upper * style.floor_m + random.between(0.25F, 0.8F);
  const bool flat = random.chance(style.masonry == Masonry::concrete ? 0.8F : 0.1F);
  const float slope = flat ? 0.0F : random.between(0.5F, 1.0F);
  style.ridge_m = style.eaves_m + slope * static_cast<float>(depth_m) / 2;
}

void choose_windows(HouseStyle& style, Random& random) {
  style.bay_m = random.between(1.8F, 3.2F);
  style.window_width_m = style.bay_m * random.between(0.34F, 0.5F);
  style.window_height_m = random.between(1.15F, 1.7F);
  style.panes = 1 + random.pick(4);
  style.shutters = style.masonry != Masonry::concrete && random.chance(0.4F);
  style.surrounds = random.chance(0.55F);
  style.balconies = style.floors > 2 && random.chance(0.3F);
  style.shop = style.floors > 1 && random.chance(0.3F);
}

}  // namespace

HouseStyle make_house_style(std::uint32_t seed, double depth_m) {
  Random random(seed);
  HouseStyle style;
  style.seed = seed;
  style.masonry = choose_masonry(random);
  style.wall = wall_color(style.masonry, random);
  style.trim = random.chance(0.6F) ? gray(random.between(0.7F, 0.9F)) : choose(kStones, random);
  style.frame = random.chance(0.7F) ? gray(random.between(0.75F, 0.92F)) : choose(kPaints, random);
  style.shutter = choose(kPaints, random);
  style.door = choose(kPaints, random);
  style.roof = choose(kRoofs, random);
  style.sign = choose(kPaints, random);
  choose_heights(style, depth_m, random);
  choose_windows(style, random);
  return style;
}

}  // namespace loopbit::town
