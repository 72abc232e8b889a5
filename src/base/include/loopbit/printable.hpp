// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace loopbit {

/// `text`, fit to be shown to people: control characters other than line feeds, by which the name
/// of a file could steer a terminal, are written as "\x1b". What is printable stays as it is.
std::string printable(std::string_view text);

}  // namespace loopbit
