// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/evidence_file.hpp"

#include <bit>
#include <cstring>
#include <span>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "loopbit/database.hpp"
#include "loopbit/picture_jpeg.hpp"

#include "evidence_writer.hpp"

namespace loopbit {
namespace {

using Bytes = std::vector<unsigned char>;

static_assert(std::endian::native == std::endian::little, "the file's numbers are little-endian");
static_assert(sizeof(PointPair) == 4 * sizeof(float));

constexpr int kFormatVersion = 1;

Database open_evidence(const std::string& path, Database::Access access) {
  return {path,
          access,
          {.write = "check the free space and the permissions of its folder, or run without it, by "
                    "--no-report",
           .read = "it is damaged or no file of loopbit's; delete it to go on without it"}};
}

Bytes saliency_png(const cv::Mat1f& saliency) {
  double largest = 0;
  cv::minMaxLoc(saliency, nullptr, &largest);
  cv::Mat1b scaled;
  saliency.convertTo(scaled, CV_8U, largest > 0 ? 255.0 / largest : 0.0);
  Bytes bytes;
  cv::imencode(".png", scaled, bytes);
  return bytes;
}

template <typename T>
std::span<const unsigned char> bytes_of(std::span<const T> values) {
  return {reinterpret_cast<const unsigned char*>(values.data()), values.size_bytes()};
}

BinaryContent content_from(std::span<const unsigned char> bytes) {
  BinaryContent content;
  if (bytes.size() == sizeof content.rows) {
    std::memcpy(content.rows.data(), bytes.data(), bytes.size());
  }
  return content;
}

std::vector<PointPair> inliers_from(std::span<const unsigned char> bytes) {
  std::vector<PointPair> inliers(bytes.size() / sizeof(PointPair));
  if (!inliers.empty()) {
    std::memcpy(inliers.data(), bytes.data(), inliers.size() * sizeof(PointPair));
  }
  return inliers;
}

}  // namespace

class EvidenceWriter::Impl {
 public:
  explicit Impl(const std::string& path)
      : database_(open_evidence(path, Database::Access::create)) {
    database_.execute(fmt::format(
        "PRAGMA journal_mode = WAL; PRAGMA synchronous = OFF; PRAGMA user_version = {}; "
        "CREATE TABLE frame (frame INTEGER PRIMARY KEY, picture BLOB, saliency BLOB, content BLOB, "
        "inliers BLOB)",
        kFormatVersion));
    insert_ =
        std::make_unique<Statement>(database_, "INSERT INTO frame VALUES (?1, ?2, ?3, ?4, ?5)");
  }

  StoredEvidence add(PlaceId frame, const cv::Mat& image, const Evidence& evidence) {
    if (pending_ == 0) database_.execute("BEGIN");
    StoredEvidence stored{.picture_jpeg = picture_jpeg(image),
                          .saliency_png = saliency_png(evidence.saliency),
                          .content = evidence.content,
                          .inliers = evidence.inliers};
    insert_->bind(1, std::int64_t{frame});
    insert_->bind(2, stored.picture_jpeg);
    insert_->bind(3, stored.saliency_png);
    insert_->bind(4, bytes_of(std::span<const std::uint64_t>(stored.content.rows)));
    insert_->bind(5, bytes_of(std::span<const PointPair>(stored.inliers)));
    insert_->run();
    if (++pending_ == kFramesPerTransaction) save();
    return stored;
  }

  /// Readers that may not write need a file without a log beside it. Waits for a live page that
  /// reads a picture.
  void finish() {
    save();
    database_.execute_alone("PRAGMA journal_mode = DELETE");
  }

 private:
  void save() {
    if (pending_ == 0) return;
    pending_ = 0;
    database_.execute("COMMIT");
  }

  Database database_;
  std::unique_ptr<Statement> insert_;
  int pending_ = 0;
};

EvidenceWriter::EvidenceWriter(const std::string& path) : impl_(std::make_unique<Impl>(path)) {}
EvidenceWriter::~EvidenceWriter() {
  try {
    impl_->finish();
  } catch (...) {  // told by finish(), to those who ask
  }
}
StoredEvidence EvidenceWriter::add(PlaceId frame, const cv::Mat& image, const Evidence& evidence) {
  return impl_->add(frame, image, evidence);
}
void EvidenceWriter::finish() { impl_->finish(); }

class EvidenceReader::Impl {
 public:
  explicit Impl(const std::string& path)
      : database_(open_evidence(path, Database::Access::read)),
        row_(database_, "SELECT picture, saliency, content, inliers FROM frame WHERE frame = ?1") {}

  bool read(PlaceId frame, StoredEvidence& evidence) {
    row_.reset();
    row_.bind(1, std::int64_t{frame});
    if (!row_.step()) return false;
    const auto picture = row_.bytes(0);
    evidence.picture_jpeg.assign(picture.begin(), picture.end());
    const auto saliency = row_.bytes(1);
    evidence.saliency_png.assign(saliency.begin(), saliency.end());
    evidence.content = content_from(row_.bytes(2));
    evidence.inliers = inliers_from(row_.bytes(3));
    return true;
  }

  void for_each_content(const std::function<void(PlaceId, const BinaryContent&)>& visit) const {
    Statement rows(database_, "SELECT frame, content FROM frame ORDER BY frame");
    while (rows.step()) visit(static_cast<PlaceId>(rows.integer(0)), content_from(rows.bytes(1)));
  }

 private:
  Database database_;
  Statement row_;
};

EvidenceReader::EvidenceReader(const std::string& path) : impl_(std::make_unique<Impl>(path)) {}
EvidenceReader::~EvidenceReader() = default;
EvidenceReader::EvidenceReader(EvidenceReader&&) noexcept = default;
EvidenceReader& EvidenceReader::operator=(EvidenceReader&&) noexcept = default;

bool EvidenceReader::read(PlaceId frame, StoredEvidence& evidence) const {
  return impl_->read(frame, evidence);
}

void EvidenceReader::for_each_content(
    const std::function<void(PlaceId, const BinaryContent&)>& visit) const {
  impl_->for_each_content(visit);
}

}  // namespace loopbit
