// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/kernels.hpp"

#if defined(__aarch64__)
#include <sys/auxv.h>
#endif

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "kernel_variants.hpp"

namespace loopbit {
namespace {

std::vector<const Kernels*> kernels_of_this_processor() {
  std::vector<const Kernels*> kernels{&kScalarKernels};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") != 0) kernels.push_back(&kAvx2Kernels);
  const bool has_avx512 =
      __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
      __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
      __builtin_cpu_supports("avx512vnni") != 0 && __builtin_cpu_supports("avx512vpopcntdq") != 0;
  if (has_avx512) kernels.push_back(&kAvx512Kernels);
#elif defined(__aarch64__)
  if ((getauxval(AT_HWCAP) & HWCAP_ASIMDDP) != 0) kernels.push_back(&kDotprodKernels);
#endif
  return kernels;
}

const Kernels& choose() {
  const auto kernels = available_kernels();
  const char* forced = std::getenv("LOOPBIT_KERNEL");
  if (forced == nullptr || *forced == '\0') return *kernels.back();
  const auto found =
      std::find_if(kernels.begin(), kernels.end(), [&](auto* k) { return k->name == forced; });
  if (found != kernels.end()) return **found;
  std::string names;
  for (const Kernels* kernel : kernels) names += fmt::format(" {}", kernel->name);
  throw Error(ErrorKind::option,
              fmt::format("LOOPBIT_KERNEL is '{}', which this processor cannot run; unset it or "
                          "take one of:{}.",
                          forced, names));
}

}  // namespace

std::span<const Kernels* const> available_kernels() {
  static const std::vector<const Kernels*> kernels = kernels_of_this_processor();
  return kernels;
}

const Kernels& active_kernels() {
  static const Kernels& kernels = choose();
  return kernels;
}

}  // namespace loopbit
