// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "mat_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <matio.h>
#include <zlib.h>

#include "loopbit/error.hpp"

namespace loopbit::truth {
namespace {

namespace fs = std::filesystem;

// "MAT-File Format", The MathWorks, chapter 1: a header of 128 bytes that ends in the version and
// the byte order, then elements, each with a tag of its type and length.
constexpr std::size_t kHeaderBytes = 128;
constexpr std::size_t kVersionAt = 124;
constexpr std::size_t kOrderAt = 126;
constexpr std::size_t kTagBytes = 8;
constexpr std::uint32_t kMatrix = 14;
constexpr std::uint32_t kCompressed = 15;

std::uint32_t read_number(const std::byte* bytes, std::size_t count, bool little) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = little ? count - 1 - i : i;
    number = number << 8U | std::to_integer<std::uint32_t>(bytes[at]);
  }
  return number;
}

template <std::size_t size>
bool read(std::ifstream& stream, std::array<std::byte, size>& bytes) {
  stream.read(reinterpret_cast<char*>(bytes.data()), size);
  return stream.good();
}

/// What follows the tag of a matrix: its flags, and the tag of its dimensions.
constexpr std::size_t kMatrixStartBytes = 24;
using MatrixStart = std::array<std::byte, kMatrixStartBytes>;

/// libmatio takes memory for as many dimensions as a file says, up to 8 GB.
bool has_sane_dimensions(const MatrixStart& start, bool little) {
  // Strings, tables and other objects of MATLAB's have none, and are passed over.
  constexpr std::uint32_t kOpaque = 17;
  if ((read_number(start.data() + 8, 4, little) & 0xFFU) == kOpaque) return true;
  constexpr std::uint32_t kInt32 = 5;
  constexpr std::uint32_t kMaxDimensions = 32;
  const std::uint32_t type = read_number(start.data() + 16, 4, little);
  const std::uint32_t bytes = read_number(start.data() + 20, 4, little);
  return type == kInt32 && bytes >= 8 && bytes <= 4 * kMaxDimensions;
}

/// The first bytes that `stream` unpacks to, without the tag of the matrix; false where there are
/// not so many.
bool unpack(std::ifstream& stream, std::uint32_t packed_bytes, MatrixStart& start) {
  std::array<char, 512> packed{};
  stream.read(packed.data(), std::min<std::streamsize>(packed_bytes, packed.size()));
  std::array<std::byte, kTagBytes + kMatrixStartBytes> unpacked{};
  z_stream zlib{};
  if (inflateInit(&zlib) != Z_OK) return false;
  zlib.next_in = reinterpret_cast<Bytef*>(packed.data());
  zlib.avail_in = static_cast<uInt>(stream.gcount());
  zlib.next_out = reinterpret_cast<Bytef*>(unpacked.data());
  zlib.avail_out = static_cast<uInt>(unpacked.size());
  inflate(&zlib, Z_SYNC_FLUSH);
  inflateEnd(&zlib);
  std::copy(unpacked.begin() + kTagBytes, unpacked.end(), start.begin());
  return zlib.avail_out == 0;
}

/// Of the element whose tag was just read. An empty matrix has nothing to be wrong.
bool is_sane_matrix(std::ifstream& stream, std::uint32_t type, std::uint32_t bytes, bool little) {
  if (bytes == 0) return true;
  MatrixStart start{};
  const bool is_read = type == kCompressed ? unpack(stream, bytes, start) : read(stream, start);
  return is_read && has_sane_dimensions(start, little);
}

/// Walks over the variables from the end of the header to `file_bytes`.
std::string fault_of_elements(std::ifstream& stream, std::uintmax_t file_bytes, bool little) {
  std::uintmax_t at = kHeaderBytes;
  while (at < file_bytes) {
    std::array<std::byte, kTagBytes> tag{};
    stream.seekg(static_cast<std::streamoff>(at));
    if (file_bytes - at < kTagBytes || !read(stream, tag)) {
      return fmt::format("is cut off after {} bytes: copy it again", file_bytes);
    }
    const std::uint32_t type = read_number(tag.data(), 4, little);
    const std::uint32_t bytes = read_number(tag.data() + 4, 4, little);
    if (type != kMatrix && type != kCompressed) {
      return fmt::format("is damaged at byte {}: copy it again, or save it anew", at);
    }
    at += kTagBytes;
    if (bytes > file_bytes - at) {
      return fmt::format("is cut off after {} bytes: copy it again", file_bytes);
    }
    if (!is_sane_matrix(stream, type, bytes, little)) {
      return fmt::format("is damaged at byte {}: copy it again, or save it anew", at);
    }
    at += bytes;
  }
  return "";
}

/// Empty if `path` looks like a whole MATLAB file of version 5 to 7.3, else what is wrong with it,
/// to be read after the file's name. libmatio reads on where a file stops. Looks at the header and
/// at how long each variable is, not at what is in it; of version 7.3, which is an HDF5 file, at
/// the header alone, since HDF5 knows how long a file is.
std::string fault_of_mat_file(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return "cannot be found: correct the path";
  const std::uintmax_t bytes = fs::file_size(path, error);
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream) {
    return fmt::format("cannot be read ({}): check its permissions",
                       error ? error.message() : std::generic_category().message(errno));
  }
  std::array<std::byte, kHeaderBytes> header{};
  if (!read(stream, header)) return fmt::format("is cut off after {} bytes: copy it again", bytes);
  const std::uint32_t order = read_number(header.data() + kOrderAt, 2, false);
  const bool little = order == 0x494D;  // "IM"
  const bool big = order == 0x4D49;
  const std::uint32_t version = read_number(header.data() + kVersionAt, 2, little);
  if ((little || big) && version == 0x0200) return "";
  if ((little || big) && version == 0x0100) return fault_of_elements(stream, bytes, little);
  return "is not of MATLAB's format 5 to 7.3: save it anew, in MATLAB with the option -v7";
}

constexpr std::size_t kMaxDenseBytes = std::size_t{1} << 30U;

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using MatFile = std::unique_ptr<mat_t, CloseFile>;
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

[[noreturn]] void fail_file(const std::string& path, const std::string& what) {
  throw Error(ErrorKind::input, fmt::format("MATLAB file '{}' {}.", path, what));
}

[[noreturn]] void fail_damaged(const std::string& path, const std::string& name) {
  fail_file(path, fmt::format("has a damaged variable '{}': copy or save it again", name));
}

/// What libmatio says of a file it would also say on stderr, which is the program's.
bool complained = false;
void note_complaint(int /*level*/, char* /*message*/) { complained = true; }

std::string name_of(const matvar_t& variable) {
  return variable.name == nullptr ? "" : variable.name;
}

/// Name and size.
std::string describe(const matvar_t& variable) {
  if (variable.dims == nullptr || variable.rank < 1) return name_of(variable);
  const std::span dims(variable.dims, static_cast<std::size_t>(variable.rank));
  return fmt::format("{} ({})", name_of(variable), fmt::join(dims, " x "));
}

/// Of a class that can be a matrix of ground truth.
bool is_numeric(const matvar_t& variable) {
  const bool is_number = variable.class_type >= MAT_C_DOUBLE && variable.class_type <= MAT_C_UINT64;
  return is_number || variable.class_type == MAT_C_SPARSE;
}

bool is_square(const matvar_t& variable) {
  return variable.rank == 2 && variable.dims != nullptr && variable.dims[0] == variable.dims[1] &&
         variable.dims[0] > 1;
}

bool is_candidate(const matvar_t& variable) { return is_numeric(variable) && is_square(variable); }

MatFile open(const std::string& path) {
  MatFile file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) fail_file(path, "cannot be read: copy it again, or save it again with the option -v7");
  return file;
}

/// Finds a variable without its data.
Variable find(mat_t* file, const std::string& path, const std::string& wanted) {
  Variable found;
  std::vector<std::string> all;
  std::vector<std::string> candidates;
  while (Variable next{Mat_VarReadNextInfo(file)}) {
    if (!wanted.empty() && name_of(*next) == wanted) return next;
    all.push_back(describe(*next));
    if (!wanted.empty() || !is_candidate(*next)) continue;
    candidates.push_back(name_of(*next));
    found = std::move(next);
  }
  if (candidates.size() == 1) return found;
  if (found) {
    fail_file(path, fmt::format("has several square matrices: name the variable, one of {}",
                                fmt::join(candidates, ", ")));
  }
  fail_file(path,
            fmt::format("has no {}, but {}: give a square matrix of numbers",
                        wanted.empty() ? "square matrix" : fmt::format("variable '{}'", wanted),
                        all.empty() ? "nothing" : fmt::format("{}", fmt::join(all, ", "))));
}

TruthMatrix::Shape checked_shape(const matvar_t& variable, const std::string& path) {
  const std::string name = name_of(variable);
  if (!is_numeric(variable) || variable.isComplex != 0 || variable.rank != 2) {
    fail_file(path,
              fmt::format("has a variable '{}' that is not a matrix of real numbers: give another, "
                          "or save a logical or numeric matrix",
                          name));
  }
  if (variable.dims == nullptr) fail_damaged(path, name);
  return {variable.dims[0], variable.dims[1]};
}

/// Row and column, from 0, are for messages.
template <typename Number>
bool is_true(Number entry, std::size_t row, std::size_t column, const std::string& thing) {
  if constexpr (std::floating_point<Number>) {
    if (!std::isfinite(entry)) {
      throw Error(ErrorKind::input,
                  fmt::format("{} has no finite number in row {}, column {} (from 1): set it to 0 "
                              "or 1.",
                              thing, row + 1, column + 1));
    }
  }
  return entry != Number{0};
}

/// Calls visit(number) with a null pointer to the type of number.
template <typename Visit>
bool visit_type(matio_types type, Visit visit) {
  switch (type) {
    case MAT_T_DOUBLE:
      visit(static_cast<const double*>(nullptr));
      return true;
    case MAT_T_SINGLE:
      visit(static_cast<const float*>(nullptr));
      return true;
    case MAT_T_INT8:
      visit(static_cast<const std::int8_t*>(nullptr));
      return true;
    case MAT_T_UINT8:
      visit(static_cast<const std::uint8_t*>(nullptr));
      return true;
    case MAT_T_INT16:
      visit(static_cast<const std::int16_t*>(nullptr));
      return true;
    case MAT_T_UINT16:
      visit(static_cast<const std::uint16_t*>(nullptr));
      return true;
    case MAT_T_INT32:
      visit(static_cast<const std::int32_t*>(nullptr));
      return true;
    case MAT_T_UINT32:
      visit(static_cast<const std::uint32_t*>(nullptr));
      return true;
    case MAT_T_INT64:
      visit(static_cast<const std::int64_t*>(nullptr));
      return true;
    case MAT_T_UINT64:
      visit(static_cast<const std::uint64_t*>(nullptr));
      return true;
    default:
      return false;
  }
}

/// libmatio stores matrices column by column.
void add_dense(const matvar_t& variable, const std::string& thing, const std::string& path,
               TruthMatrix& matrix) {
  const std::size_t side = variable.dims[0];
  const auto add = [&]<typename Number>(const Number* /*type*/) {
    if (variable.nbytes != side * side * sizeof(Number)) fail_damaged(path, name_of(variable));
    const auto* entries = static_cast<const Number*>(variable.data);
    for (std::size_t i = 0; i < side * side; ++i) {
      if (entries[i] == Number{0}) continue;
      if (is_true(entries[i], i % side, i / side, thing)) matrix.add(i % side, i / side);
    }
  };
  if (!visit_type(variable.data_type, add)) fail_damaged(path, name_of(variable));
}

/// Column c has the entries jc[c] to jc[c + 1] - 1, entry i in row ir[i].
bool is_sound(const mat_sparse_t& sparse, std::size_t side) {
  if (sparse.jc == nullptr || sparse.njc != side + 1) return false;
  const std::span ends(sparse.jc, sparse.njc);
  const std::size_t count = ends.back();
  if (!std::ranges::is_sorted(ends) || count > std::min(sparse.nir, sparse.ndata)) return false;
  if (count == 0) return true;
  if (sparse.ir == nullptr || sparse.data == nullptr) return false;
  return std::ranges::all_of(std::span(sparse.ir, count), [&](auto row) { return row < side; });
}

void add_sparse(const matvar_t& variable, const std::string& thing, const std::string& path,
                TruthMatrix& matrix) {
  const std::size_t side = variable.dims[0];
  const auto& sparse = *static_cast<const mat_sparse_t*>(variable.data);
  if (!is_sound(sparse, side)) fail_damaged(path, name_of(variable));
  const auto add = [&]<typename Number>(const Number* /*type*/) {
    const auto* entries = static_cast<const Number*>(sparse.data);
    for (std::size_t column = 0; column < side; ++column) {
      for (std::size_t i = sparse.jc[column]; i < sparse.jc[column + 1]; ++i) {
        if (is_true(entries[i], sparse.ir[i], column, thing)) matrix.add(sparse.ir[i], column);
      }
    }
  };
  if (!visit_type(variable.data_type, add)) fail_damaged(path, name_of(variable));
}

/// Of a dense matrix before its data is read; a sparse one is as large as its file.
void check_bytes(const matvar_t& variable, const std::string& path) {
  if (variable.class_type == MAT_C_SPARSE) return;
  const std::size_t bytes =
      variable.dims[0] * variable.dims[1] * Mat_SizeOfClass(variable.class_type);
  if (bytes <= kMaxDenseBytes) return;
  fail_file(path, fmt::format("has a matrix '{}' of {} bytes, but at most {} are read: save it as "
                              "logical or sparse",
                              name_of(variable), bytes, kMaxDenseBytes));
}

}  // namespace

TruthMatrix read_mat_file(const std::string& path, const std::string& variable, int views) {
  if (const std::string fault = fault_of_mat_file(path); !fault.empty()) fail_file(path, fault);
  static std::mutex libmatio;  // which reports to a function that is everybody's
  const std::scoped_lock lock(libmatio);
  Mat_LogInitFunc("loopbit", note_complaint);
  complained = false;
  const MatFile file = open(path);
  const Variable found = find(file.get(), path, variable);
  const std::string thing = fmt::format("Matrix '{}' of '{}'", name_of(*found), path);
  TruthMatrix matrix(thing, checked_shape(*found, path), views);
  check_bytes(*found, path);
  const bool is_read = Mat_VarReadDataAll(file.get(), found.get()) == 0 && !complained;
  if (matrix.frames() == 0) return matrix;
  if (!is_read || found->data == nullptr) fail_damaged(path, name_of(*found));
  if (found->class_type == MAT_C_SPARSE) {
    add_sparse(*found, thing, path, matrix);
  } else {
    add_dense(*found, thing, path, matrix);
  }
  return matrix;
}

}  // namespace loopbit::truth
