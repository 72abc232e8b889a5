// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "crc32.hpp"

#include <array>

#include <zlib.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace loopbit {
namespace {

using Bytes = std::span<const unsigned char>;

std::uint32_t zlib_crc32(std::uint32_t crc, Bytes bytes) {
  if (bytes.empty()) return crc;
  return static_cast<std::uint32_t>(crc32_z(crc, bytes.data(), bytes.size()));
}

#if defined(__x86_64__)

// Gopal et al., "Fast CRC Computation for Generic Polynomials Using PCLMULQDQ Instruction", Intel
// 2009: what was read is kept as a polynomial of 128 bits with the same remainder, which moves on
// by n bits when it is multiplied by x^n modulo the CRC's polynomial. Four of them side by side
// hide how long a product takes. The constants are those of the paper for the bit-reflected
// polynomial.

constexpr std::size_t kLane = sizeof(__m128i);
constexpr std::size_t kBlock = 4 * kLane;

__attribute__((target("pclmul"))) __m128i moved(__m128i lane, __m128i power) {
  return _mm_xor_si128(_mm_clmulepi64_si128(lane, power, 0x00),
                       _mm_clmulepi64_si128(lane, power, 0x11));
}

__m128i load(const unsigned char* bytes) {
  return _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes));
}

/// At least kBlock bytes.
__attribute__((target("pclmul"))) std::uint32_t pclmul_crc32(std::uint32_t crc, Bytes bytes) {
  const __m128i by_512_bits = _mm_set_epi64x(0x1c6e41596, 0x154442bd4);
  const __m128i by_128_bits = _mm_set_epi64x(0x0ccaa009e, 0x1751997d0);
  __m128i a = _mm_xor_si128(load(bytes.data()), _mm_cvtsi32_si128(static_cast<int>(~crc)));
  __m128i b = load(bytes.data() + kLane);
  __m128i c = load(bytes.data() + 2 * kLane);
  __m128i d = load(bytes.data() + 3 * kLane);
  for (bytes = bytes.subspan(kBlock); bytes.size() >= kBlock; bytes = bytes.subspan(kBlock)) {
    a = _mm_xor_si128(moved(a, by_512_bits), load(bytes.data()));
    b = _mm_xor_si128(moved(b, by_512_bits), load(bytes.data() + kLane));
    c = _mm_xor_si128(moved(c, by_512_bits), load(bytes.data() + 2 * kLane));
    d = _mm_xor_si128(moved(d, by_512_bits), load(bytes.data() + 3 * kLane));
  }
  a = _mm_xor_si128(moved(a, by_128_bits), b);
  a = _mm_xor_si128(moved(a, by_128_bits), c);
  a = _mm_xor_si128(moved(a, by_128_bits), d);
  for (; bytes.size() >= kLane; bytes = bytes.subspan(kLane)) {
    a = _mm_xor_si128(moved(a, by_128_bits), load(bytes.data()));
  }
  std::array<unsigned char, kLane> rest{};
  _mm_storeu_si128(reinterpret_cast<__m128i*>(rest.data()), a);
  constexpr std::uint32_t kZeroState = 0xffffffff;  // zlib inverts it
  return zlib_crc32(zlib_crc32(kZeroState, rest), bytes);
}

#endif

}  // namespace

std::uint32_t crc32_of(std::uint32_t crc, std::span<const unsigned char> bytes) {
#if defined(__x86_64__)
  static const bool has_pclmul = __builtin_cpu_supports("pclmul") != 0;
  if (has_pclmul && bytes.size() >= kBlock) return pclmul_crc32(crc, bytes);
#endif
  return zlib_crc32(crc, bytes);
}

}  // namespace loopbit
