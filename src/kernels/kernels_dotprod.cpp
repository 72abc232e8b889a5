// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled for Arm with the dot product extension: nothing here may run before the processor was
// asked.
#include "portable_loops.inc"

namespace loopbit {

constinit const Kernels kDotprodKernels = portable_kernels("dotprod");

}  // namespace loopbit
