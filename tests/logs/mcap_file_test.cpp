// SPDX-License-Identifier: Apache-2.0
// MCAP files against the specification (https://mcap.dev/spec), with bytes put together by hand.
#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "formats/files/bytes.hpp"
#include "tests/logs/mcap_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::mcap_file_test {
namespace {

using testing::McapKind;
using testing::OwnedMessage;

const std::string magic = {'\x89', 'M', 'C', 'A', 'P', '0', '\r', '\n'};

std::string le(std::uint64_t value, int bytes) {
  std::string text;
  for (int k = 0; k < bytes; ++k) {
    text += static_cast<char>(k < 8 ? value >> (8 * k) & 0xFF : 0);
  }
  return text;
}
std::string str(const std::string& text) { return le(text.size(), 4) + text; }
std::string record(int op, const std::string& content) {
  return le(static_cast<unsigned>(op), 1) + le(content.size(), 8) + content;
}

/// CRC-32 bit by bit (polynomial 0xEDB88320, reflected).
std::uint64_t crc(const std::string& bytes) {
  std::uint32_t sum = 0xFFFFFFFF;
  for (const char byte : bytes) {
    sum ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) {
      sum = (sum >> 1) ^ ((sum & 1) != 0 ? 0xEDB88320U : 0U);
    }
  }
  return sum ^ 0xFFFFFFFF;
}

const std::string header = record(1, str("ros2") + str("hand"));
const std::string schema = record(3, le(1, 2) + str("pkg/msg/A") + str("ros2msg") + str("float64 x\n"));
const std::string channel = record(4, le(1, 2) + le(1, 2) + str("/a") + str("cdr") + str(str("k") + str("v")));

std::string message(int sequence, std::uint64_t time, const std::string& data, int channel_id = 1) {
  return record(5, le(static_cast<unsigned>(channel_id), 2) + le(static_cast<unsigned>(sequence), 4) + le(time, 8) +
                       le(time + 1, 8) + data);
}

std::string chunk(const std::string& records, std::uint64_t sum, const std::string& compression = "") {
  return record(
      6, le(0, 8) + le(0, 8) + le(records.size(), 8) + le(sum, 4) + str(compression) + le(records.size(), 8) + records);
}

/// Data end and footer without a summary.
const std::string end = record(15, le(0, 4)) + record(2, le(0, 8) + le(0, 8) + le(0, 4)) + magic;

class McapFile : public testing::ScratchTest {
 protected:
  /// Reads a file of these bytes to its end.
  std::vector<OwnedMessage> read(const std::string& bytes, McapReaderOptions options = {}) {
    McapReader reader(put("hand.mcap", bytes), options);
    auto messages = testing::all_messages(reader);
    report_ = reader.report();
    channels_ = reader.channels();
    schemas_ = reader.schemas();
    return messages;
  }
  /// Its sentences.
  [[nodiscard]] std::string said() const { return testing::joined(sentences(report_)); }

  McapReport report_;
  std::map<std::uint16_t, McapChannel> channels_;
  std::map<std::uint16_t, McapSchema> schemas_;
};

TEST_F(McapFile, WriterWithoutChunks) {
  McapWriter writer(path("a.mcap"), {McapCompression::none, 0, "ros2", "hand"});
  EXPECT_EQ(writer.add_schema("pkg/msg/A", "ros2msg", "float64 x\n"), 1);
  EXPECT_EQ(writer.add_channel(1, "/a", "cdr", {{"k", "v"}}), 1);
  writer.write({1, 5, 100, 101, "abc"});
  writer.write({1, 6, 90, 91, ""});
  EXPECT_FALSE(std::filesystem::exists(path("a.mcap")));
  writer.commit();

  const std::string data = magic + header + schema + channel + message(5, 100, "abc") + message(6, 90, "");
  std::string expected = data + record(15, le(crc(data), 4));
  const std::size_t start = expected.size();
  const std::string statistics =
      record(11, le(2, 8) + le(1, 2) + le(1, 4) + le(0, 12) + le(90, 8) + le(100, 8) + str(le(1, 2) + le(2, 8)));
  std::string summary = schema + channel + statistics;
  const std::size_t offsets = start + summary.size();
  summary += record(14, le(3, 1) + le(start, 8) + le(schema.size(), 8)) +
             record(14, le(4, 1) + le(start + schema.size(), 8) + le(channel.size(), 8)) +
             record(14, le(11, 1) + le(start + schema.size() + channel.size(), 8) + le(statistics.size(), 8));
  summary += le(2, 1) + le(20, 8) + le(start, 8) + le(offsets, 8);
  expected += summary + le(crc(summary), 4) + magic;
  EXPECT_EQ(bytes(path("a.mcap")), expected);
}

TEST_F(McapFile, WriterWithAChunk) {
  McapWriter writer(path("a.mcap"), {McapCompression::none, 1 << 20, "ros2", "hand"});
  writer.add_schema("pkg/msg/A", "ros2msg", "float64 x\n");
  writer.add_channel(1, "/a", "cdr", {{"k", "v"}});
  writer.write({1, 5, 100, 101, "abc"});
  writer.write({1, 6, 90, 91, ""});
  writer.commit();

  const std::string records = schema + channel + message(5, 100, "abc") + message(6, 90, "");
  const std::string packed = record(6, le(90, 8) + le(100, 8) + le(records.size(), 8) + le(crc(records), 4) + str("") +
                                           le(records.size(), 8) + records);
  const std::size_t first = schema.size() + channel.size();
  const std::string index =
      record(7, le(1, 2) + str(le(100, 8) + le(first, 8) + le(90, 8) + le(first + message(5, 100, "abc").size(), 8)));
  const std::size_t chunk_at = magic.size() + header.size();
  const std::size_t index_at = chunk_at + packed.size();
  const std::string chunk_index =
      record(8, le(90, 8) + le(100, 8) + le(chunk_at, 8) + le(packed.size(), 8) + str(le(1, 2) + le(index_at, 8)) +
                    le(index.size(), 8) + str("") + le(records.size(), 8) + le(records.size(), 8));
  const std::string data = magic + header + packed + index;
  const std::string written = bytes(path("a.mcap"));
  EXPECT_EQ(written.substr(0, data.size() + 13), data + record(15, le(crc(data), 4)));
  EXPECT_NE(written.find(chunk_index), std::string::npos);
  EXPECT_NE(written.find(record(14, le(8, 1) + le(written.find(chunk_index), 8) + le(chunk_index.size(), 8))),
            std::string::npos);
}

TEST_F(McapFile, RoundTrip) {
  const auto messages = testing::sample_messages(200);
  for (const McapKind& kind : testing::mcap_kinds()) {
    testing::write_sample(path("a.mcap"), messages, kind.options());
    McapReader reader(path("a.mcap"), {std::size_t{1} << 20, true});
    EXPECT_EQ(reader.channels().size(), 3u) << "known before the first message";
    for (int pass = 0; pass < 2; ++pass) {
      EXPECT_EQ(testing::all_messages(reader), messages) << kind.name;
      const McapReport& report = reader.report();
      EXPECT_TRUE(report.clean() && report.indexed && report.finished) << testing::joined(sentences(report));
      EXPECT_EQ(report.promised, 200u);
      EXPECT_EQ(report.unchecked, kind.chunk_bytes == 0 ? 200u : 0u);
      EXPECT_EQ(report.profile, "ros2");
      EXPECT_EQ(report.library, "test");
      const std::string content = bytes(path("a.mcap"));
      files::Xxh64 hash;
      hash.update(content.data(), content.size());
      EXPECT_EQ(report.hash, hash.text());
      reader.rewind();
    }
    const McapChannel& joints = reader.channels().at(1);
    EXPECT_EQ(joints, (McapChannel{1, 1, "/joint_states", "cdr", {{"offered_qos_profiles", ""}, {"a", "b"}}}));
    ASSERT_NE(reader.schema_of(joints), nullptr);
    EXPECT_EQ(*reader.schema_of(joints),
              (McapSchema{1, "sensor_msgs/msg/JointState", "ros2msg", "float64[] position\n"}));
    EXPECT_EQ(reader.schema_of(reader.channels().at(3)), nullptr);
  }
}

TEST_F(McapFile, LongMessages) {
  // Longer than the pieces in which the file is read, and than a chunk.
  std::vector<OwnedMessage> messages = testing::sample_messages(6);
  for (OwnedMessage& m : messages) {
    m.data.assign(700'000 * (m.sequence + 1), static_cast<char>('a' + m.sequence));
    m.data[m.data.size() / 2] = '!';
  }
  for (const McapKind& kind : testing::mcap_kinds()) {
    testing::write_sample(path("a.mcap"), messages, kind.options());
    McapReader reader(path("a.mcap"));
    EXPECT_TRUE(testing::all_messages(reader) == messages) << kind.name;
    EXPECT_TRUE(reader.report().clean());
  }
}

TEST_F(McapFile, WhatTheSpecificationAllows) {
  EXPECT_TRUE(read(magic + header + record(2, le(0, 20)) + magic).empty());  // its smallest file: no data end
  EXPECT_TRUE(report_.clean()) << said();

  const std::string attachment = record(9, le(0, 16) + str("a.jpg") + str("image/jpeg") + le(3, 8) + "abc" + le(0, 4));
  const std::string metadata = record(12, str("m") + str(str("k") + str("v")));
  const std::string longer = record(4, channel.substr(9) + "fields of a later version");
  const auto messages =
      read(magic + header + record(3, le(0, 2) + str("") + str("") + str("")) + schema + longer + metadata +
           message(1, 10, "x") + attachment + record(0x90, "mine") + chunk(message(2, 9, "y"), 0) +
           chunk(channel + message(3, 8, "z"), crc(channel + message(3, 8, "z"))) + end);
  EXPECT_EQ(messages, (std::vector<OwnedMessage>{{1, 1, 10, 11, "x"}, {1, 2, 9, 10, "y"}, {1, 3, 8, 9, "z"}}));
  EXPECT_TRUE(report_.clean()) << said();
  EXPECT_EQ(report_.unchecked, 2u);
  EXPECT_EQ(report_.attachments, 1u);
  EXPECT_EQ(report_.metadata, 1u);
  EXPECT_EQ(report_.unknown.count, 1u);
  EXPECT_EQ(report_.unknown.bytes, 13u);
  EXPECT_EQ(schemas_.size(), 1u);
  EXPECT_EQ(channels_.at(1).metadata.at("k"), "v");
}

TEST_F(McapFile, DamagedChunkIsLeftOutAndCounted) {
  const auto messages = testing::sample_messages(60);
  for (const McapKind& kind : testing::mcap_kinds()) {
    if (kind.chunk_bytes == 0) {
      continue;
    }
    testing::write_sample(path("a.mcap"), messages, kind.options());
    std::string bad = bytes(path("a.mcap"));
    bad[bad.size() / 3] ^= 1;  // in the middle of some chunk
    const auto good = read(bad);
    ASSERT_GE(report_.damages.size(), 2u);  // and the checksum of the data section
    ASSERT_TRUE(report_.damages.front().messages) << said();
    EXPECT_GT(*report_.damages.front().messages, 0u);
    EXPECT_EQ(good.size() + *report_.damages.front().messages, messages.size()) << said();
    for (const OwnedMessage& m : good) {
      EXPECT_EQ(m, messages[m.sequence]);
    }
    EXPECT_EQ(report_.promised, messages.size());
  }
}

TEST_F(McapFile, ChunksThatCannotBeUsed) {
  const std::string start = magic + header + schema + channel;
  const auto at = " at byte " + std::to_string(start.size()) + ": ";
  const std::string one = message(1, 1, "x"), two = chunk(message(2, 2, "y"), 0);
  const auto only_second = std::vector<OwnedMessage>{{1, 2, 2, 3, "y"}};
  EXPECT_EQ(read(start + chunk(one, crc(one) + 1) + two + end), only_second);
  EXPECT_NE(said().find(at + "a chunk is left out: its checksum does not match"), std::string::npos) << said();
  EXPECT_EQ(read(start + chunk(one, 0, "bz2") + two + end), only_second);
  EXPECT_NE(said().find(at + "a chunk is left out: compression 'bz2' is not known"), std::string::npos) << said();
  EXPECT_EQ(read(start + chunk(one, 0, "zstd") + two + end), only_second);
  EXPECT_NE(said().find(at + "a chunk is left out: packing damaged"), std::string::npos) << said();
  EXPECT_EQ(read(start + chunk(one, 0, "lz4") + two + end), only_second);
  EXPECT_NE(said().find(at + "a chunk is left out: packing damaged"), std::string::npos) << said();
  EXPECT_EQ(read(start + chunk(message(1, 1, "x", 9), 0) + two + end), only_second);
  EXPECT_NE(said().find(at + "messages on channel 9, which is not defined"), std::string::npos) << said();
  EXPECT_EQ(read(start + chunk(message(1, 1, std::string(1000, 'x')), 0) + two + end, {200, false}), only_second);
  EXPECT_NE(said().find(at + "a chunk is left out: it is longer than 200 bytes"), std::string::npos) << said();
}

TEST_F(McapFile, FramesByHand) {
  // Zstandard (RFC 8878): no content size, a window of 1 KiB, one raw block that is the last. LZ4 frame: independent
  // blocks of at most 64 KiB, one that is not compressed.
  const auto zstd = [](const std::string& raw) {
    return le(0xFD2FB528, 4) + le(0, 1) + le(0, 1) + le(1 + 8 * raw.size(), 3) + raw;
  };
  const auto lz4 = [](const std::string& raw) {
    return le(0x184D2204, 4) + le(0x824060, 3) + le(0x80000000 + raw.size(), 4) + raw + le(0, 4);
  };
  const auto packed = [](std::size_t size, const std::string& word, const std::string& records) {
    return record(6, le(0, 16) + le(size, 8) + le(0, 4) + str(word) + le(records.size(), 8) + records);
  };
  const std::string start = magic + header + schema + channel;
  const std::string one = message(1, 1, "x"), two = message(2, 2, "y");
  const std::size_t size = one.size() + two.size();
  for (const auto& [word, frame] : {std::pair{"zstd", zstd(one + two)}, std::pair{"zstd", zstd(one) + zstd(two)},
                                    std::pair{"lz4", lz4(one + two)}, std::pair{"lz4", lz4(one) + lz4(two)}}) {
    EXPECT_EQ(read(start + packed(size, word, frame) + end).size(), 2u) << word;
    EXPECT_TRUE(report_.clean()) << said();
    EXPECT_TRUE(read(start + packed(size - 1, word, frame) + end).empty());
    EXPECT_NE(said().find("more bytes than its head says"), std::string::npos) << said();
    EXPECT_TRUE(read(start + packed(size + 1, word, frame) + end).empty());
    EXPECT_NE(said().find("fewer bytes than its head says"), std::string::npos) << said();
    EXPECT_TRUE(read(start + packed(size, word, frame.substr(0, frame.size() - 5)) + end).empty());
    EXPECT_NE(said().find("ends early"), std::string::npos) << said();
    EXPECT_TRUE(read(start + packed(0, word, "") + end).empty());
    EXPECT_TRUE(report_.clean()) << said();
  }
}

TEST_F(McapFile, DamagedLengthsReserveNoMemory) {
  // A head that promises 2^60 bytes, in each place where a length stands.
  const std::string start = magic + header + schema + channel;
  const std::string one = message(1, 1, "x"), two = chunk(message(2, 2, "y"), 0);
  for (const std::size_t place : {std::size_t{1}, std::size_t{9 + 16}, std::size_t{9 + 32}}) {
    std::string damaged = chunk(one, crc(one));
    damaged.replace(place, 8, le(std::uint64_t{1} << 60, 8));
    const auto messages = read(start + damaged + two + end);
    ASSERT_FALSE(messages.empty());
    EXPECT_EQ(messages.back().data, "y");
    EXPECT_FALSE(report_.clean());
  }
}

TEST_F(McapFile, ChannelsOfADamagedChunkComeFromTheSummary) {
  const auto messages = testing::sample_messages(60);
  testing::write_sample(path("a.mcap"), messages, {McapCompression::none, 300, "", ""});
  std::string bad = bytes(path("a.mcap"));
  bad[bad.find("/imu")] = '?';
  const auto good = read(bad);
  EXPECT_EQ(channels_.at(2).topic, "/imu");
  EXPECT_GT(good.size(), 40u);
  EXPECT_EQ(std::count_if(good.begin(), good.end(), [](const OwnedMessage& m) { return m.channel_id == 2; }),
            20 - (60 - static_cast<long>(good.size())) / 3);
}

TEST_F(McapFile, ConflictingDefinitions) {
  std::string other = channel;
  other[other.find("/a") + 1] = 'b';
  EXPECT_EQ(read(magic + header + schema + channel + message(1, 1, "x") + other + message(2, 2, "y") + end).size(), 2u);
  EXPECT_EQ(channels_.at(1).topic, "/a");
  EXPECT_NE(said().find("channel 1 is defined differently"), std::string::npos) << said();
}

TEST_F(McapFile, FilesThatAreNone) {
  EXPECT_NE(testing::input_error([&] { McapReader reader(path("none.mcap")); }).find("none.mcap: no such file"),
            std::string::npos);
  EXPECT_NE(testing::input_error([&] { McapReader reader(directory_); }).find("is a directory"), std::string::npos);
  EXPECT_NE(testing::input_error([&] { read("t,omega_r\n0,1\n"); }).find("hand.mcap: at byte 0: is no MCAP file"),
            std::string::npos);
  EXPECT_NE(testing::input_error([&] { read(""); }).find("is empty"), std::string::npos);
  EXPECT_NE(testing::input_error([&] { read("\x89MCAP1\r\n rest"); }).find("of another version"), std::string::npos);
}

TEST_F(McapFile, WriterRefuses) {
  McapWriter writer(path("a.mcap"));
  EXPECT_THROW(writer.write({1, 0, 0, 0, ""}), InvalidArgument);
  EXPECT_THROW(writer.add_channel(1, "/a", "cdr"), InvalidArgument);
  EXPECT_THROW(McapWriter(path("no/such/directory.mcap")), InputError);
  EXPECT_FALSE(std::filesystem::exists(path("a.mcap")));
}

}  // namespace
}  // namespace wheelwright::logs::mcap_file_test
