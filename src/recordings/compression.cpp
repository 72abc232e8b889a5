// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "compression.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <span>

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

namespace loopbit::recordings {
namespace {

constexpr std::array<unsigned char, 4> kZstdStart = {0x28, 0xB5, 0x2F, 0xFD};

/// What one call of a decompressor did.
struct Step {
  std::size_t read = 0;
  std::size_t written = 0;
  bool ended = false;  ///< the whole frame is read and written
  bool failed = false;
};

class Lz4 {
 public:
  Lz4() {
    LZ4F_dctx* context = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) == 0U) {
      context_.reset(context);
    }
  }

  Step step(Bytes in, std::span<unsigned char> out) {
    if (!context_) return {.failed = true};
    std::size_t read = in.size();
    std::size_t written = out.size();
    const std::size_t hint =
        LZ4F_decompress(context_.get(), out.data(), &written, in.data(), &read, nullptr);
    if (LZ4F_isError(hint) != 0U) return {.failed = true};
    return {.read = read, .written = written, .ended = hint == 0};
  }

 private:
  struct Free {
    void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
  };
  std::unique_ptr<LZ4F_dctx, Free> context_;
};

class Zstd {
 public:
  Step step(Bytes in, std::span<unsigned char> out) {
    if (!context_) return {.failed = true};
    ZSTD_inBuffer from{in.data(), in.size(), 0};
    ZSTD_outBuffer to{out.data(), out.size(), 0};
    const std::size_t hint = ZSTD_decompressStream(context_.get(), &to, &from);
    return {.read = from.pos,
            .written = to.pos,
            .ended = hint == 0,
            .failed = ZSTD_isError(hint) != 0U};
  }

 private:
  struct Free {
    void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
  };
  std::unique_ptr<ZSTD_DCtx, Free> context_{ZSTD_createDCtx()};
};

class Bz2 {
 public:
  Bz2() : ready_(BZ2_bzDecompressInit(&stream_, 0, 0) == BZ_OK) {}
  ~Bz2() {
    if (ready_) BZ2_bzDecompressEnd(&stream_);
  }
  Bz2(const Bz2&) = delete;
  Bz2& operator=(const Bz2&) = delete;
  Bz2(Bz2&&) = delete;
  Bz2& operator=(Bz2&&) = delete;

  Step step(Bytes in, std::span<unsigned char> out) {
    if (!ready_) return {.failed = true};
    // The library has no view of constant bytes.
    const Bytes some = in.first(std::min(in.size(), input_.size()));
    std::memcpy(input_.data(), some.data(), some.size());
    stream_.next_in = input_.data();
    stream_.next_out = reinterpret_cast<char*>(out.data());
    stream_.avail_in = static_cast<unsigned>(some.size());
    stream_.avail_out = static_cast<unsigned>(out.size());
    const int result = BZ2_bzDecompress(&stream_);
    return {.read = some.size() - stream_.avail_in,
            .written = out.size() - stream_.avail_out,
            .ended = result == BZ_STREAM_END,
            .failed = result != BZ_OK && result != BZ_STREAM_END};
  }

 private:
  bz_stream stream_{};
  std::vector<char> input_ = std::vector<char>(std::size_t{64} << 10U);
  bool ready_;
};

template <typename Decoder>
bool run(Bytes in, std::size_t max_size, std::vector<unsigned char>& out) {
  constexpr std::size_t kLeast = std::size_t{64} << 10U;
  Decoder decoder;
  out.resize(std::min(max_size, std::max(kLeast, in.size() * 2)));
  std::size_t size = 0;
  bool is_whole = false;
  while (true) {
    const Step step = decoder.step(in, std::span(out).subspan(size));
    in = in.subspan(step.read);
    size += step.written;
    is_whole = step.ended;
    const bool is_stuck = step.read == 0 && step.written == 0;
    if (step.ended || step.failed || (is_stuck && size < out.size())) break;
    if (is_stuck && size == max_size) break;
    if (size == out.size()) out.resize(std::min(max_size, 2 * size));
  }
  out.resize(size);
  return is_whole;
}

}  // namespace

std::optional<Compression> compression_of(std::string_view name) {
  if (name.empty() || name == "none") return Compression::none;
  if (name == "lz4") return Compression::lz4;
  if (name == "zstd") return Compression::zstd;
  if (name == "bz2") return Compression::bz2;
  return std::nullopt;
}

bool decompress(Compression compression, Bytes compressed, std::size_t size,
                std::vector<unsigned char>& out) {
  bool is_whole = true;
  switch (compression) {
    case Compression::none:
      out.assign(compressed.begin(), compressed.end());
      break;
    case Compression::lz4:
      is_whole = run<Lz4>(compressed, size, out);
      break;
    case Compression::zstd:
      is_whole = run<Zstd>(compressed, size, out);
      break;
    case Compression::bz2:
      is_whole = run<Bz2>(compressed, size, out);
      break;
  }
  return is_whole && out.size() == size;
}

bool is_zstd(Bytes bytes) {
  return bytes.size() >= kZstdStart.size() &&
         std::ranges::equal(bytes.first(kZstdStart.size()), kZstdStart);
}

bool decompress_zstd(Bytes compressed, std::size_t max_size, std::vector<unsigned char>& out) {
  return run<Zstd>(compressed, max_size, out);
}

std::vector<unsigned char> compress_zstd(Bytes bytes) {
  constexpr int kFast = 1;
  std::vector<unsigned char> frame(ZSTD_compressBound(bytes.size()));
  frame.resize(ZSTD_compress(frame.data(), frame.size(), bytes.data(), bytes.size(), kFast));
  return frame;
}

}  // namespace loopbit::recordings
