// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "content_query.hpp"
#include "postgres.hpp"

namespace loopbit::server {

/// The setting loopbit.shift_tolerance_columns of the connection.
[[nodiscard]] int shift_tolerance_columns();

/// See prepare(). Its failure is an error.
void prepare_or_fail(const void* content, int tolerance_columns, ContentQuery& query);

}  // namespace loopbit::server
