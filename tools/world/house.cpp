// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <array>

#include "chance.hpp"
#include "surfaces.hpp"
#include "town.hpp"

namespace loopbit::town {
namespace {

constexpr float kPlinth_m = 0.45F;
constexpr float kSill_m = 0.85F;     // above the floor
constexpr float kFrame_m = 0.07F;    // width of window frames
constexpr float kShopTop_m = 2.45F;  // where the sign begins
constexpr float kDoorHalf_m = 0.52F;
constexpr float kDoorTop_m = 2.15F;
constexpr float kOwnCurtains = 0.3F;  // share of windows in which look-alikes differ

constexpr Color kDarkRoom = rgb(0.13F, 0.15F, 0.18F);
constexpr Color kGlass = rgb(0.42F, 0.50F, 0.58F);

Color brick(const HouseStyle& style, float u, float z, float footprint) {
  constexpr float kHigh = 0.075F;
  constexpr float kWide = 0.24F;
  constexpr float kMortar = 0.012F;
  const int row = floor_int(z / kHigh);
  const float shifted = u / kWide + 0.5F * static_cast<float>(row & 1);
  const int column = floor_int(shifted);
  const float fade = resolved(kHigh, footprint);
  if (fade <= 0) return style.wall;
  const float own = unit(hash_of(style.seed, column, row)) - 0.5F;
  const float joint =
      std::max(cover(z - static_cast<float>(row) * kHigh, 0.0F, kMortar, footprint),
               cover((shifted - static_cast<float>(column)) * kWide, 0.0F, kMortar, footprint));
  return blend(style.wall * (1.0F + 0.35F * own * fade), gray(0.66F), 0.7F * joint * fade);
}

Color stone(const HouseStyle& style, float u, float z, float footprint) {
  constexpr float kHigh = 0.34F;
  constexpr float kWide = 0.7F;
  const int row = floor_int(z / kHigh);
  const float shifted = u / kWide + unit(hash_of(style.seed, row));
  const int column = floor_int(shifted);
  const float fade = resolved(kHigh, footprint);
  const float own = unit(hash_of(style.seed + 1, column, row)) - 0.5F;
  const float joint =
      std::max(cover(z - static_cast<float>(row) * kHigh, 0.0F, 0.02F, footprint),
               cover((shifted - static_cast<float>(column)) * kWide, 0.0F, 0.02F, footprint));
  return blend(style.wall * (1.0F + 0.25F * own * fade), style.wall * 0.6F, joint * fade);
}

Color concrete(const HouseStyle& style, float u, float z, float footprint) {
  const float in_panel = wrap(z, 1.45F);
  const float in_width = wrap(u, 2.9F);
  const float seam =
      std::max(cover(in_panel, 0.0F, 0.03F, footprint), cover(in_width, 0.0F, 0.03F, footprint));
  return style.wall * (1.0F - 0.35F * seam);
}

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

HouseColumn::HouseColumn(const HouseStyle& style, std::uint32_t detail, float width_m, float u,
                         float footprint_u)
    : style_(style), detail_(detail), u_(u), fu_(footprint_u), from_middle_(u - width_m / 2) {
  const int bays = std::max(1, floor_int(width_m / style.bay_m + 0.3F));
  const float bay_m = width_m / static_cast<float>(bays);
  bay_ = std::clamp(floor_int(u / bay_m), 0, bays - 1);
  x_ = u - (static_cast<float>(bay_) + 0.5F) * bay_m;
  door_bay_ = bay_ == static_cast<int>(style.seed % static_cast<std::uint32_t>(bays));
}

Color HouseColumn::masonry(float z, float footprint) const {
  Color color = style_.wall;
  if (style_.masonry == Masonry::brick) color = brick(style_, u_, z, footprint);
  if (style_.masonry == Masonry::stone) color = stone(style_, u_, z, footprint);
  if (style_.masonry == Masonry::concrete) color = concrete(style_, u_, z, footprint);
  const float pixel = std::max(fu_, footprint);
  const float stains = 0.20F * noise_of_size(detail_, u_, z, 1.1F, pixel) +
                       0.12F * noise_of_size(detail_ + 1, u_, z * 0.4F, 0.28F, pixel) +
                       0.10F * noise_of_size(detail_ + 2, u_, z, 0.06F, pixel);
  const float dirt = 0.22F * clamp01(1.0F - z / 1.6F);
  return color * (1.0F + stains - dirt);
}

// y from the foot of the window.
Color HouseColumn::pane(std::uint32_t window_seed, float y, float footprint) const {
  const float height = style_.window_height_m;
  const float half = style_.window_width_m / 2;
  Color color = blend(kDarkRoom, kGlass, 0.25F + 0.45F * y / height);
  Random random(window_seed);
  const Color cloth =
      random.chance(0.6F) ? gray(random.between(0.6F, 0.85F)) : style_.shutter * 1.3F + gray(0.15F);
  const int kind = random.pick(5);
  const float folds = 1.0F - 0.25F * resolved(0.12F, fu_) * std::abs(wrap(x_ / 0.12F, 1.0F) - 0.5F);
  if (kind == 0) color = blend(color, cloth * folds, 1.0F - across(-half * 0.55F, half * 0.55F));
  if (kind == 1) color = blend(color, cloth, cover(y, height * 0.5F, height, footprint));
  if (kind == 2) color = blend(color, cloth * folds, 0.75F);
  if (kind == 3) {
    const float plant = cover(y, 0.05F, 0.3F + 0.2F * unit(window_seed), footprint);
    color = blend(color, rgb(0.22F, 0.40F, 0.18F), plant * across(-half * 0.5F, half * 0.2F));
  }
  return color;
}

// What is around a window: its surround, shutters and sill.
Color HouseColumn::dressing(Color color, float y, float footprint) const {
  const float half = style_.window_width_m / 2;
  const float height = style_.window_height_m;
  if (style_.surrounds) {
    const float around =
        across(-half - 0.13F, half + 0.13F) * cover(y, -0.05F, height + 0.18F, footprint);
    color = blend(color, style_.trim, around);
  }
  if (style_.shutters) {
    const float slat = cover(wrap(y, 0.08F), 0.0F, 0.03F, footprint);
    const float slats = 1.0F - 0.3F * resolved(0.08F, footprint) * slat;
    const float wings =
        std::max(across(-half * 1.95F, -half - 0.02F), across(half + 0.02F, half * 1.95F));
    color = blend(color, style_.shutter * slats, wings * cover(y, 0.0F, height, footprint));
  }
  const float under = across(-half - 0.12F, half + 0.12F);
  color = blend(color, color * 0.72F, under * cover(y, -0.24F, -0.08F, footprint));
  return blend(color, style_.trim, under * cover(y, -0.08F, 0.02F, footprint));
}

Color HouseColumn::window(Color color, int floor, float y, float footprint) const {
  const float half = style_.window_width_m / 2;
  const float height = style_.window_height_m;
  if (std::abs(x_) > 2 * half + 0.1F) return color;
  color = dressing(color, y, footprint);
  const float opening = across(-half, half) * cover(y, 0.0F, height, footprint);
  if (opening <= 0) return color;

  const bool own = unit(hash_of(detail_, bay_, floor)) < kOwnCurtains;
  const Color glass = pane(hash_of(own ? detail_ : style_.seed, bay_ + 100, floor), y, footprint);
  float bars = style_.panes >= 2 ? across(-kFrame_m / 2, kFrame_m / 2) : 0.0F;
  if (style_.panes >= 3) {
    bars = std::max(bars, cover(y, height * 0.62F, height * 0.62F + 0.05F, footprint));
  }
  const float inside = across(-half + kFrame_m, half - kFrame_m) *
                       cover(y, kFrame_m, height - kFrame_m, footprint) * (1.0F - bars);
  Color seen = blend(style_.frame, glass, inside);
  seen = blend(seen, seen * 0.55F, cover(y, height - 0.12F, height, footprint));
  return blend(color, seen, opening);
}

// Above the eaves there is wall only in a gable.
Color HouseColumn::attic(Color color, float z, float footprint) const {
  const float cornice = cover(z, style_.eaves_m - 0.2F, style_.eaves_m + 0.02F, footprint);
  color = blend(color, style_.trim * 0.85F, cornice);
  if (style_.ridge_m < style_.eaves_m + 2.2F) return color;
  const float y = z - style_.eaves_m - 0.5F;
  const auto box = [&](float half, float low, float high) {
    return cover(from_middle_, -half, half, fu_) * cover(y, low, high, footprint);
  };
  color = blend(color, style_.frame, box(0.4F, 0.0F, 0.9F));
  return blend(color, kGlass * 0.6F, box(0.32F, 0.08F, 0.82F));
}

Color HouseColumn::upper_floor(Color color, int floor, float y, float footprint) const {
  if (style_.surrounds) {
    color = blend(color, style_.trim * 0.92F, cover(y, -0.12F, 0.06F, footprint));
  }
  color = window(color, floor, y - kSill_m, footprint);
  if (!style_.balconies || bay_ % 2 == 0) return color;
  const float rail = cover(y, 0.95F, 1.02F, footprint);
  const float bar = wrap(x_ / 0.13F, 1.0F);
  const float bars = cover(y, 0.1F, 1.0F, footprint) *
                     blend(0.3F, cover(bar, 0.0F, 0.3F, fu_ / 0.13F), resolved(0.13F, fu_));
  const float slab = cover(y, -0.02F, 0.12F, footprint);
  const float reach = across(-style_.bay_m * 0.42F, style_.bay_m * 0.42F);
  color = blend(color, gray(0.16F), reach * std::max(rail, bars));
  return blend(color, style_.trim * 0.8F, reach * slab);
}

Color HouseColumn::shop(Color color, float z, float footprint) const {
  const float glass = cover(z, 0.5F, kShopTop_m - 0.1F, footprint);
  const int item_x = floor_int(u_ / 0.45F);
  const int item_z = floor_int(z / 0.5F);
  const std::uint32_t item = hash_of(style_.seed + 7, item_x, item_z);
  const Color tint = rgb(unit(item), unit(scramble(item)), unit(scramble(item + 1)));
  Color ware = blend(gray(0.15F + 0.6F * unit(scramble(item + 2))), tint, 0.35F);
  ware = blend(gray(0.42F), ware, resolved(0.45F, std::max(fu_, footprint)));
  const float wide = 0.12F + 0.3F * unit(scramble(item + 3));
  const float high = 0.15F + 0.3F * unit(scramble(item + 4));
  const float shown =
      0.9F * cover(wrap(u_, 0.45F), 0.02F, wide, fu_) * cover(wrap(z, 0.5F), 0.0F, high, footprint);
  const Color behind = blend(blend(kDarkRoom, kGlass, 0.3F + 0.15F * z), ware, shown);
  const float post = 1.0F - across(-style_.bay_m * 0.44F, style_.bay_m * 0.44F);
  color = blend(color, style_.sign * 0.8F, cover(z, 0.0F, kShopTop_m, footprint));
  color = blend(color, behind, glass * (1.0F - post));
  const float sign_top = std::min(style_.ground_floor_m, kShopTop_m + 0.75F);
  const float letter = std::min(0.42F, sign_top - kShopTop_m - 0.2F);
  const float marks = glyphs(style_.seed + 3, u_ - 0.6F, z - kShopTop_m - 0.14F, letter, fu_);
  const Color board = blend(style_.sign, gray(0.93F) + style_.sign * -0.1F, marks);
  return blend(color, board, cover(z, kShopTop_m, sign_top, footprint));
}

Color HouseColumn::door(Color color, float z, float footprint) const {
  const float frame = across(-kDoorHalf_m - 0.12F, kDoorHalf_m + 0.12F) *
                      cover(z, 0.0F, kDoorTop_m + 0.12F, footprint);
  color = blend(color, style_.trim, frame);
  const float leaf = across(-kDoorHalf_m, kDoorHalf_m) * cover(z, 0.12F, kDoorTop_m, footprint);
  const float panels = across(-0.36F, -0.05F) + across(0.05F, 0.36F);
  const float rows = cover(z, 0.3F, 0.95F, footprint) + cover(z, 1.1F, 1.45F, footprint);
  Color wood = blend(style_.door, style_.door * 0.65F, panels * rows);
  wood = blend(wood, kGlass * 0.6F, across(-0.38F, 0.38F) * cover(z, 1.6F, 2.0F, footprint));
  return blend(color, wood, leaf);
}

Color HouseColumn::ground_floor(Color color, float z, float footprint) const {
  if (style_.shop && !door_bay_) return shop(color, z, footprint);
  color = blend(color, gray(0.42F), cover(z, -1.0F, kPlinth_m, footprint) * 0.75F);
  if (door_bay_) return door(color, z, footprint);
  return window(color, 0, z - kSill_m - 0.2F, footprint);
}

Color HouseColumn::at(float z, float footprint) const {
  const Color wall = masonry(z, footprint);
  if (z > style_.eaves_m - 0.25F) return attic(wall, z, footprint);
  if (z < style_.ground_floor_m) return ground_floor(wall, z, footprint);
  const float upper = (z - style_.ground_floor_m) / style_.floor_m;
  const int floor = floor_int(upper);
  if (floor + 1 >= style_.floors) return wall;
  return upper_floor(wall, floor + 1, (upper - static_cast<float>(floor)) * style_.floor_m,
                     footprint);
}

float HouseColumn::glow(float z, float footprint) const {
  constexpr float kLit = 0.4F;  // share of windows
  if (z > style_.eaves_m - 0.25F) return 0.0F;
  const bool low = z < style_.ground_floor_m;
  if (low && door_bay_) return 0.0F;
  if (low && style_.shop) {
    return across(-style_.bay_m * 0.44F, style_.bay_m * 0.44F) *
           cover(z, 0.5F, kShopTop_m - 0.1F, footprint);
  }
  const float upper = low ? 0.0F : (z - style_.ground_floor_m) / style_.floor_m;
  const int floor = low ? 0 : floor_int(upper) + 1;
  if (floor >= style_.floors || unit(hash_of(detail_ + 31, bay_, floor)) >= kLit) return 0.0F;
  const float y =
      low ? z - kSill_m - 0.2F : (upper - static_cast<float>(floor - 1)) * style_.floor_m - kSill_m;
  const float half = style_.window_width_m / 2 - kFrame_m;
  return across(-half, half) * cover(y, kFrame_m, style_.window_height_m - kFrame_m, footprint);
}

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
