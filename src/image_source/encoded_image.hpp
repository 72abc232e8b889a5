// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace loopbit::images {

/// True if `encoded` is a JPEG or PNG file that stops before its end marker. Decoders fill what is
/// missing with grey and say nothing. Looks at structure only: changed bytes inside a file of full
/// length go unseen, and any other format counts as whole.
bool is_cut_off(std::span<const unsigned char> encoded);

/// Width and height in pixels, as a header says.
struct DeclaredSize {
  std::int64_t width;
  std::int64_t height;
};

/// What the header of a PNG, JPEG, BMP, PBM, PGM, PPM, TIFF or WebP file says; none for a damaged
/// header and for any other format. OpenCV tells a size only by decoding.
std::optional<DeclaredSize> declared_size(std::span<const unsigned char> encoded);

}  // namespace loopbit::images
