// SPDX-License-Identifier: Apache-2.0
// Databases that are cut off or changed at random: what is handed out is right, and what is missing is reported.
#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

#include "formats/logs/ros_messages.hpp"
#include "tests/logs/bag_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::bag_fuzz_test {
namespace {

using testing::all_items;
using testing::all_losses;
using testing::BagItem;
using ::testing::HasSubstr;
using testing::sample_items;

/// What reading a database gave.
struct Outcome {
  std::string refused;  ///< why it could not be opened
  std::vector<BagItem> items;
  std::string losses;
};

class BagFuzz : public testing::ScratchTest {
 protected:
  std::string sample(const std::vector<BagItem>& items) const {
    testing::write_humble(path("good.db3"), items, 512);
    return bytes(path("good.db3"));
  }

  Outcome outcome(std::string_view content) const {
    const auto file = put("damaged.db3", content);
    Outcome found;
    try {
      const auto bag = open_bag({file});
      found.items = all_items(*bag);
      found.losses = all_losses(*bag);
      bag->rewind();
      EXPECT_EQ(all_items(*bag).size(), found.items.size());
      EXPECT_EQ(all_losses(*bag), found.losses);
    } catch (const InputError& error) {
      found.refused = error.what();
      EXPECT_THAT(found.refused, HasSubstr("damaged.db3: "));
    }
    return found;
  }
};

/// Whether `part` is `whole` with some left out.
bool is_subsequence(const std::vector<BagItem>& part, const std::vector<BagItem>& whole) {
  auto at = whole.begin();
  return std::all_of(part.begin(), part.end(), [&](const BagItem& item) {
    at = std::find(at, whole.end(), item);
    return at++ != whole.end();
  });
}

TEST_F(BagFuzz, CutOffAnywhere) {
  const auto items = sample_items(80);
  const std::string good = sample(items);
  std::size_t opened = 0, most = 0;
  for (std::size_t length = 3; length < good.size(); length += good.size() / 200) {
    const Outcome found = outcome(std::string_view(good).substr(0, length));
    if (!found.refused.empty()) {
      continue;
    }
    ++opened;
    ASSERT_TRUE(is_subsequence(found.items, items)) << length;
    ASSERT_THAT(found.losses, HasSubstr("damaged.db3: at byte " + std::to_string(length) + ": the file ends here"));
    ASSERT_GE(found.items.size(), most) << length;
    most = found.items.size();
  }
  EXPECT_GT(opened, 150U);
  EXPECT_GT(most, 70U);
}

TEST_F(BagFuzz, ADamagedPageCostsItsRowsAndSaysWhichTheyWere) {
  const auto items = sample_items(200);
  const std::string good = sample(items);
  std::size_t salvaged = 0;
  for (std::size_t page = 8; 512 * (page + 1) <= good.size(); page += 3) {
    std::string bad = good;
    std::fill_n(bad.begin() + static_cast<std::ptrdiff_t>(512 * page), 512, '\xFF');
    const Outcome found = outcome(bad);
    ASSERT_EQ(found.refused, "") << page;
    ASSERT_TRUE(is_subsequence(found.items, items)) << page;
    ASSERT_THAT(found.losses, HasSubstr("damaged.db3: ")) << page;
    if (found.items.size() < items.size()) {
      ASSERT_THAT(found.losses, HasSubstr("damaged.db3: table messages: ")) << page;
      salvaged += found.losses.find("reading goes on at row") != std::string::npos ? 1 : 0;
      ASSERT_GE(found.items.size() + 10, items.size()) << found.losses;
    }
  }
  EXPECT_GT(salvaged, 10U);
}

TEST_F(BagFuzz, ThePlaceOfTheDamageIsTheMessageBefore) {
  const auto items = sample_items(80);
  std::string bad = sample(items);
  bad.resize(bad.size() / 2);
  const Outcome found = outcome(bad);
  ASSERT_FALSE(found.items.empty());
  ASSERT_LT(found.items.size(), items.size());
  const std::size_t last = found.items.size();  // messages have no gaps here
  ASSERT_EQ(found.items.back(), items[last - 1]);
  EXPECT_THAT(found.losses, HasSubstr("behind message " + std::to_string(last) + " (row " + std::to_string(last) +
                                      ", time " + std::to_string(1000 + last - 1) + ".000000000 s)"));
  EXPECT_THAT(found.losses, HasSubstr("nothing behind it can be read"));
}

/// A byte inside a message can change unseen, since SQLite has no checksums; a message that is missing, and one whose
/// time was changed, is reported.
TEST_F(BagFuzz, ChangedAtRandom) {
  const auto items = sample_items(60);
  const std::string good = sample(items);
  std::mt19937_64 random(17);
  std::size_t noticed = 0;
  for (int round = 0; round < 200; ++round) {
    std::string bad = good;
    for (std::size_t change = 0; change < 1 + random() % 8; ++change) {
      bad[random() % (round % 2 == 0 ? bad.size() : 2000)] = static_cast<char>(random());
    }
    const Outcome found = outcome(bad);
    if (!found.refused.empty() || !found.losses.empty()) {
      ++noticed;
      continue;
    }
    ASSERT_EQ(found.items.size(), items.size()) << round;
    for (std::size_t k = 0; k < items.size(); ++k) {
      ASSERT_EQ(found.items[k].time, items[k].time) << round;
    }
  }
  EXPECT_GT(noticed, 40U);
}

TEST_F(BagFuzz, PackedFilesCutOffAnywhere) {
  const auto items = sample_items(40);
  testing::write_humble(path("good.db3"), items, 512);
  const std::string good = testing::packed(bytes(path("good.db3")));
  for (std::size_t length = 0; length < good.size(); length += good.size() / 40) {
    const auto file = put("cut.db3.zstd", std::string_view(good).substr(0, length));
    try {
      const auto bag = open_bag({file});
      ASSERT_TRUE(is_subsequence(all_items(*bag), items));
      ASSERT_THAT(all_losses(*bag), HasSubstr("cut.db3.zstd: zstd stream ends early"));
    } catch (const InputError& error) {
      ASSERT_THAT(error.what(), HasSubstr("cut.db3.zstd: "));
    }
  }
}

}  // namespace
}  // namespace wheelwright::logs::bag_fuzz_test
