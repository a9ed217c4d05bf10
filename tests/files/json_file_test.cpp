// SPDX-License-Identifier: Apache-2.0
#include "formats/files/json.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <random>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/support/scratch.hpp"

namespace wheelwright::files::json_file_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error;

class JsonFile : public testing::ScratchTest {};

TEST_F(JsonFile, NumbersReadBackExactly) {
  std::mt19937_64 random(5);
  Json numbers = Json::array();
  std::vector<double> expected;
  for (int k = 0; k < 20000; ++k) {
    const double value = std::bit_cast<double>(random());
    if (std::isfinite(value)) {
      numbers.push_back(value);
      expected.push_back(value);
    }
  }
  write_json(path("n.json"), {{"numbers", numbers}});
  const Json read = read_json(path("n.json"));
  EXPECT_EQ(JsonPlace(read, "n.json").at("numbers").numbers(), expected);
}

TEST_F(JsonFile, NanAndInfinityAreNull) {
  write_json(path("n.json"), {{"a", NAN}, {"b", INFINITY}, {"c", 1.5}});
  const std::string text = bytes(path("n.json"));
  EXPECT_THAT(text, HasSubstr("\"a\": null"));
  EXPECT_THAT(text, HasSubstr("\"b\": null"));
  const Json read = read_json(path("n.json"));
  const JsonPlace root(read, "n.json");
  EXPECT_FALSE(root.has("a"));
  EXPECT_TRUE(root.has("c"));
  EXPECT_THAT(root.keys(), ElementsAre("a", "b", "c"));
}

TEST_F(JsonFile, NothingIsLeftWhenWritingFails) {
  EXPECT_THAT(input_error([&] { write_json(path("no/n.json"), Json::object()); }),
              AllOf(HasSubstr("n.json"), HasSubstr("expected a file name in an existing, writable directory")));
  EXPECT_EQ(files(), 0u);
  write_json(path("n.json"), Json::object());
  write_json(path("n.json"), {{"a", 1}});
  EXPECT_EQ(files(), 1u);
}

TEST_F(JsonFile, ErrorsNameTheirPlace) {
  const Json value = parse_json(R"({"parameters": [{"lower": "abc", "n": -1, "on": 1, "list": [1, null]}]})", "m.json");
  const JsonPlace entry = JsonPlace(value, "m.json").at("parameters").at(std::size_t{0});
  EXPECT_THAT(input_error([&] { (void)entry.at("lower").number(); }),
              HasSubstr("m.json: /parameters/0/lower: '\"abc\"': expected a number"));
  EXPECT_THAT(input_error([&] { (void)entry.at("lowr"); }),
              AllOf(HasSubstr("m.json: /parameters/0: no member 'lowr'"), HasSubstr("did you mean 'lower'?")));
  EXPECT_THAT(input_error([&] { (void)entry.at("n").count(); }), HasSubstr("/n: '-1': expected an integer >= 0"));
  EXPECT_THAT(input_error([&] { (void)entry.at("on").boolean(); }), HasSubstr("/on: '1': expected true or false"));
  EXPECT_THAT(input_error([&] { (void)entry.at("on").text(); }), HasSubstr("expected a string"));
  EXPECT_THAT(input_error([&] { (void)entry.at("list").numbers(); }),
              HasSubstr("/parameters/0/list/1: 'null': expected a number"));
  EXPECT_THAT(input_error([&] { (void)entry.at("list").at(std::size_t{2}); }), HasSubstr("at least 3 elements"));
  EXPECT_THAT(input_error([&] { (void)entry.at(std::size_t{0}); }), HasSubstr("expected an array"));
  EXPECT_THAT(input_error([&] { (void)entry.size(); }),
              AllOf(HasSubstr("m.json: /parameters/0: "), HasSubstr("expected an array")));
  EXPECT_THAT(input_error([&] { (void)entry.at("list").keys(); }),
              AllOf(HasSubstr("m.json: /parameters/0/list: "), HasSubstr("expected an object")));
}

TEST_F(JsonFile, TextThatIsNoJson) {
  EXPECT_THAT(input_error([&] { (void)parse_json("{\n  \"a\": 1,\n  b: 2\n}", "m.json"); }),
              AllOf(HasSubstr("m.json:3:3"), HasSubstr("expected JSON")));
  EXPECT_THAT(input_error([&] { (void)parse_json("{\"a\": 1", "m.json"); }), HasSubstr("m.json:1:"));
  EXPECT_THAT(input_error([&] { (void)parse_json(std::string("{\"a\": 1}\0, 2", 13), "m.json"); }),
              HasSubstr("m.json: binary data"));
  EXPECT_THAT(input_error([&] { (void)parse_json("{\"a\": 1e999}", "m.json"); }), HasSubstr("m.json"));
  EXPECT_THAT(input_error([&] { (void)parse_json(std::string(100000, '['), "m.json"); }), HasSubstr("nested"));
  EXPECT_THAT(input_error([&] { (void)read_json(path("absent.json")); }), HasSubstr("absent.json: no such file"));
}

// Of a key that stood twice the last was taken, whatever a reader of the file saw first.
TEST_F(JsonFile, AKeyThatStandsTwiceIsRefusedByName) {
  EXPECT_THAT(input_error([&] { (void)parse_json(R"({"a": 1, "b": [{"c": 1}, {"d": 1, "d": 2}]})", "m.json"); }),
              HasSubstr("m.json: /b/1/d: stands there twice: expected it once"));
  EXPECT_EQ(json_text(parse_json(R"({"b": {"a": 1}, "a": [{"a": 2}, {"a": 3}]})", "m.json"), -1),
            R"({"b":{"a":1},"a":[{"a":2},{"a":3}]})");
}

// 700,000 keys (8 MB) took 20 s, 4.5 million empty arrays (9 MB) 1.4 GB: what no result has is refused on the way.
TEST_F(JsonFile, WhatNoResultHasIsRefusedByItsLimit) {
  std::string keys = "{", arrays = "[[]";
  for (int k = 0; k < 700'000; ++k) {
    keys += fmt::format("{}\"k{}\":1", k == 0 ? "" : ",", k);
  }
  for (int k = 0; k < 4'500'000; ++k) {
    arrays += ",[]";
  }
  EXPECT_THAT(input_error([&] { (void)parse_json(keys + "}", "m.json"); }),
              HasSubstr("m.json: /k9999: more than 10000 members"));
  EXPECT_THAT(input_error([&] { (void)parse_json(arrays + "]", "m.json"); }),
              HasSubstr("m.json: /1999999: more than 2000000 values"));
  EXPECT_THAT(input_error([&] { (void)parse_json(std::string(201, '[') + std::string(201, ']'), "m.json"); }),
              HasSubstr("nested more than 200 deep"));
  EXPECT_EQ(parse_json(std::string(200, '[') + std::string(200, ']'), "m.json").size(), 1u);
  std::ofstream(path("long.json")) << '[' << std::string((std::size_t{1} << 26), ' ') << ']';
  EXPECT_THAT(input_error([&] { (void)read_json(path("long.json")); }), HasSubstr("is longer than 67108864 bytes"));
}

}  // namespace
}  // namespace wheelwright::files::json_file_test
