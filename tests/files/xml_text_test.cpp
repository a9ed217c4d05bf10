// SPDX-License-Identifier: Apache-2.0
// XML that is edited in place: what is not edited stays byte for byte, and what comes out reads back.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "core/error.hpp"
#include "formats/files/place.hpp"
#include "formats/files/xml_text.hpp"

namespace wheelwright::files::xml_text_test {
namespace {

const std::string kSample =
    "\xEF\xBB\xBF<?xml version='1.0'?>\r\n<!-- <joint name=\"not this\"/> -->\r\n<robot name = 'a &amp; b'\r\n>\r\n"
    "  <link name=\"x\"><mass   value='1.50'  /></link>\r\n"
    "  <joint name=\"j\"/>\r\n  <note><![CDATA[ <a> ]]></note>\r\n  <mass>\r\n    2.0\r\n  </mass>\r\n</robot>\r\n<!-- "
    "end -->\r\n";

TEST(XmlText, WithoutEditsNothingChanges) {
  const XmlText xml = XmlText::parse(kSample, "a.xml");
  EXPECT_EQ(xml.edited(), kSample);
  EXPECT_EQ(xml.attribute(0, "name"), "a & b");
  EXPECT_EQ(xml.children(0).size(), 4U);
  EXPECT_EQ(xml.text(*xml.child(0, "mass")), "2.0");
}

TEST(XmlText, CharactersByNumberAreReadWhereTheyAreAscii) {
  const XmlText xml = XmlText::parse("<a b='&#77;&#9999;&quot;'/>", "a.xml");
  EXPECT_EQ(xml.attribute(0, "b"), "M&#9999;\"");
}

// Found by the fuzzer of simulator files: the parser takes a vertical tab for white space, and the joint had no name
// here.
TEST(XmlText, WhiteSpaceIsWhatTheParserTakesForIt) {
  const XmlText xml = XmlText::parse("<a\vb\f=\v'1'\fc='2'/>", "a.xml");
  EXPECT_EQ(xml.attribute(0, "b"), "1");
  EXPECT_EQ(xml.attribute(0, "c"), "2");
}

TEST(XmlText, EditsReplaceTheirBytesAlone) {
  XmlText xml = XmlText::parse(kSample, "a.xml");
  const auto mass = *xml.child(*xml.child(0, "link"), "mass");
  xml.set_attribute(mass, "value", "7");
  xml.set_attribute(mass, "unit", "kg");
  xml.set_attribute(mass, "unit", "g");
  xml.set_text(*xml.child(0, "mass"), "3");
  const auto fresh = xml.child_or_new(*xml.child(0, "joint"), "dynamics");
  EXPECT_EQ(xml.child_or_new(*xml.child(0, "joint"), "dynamics"), fresh);
  xml.set_attribute(fresh, "damping", "0.1");
  xml.set_attribute(xml.add_child(0, "last"), "a", "b");
  std::string expected = kSample;
  const auto put = [&](const std::string& old, const std::string& now) {
    expected.replace(expected.find(old), old.size(), now);
  };
  put("value='1.50'", "value='7' unit=\"g\"");
  put("<joint name=\"j\"/>", "<joint name=\"j\">\r\n    <dynamics damping=\"0.1\"/>\r\n  </joint>");
  put("    2.0", "    3");
  put("  </mass>", "  </mass>\r\n  <last a=\"b\"/>");
  EXPECT_EQ(xml.edited(), expected);
  const XmlPlace back = XmlPlace::parse(xml.edited(), "b.xml");
  EXPECT_EQ(back.need("joint").need("dynamics").number("damping"), 0.1);
  EXPECT_EQ(xml.attribute(mass, "value"), "7");
  EXPECT_EQ(xml.place(fresh).text(), "a.xml:6: <dynamics> of joint 'j'");
}

TEST(XmlText, WhatIsNoXmlIsToldWithItsLine) {
  for (const char* bad : {"", "<a>", "<a></b>", "<a b></a>", "<a b='c></a>", "<a/><b/>", "<a>\n<b></a>", "plain"}) {
    try {
      static_cast<void>(XmlText::parse(bad, "a.xml"));
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("a.xml:", 0), 0U) << error.what();
    }
  }
}

// Any text is refused, or read, and then comes out as it went in; edits of it are XML again.
TEST(XmlText, BrokenFilesAreRefusedOrKept) {
  std::mt19937_64 random(7);
  const std::string spice = "<>/\"'= &;![]-?ab1\n";
  int read = 0;
  for (int k = 0; k < 3000; ++k) {
    std::string text = kSample;
    for (std::uint64_t n = 0; n <= random() % 4; ++n) {
      const std::size_t at = random() % text.size();
      switch (random() % 3) {
        case 0: text.erase(at, 1 + random() % 9); break;
        case 1: text.insert(at, 1, spice[random() % spice.size()]); break;
        default: text[at] = spice[random() % spice.size()];
      }
    }
    try {
      XmlText xml = XmlText::parse(text, "a.xml");
      ASSERT_EQ(xml.edited(), text);
      xml.set_attribute(0, "wheelwright", "1");
      xml.add_child(0, "wheelwright");
      ASSERT_EQ(XmlPlace::parse(xml.edited(), "b.xml").need_attribute("wheelwright"), "1") << text;
      ++read;
    } catch (const InputError& error) {
      ASSERT_EQ(std::string(error.what()).rfind("a.xml:", 0), 0U) << error.what() << "\n" << text;
    }
  }
  EXPECT_GT(read, 300);
}

// Quadratic work would take minutes, which ctest does not wait for.
TEST(XmlText, WorkGrowsAsTheInputDoes) {
  std::string line = "<robot>";
  for (std::size_t k = 0; k < 400000; ++k) {
    line += "<a/>";
  }
  XmlText wide = XmlText::parse(line + "</robot>", "wide.xml");
  wide.set_attribute(wide.add_child(0, "b"), "name", "c");
  EXPECT_TRUE(wide.edited().ends_with("<b name=\"c\"/></robot>"));
  const std::string ampersands(4000000, '&');
  const XmlText text = XmlText::parse("<robot name='" + ampersands + "'/>", "text.xml");
  EXPECT_EQ(text.attribute(0, "name"), ampersands);
}

TEST(XmlText, EntitiesAreReadAsXmlHasThem) {
  const XmlText text = XmlText::parse("<a b='&lt;&amp;&quot;&apos;&gt;&#65;&#x41;&unknown;&;&amp'/>", "a.xml");
  EXPECT_EQ(text.attribute(0, "b"), "<&\"'>A&#x41;&unknown;&;&amp");
}

}  // namespace
}  // namespace wheelwright::files::xml_text_test
