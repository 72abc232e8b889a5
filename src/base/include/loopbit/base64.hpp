// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>

namespace loopbit {

/// RFC 4648, with padding.
std::string base64(std::span<const unsigned char> bytes);

}  // namespace loopbit
