// SPDX-License-Identifier: Apache-2.0
// MCAP files that are cut off or changed at random: what is handed out is right, and what is missing is reported.
#include <random>
#include <string>

#include "tests/logs/mcap_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::mcap_fuzz_test {
namespace {

using testing::McapKind;
using testing::OwnedMessage;

class McapFuzz : public testing::ScratchTest, public ::testing::WithParamInterface<McapKind> {
 protected:
  /// Bytes of a file with `count` messages.
  std::string sample(std::size_t count) const {
    testing::write_sample(path("good.mcap"), testing::sample_messages(count), GetParam().options());
    return bytes(path("good.mcap"));
  }
};

TEST_P(McapFuzz, CutOffAtEveryLength) {
  const auto messages = testing::sample_messages(24);
  const std::string good = sample(messages.size());
  std::size_t most = 0;
  for (std::size_t length = 0; length < good.size(); ++length) {
    const auto file = put("cut.mcap", std::string_view(good).substr(0, length));
    if (length < 8) {
      EXPECT_NE(testing::input_error([&] { McapReader reader(file); }).find("cut.mcap: at byte 0"), std::string::npos);
      continue;
    }
    McapReader reader(file);
    const auto read = testing::all_messages(reader);
    ASSERT_GE(read.size(), most) << length;
    ASSERT_LE(read.size(), messages.size()) << length;
    ASSERT_TRUE(std::equal(read.begin(), read.end(), messages.begin())) << length;
    ASSERT_FALSE(reader.report().clean()) << length;
    ASSERT_TRUE(reader.report().finished);
    ASSERT_NE(testing::joined(sentences(reader.report())).find("cut.mcap: at byte "), std::string::npos);
    most = read.size();
  }
  EXPECT_EQ(most, messages.size());  // the index at the end is not needed
}

std::string mutated(std::string bytes, std::mt19937_64& random) {
  if (random() % 8 == 0) {
    bytes.resize(random() % bytes.size());
  }
  for (std::uint64_t left = 1 + random() % 4; left > 0 && !bytes.empty(); --left) {
    const std::size_t at = random() % bytes.size();
    switch (random() % 6) {
      case 0: bytes.erase(at, 1 + random() % 40); break;
      case 1: bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 60)); break;
      case 2: bytes.replace(at, 8, 8, static_cast<char>(random() % 2 == 0 ? 0 : 0xFF)); break;
      case 3: bytes[at] = static_cast<char>(random() % 18); break;
      default: bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
    }
  }
  return bytes;
}

TEST_P(McapFuzz, Mutations) {
  std::mt19937_64 random(71);
  const auto messages = testing::sample_messages(60);
  const std::string good = sample(messages.size());
  const bool chunked = GetParam().chunk_bytes > 0;
  std::size_t whole = 0, in_part = 0, rejected = 0;
  for (int k = 0; k < 400; ++k) {
    const std::string bad = mutated(good, random);
    const auto file = put("bad.mcap", bad);
    try {
      McapReaderOptions options;
      options.max_record_bytes = std::size_t{1} << 20;
      McapReader reader(file, options);
      McapMessage message;
      std::size_t count = 0;
      bool all_right = true;
      std::uint64_t unchecked = 0;
      while (reader.next(message)) {
        const bool right = message.sequence < messages.size() && testing::owned(message) == messages[message.sequence];
        ASSERT_TRUE(right || !chunked || reader.report().unchecked > unchecked) << k;
        ASSERT_TRUE(reader.channels().contains(message.channel_id));
        unchecked = reader.report().unchecked;
        all_right = all_right && right && message.sequence == count;
        ++count;
      }
      const McapReport& report = reader.report();
      ASSERT_TRUE(report.finished);
      ASSERT_EQ(report.messages, count);
      if (!all_right || count != messages.size()) {
        ASSERT_FALSE(report.clean()) << k;
      }
      ASSERT_EQ(report.clean() && report.unknown.count == 0, sentences(report).empty()) << k;
      for (const McapDamage& damage : report.damages) {
        ASSERT_LE(damage.offset, bad.size());
        ASSERT_FALSE(damage.why.empty());
      }
      for (const std::string& line : sentences(report)) {
        ASSERT_NE(line.find("bad.mcap: "), std::string::npos);
      }
      (all_right && count == messages.size() ? whole : in_part)++;
    } catch (const InputError& error) {
      ASSERT_NE(std::string(error.what()).find("bad.mcap: at byte "), std::string::npos) << error.what();
      ++rejected;
    }
  }
  EXPECT_GT(in_part, 100u);
  EXPECT_LT(rejected, 100u);
  EXPECT_GT(whole, 10u);
}

TEST_P(McapFuzz, OneDamagedByteCostsOneChunkAtMost) {
  const auto messages = testing::sample_messages(60);
  const std::string good = sample(messages.size());
  const std::size_t chunk = GetParam().chunk_bytes > 0 ? 14 : 1;  // messages: 300 bytes, each at least 31
  for (std::size_t at = 8; at < good.size(); ++at) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x41);
    McapReader reader(put("bad.mcap", bad));
    const auto read = testing::all_messages(reader);
    ASSERT_GE(read.size() + chunk, messages.size()) << at << "\n" << testing::joined(sentences(reader.report()));
    if (read != messages) {
      ASSERT_FALSE(reader.report().clean()) << at;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, McapFuzz, ::testing::ValuesIn(testing::mcap_kinds()),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace wheelwright::logs::mcap_fuzz_test
