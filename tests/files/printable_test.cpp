// SPDX-License-Identifier: Apache-2.0
// Texts for a terminal: what it would obey is shown, and all else is left alone.
#include <string>

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/files/json.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::files::printable_test {
namespace {

TEST(Printable, TextIsLeftAlone) {
  for (const std::string text :
       {"", "mass 21 kg\n\tand more", "θ̂ ≤ 3 · 10⁻⁹, naïve → 🤖", "back\\slash \"quoted\""}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, CommandsAreShown) {
  EXPECT_EQ(printable("\x1B[2J"), "\\x1B[2J");
  EXPECT_EQ(printable("a\rb\x07\x7F"), "a\\x0Db\\x07\\x7F");
  EXPECT_EQ(printable(std::string("\0", 1)), "\\x00");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m"),
            "\\xC2\\x9B"
            "31m");  // CSI of ISO 6429 in UTF-8
  EXPECT_EQ(printable("\xE2\x80\xAE"
                      "fdp"),
            "\\xE2\\x80\\xAE"
            "fdp");  // right-to-left override
}

// The byte sequences that Unicode 15, section 3.9 calls ill-formed.
TEST(Printable, BytesThatAreNoUtf8AreShown) {
  EXPECT_EQ(printable("\xFF"), "\\xFF");
  EXPECT_EQ(printable("\xC0\xAF"), "\\xC0\\xAF");
  EXPECT_EQ(printable("\xE0\x80\xAF"), "\\xE0\\x80\\xAF");
  EXPECT_EQ(printable("\xED\xA0\x80"), "\\xED\\xA0\\x80");
  EXPECT_EQ(printable("\xF4\x91\x92\x93"), "\\xF4\\x91\\x92\\x93");
  EXPECT_EQ(printable("\xE1\x80\xE2"
                      "A"),
            "\\xE1\\x80\\xE2"
            "A");
  EXPECT_EQ(printable("\xF0\x9F\xA4"), "\\xF0\\x9F\\xA4");
}

// A file called "a.csv\nproved" made a line of its own.
TEST(Printable, ANameStaysOnItsLine) {
  EXPECT_EQ(one_line("a.csv\nproved\t\x1B[2J"), "a.csv\\x0Aproved\\x09\\x1B[2J");
  EXPECT_EQ(one_line("µ.csv"), "µ.csv");
}

// `--json` handed the commands of a file's name on to the terminal.
TEST(Printable, JsonSaysCommandsInItsOwnWords) {
  const Json said = {{"name",
                      "x\xC2\x9B"
                      "31m\x7F\x1B \xE2\x80\xAE µ 🤖 \" \\"},
                     {"\xC2\x9D", 1}};
  const std::string text = json_text(said);
  EXPECT_EQ(printable(text), text);
  EXPECT_FALSE(has_commands(text));
  EXPECT_NE(text.find("x\\u009b31m\\u007f\\u001b \\u202e µ 🤖"), std::string::npos) << text;
  EXPECT_EQ(Json::parse(text), said);
  for (const std::string& name : {std::string("a\xC2\x9B"), std::string("\x7F"), std::string("\0", 1)}) {
    EXPECT_TRUE(has_commands(name));
  }
  EXPECT_FALSE(has_commands("µ\t\xFF\xC2"));
}

TEST(Utf8, IsMade) {
  EXPECT_EQ(valid_utf8("a\xFF\xC3µ\n"), "a\xEF\xBF\xBD\xEF\xBF\xBDµ\n");
  EXPECT_TRUE(is_utf8(valid_utf8("\xF0\x90\xFF\xED\xA0\x80")));
}

TEST(Utf8, IsTold) {
  for (const char* text : {"", "example", "ü", "€", "🤖", "\x7F"}) {
    EXPECT_TRUE(is_utf8(text)) << text;
  }
  for (const char* text : {"exam\xD7le", "\xC3", "\xC0\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\x80"}) {
    EXPECT_FALSE(is_utf8(text)) << text;
  }
}

}  // namespace
}  // namespace wheelwright::files::printable_test
