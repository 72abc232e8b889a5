// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/folder_watch.hpp"
#include "loopbit/image_source.hpp"

#include "test_support.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<unsigned char>;

cv::Mat noise(int type, cv::Size size = {40, 24}) {
  cv::Mat image(size, type);
  cv::RNG rng(7);
  rng.fill(image, cv::RNG::UNIFORM, 0, image.depth() == CV_16U ? 65536 : 256);
  return image;
}

bool same_pixels(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

Bytes encode(const std::string& extension, const cv::Mat& image,
             const std::vector<int>& options = {}) {
  Bytes bytes;
  cv::imencode(extension, image, bytes, options);
  return bytes;
}

/// `jpeg` with an APP1 segment that holds `payload` put in after its start marker.
Bytes with_app1(Bytes jpeg, const Bytes& payload) {
  const std::size_t length = payload.size() + 2;
  Bytes segment = {0xFF, 0xE1, static_cast<unsigned char>(length >> 8U),
                   static_cast<unsigned char>(length & 0xFFU)};
  segment.insert(segment.end(), payload.begin(), payload.end());
  jpeg.insert(jpeg.begin() + 2, segment.begin(), segment.end());
  return jpeg;
}

std::vector<Frame> read_all(ImageSource& source) {
  std::vector<Frame> frames;
  Frame frame;
  while (source.next(frame)) frames.push_back(frame);
  EXPECT_FALSE(source.next(frame)) << "the end stays the end";
  EXPECT_FALSE(source.skip());
  return frames;
}

std::vector<Frame> read_all(const std::string& input) { return read_all(*open_source(input)); }

std::vector<std::string> names(const std::vector<Frame>& frames) {
  std::vector<std::string> result;
  result.reserve(frames.size());
  for (const Frame& frame : frames) result.push_back(frame.name);
  return result;
}

void expect_all_readable(const std::vector<Frame>& frames) {
  for (const Frame& frame : frames) {
    EXPECT_EQ(frame.error, "") << frame.name;
    EXPECT_FALSE(frame.image.empty()) << frame.name;
  }
}

void expect_open_error(const std::string& input, ErrorKind kind,
                       std::initializer_list<std::string_view> parts) {
  test::expect_error(kind, parts, [&] { (void)open_source(input); });
}

class Images : public test::ScratchTest {
 protected:
  using ScratchTest::write;
  void write(const std::string& name, const Bytes& bytes) const {
    write(name, std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }

  void write_images(const std::vector<std::string>& image_names) const {
    const Bytes png = encode(".png", noise(CV_8UC1));
    for (const std::string& name : image_names) write(name, png);
  }

  [[nodiscard]] Frame read_bytes(const std::string& name, const Bytes& bytes) const {
    write(name, bytes);
    return read_one(name);
  }

  void expect_frame_error(const Frame& frame, const std::string& part) const {
    EXPECT_TRUE(frame.image.empty());
    EXPECT_NE(frame.error.find(path(frame.name)), std::string::npos) << frame.error;
    EXPECT_NE(frame.error.find(part), std::string::npos) << frame.error;
  }

  [[nodiscard]] Frame read_one(const std::string& name) const {
    Frame frame;
    EXPECT_TRUE(open_source(path(name))->next(frame));
    return frame;
  }

  /// Cuts the file to each length below `longest` and down to `shortest`.
  void expect_cuts_seen(const std::string& name, std::size_t shortest, std::size_t longest) const {
    for (std::size_t length = longest; length-- > shortest;) {
      fs::resize_file(path(name), length);
      const Frame frame = read_one(name);
      ASSERT_TRUE(frame.image.empty()) << "cut at " << length;
      ASSERT_NE(frame.error.find(path(name)), std::string::npos) << "cut at " << length;
    }
  }

  /// `bytes` is readable, and none of its beginnings is. No decoder complains on stderr where at
  /// least the `signature_bytes` that tell the format are left.
  void expect_every_cut_seen(const std::string& name, const Bytes& bytes,
                             std::size_t signature_bytes) const {
    EXPECT_EQ(read_bytes(name, bytes).error, "");
    testing::internal::CaptureStderr();
    expect_cuts_seen(name, signature_bytes, bytes.size());
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    expect_cuts_seen(name, 0, signature_bytes);
  }

  void write_video(const std::string& name, std::size_t frames) const {
    ASSERT_TRUE(write_video(name, frames, "MJPG", cv::CAP_ANY))
        << "this OpenCV writes no MJPG video";
  }

  /// False where this OpenCV does not write such a video.
  [[nodiscard]] bool write_video(const std::string& name, std::size_t frames,
                                 const std::string& codec, int backend) const {
    const cv::Size size(64, 48);
    cv::VideoWriter writer(path(name), backend,
                           cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), 10.0,
                           size);
    for (std::size_t i = 0; writer.isOpened() && i < frames; ++i) {
      writer.write(cv::Mat(size, CV_8UC3, cv::Scalar::all(20.0 * static_cast<double>(i))));
    }
    return writer.isOpened();
  }
};

// Folders of images

TEST_F(Images, FolderIsReadInNaturalOrder) {
  const std::vector<std::string> ordered = {
      "0001.png", "001.png",   "01.png",
      "1.png",    "2.png",     "10.png",
      "10_2.png", "10_11.png", "123456789012345678901234567890.png",
      "B.PNG",    "a2b9.png",  "a2b10.png"};
  std::vector<std::string> written = ordered;
  std::ranges::reverse(written);
  write_images(written);
  const auto source = open_source(path());
  EXPECT_EQ(source->size(), ordered.size());
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(names(frames), ordered);
  expect_all_readable(frames);
  EXPECT_FALSE(frames.front().timestamp_s.has_value());
}

TEST_F(Images, FolderTakesEveryImageExtensionAndNothingElse) {
  const std::vector<std::string> images = {"a.png", "b.jpg", "c.JPEG", "d.bmp",  "e.pgm",
                                           "f.ppm", "g.pnm", "h.tif",  "i.Tiff", "j.webp"};
  write_images(images);
  write_images({".hidden.png", "images/z.png", "folder.png/z.png"});
  write("notes.txt", "no image");
  write("png", "no extension");
  EXPECT_EQ(names(read_all(path())), images);
}

TEST_F(Images, FolderWithoutImagesIsAnError) {
  write("notes.txt", "no image");
  expect_open_error(path(), ErrorKind::input, {path(), "holds no image", ".png", "give"});
}

TEST_F(Images, ImagesFolderBelowIsNamedNotSearched) {
  write_images({"sequence/images/0.png"});
  expect_open_error(path("sequence"), ErrorKind::input, {path("sequence/images"), "instead"});
  EXPECT_EQ(read_all(path("sequence/images")).size(), 1U);
}

TEST_F(Images, SkipPassesOverOneImage) {
  write_images({"0.png", "1.png", "2.png"});
  const auto source = open_source(path());
  Frame frame;
  EXPECT_TRUE(source->skip());
  EXPECT_TRUE(source->next(frame));
  EXPECT_EQ(frame.name, "1.png");
  EXPECT_TRUE(source->skip());
  EXPECT_FALSE(source->skip());
  EXPECT_FALSE(source->next(frame));
}

// Data sets

TEST_F(Images, KittiPrefersTheGreyCamera) {
  write_images({"image_0/000000.png", "image_0/000001.png", "image_2/000000.png"});
  write("times.txt", "0.000000e+00\n1.037302e-01\n2.0e-01\n");
  const auto source = open_source(path());
  EXPECT_EQ(source->description(), "KITTI odometry sequence, image_0");
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(names(frames), (std::vector<std::string>{"000000.png", "000001.png"}));
  expect_all_readable(frames);
  EXPECT_DOUBLE_EQ(frames[0].timestamp_s.value(), 0.0);
  EXPECT_DOUBLE_EQ(frames[1].timestamp_s.value(), 0.1037302);
}

TEST_F(Images, KittiNeedsNoTimes) {
  write_images({"image_2/000000.png"});
  const auto source = open_source(path());
  EXPECT_EQ(source->description(), "KITTI odometry sequence, image_2");
  EXPECT_FALSE(read_all(*source).at(0).timestamp_s.has_value());
}

TEST_F(Images, KittiTimesMustCoverTheImages) {
  write_images({"image_0/0.png", "image_0/1.png"});
  write("times.txt", "0.0\n");
  expect_open_error(path(), ErrorKind::input, {path("times.txt"), "1 times", "2 images"});
  write("times.txt", "0.0\n\n0.1 0.2\n");
  expect_open_error(path(), ErrorKind::input, {path("times.txt"), "line 3", "'0.1 0.2'"});
  write("times.txt", "0.0\nnan\n");
  expect_open_error(path(), ErrorKind::input, {path("times.txt"), "line 2", "'nan'"});
}

TEST_F(Images, KittiTimesAreThoseOfTheNumbersWhereImagesAreMissing) {
  write_images({"image_0/000000.png", "image_0/000002.png", "image_0/000003.png"});
  write("times.txt", "0.0\n0.1\n0.2\n0.3\n0.4\n");
  const std::vector<Frame> frames = read_all(path());
  EXPECT_DOUBLE_EQ(frames.at(0).timestamp_s.value(), 0.0);
  EXPECT_DOUBLE_EQ(frames.at(1).timestamp_s.value(), 0.2);
  EXPECT_DOUBLE_EQ(frames.at(2).timestamp_s.value(), 0.3);
  write_images({"image_0/000005.png"});
  expect_open_error(path(), ErrorKind::input, {path("times.txt"), "5 times", "000005.png"});
}

TEST_F(Images, EurocSaysWhichCameraItIs) {
  write_images({"mav0/cam1/data/a.png"});
  write("mav0/cam1/data.csv", "#timestamp [ns],filename\n1403636579763555584,a.png\n");
  for (const std::string folder : {"mav0/cam1", "mav0/cam1/", "mav0/cam1/."}) {
    EXPECT_EQ(open_source(path(folder))->description(), "EuRoC sequence, cam1") << folder;
  }
}

TEST_F(Images, EurocIsFoundFromAnyOfItsFolders) {
  write_images({"mav0/cam0/data/a.png", "mav0/cam0/data/b.png"});
  write("mav0/cam0/data.csv",
        "#timestamp [ns],filename\r\n1403636579763555584,b.png\r\n1403636579813555456, a.png\r\n");
  for (const std::string folder : {"", "mav0", "mav0/cam0"}) {
    const auto source = open_source(path(folder));
    EXPECT_EQ(source->description(), "EuRoC sequence, cam0") << folder;
    const std::vector<Frame> frames = read_all(*source);
    EXPECT_EQ(names(frames), (std::vector<std::string>{"b.png", "a.png"})) << folder;
    expect_all_readable(frames);
    EXPECT_NEAR(frames[0].timestamp_s.value(), 1403636579.763555584, 1e-6);
    EXPECT_NEAR(frames[1].timestamp_s.value(), 1403636579.813555456, 1e-6);
  }
}

TEST_F(Images, EurocNamesTheMalformedRow) {
  fs::create_directories(path("mav0/cam0/data"));
  const std::string file = path("mav0/cam0/data.csv");
  for (const std::string row : {"12.5,a.png", "12", "12,", ",a.png", "x,a.png", "12,a.png,3",
                                "99999999999999999999,a.png"}) {
    write("mav0/cam0/data.csv", "#timestamp [ns],filename\n11,a.png\n" + row + "\n");
    expect_open_error(path(), ErrorKind::input,
                      {file, "line 3", "'" + row + "'", "timestamp_ns,filename", "correct"});
  }
  write("mav0/cam0/data.csv", "#timestamp [ns],filename\n");
  expect_open_error(path(), ErrorKind::input, {file, "lists no image"});
}

TEST_F(Images, FolderWithSomeDataCsvIsNoEuroc) {
  write_images({"0.png"});
  write("data.csv", "what,ever\n");
  EXPECT_EQ(names(read_all(path())), (std::vector<std::string>{"0.png"}));
}

TEST_F(Images, TumReadsTimesAndPaths) {
  write_images({"rgb/1305031102.175304.png", "rgb/two words.png"});
  write("rgb.txt",
        "# color images\n# timestamp filename\n1305031102.175304 rgb/1305031102.175304.png\n"
        "1305031102.211214\trgb/two words.png\n");
  const auto source = open_source(path());
  EXPECT_EQ(source->description(), "TUM RGB-D sequence, rgb.txt");
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(names(frames),
            (std::vector<std::string>{"rgb/1305031102.175304.png", "rgb/two words.png"}));
  expect_all_readable(frames);
  EXPECT_DOUBLE_EQ(frames[0].timestamp_s.value(), 1305031102.175304);
  EXPECT_DOUBLE_EQ(frames[1].timestamp_s.value(), 1305031102.211214);
}

TEST_F(Images, TumNamesTheMalformedRow) {
  for (const std::string row : {"rgb/1.png", "1.5", "inf rgb/1.png"}) {
    write("rgb.txt", "# color images\n" + row + "\n");
    expect_open_error(path(), ErrorKind::input, {path("rgb.txt"), "line 2", "'" + row + "'"});
  }
}

// Image lists

TEST_F(Images, ListIsRelativeToItsFile) {
  write_images({"lists/here.png", "there/with space.png", "there/a,b.png"});
  const std::string absolute = path("there/with space.png");
  write("lists/list.txt",
        "\xEF\xBB\xBF# comment\r\n\r\n  here.png \r\n../there/with space.png\r\n" + absolute +
            "\n../there/a,b.png");
  const auto source = open_source(path("lists/list.txt"));
  EXPECT_EQ(source->size(), 4U);
  EXPECT_EQ(source->description(), "image list list.txt");
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(names(frames), (std::vector<std::string>{"here.png", "../there/with space.png",
                                                     absolute, "../there/a,b.png"}));
  expect_all_readable(frames);
}

TEST_F(Images, ListFindsTheFolderOfItsImagesThoughSomeAreMissing) {
  write_images({"images/b.png", "images/c.png"});
  write("list.txt", "a.png\nb.png\nc.png\n");
  const std::vector<Frame> frames = read_all(*open_source(path("list.txt")));
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_NE(frames[0].error, "");
  expect_all_readable({frames[1], frames[2]});
}

TEST_F(Images, ListOfNamesThatNulBytesEndIsReadWhole) {
  const std::vector<std::string> images{"a.png", "./b b.png", "#c.png", " d\n.png"};
  write_images({"a.png", "b b.png", "#c.png", " d\n.png"});
  std::string list;
  for (const std::string& name : images) list += name + '\0';  // as find -print0 writes it
  write("list.txt", list);
  const std::vector<Frame> frames = read_all(*open_source(path("list.txt")));
  EXPECT_EQ(names(frames), images);
  expect_all_readable(frames);
  write("list.txt", std::string("a.png\0b.doc\0", 12));
  expect_open_error(path("list.txt"), ErrorKind::input, {path("list.txt"), "line 2", "'b.doc'"});
}

TEST_F(Images, ListNamesTheMalformedRow) {
  write("list.csv", "# name\na.png\n17,a.png\n");
  expect_open_error(path("list.csv"), ErrorKind::input,
                    {path("list.csv"), "line 3", "'17,a.png'", "one image name"});
  write("list.TXT", "a.png\nb.doc\n");
  expect_open_error(path("list.TXT"), ErrorKind::input, {path("list.TXT"), "line 2", "'b.doc'"});
  write("empty.txt", "# nothing\n\n");
  expect_open_error(path("empty.txt"), ErrorKind::input, {path("empty.txt"), "lists no image"});
}

TEST_F(Images, LongOrBinaryRowsAreCutInMessages) {
  write("list.txt", std::string(79, 'a') + "\xC3\xA4\xC3\xA4\n");
  expect_open_error(path("list.txt"), ErrorKind::input, {"'" + std::string(79, 'a') + "...'"});
  write("list.txt", std::string(80, 'a') + "b\n");
  expect_open_error(path("list.txt"), ErrorKind::input, {"'" + std::string(80, 'a') + "...'"});
  write("list.txt", "a\x1B[31m\x7F\n");
  expect_open_error(path("list.txt"), ErrorKind::input, {"'a\\x1b[31m\\x7f'"});
}

TEST_F(Images, DamagedFramesDoNotEndTheSequence) {
  write_images({"good.png", "folder.png/z.png"});
  write("empty.jpg", "");
  write("text.png", "this is no image");
  write("list.txt", "missing.png\nempty.jpg\ntext.png\nfolder.png\ngood.png\n");
  const std::vector<Frame> frames = read_all(path("list.txt"));
  ASSERT_EQ(frames.size(), 5U);
  expect_frame_error(frames[0], "cannot be found");
  expect_frame_error(frames[1], "is empty (0 bytes)");
  expect_frame_error(frames[2], "not an image");
  expect_frame_error(frames[3], "is a folder");
  EXPECT_EQ(frames[4].error, "");
  EXPECT_TRUE(same_pixels(frames[4].image, noise(CV_8UC1)));
}

// Image files

TEST_F(Images, DepthAndChannelsStayAsStored) {
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3}) {
    const Frame frame = read_bytes("image.png", encode(".png", noise(type)));
    EXPECT_EQ(frame.error, "");
    EXPECT_TRUE(same_pixels(frame.image, noise(type))) << cv::typeToString(type);
  }
  EXPECT_EQ(read_bytes("grey.jpg", encode(".jpg", noise(CV_8UC1))).image.type(), CV_8UC1);
  EXPECT_EQ(read_bytes("colour.jpg", encode(".jpg", noise(CV_8UC3))).image.type(), CV_8UC3);
}

TEST_F(Images, OtherPixelFormatsAreNamed) {
  const Frame frame = read_bytes("x.tif", encode(".tif", cv::Mat(4, 4, CV_32FC1, 0.5F)));
  expect_frame_error(frame, "CV_32FC1");
}

TEST_F(Images, ExifOrientationIsIgnored) {
  const Bytes rotated = {'E',  'x', 'i', 'f', 0, 0, 'I', 'I', '*', 0, 8, 0, 0, 0, 1, 0,
                         0x12, 1,   3,   0,   1, 0, 0,   0,   6,   0, 0, 0, 0, 0, 0, 0};
  const Bytes jpeg = with_app1(encode(".jpg", noise(CV_8UC1)), rotated);
  ASSERT_EQ(cv::imdecode(jpeg, cv::IMREAD_COLOR).size(), cv::Size(24, 40)) << "OpenCV reads it";
  EXPECT_EQ(read_bytes("x.jpg", jpeg).image.size(), cv::Size(40, 24));
}

TEST_F(Images, EveryCutOfABaselineJpegIsSeen) {
  expect_every_cut_seen("x.jpg", encode(".jpg", noise(CV_8UC3)), 2);
}

TEST_F(Images, EveryCutOfAProgressiveJpegIsSeen) {
  const Bytes jpeg = encode(".jpg", noise(CV_8UC3), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  constexpr std::array<unsigned char, 2> kProgressive = {0xFF, 0xC2};
  ASSERT_NE(std::search(jpeg.begin(), jpeg.end(), kProgressive.begin(), kProgressive.end()),
            jpeg.end());
  expect_every_cut_seen("x.jpg", jpeg, 2);
}

TEST_F(Images, EveryCutOfAJpegWithRestartMarkersIsSeen) {
  expect_every_cut_seen("x.jpg", encode(".jpg", noise(CV_8UC1), {cv::IMWRITE_JPEG_RST_INTERVAL, 1}),
                        2);
}

TEST_F(Images, ThumbnailIsNotTakenForTheImage) {
  const Bytes thumbnail = encode(".jpg", noise(CV_8UC1, {8, 8}));
  ASSERT_EQ(thumbnail.back(), 0xD9);
  expect_every_cut_seen("x.jpg", with_app1(encode(".jpg", noise(CV_8UC3)), thumbnail), 2);
}

TEST_F(Images, EveryCutOfAPngIsSeen) {
  expect_every_cut_seen("x.png", encode(".png", noise(CV_8UC3)), 8);
  expect_every_cut_seen("x.png", encode(".png", noise(CV_16UC1)), 8);
}

TEST_F(Images, CutsOfOtherFormatsAreSeen) {
  for (const std::string extension : {".bmp", ".ppm", ".tif", ".webp"}) {
    const Bytes bytes = encode(extension, noise(CV_8UC3));
    for (const std::size_t length : {std::size_t{1}, bytes.size() / 2, bytes.size() - 1}) {
      const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
      expect_frame_error(read_bytes("x" + extension, cut), "damaged");
    }
  }
}

TEST_F(Images, BytesAfterTheEndDoNoHarm) {
  for (const std::string extension : {".jpg", ".png"}) {
    Bytes bytes = encode(extension, noise(CV_8UC1));
    bytes.insert(bytes.end(), 100, 0);
    EXPECT_EQ(read_bytes("x" + extension, bytes).error, "");
  }
}

TEST_F(Images, DamagedPngChunkIsSeen) {
  Bytes png = encode(".png", noise(CV_8UC1));
  png[png.size() / 2] ^= 0x55U;
  expect_frame_error(read_bytes("x.png", png), "damaged");
}

TEST_F(Images, HugeDeclaredSizeIsAFrameError) {
  Bytes jpeg = encode(".jpg", noise(CV_8UC1));
  constexpr std::array<unsigned char, 2> kFrameHeader = {0xFF, 0xC0};
  const auto header =
      std::search(jpeg.begin(), jpeg.end(), kFrameHeader.begin(), kFrameHeader.end());
  ASSERT_NE(header, jpeg.end());
  std::fill_n(header + 5, 4, static_cast<unsigned char>(0xFE));  // height and width
  expect_frame_error(read_bytes("x.jpg", jpeg),
                     "has 65278 x 65278 pixels, but max_megapixels is 100");
}

/// `image` in each format and variant of a header that gives its size.
std::vector<std::pair<std::string, Bytes>> in_all_formats(const cv::Mat& image) {
  std::vector<std::pair<std::string, Bytes>> all;
  for (const std::string extension : {".png", ".jpg", ".bmp", ".ppm", ".tif", ".webp"}) {
    all.emplace_back(extension, encode(extension, image));
  }
  all.emplace_back(".jpg", encode(".jpg", image, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}));
  all.emplace_back(".webp", encode(".webp", image, {cv::IMWRITE_WEBP_QUALITY, 101}));
  cv::Mat alpha;
  cv::cvtColor(image, alpha, cv::COLOR_BGR2BGRA);
  all.emplace_back(".webp", encode(".webp", alpha, {cv::IMWRITE_WEBP_QUALITY, 50}));
  for (const int binary : {0, 1}) {
    for (const std::string extension : {".pbm", ".pgm"}) {
      cv::Mat grey;
      cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
      all.emplace_back(".pnm", encode(extension, grey, {cv::IMWRITE_PXM_BINARY, binary}));
    }
  }
  return all;
}

TEST_F(Images, LargeImagesAreRefusedByTheirHeaders) {
  constexpr int kMegapixels = 1;
  const auto larger = in_all_formats(cv::Mat(501, 2000, CV_8UC3, cv::Scalar::all(90)));
  const auto largest = in_all_formats(cv::Mat(500, 2000, CV_8UC3, cv::Scalar::all(90)));
  for (std::size_t i = 0; i < larger.size(); ++i) {
    const std::string name = std::to_string(i) + larger[i].first;
    write(name, larger[i].second);
    Frame frame;
    ASSERT_TRUE(open_source(path(name), kMegapixels)->next(frame));
    expect_frame_error(frame, "has 2000 x 501 pixels, but max_megapixels is 1:");
    write(name, largest[i].second);
    ASSERT_TRUE(open_source(path(name), kMegapixels)->next(frame));
    EXPECT_EQ(frame.error, "");
    EXPECT_EQ(frame.image.size(), cv::Size(2000, 500)) << name;
  }
}

TEST_F(Images, HeadersOfEveryKindGiveTheSize) {
  const Bytes be = {'M', 'M', 0, '*', 0, 0, 0, 8, 0, 2, 1, 0, 0, 4, 0, 0, 0, 1, 0,
                    1,   0,   0, 1,   1, 0, 3, 0, 0, 0, 1, 8, 0, 0, 0, 0, 0, 0, 0};
  expect_frame_error(read_bytes("x.tif", be), "has 65536 x 2048 pixels");
  Bytes os2 = {'B', 'M', 0, 0, 0, 0, 0, 0, 0, 0, 26, 0, 0, 0, 12, 0, 0, 0, 0xFF, 0xFF, 0, 0x80};
  os2.resize(64);
  expect_frame_error(read_bytes("x.bmp", os2), "has 65535 x 32768 pixels");
  Bytes upright = {'B', 'M', 0, 0, 0, 0, 0, 0, 0, 0, 54, 0, 0,
                   0,   40,  0, 0, 0, 0, 0, 1, 0, 0, 0,  0, 0x80};
  upright.resize(64);
  expect_frame_error(read_bytes("x.bmp", upright), "has 65536 x 2147483648 pixels");
  write("x.pgm", "P5 # 1 1\n#\n99999\t99999 255\n");
  expect_frame_error(read_one("x.pgm"), "has 99999 x 99999 pixels");
  write("x.pgm", "P2 99999999999999999999 7 255\n");
  expect_frame_error(read_one("x.pgm"), "max_megapixels");
}

TEST_F(Images, FormatsWhoseSizeIsUnknownAreNotDecoded) {
  for (const std::string extension : {".jp2", ".ras", ".pam"}) {
    const cv::Size size(128, 96);
    const Bytes bytes = encode(extension, noise(CV_8UC3, size));
    ASSERT_EQ(cv::imdecode(bytes, cv::IMREAD_COLOR).size(), size) << extension;
    expect_frame_error(read_bytes("x.png", bytes), "convert it to PNG or JPEG");
  }
}

TEST_F(Images, NoHeaderIsReadBeyondItsEnd) {
  for (const auto& [extension, bytes] : in_all_formats(noise(CV_8UC3))) {
    for (std::size_t length = 1; length < std::min<std::size_t>(bytes.size(), 100); length += 3) {
      const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
      EXPECT_TRUE(read_bytes("x" + extension, cut).image.empty()) << extension << length;
    }
  }
}

TEST_F(Images, FilesOverTheLimitAreNotRead) {
  write("x.png", "");
  fs::resize_file(path("x.png"), (std::uintmax_t{512} << 20U) + 1);  // sparse: takes no space
  expect_frame_error(read_one("x.png"), "at most 536870912");
}

TEST_F(Images, AWatchForgetsImagesThatAreGone) {
  write("a.png", "1");
  const fs::path file = fs::path(path()) / "a.png";
  const auto written = fs::last_write_time(file);
  FolderWatch watch(path());
  const auto arrived = [&] {
    std::size_t images = watch.arrived().size();
    return images + watch.arrived().size();
  };
  EXPECT_EQ(arrived(), 1U);
  EXPECT_EQ(arrived(), 0U);
  fs::remove(file);
  EXPECT_EQ(arrived(), 0U);
  write("a.png", "1");
  fs::last_write_time(file, written);
  EXPECT_EQ(arrived(), 1U) << "the same again, for all that can be seen";
}

TEST_F(Images, ForbiddenFilesAreNamed) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  write_images({"x.png"});
  write("list.txt", "x.png\n");
  fs::permissions(path("x.png"), fs::perms::none);
  expect_frame_error(read_all(path("list.txt")).at(0), "Permission denied");
  fs::permissions(path("list.txt"), fs::perms::none);
  expect_open_error(path("list.txt"), ErrorKind::input, {path("list.txt"), "Permission denied"});
}

// Other inputs

TEST_F(Images, InputMustExistAndBeReadable) {
  expect_open_error(path("nothing"), ErrorKind::input, {path("nothing"), "does not exist", "give"});
  expect_open_error("", ErrorKind::input, {"does not exist"});
  write("x.dat", "neither an image nor a video");
  expect_open_error(path("x.dat"), ErrorKind::input, {path("x.dat"), "not a video", "convert"});
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  expect_open_error(path("pipe"), ErrorKind::input, {path("pipe"), "neither a file nor a folder"});
}

TEST_F(Images, CameraNumbersAreChecked) {
  for (const std::string input : {"camera:", "camera:x", "camera:-1", "camera:1x", "camera: 1",
                                  "camera:100", "camera:99999999999"}) {
    expect_open_error(input, ErrorKind::option, {input, "0 to 99"});
  }
}

TEST_F(Images, MissingCameraIsAnError) {
#ifdef LOOPBIT_SANITIZED
  GTEST_SKIP() << "OpenCV's search for cameras leaks (libdc1394, libusb)";
#endif
  expect_open_error("camera:99", ErrorKind::input, {"camera:99", "attached"});
}

TEST_F(Images, VideoIsReadWithTimes) {
  constexpr std::size_t kFrames = 12;
  write_video("v.avi", kFrames);
  const auto source = open_source(path("v.avi"));
  EXPECT_EQ(source->size(), kFrames);
  EXPECT_EQ(source->description(), "video v.avi");
  const std::vector<Frame> frames = read_all(*source);
  ASSERT_EQ(frames.size(), kFrames);
  expect_all_readable(frames);
  for (std::size_t i = 0; i < kFrames; ++i) {
    const auto number = static_cast<double>(i);
    EXPECT_EQ(frames[i].name, "frame " + std::to_string(i));
    EXPECT_NEAR(frames[i].timestamp_s.value(), 0.1 * number, 1e-6);
    EXPECT_NEAR(cv::mean(frames[i].image)[0], 20.0 * number, 3.0) << "frames share memory";
  }
}

TEST_F(Images, CutOffVideoEndsEarlyAndSaysSo) {
  constexpr std::size_t kFrames = 200;
  write_video("v.avi", kFrames);
  const auto whole = fs::file_size(path("v.avi"));
  const auto source = open_source(path("v.avi"));
  EXPECT_EQ(read_all(*source).size(), kFrames);
  EXPECT_EQ(source->early_end(), "");
  fs::resize_file(path("v.avi"), whole / 2);
  const auto cut = open_source(path("v.avi"));
  EXPECT_EQ(cut->early_end(), "") << "the end is not reached";
  const std::size_t frames = read_all(*cut).size();
  EXPECT_GT(frames, 0U);
  EXPECT_LT(frames, kFrames);
  for (const std::string& part : {path("v.avi"), std::to_string(whole / 2)}) {
    EXPECT_NE(cut->early_end().find(part), std::string::npos) << cut->early_end();
  }
}

TEST_F(Images, TheEarlyEndIsPassedOnFromTheEnd) {
  write_video("v.avi", 40);
  fs::resize_file(path("v.avi"), fs::file_size(path("v.avi")) / 2);
  const auto ahead = prefetch(subsample(open_source(path("v.avi")), {.every = 3}), 2);
  EXPECT_GT(read_all(*ahead).size(), 2U);
  EXPECT_NE(ahead->early_end(), "");
  const auto limited = prefetch(subsample(open_source(path("v.avi")), {.every = 3, .limit = 2}), 2);
  EXPECT_EQ(read_all(*limited).size(), 2U);
  EXPECT_EQ(limited->early_end(), "") << "what is missing was not asked for";
}

TEST_F(Images, OnlyACutVideoIsCalledCut) {
  struct Case {
    std::string name, codec;
    int backend;
  };
  for (const Case& c : {Case{"v.avi", "MJPG", cv::CAP_FFMPEG},
                        {"o.avi", "MJPG", cv::CAP_OPENCV_MJPEG},
                        {"v.mkv", "MJPG", cv::CAP_FFMPEG},
                        {"v.webm", "VP80", cv::CAP_FFMPEG},
                        {"m.mkv", "mp4v", cv::CAP_FFMPEG},
                        {"v.mp4", "mp4v", cv::CAP_FFMPEG},
                        {"v.mov", "mp4v", cv::CAP_FFMPEG}}) {
    if (!write_video(c.name, 40, c.codec, c.backend)) continue;
    const auto whole = fs::file_size(path(c.name));
    for (const auto size : {whole, whole - 100, whole * 3 / 4, whole / 2}) {
      fs::resize_file(path(c.name), size);
      std::unique_ptr<ImageSource> source;
      try {
        source = open_source(path(c.name));
      } catch (const Error&) {  // an index at the end is missing
        EXPECT_LT(size, whole) << c.name;
        continue;
      }
      EXPECT_GT(read_all(*source).size(), 0U);
      EXPECT_EQ(source->early_end().empty(), size == whole) << c.name << ' ' << size;
    }
  }
}

TEST_F(Images, TheNumberOfImagesIsSureAndThatOfAVideoIsNot) {
  write_images({"images/0.png", "images/1.png", "images/2.png"});
  write_video("v.avi", 4);
  const auto every_second = subsample(open_source(path("images")), {.every = 2});
  EXPECT_EQ(exact_size(*every_second, path("images")), 2U);
  write("list.txt", "images/0.png\nimages/1.png\n");
  EXPECT_EQ(exact_size(*open_source(path("list.txt")), path("list.txt")), 2U);
  const auto video = open_source(path("v.avi"));
  EXPECT_EQ(video->size(), 4U);
  EXPECT_EQ(exact_size(*video, path("v.avi")), std::nullopt);
}

// Every n-th frame

TEST_F(Images, SubsampleTakesEveryNthUpToTheLimit) {
  write_images({"0.png", "1.png", "2.png", "3.png", "4.png", "5.png", "6.png"});
  struct Case {
    int every, limit;
    std::vector<std::string> expected;
  };
  const std::vector<std::string> all = {"0.png", "1.png", "2.png", "3.png",
                                        "4.png", "5.png", "6.png"};
  for (const Case& c :
       {Case{1, 0, all}, Case{1, 2, {"0.png", "1.png"}}, Case{3, 0, {"0.png", "3.png", "6.png"}},
        Case{4, 0, {"0.png", "4.png"}}, Case{3, 2, {"0.png", "3.png"}},
        Case{2, 9, {"0.png", "2.png", "4.png", "6.png"}}, Case{100, 0, {"0.png"}}}) {
    const auto source = subsample(open_source(path()), {c.every, c.limit});
    EXPECT_EQ(source->size(), c.expected.size()) << c.every << ", " << c.limit;
    EXPECT_EQ(names(read_all(*source)), c.expected) << c.every << ", " << c.limit;
  }
}

TEST_F(Images, SubsampleSkipsInItsOwnFrames) {
  write_images({"0.png", "1.png", "2.png", "3.png", "4.png", "5.png", "6.png"});
  const auto source = subsample(open_source(path()), {.every = 2, .limit = 3});
  EXPECT_EQ(source->description(), "folder of images, 1 frame in 2, at most 3 frames");
  Frame frame;
  EXPECT_TRUE(source->skip());
  EXPECT_TRUE(source->next(frame));
  EXPECT_EQ(frame.name, "2.png");
  EXPECT_TRUE(source->skip());
  EXPECT_FALSE(source->next(frame)) << "skipped frames count towards the limit";
}

TEST_F(Images, SubsampleNestsAndReadsVideos) {
  write_video("v.avi", 12);
  const auto source = subsample(subsample(open_source(path("v.avi")), {.every = 2}), {.every = 2});
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(names(frames), (std::vector<std::string>{"frame 0", "frame 4", "frame 8"}));
  EXPECT_NEAR(frames[1].timestamp_s.value(), 0.4, 1e-6);
  EXPECT_NEAR(cv::mean(frames[2].image)[0], 160.0, 3.0);
}

TEST_F(Images, SubsampleByZeroIsAnError) {
  write_images({"0.png"});
  for (const Sampling sampling : {Sampling{.every = 0}, Sampling{.limit = -1}}) {
    test::expect_error(ErrorKind::option, {"every must be at least 1, and limit 0"},
                       [&] { (void)subsample(open_source(path()), sampling); });
  }
}

class UnknownSize final : public ImageSource {
 public:
  bool next(Frame&) override { return true; }
  bool skip() override { return true; }
  [[nodiscard]] std::optional<std::size_t> size() const override { return std::nullopt; }
  [[nodiscard]] std::string description() const override { return "endless"; }
};

TEST_F(Images, SubsampleOfUnknownSizeIsUnknownButEnds) {
  const auto source = subsample(std::make_unique<UnknownSize>(), {.every = 1000, .limit = 3});
  EXPECT_FALSE(source->size().has_value());
  EXPECT_EQ(read_all(*source).size(), 3U);
}

// Real images

/// Folder of real data sets; empty if there is none.
std::string real_data() {
  if (const char* folder = std::getenv("LOOPBIT_DATA")) return folder;
#ifdef LOOPBIT_DEFAULT_DATA
  return LOOPBIT_DEFAULT_DATA;
#else
  return "";
#endif
}

void expect_real_sequence(const std::string& name, std::size_t count, cv::Size size, int type) {
  const std::string folder = real_data() + "/" + name;
  if (!fs::is_directory(folder)) GTEST_SKIP() << "no " << name << ": set LOOPBIT_DATA";
  const auto source = open_source(folder);
  EXPECT_EQ(source->size(), count);
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(frames.size(), count);
  expect_all_readable(frames);
  // All names have the same number of digits: natural order is plain order.
  EXPECT_TRUE(std::ranges::is_sorted(frames, {}, &Frame::name));
  for (const Frame& frame : frames) {
    ASSERT_EQ(frame.image.size(), size) << frame.name;
    ASSERT_EQ(frame.image.type(), type) << frame.name;
  }
}

TEST(RealImages, Kitti03) { expect_real_sequence("kitti03/images", 401, {1242, 375}, CV_8UC1); }

TEST(RealImages, CorridorLoop) {
  expect_real_sequence("corridor_loop/images", 84, {512, 384}, CV_8UC3);
}

}  // namespace
}  // namespace loopbit
