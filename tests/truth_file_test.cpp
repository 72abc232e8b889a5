// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/truth_file.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <numeric>
#include <set>

#include <fmt/format.h>
#include <matio.h>
#include <opencv2/imgcodecs.hpp>
#include <sys/stat.h>

#include "camera_poses.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

using Runs = std::vector<PlaceRun>;

constexpr std::size_t kSide = 13;

/// A square matrix with a few true entries.
struct Entries {
  std::size_t side = kSide;
  std::vector<std::pair<std::size_t, std::size_t>> at = {{9, 1}, {9, 2}, {5, 0}, {9, 4}, {12, 11}};
};

const Runs kExpected = {{5, 0, 0}, {9, 1, 2}, {9, 4, 4}, {12, 11, 11}};

template <typename Number>
std::vector<Number> dense(const Entries& entries, Number value = Number{1}) {
  std::vector<Number> all(entries.side * entries.side);
  for (const auto& [row, column] : entries.at) all[column * entries.side + row] = value;
  return all;
}

template <typename Number>
constexpr std::pair<matio_classes, matio_types> kCodes;
template <>
constexpr std::pair kCodes<double> = {MAT_C_DOUBLE, MAT_T_DOUBLE};
template <>
constexpr std::pair kCodes<float> = {MAT_C_SINGLE, MAT_T_SINGLE};
template <>
constexpr std::pair kCodes<std::int8_t> = {MAT_C_INT8, MAT_T_INT8};
template <>
constexpr std::pair kCodes<std::uint8_t> = {MAT_C_UINT8, MAT_T_UINT8};
template <>
constexpr std::pair kCodes<std::int16_t> = {MAT_C_INT16, MAT_T_INT16};
template <>
constexpr std::pair kCodes<std::uint16_t> = {MAT_C_UINT16, MAT_T_UINT16};
template <>
constexpr std::pair kCodes<std::int32_t> = {MAT_C_INT32, MAT_T_INT32};
template <>
constexpr std::pair kCodes<std::uint32_t> = {MAT_C_UINT32, MAT_T_UINT32};
template <>
constexpr std::pair kCodes<std::int64_t> = {MAT_C_INT64, MAT_T_INT64};
template <>
constexpr std::pair kCodes<std::uint64_t> = {MAT_C_UINT64, MAT_T_UINT64};

/// A MATLAB file in the making.
class MatWriter {
 public:
  explicit MatWriter(const std::string& path, mat_ft version = MAT_FT_MAT5,
                     matio_compression compression = MAT_COMPRESSION_NONE)
      : file_(Mat_CreateVer(path.c_str(), nullptr, version), Mat_Close),
        compression_(compression) {}

  /// False if this libmatio cannot write the version.
  [[nodiscard]] bool is_open() const { return file_ != nullptr; }

  template <typename Number>
  void add(const char* name, const std::vector<std::size_t>& dims, std::vector<Number> numbers,
           int flags = 0) {
    const auto [klass, type] = kCodes<Number>;
    void* data = numbers.data();
    mat_complex_split_t parts{data, data};
    if ((flags & MAT_F_COMPLEX) != 0) data = &parts;
    write(name, klass, type, dims, data, flags);
  }

  template <typename Number>
  void add_square(const char* name, const Entries& entries, int flags = 0) {
    add(name, {entries.side, entries.side}, dense<Number>(entries), flags);
  }

  void add_sparse(const char* name, const Entries& entries, double value = 1, int flags = 0) {
    std::vector<std::uint32_t> rows;
    std::vector<std::uint32_t> ends{0};
    for (std::size_t column = 0; column < entries.side; ++column) {
      for (const auto& at : entries.at) {
        if (at.second == column) rows.push_back(static_cast<std::uint32_t>(at.first));
      }
      ends.push_back(static_cast<std::uint32_t>(rows.size()));
    }
    add_sparse(name, entries.side, rows, ends, value, flags);
  }

  void add_sparse(const char* name, std::size_t side, std::vector<std::uint32_t> rows,
                  std::vector<std::uint32_t> ends, double value, int flags) {
    std::vector<double> values(rows.size(), value);
    std::vector<std::uint8_t> switches(rows.size(), 1);
    const bool logical = (flags & MAT_F_LOGICAL) != 0;
    const auto count = static_cast<std::uint32_t>(rows.size());
    mat_sparse_t sparse{};
    sparse.nzmax = sparse.nir = sparse.ndata = count;
    sparse.ir = rows.data();
    sparse.jc = ends.data();
    sparse.njc = static_cast<std::uint32_t>(ends.size());
    sparse.data = logical ? static_cast<void*>(switches.data()) : values.data();
    write(name, MAT_C_SPARSE, logical ? MAT_T_UINT8 : MAT_T_DOUBLE, {side, side}, &sparse, flags);
  }

  /// Cells, each empty.
  void add_cells(const char* name, std::size_t side) {
    std::vector<matvar_t*> cells(side * side, nullptr);
    write(name, MAT_C_CELL, MAT_T_CELL, {side, side}, cells.data(), 0);
  }

 private:
  void write(const char* name, matio_classes klass, matio_types type, std::vector<std::size_t> dims,
             void* data, int flags) {
    const std::unique_ptr<matvar_t, decltype(&Mat_VarFree)> variable(
        Mat_VarCreate(name, klass, type, static_cast<int>(dims.size()), dims.data(), data,
                      flags | MAT_F_DONT_COPY_DATA),
        Mat_VarFree);
    ASSERT_NE(variable, nullptr);
    ASSERT_EQ(Mat_VarWrite(file_.get(), variable.get(), compression_), 0);
  }

  std::unique_ptr<mat_t, decltype(&Mat_Close)> file_;
  matio_compression compression_;
};

std::string bytes_of(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// So many frames without times.
FramesRead untimed(std::size_t count, int every = 1, bool all = false) {
  return {every, FrameTimes(count), all};
}

class TruthFileTest : public test::ScratchTest {
 protected:
  /// A file with `entries` as a logical matrix.
  [[nodiscard]] std::string mat(const Entries& entries) const {
    MatWriter(path("truth.mat")).add_square<std::uint8_t>("truth", entries, MAT_F_LOGICAL);
    return path("truth.mat");
  }

  static void expect_input_error(const std::string& file,
                                 std::initializer_list<std::string_view> parts,
                                 const TruthOptions& options = {}) {
    test::expect_error(ErrorKind::input, {file}, [&] { read_truth(file, options); });
    test::expect_error(ErrorKind::input, parts, [&] { read_truth(file, options); });
  }

  /// Whether the file is refused, and by an input error.
  static bool is_refused(const std::string& file) {
    try {
      read_truth(file);
      return false;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input) << error.what();
      return true;
    }
  }

  template <typename Number>
  void expect_class_is_read() const {
    const std::string file = path("truth.mat");
    for (const auto compression : {MAT_COMPRESSION_NONE, MAT_COMPRESSION_ZLIB}) {
      MatWriter(file, MAT_FT_MAT5, compression).add_square<Number>("m", {});
      EXPECT_EQ(read_truth(file).same_place, kExpected) << sizeof(Number) << ' ' << compression;
    }
  }
};

TEST_F(TruthFileTest, ReadsMatricesOfAllClasses) {
  expect_class_is_read<double>();
  expect_class_is_read<float>();
  expect_class_is_read<std::int8_t>();
  expect_class_is_read<std::uint8_t>();
  expect_class_is_read<std::int16_t>();
  expect_class_is_read<std::uint16_t>();
  expect_class_is_read<std::int32_t>();
  expect_class_is_read<std::uint32_t>();
  expect_class_is_read<std::int64_t>();
  expect_class_is_read<std::uint64_t>();
  EXPECT_EQ(read_truth(mat({})).same_place, kExpected);
}

TEST_F(TruthFileTest, ReadsSparseMatrices) {
  const std::string file = path("truth.mat");
  for (const auto compression : {MAT_COMPRESSION_NONE, MAT_COMPRESSION_ZLIB}) {
    for (const int flags : {0, static_cast<int>(MAT_F_LOGICAL)}) {
      SCOPED_TRACE(fmt::format("compression {}, flags {}", static_cast<int>(compression), flags));
      MatWriter(file, MAT_FT_MAT5, compression).add_sparse("m", {}, 1, flags);
      EXPECT_EQ(read_truth(file).same_place, kExpected);
    }
  }
  MatWriter(file).add_sparse("m", {90'000, {{89'999, 3}, {89'999, 4}, {70'000, 69'999}}});
  EXPECT_EQ(read_truth(file).same_place, (Runs{{70'000, 69'999, 69'999}, {89'999, 3, 4}}));
}

TEST_F(TruthFileTest, ReadsVersion73) {
  const std::string file = path("truth.mat");
  {
    MatWriter writer(file, MAT_FT_MAT73);
    if (!writer.is_open()) GTEST_SKIP() << "this libmatio knows no HDF5.";
    writer.add_square<double>("other", {});
    writer.add_square<std::uint8_t>("truth", {}, MAT_F_LOGICAL);
    writer.add_sparse("sparse", {});
  }
  TruthOptions options;
  for (const char* name : {"other", "truth", "sparse"}) {
    SCOPED_TRACE(name);
    options.variable = name;
    EXPECT_EQ(read_truth(file, options).same_place, kExpected);
  }
  expect_input_error(file, {"several square matrices", "other", "truth", "sparse"});
}

TEST_F(TruthFileTest, TheLaterFrameIsTheQueryAndTheDiagonalSaysNothing) {
  const Entries entries{kSide, {{1, 9}, {9, 2}, {2, 9}, {7, 7}, {0, 12}}};
  EXPECT_EQ(read_truth(mat(entries)).same_place, (Runs{{9, 1, 2}, {12, 0, 0}}));
}

TEST_F(TruthFileTest, ViewsOfAFrameCountTogether) {
  // Rows 2 k and 2 k + 1 are frame k: frames 4 and 0, 5 and 1, 5 and 2, and 3 and itself.
  const Entries entries{12, {{9, 0}, {8, 1}, {10, 3}, {4, 11}, {7, 6}}};
  TruthOptions options;
  options.views = 2;
  EXPECT_EQ(read_truth(mat(entries), options).same_place, (Runs{{4, 0, 0}, {5, 1, 2}}));
  options.views = 5;
  expect_input_error(path("truth.mat"), {"12 rows", "5 views"}, options);
  options.views = 0;
  test::expect_error(ErrorKind::option, {"views is 0"},
                     [&] { read_truth(path("truth.mat"), options); });
}

TEST_F(TruthFileTest, TakesTheNamedVariableOrTheOnlySquareOne) {
  const std::string file = path("truth.mat");
  {
    MatWriter writer(file);
    writer.add<double>("radius", {1, 1}, {25});
    writer.add<double>("positions", {2, 3}, std::vector<double>(6));
    writer.add_square<std::uint8_t>("truth", {});
  }
  EXPECT_EQ(read_truth(file).same_place, kExpected);
  TruthOptions options;
  options.variable = "positions";
  expect_input_error(file, {"'positions'", "2 rows and 3 columns"}, options);
  options.variable = "gt";
  expect_input_error(file, {"'gt'", "radius (1 x 1)", "positions (2 x 3)", "truth (13 x 13)"},
                     options);
  {
    MatWriter writer(file);
    writer.add_square<std::uint8_t>("one", {});
    writer.add_square<std::uint8_t>("two", {kSide, {{1, 0}}});
  }
  expect_input_error(file, {"several", "one, two"});
  options.variable = "two";
  EXPECT_EQ(read_truth(file, options).same_place, (Runs{{1, 0, 0}}));
}

TEST_F(TruthFileTest, RefusesWhatIsNoMatrixOfRealNumbers) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::string file = path("truth.mat");
  MatWriter(file).add<double>("m", {3, 4}, std::vector<double>(12));
  expect_input_error(file, {"no square matrix", "m (3 x 4)"});
  MatWriter(file).add<double>("m", {3, 3, 3}, std::vector<double>(27));
  expect_input_error(file, {"no square matrix", "m (3 x 3 x 3)"});
  MatWriter(file).add_cells("m", 3);
  expect_input_error(file, {"no square matrix", "m (3 x 3)"});
  TruthOptions options;
  options.variable = "m";
  expect_input_error(file, {"'m'", "not a matrix of real numbers"}, options);
  MatWriter(file).add_square<double>("m", {}, MAT_F_COMPLEX);
  expect_input_error(file, {"'m'", "not a matrix of real numbers"});
  MatWriter(file).add<double>("m", {kSide, kSide}, dense<double>({kSide, {{4, 2}}}, kNan));
  expect_input_error(file, {"'m'", "row 5, column 3"});
  MatWriter(file).add_sparse("m", {kSide, {{4, 2}}}, kNan);
  expect_input_error(file, {"'m'", "row 5, column 3"});
  { const MatWriter empty(file); }
  expect_input_error(file, {"nothing"});
  expect_input_error(write("text.mat", std::string(500, 'x')), {"format 5 to 7.3"});
  expect_input_error(path("missing.mat"), {"cannot be found"});
}

TEST_F(TruthFileTest, RefusesHugeMatricesBeforeReadingThem) {
  const std::string file = path("truth.mat");
  MatWriter(file).add_sparse("m", {100'001, {}});
  expect_input_error(file, {"100001 rows", "at most 100000"});
  // The numbers of rows and columns stand 32 bytes into the first variable, after the header.
  std::string bytes = bytes_of(mat({}));
  for (const std::size_t at : {160U, 164U}) {
    ASSERT_EQ(bytes[at], static_cast<char>(kSide));
    bytes.replace(at, 4, "\x40\x9c\0\0", 4);  // 40000
  }
  expect_input_error(write("truth.mat", bytes), {"1600000000 bytes"});
}

TEST_F(TruthFileTest, SparseIndicesAreNotTrusted) {
  const std::string file = path("truth.mat");
  MatWriter(file).add_sparse("m", 3, {1, 3}, {0, 1, 2, 2}, 1, 0);
  expect_input_error(file, {"damaged", "'m'"});
  MatWriter(file).add_sparse("m", 3, {1, 2}, {0, 1, 9, 2}, 1, 0);
  expect_input_error(file, {"damaged", "'m'"});
  MatWriter(file).add_sparse("m", 3, {1, 2}, {0, 1, 2}, 1, 0);
  expect_input_error(file, {"damaged", "'m'"});
}

TEST_F(TruthFileTest, FilesCutOffAtAnyByteAreRefused) {
  const std::string file = path("truth.mat");
  const std::string cut = path("cut.mat");
  for (const bool sparse : {false, true}) {
    for (const auto compression : {MAT_COMPRESSION_NONE, MAT_COMPRESSION_ZLIB}) {
      {
        MatWriter writer(file, MAT_FT_MAT5, compression);
        sparse ? writer.add_sparse("m", {}) : writer.add_square<std::uint8_t>("m", {});
      }
      const std::string bytes = bytes_of(file);
      for (std::size_t size = 0; size < bytes.size(); ++size) {
        SCOPED_TRACE(size);
        expect_input_error(write("cut.mat", std::string_view(bytes).substr(0, size)), {"MATLAB"});
      }
    }
  }
}

TEST_F(TruthFileTest, CutOffFilesOfVersion73AreRefused) {
  const std::string file = path("truth.mat");
  {
    MatWriter writer(file, MAT_FT_MAT73);
    if (!writer.is_open()) GTEST_SKIP() << "this libmatio knows no HDF5.";
    writer.add_square<std::uint8_t>("m", {});
  }
  const std::string bytes = bytes_of(file);
  testing::internal::CaptureStderr();
  for (std::size_t size = 0; size < bytes.size(); size += 7) {
    SCOPED_TRACE(size);
    expect_input_error(write("cut.mat", std::string_view(bytes).substr(0, size)), {"MATLAB"});
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(TruthFileTest, DamagedFilesAreReadOrRefused) {
#ifdef LOOPBIT_SANITIZED
  constexpr int kEach = 250;  // A thousand take eight seconds.
#else
  constexpr int kEach = 1000;
#endif
  const std::string file = path("truth.mat");
  test::Random random;
  int refused = 0;
  for (const bool sparse : {false, true}) {
    for (const auto compression : {MAT_COMPRESSION_NONE, MAT_COMPRESSION_ZLIB}) {
      {
        MatWriter writer(file, MAT_FT_MAT5, compression);
        sparse ? writer.add_sparse("m", {}) : writer.add_square<double>("m", {});
      }
      const std::string bytes = bytes_of(file);
      for (int i = 0; i < kEach; ++i) {
        std::string damaged = bytes;
        const int last = std::min(static_cast<int>(bytes.size()), 400) - 1;
        damaged[static_cast<std::size_t>(random.between(110, last))] =
            static_cast<char>(random.between(0, 255));
        if (is_refused(write("damaged.mat", damaged))) ++refused;
      }
    }
  }
  EXPECT_GT(refused, kEach);
}

std::string text_of(const Entries& entries, char separator, std::string_view one,
                    std::string_view zero) {
  std::string text;
  for (std::size_t row = 0; row < entries.side; ++row) {
    for (std::size_t column = 0; column < entries.side; ++column) {
      const bool is_true =
          std::ranges::find(entries.at, std::pair(row, column)) != entries.at.end();
      if (column > 0) text += separator;
      text += is_true ? one : zero;
    }
    text += '\n';
  }
  return text;
}

TEST_F(TruthFileTest, ReadsMatricesAsText) {
  for (const std::string& text :
       {text_of({}, ',', "1", "0"), text_of({}, ' ', "1.0000e+00", "0.0000e+00"),
        "# by hand\n" + text_of({}, '\t', "-0.5", "-0")}) {
    EXPECT_EQ(read_truth(write("truth.txt", text)).same_place, kExpected);
  }
  TruthOptions options;
  options.views = 2;
  expect_input_error(path("truth.txt"), {"13 rows", "2 views"}, options);
  const std::string text = text_of({}, ',', "1", "0");
  expect_input_error(write("truth.txt", text.substr(0, text.size() - 2)), {"line 13"});
  expect_input_error(write("truth.txt", text + text), {"line 1", "26 numbers"});
  expect_input_error(write("truth.txt", text_of({}, ',', "nan", "0")), {"line 6", "'nan'"});
  expect_input_error(write("truth.txt", text_of({}, ',', "", "0")), {"line 6", "''"});
}

TEST_F(TruthFileTest, ReadsMasks) {
  cv::Mat1b mask(kSide, kSide, std::uint8_t{0});
  for (const auto& [row, column] : Entries().at) {
    mask(static_cast<int>(row), static_cast<int>(column)) = 1;
  }
  const std::string file = path("mask.png");
  cv::imwrite(file, mask);
  EXPECT_EQ(read_truth(file).same_place, kExpected);
  cv::Mat deep;
  mask.convertTo(deep, CV_16U, 256);  // black in its lower bytes
  cv::imwrite(file, deep);
  EXPECT_EQ(read_truth(file).same_place, kExpected);
  const cv::Mat none = cv::Mat::zeros(mask.size(), CV_8U);
  cv::Mat colour;
  cv::merge(std::array<cv::Mat, 3>{none, none, mask}, colour);
  cv::imwrite(file, colour);
  EXPECT_EQ(read_truth(file).same_place, kExpected);
  cv::imwrite(file, mask.rowRange(0, 5));
  expect_input_error(file, {"5 rows and 13 columns"});
  cv::imwrite(path("mask.jpg"), mask);
  expect_input_error(path("mask.jpg"), {"JPEG", "PNG"});
  expect_input_error(write("mask.png", "no image"), {});
}

TEST_F(TruthFileTest, ReadsRuns) {
  EXPECT_EQ(read_truth(write("truth.csv", "query,first,last\n9,1,2\n")).same_place,
            (Runs{{9, 1, 2}}));
  EXPECT_EQ(read_truth(write("truth.csv", "9,1\n")).same_place, (Runs{{9, 1, 1}}));
  EXPECT_TRUE(read_truth(write("truth.csv", "query,first,last\n")).same_place.empty());
  write_place_runs(path("truth.csv"), "a drive without revisit", {});
  EXPECT_TRUE(read_truth(path("truth.csv")).same_place.empty());
  expect_input_error(write("truth.csv", "9,1,2\n9,x,2\n"), {"line 2"});
}

TEST_F(TruthFileTest, ReadsPoses) {
  const std::string row = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const std::string file = write("poses.txt", row + row + row);
  TruthOptions options;
  options.poses.min_gap_frames = 1;
  const Runs expected{{2, 0, 0}};
  EXPECT_EQ(read_truth(file, options).same_place, expected);
  EXPECT_EQ(read_truth(file, options, untimed(3)).same_place, expected);
  EXPECT_EQ(read_truth(file, options, untimed(2)).same_place, expected) << "the run ended early";
  test::expect_error(ErrorKind::input, {"3 poses", "4 frames"},
                     [&] { read_truth(file, options, untimed(4)); });
}

TEST_F(TruthFileTest, ReadsTrajectories) {
  std::string text;
  for (int i = 0; i < 40; ++i) {
    text += fmt::format("{} {} 0 0 0 0 0 1\n", 100 + 0.1 * i, 7 * (i % 20));
  }
  const std::string file = write("trajectory.txt", text);
  TruthOptions options;
  options.poses.min_gap_frames = 1;
  const FramesRead frames{.times_s = {100.0, 100.2, 101.0, 102.2, 103.01, 200.0}};
  const GroundTruth truth = read_truth(file, options, frames);
  EXPECT_EQ(truth.same_place, (Runs{{3, 1, 1}, {4, 2, 2}}));
  EXPECT_EQ(truth.unknown, (std::vector<int>{5}));
  expect_input_error(file, {"by time", "sequence"}, options);
}

TEST_F(TruthFileTest, ATrajectoryOfFramesWithoutTimesHasARowAFrame) {
  std::string text;
  for (int i = 0; i < 6; ++i) text += fmt::format("{} {} 0 0 0 0 0 1\n", 100 + i, 7 * (i % 3));
  const std::string file = write("trajectory.txt", text);
  TruthOptions options;
  options.poses.min_gap_frames = 1;
  const Runs expected{{3, 0, 0}, {4, 1, 1}, {5, 2, 2}};
  EXPECT_EQ(read_truth(file, options, untimed(6)).same_place, expected);
  for (const std::size_t frames : {3U, 5U, 7U}) {
    const std::string named = fmt::format("{} frames", frames);
    test::expect_error(ErrorKind::input, {file, "6 poses", named.c_str(), "have no times"},
                       [&] { read_truth(file, options, untimed(frames)); });
  }
  options.poses.min_gap_frames = 2;
  EXPECT_EQ(read_truth(file, options, untimed(2, 4)).same_place, expected) << "frames 0 and 4";
}

TEST_F(TruthFileTest, ReadsStatesOfEuroc) {
  std::string text = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], and so on\n";
  for (int i = 0; i < 20; ++i) {
    text += fmt::format("14036366{:02}000000000,{},0,0,0.5,0.5,0.5,0.5,1,2,3,4,5,6,7,8,9\r\n", i,
                        7 * (i % 10));
  }
  const std::string file = write("data.csv", text);
  EXPECT_EQ(truth_kind(file), TruthKind::poses);
  const std::vector<CameraPose> poses = read_poses(file);
  ASSERT_EQ(poses.size(), 20U);
  EXPECT_NEAR(poses[3].timestamp_s.value(), 1403636603.0, 1e-6);
  EXPECT_NEAR(cv::norm(poses[3].position_m - cv::Vec3d(21, 0, 0)), 0, 1e-9);
  EXPECT_NEAR(cv::norm(poses[3].ahead - cv::Vec3d(1, 0, 0)), 0, 1e-9) << "z turns to x";
  TruthOptions options;
  options.poses.min_gap_frames = 1;
  const FramesRead frames{.times_s = {1403636601.01, 1403636602.0, 1403636611.0}};
  EXPECT_EQ(read_truth(file, options, frames).same_place, (Runs{{2, 0, 0}}));
  expect_input_error(write("data.csv", text + "1,2,3\n"), {"line 22", "EuRoC"});
}

TEST_F(TruthFileTest, TruthKeepsTheNumbersOfTheWholeSequence) {
  const GroundTruth listed = read_truth(write("truth.csv", "9,1,2\n"), {}, untimed(4, 3));
  EXPECT_EQ(listed.same_place, (Runs{{9, 1, 2}}));
  EXPECT_EQ(listed.every, 3);

  TruthOptions options;
  options.poses.min_gap_frames = 4;
  const std::string row = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const std::string kitti = write("poses.txt", row + row + row + row + row + row + row);
  EXPECT_EQ(read_truth(kitti, options, untimed(3, 3)).same_place, (Runs{{5, 0, 0}, {6, 0, 1}}));
  test::expect_error(ErrorKind::input, {"7 poses", "10 frames"},
                     [&] { read_truth(kitti, options, untimed(4, 3)); });

  std::string text;
  for (int i = 0; i < 10; ++i) text += fmt::format("{} 0 0 0 0 0 0 1\n", 100 + i);
  const std::string timed = write("trajectory.txt", text);
  const GroundTruth by_time =
      read_truth(timed, options, {.every = 3, .times_s = {100.0, 103.0, 50.0, 109.0}});
  EXPECT_EQ(by_time.same_place, (Runs{{9, 0, 3}})) << "frames more than 4 apart, 0 and 3";
  EXPECT_EQ(by_time.unknown, (std::vector<int>{6}));
  EXPECT_EQ(by_time.every, 3);
  test::expect_error(ErrorKind::option, {"every is 0"},
                     [&] { read_truth(timed, options, {.every = 0}); });
}

TEST_F(TruthFileTest, OfTwoViewsInTurnTheFirstMayBeReadAlone) {
  const std::string file = path("mask.png");
  cv::Mat mask = cv::Mat::zeros(8, 8, CV_8U);
  mask.at<std::uint8_t>(7, 0) = 255;  // frame 3 as seen on the right, frame 0 on the left
  cv::imwrite(file, mask);
  TruthOptions options;
  options.views = 2;
  for (const int every : {1, 2}) {
    const GroundTruth truth = read_truth(file, options, untimed(4, every));
    EXPECT_EQ(truth.same_place, (Runs{{3, 0, 0}}));
    EXPECT_EQ(truth.every, 1);
  }
  for (const std::size_t images : {5U, 8U}) {
    test::expect_error(ErrorKind::input, {file, "4 frames of 2 rows", "read every 2-th"},
                       [&] { read_truth(file, options, untimed(images)); });
  }
  test::expect_error(ErrorKind::input, {file, "4 frames", "has 9 frames"},
                     [&] { read_truth(file, options, untimed(9)); });
  test::expect_error(ErrorKind::option, {"Every 3-th", "2 images"},
                     [&] { read_truth(file, options, untimed(2, 3)); });
  test::expect_error(ErrorKind::input, {file, "8 frames", "has 10 frames"},
                     [&] { read_truth(file, {}, untimed(4, 3)); });
}

TEST_F(TruthFileTest, KindsAreTold) {
  EXPECT_EQ(truth_kind(write("truth.mat", "")), TruthKind::matrix);
  EXPECT_EQ(truth_kind(write("truth.PNG", "")), TruthKind::matrix);
  EXPECT_EQ(truth_kind(write("truth.txt", text_of({}, ' ', "1", "0"))), TruthKind::matrix);
  EXPECT_EQ(truth_kind(write("truth.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n")), TruthKind::poses);
  EXPECT_EQ(truth_kind(write("truth.txt", "1.5 0 0 0 0 0 0 1\n")), TruthKind::poses);
  EXPECT_EQ(truth_kind(write("truth.csv", "query,match\n")), TruthKind::runs);
  EXPECT_EQ(truth_kind(write("truth.csv", "9,1,2\n")), TruthKind::runs);
  const std::string other = write("truth.csv", "1,2,3,4\n");
  test::expect_error(ErrorKind::input, {other, "line 1"}, [&] { truth_kind(other); });
}

TEST_F(TruthFileTest, OtherTextIsRefused) {
  for (const char* text :
       {"1\n", "1,2,3,4\n", "1 2 3 4 5 6 7 8 9 10 11\n", "0 1 0 0 0 0 1 0 0 0 0 1 0\n",
        "no ground truth at all\n", "\x01\x02\n"}) {
    SCOPED_TRACE(text);
    expect_input_error(write("truth.txt", text), {"line 1"});
  }
  expect_input_error(path("missing.txt"), {});
}

TEST_F(TruthFileTest, TruthWithoutAPlaceIsRefused) {
  for (const char* text : {"", "\n", "# no revisit\n", "hello world\n"}) {
    SCOPED_TRACE(text);
    expect_input_error(write("truth.csv", text), {"query,first,last"});
  }
  const cv::Mat black = cv::Mat::zeros(20, 20, CV_8U);
  cv::imwrite(path("mask.png"), black);
  expect_input_error(path("mask.png"), {"no true place", "query,first,last"});
}

TEST_F(TruthFileTest, TruthOfFramesThatTheSequenceDoesNotHaveIsRefused) {
  TruthOptions options;
  options.poses.min_gap_frames = 1;
  const std::string row = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const std::string poses = write("poses.txt", row + row + row + row);
  const std::string list = write("truth.csv", "3,0,1\n");
  const auto expect_too_many = [&](const std::string& file, std::size_t frames, int every,
                                   std::initializer_list<std::string_view> parts) {
    (void)read_truth(file, options, untimed(frames, every));  // the run ended early
    const auto read = [&] { read_truth(file, options, untimed(frames, every, true)); };
    test::expect_error(ErrorKind::input, {file, "this sequence"}, read);
    test::expect_error(ErrorKind::input, parts, read);
  };
  expect_too_many(poses, 3, 1, {"4 poses", "3 frames"});
  expect_too_many(list, 3, 1, {"frame 3", "3 frames"});
  expect_too_many(mat({}), 4, 1, {"13 frames", "4 frames"});
  test::expect_error(ErrorKind::input, {poses, "4 poses", "3 frames"},
                     [&] { check_poses(poses, untimed(3, 1, true)); });
  EXPECT_EQ(read_positions(poses, untimed(3, 1, true)).size(), 3U);
  expect_too_many(poses, 1, 2, {"4 poses", "2 frames"});
  EXPECT_EQ(read_truth(poses, options, untimed(2, 2, true)).frames, 4);
  EXPECT_EQ(read_truth(list, options, untimed(2, 2, true)).same_place.size(), 1U);
  EXPECT_EQ(read_truth(poses, options, untimed(2, 3, true)).frames, 4) << "0 and 3, and up to 5";
  (void)read_truth(list, options, untimed(0, 3, true));  // frames that are not known
}

TEST_F(TruthFileTest, ErrorsAboutPosesNameTheirFile) {
  const std::string timed = write("trajectory.txt", "100 0 0 0 0 0 0 1\n");
  test::expect_error(ErrorKind::input, {timed, "no frame is within"},
                     [&] { read_truth(timed, {}, {.times_s = {0.5}}); });
  test::expect_error(ErrorKind::input, {timed, "no frame is within"},
                     [&] { (void)read_positions(timed, {.times_s = {0.5}}); });
  const std::string far = write("poses.txt", "1 0 0 2e9 0 1 0 0 0 0 1 0\n");
  test::expect_error(ErrorKind::input, {far, "frame 0"}, [&] { read_truth(far); });
}

TEST_F(TruthFileTest, OnlyRegularFilesOfTextAreRead) {
  const std::string pipe = path("pipe.csv");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  test::expect_error(ErrorKind::input, {pipe, "pipe or a device"}, [&] { truth_kind(pipe); });
  test::expect_error(ErrorKind::input, {pipe, "pipe or a device"}, [&] { read_place_runs(pipe); });
  test::expect_error(ErrorKind::input, {"/dev/zero", "pipe or a device"},
                     [] { truth_kind("/dev/zero"); });
  test::expect_error(ErrorKind::input, {path(""), "is a folder"}, [&] { truth_kind(path("")); });
  for (const std::string_view text :
       {std::string_view("9,1,2\n9,\0,2\n", 12), std::string_view("# \0\n9,1,2\n", 10)}) {
    const std::string line = text.front() == '#' ? "line 1" : "line 2";
    expect_input_error(write("truth.csv", text), {"NUL", line, "UTF-8"});
  }
}

TEST_F(TruthFileTest, TooFewRowsForTheSequenceAreNoticed) {
  const std::string file = mat({});
  EXPECT_EQ(read_truth(file, {}, untimed(kSide)).same_place, kExpected);
  EXPECT_EQ(read_truth(file, {}, untimed(4)).same_place, kExpected);
  test::expect_error(ErrorKind::input, {file, "13 frames", "14"},
                     [&] { read_truth(file, {}, untimed(kSide + 1)); });
}

struct RealMatrix {
  const char* file;
  int views;
  std::size_t queries;
  int entries;
};

TEST(RealTruthFile, MatricesAreReadWhole) {
  for (const auto& [name, views, queries, entries] : {
           RealMatrix{"NewCollegeGroundTruth.mat", 1, 853, 14832},
           {"NewCollegeGroundTruth.mat", 2, 438, 4421},
           {"city_centre_htmap.mat", 1, 561, 6965},
           {"groundTruthCityCentre.mat", 1, 547, 8252},
           {"groundTruthKITTI05.mat", 1, 479, 12348},
           {"kitti05GroundTruth.mat", 1, 459, 8121},
           {"newcollege_GT.mat", 1, 1333, 46753},
       }) {
    SCOPED_TRACE(name);
    const std::string file = fmt::format("truth/mat/{}", name);
    LOOPBIT_NEEDS_DATA(file);
    TruthOptions options;
    options.views = views;
    const Runs runs = read_truth((test::data_dir().value() / file).string(), options).same_place;
    std::set<int> found;
    int places = 0;
    for (const PlaceRun& run : runs) {
      found.insert(run.query);
      places += run.last - run.first + 1;
      EXPECT_LT(run.last, run.query);
    }
    EXPECT_EQ(found.size(), queries);
    EXPECT_EQ(places, entries);
  }
}

}  // namespace
}  // namespace loopbit
