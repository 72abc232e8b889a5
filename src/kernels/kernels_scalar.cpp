// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "portable_loops.inc"

namespace loopbit {

constinit const Kernels kScalarKernels = portable_kernels("scalar");

}  // namespace loopbit
