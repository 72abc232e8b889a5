// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>

namespace loopbit::datasets {

/// True if `encoded` is a JPEG or PNG file that stops before its end marker. Decoders fill what is
/// missing with grey and say nothing. Looks at structure only: changed bytes inside a file of full
/// length go unseen, and any other format counts as whole.
bool is_cut_off(std::span<const unsigned char> encoded);

}  // namespace loopbit::datasets
