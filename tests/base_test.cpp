// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <cstddef>
#include <string>
#include <string_view>

#include <sys/stat.h>

#include "loopbit/printable.hpp"
#include "loopbit/read_file.hpp"

#include "test_support.hpp"

namespace loopbit {
namespace {

using namespace std::string_literals;
using namespace std::string_view_literals;

TEST(Printable, ControlCharactersAreWrittenOut) {
  EXPECT_EQ(printable("a\x1B[31mb\rc\td\x7F"), R"(a\x1b[31mb\x0dc\x09d\x7f)");
  EXPECT_EQ(printable("two\nlines"), R"(two\x0alines)");
  EXPECT_EQ(printable("a\0b"sv), R"(a\x00b)");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m"),
            R"(\xc2\x9b31m)")
      << "C1 in UTF-8";
  EXPECT_EQ(printable("\x9B"
                      "31m\xC2"),
            "\\x9b31m\xC2")
      << "C1 as a byte";
}

TEST(Printable, TextStaysAsItIs) {
  for (const std::string_view text : {"Stra\xC3\x9F"
                                      "e \xE2\x82\xAC \xF0\x9F\x9A\x97",
                                      "Gr\xFC\xDF", "\xC2\xA0", ""}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, JsonKeepsItsMeaning) {
  EXPECT_EQ(printable_json("{\n  \"a\\u001b\": \"\x7F\xC2\x9B\xC3\x9F\"\n}"),
            "{\n  \"a\\u001b\": \"\\u007f\\u009b\xC3\x9F\"\n}");
}

TEST(Printable, OneThingHasNoPlural) {
  EXPECT_EQ(counted(0, "frame"), "0 frames");
  EXPECT_EQ(counted(1, "wrong loop"), "1 wrong loop");
  EXPECT_EQ(counted(std::size_t{2}, "frame"), "2 frames");
}

class ReadFile : public test::ScratchTest {};

TEST_F(ReadFile, GivesAllBytes) {
  const std::string bytes = std::string(3'000'000, 'x') + "\r\n\0"s;
  EXPECT_EQ(read_file(write("file", bytes)), bytes);
  EXPECT_EQ(read_file(write("file", "")), "");
  EXPECT_EQ(read_text(write("file", "text\n")), "text\n");
}

TEST_F(ReadFile, RefusesWhatIsLongerThanTheLimit) {
  const std::string file = write("file", "12345");
  EXPECT_EQ(read_file(file, 5), "12345");
  test::expect_error(ErrorKind::input, {file, "more than 4 bytes"}, [&] { read_file(file, 4); });
}

TEST_F(ReadFile, RefusesWhatIsNoRegularFile) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  for (const std::string& name : {path("pipe"), "/dev/zero"s, "/dev/null"s}) {
    test::expect_error(ErrorKind::input, {name, "pipe or a device"}, [&] { read_file(name); });
  }
  test::expect_error(ErrorKind::input, {path(""), "folder"}, [&] { read_file(path("")); });
  test::expect_error(ErrorKind::input, {path("no"), "does not exist"},
                     [&] { read_file(path("no")); });
}

TEST_F(ReadFile, TextHasNoNulByte) {
  const std::string file = write("file", "one\ntw\0o\n"sv);
  test::expect_error(ErrorKind::input, {file, "NUL", "line 2"}, [&] { read_text(file); });
}

}  // namespace
}  // namespace loopbit
