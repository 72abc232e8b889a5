// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// A part's table of inner loops for an instruction set of this processor. `Kernels` declares a
/// static function template compiled_for() over the instruction set, which returns a const Kernels&
/// and is defined in a source that loopbit_kernels() (cmake/LoopbitKernels.cmake) compiles for
/// each set. Such a source, and the headers it includes, use nothing inline that another source
/// uses, too, such as the standard library's functions: the linker would keep one copy for all, and
/// that may be one that this processor cannot run.
template <typename Kernels>
[[nodiscard]] const Kernels& kernels_for(InstructionSet instruction_set) {
  switch (instruction_set) {
#if defined(__x86_64__)
    case InstructionSet::avx2:
      return Kernels::template compiled_for<InstructionSet::avx2>();
    case InstructionSet::avx512:
      return Kernels::template compiled_for<InstructionSet::avx512>();
#elif defined(__aarch64__)
    case InstructionSet::dotprod:
      return Kernels::template compiled_for<InstructionSet::dotprod>();
#endif
    default:
      return Kernels::template compiled_for<InstructionSet::scalar>();
  }
}

}  // namespace loopbit
