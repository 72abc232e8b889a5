// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "content_pages.hpp"

namespace loopbit::server {

// The scan of an index in the order of similarity to a query; see IndexAmRoutine.
IndexScanDesc begin_scan(Relation index, int num_keys, int num_orders);
void restart_scan(IndexScanDesc scan, ScanKey keys, int num_keys, ScanKey orders, int num_orders);
bool next_row(IndexScanDesc scan, ScanDirection direction);
void end_scan(IndexScanDesc scan);

}  // namespace loopbit::server
