// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "truth_matrix.hpp"

namespace loopbit::truth {

/// The true entries of the matrix called `variable` (empty = the only square one) in a MATLAB file
/// of version 5 to 7.3. Throws Error (kind input). Reads dense matrices of up to 1 GiB. Damage
/// inside a file of version 7.3 is HDF5's to find; its release 1.10 crashes where a compressed
/// block turns out shorter than it should be.
TruthMatrix read_mat_file(const std::string& path, const std::string& variable, int views);

}  // namespace loopbit::truth
