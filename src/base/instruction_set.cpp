// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/instruction_set.hpp"

#if defined(__aarch64__)
#include <sys/auxv.h>
#endif

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

std::vector<InstructionSet> instruction_sets_of_this_processor() {
  std::vector<InstructionSet> sets{InstructionSet::scalar};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") != 0) sets.push_back(InstructionSet::avx2);
  const bool has_avx512 =
      __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
      __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
      __builtin_cpu_supports("avx512vnni") != 0 && __builtin_cpu_supports("avx512vpopcntdq") != 0;
  if (has_avx512) sets.push_back(InstructionSet::avx512);
#elif defined(__aarch64__)
  if ((getauxval(AT_HWCAP) & HWCAP_ASIMDDP) != 0) sets.push_back(InstructionSet::dotprod);
#endif
  return sets;
}

InstructionSet choose() {
  const auto sets = available_instruction_sets();
  const char* forced = std::getenv("LOOPBIT_KERNEL");
  if (forced == nullptr || *forced == '\0') return sets.back();
  const auto found = std::find_if(sets.begin(), sets.end(),
                                  [&](InstructionSet set) { return to_string(set) == forced; });
  if (found != sets.end()) return *found;
  std::string names;
  for (const InstructionSet set : sets) names += fmt::format(" {}", to_string(set));
  throw Error(ErrorKind::option,
              fmt::format("LOOPBIT_KERNEL is '{}', which this processor cannot run; unset it or "
                          "take one of:{}.",
                          forced, names));
}

}  // namespace

std::string_view to_string(InstructionSet instruction_set) {
  constexpr std::array<std::string_view, 4> kNames{"scalar", "avx2", "avx512", "dotprod"};
  return kNames.at(static_cast<std::size_t>(instruction_set));
}

std::span<const InstructionSet> available_instruction_sets() {
  static const std::vector<InstructionSet> sets = instruction_sets_of_this_processor();
  return sets;
}

InstructionSet active_instruction_set() {
  static const InstructionSet active = choose();
  return active;
}

}  // namespace loopbit
