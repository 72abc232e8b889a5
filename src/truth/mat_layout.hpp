// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace loopbit::truth {

/// Empty if `path` looks like a whole MATLAB file of version 5 to 7.3, else what is wrong with it,
/// to be read after the file's name. libmatio reads on where a file stops. Looks at the header and
/// at how long each variable is, not at what is in it; of version 7.3, which is an HDF5 file, at
/// the header alone, since HDF5 knows how long a file is.
std::string fault_of_mat_file(const std::string& path);

}  // namespace loopbit::truth
