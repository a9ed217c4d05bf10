// SPDX-License-Identifier: Apache-2.0
// Recordings of rosbag2: databases made with plain SQL, MCAP files, directories, and what is said about unusable ones.
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "formats/files/bytes.hpp"
#include "formats/logs/bag.hpp"
#include "formats/logs/bag_write.hpp"
#include "formats/logs/mcap.hpp"
#include "formats/logs/ros_messages.hpp"
#include "tests/logs/bag_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::bag_test {
namespace {

namespace fs = std::filesystem;
using testing::all_items;
using testing::all_losses;
using testing::BagItem;
using ::testing::HasSubstr;
using testing::input_error;
using testing::packed;
using testing::sample_items;
using testing::Sql;

/// A recording that a BagWriter makes of `items`.
void write_items(const fs::path& path, const std::vector<BagItem>& items, BagWriterOptions options = {}) {
  BagWriter writer(path, options);
  const auto joints =
      writer.add_topic("/joint_states", "sensor_msgs/msg/JointState",
                       ros_definition_text(bundled_ros_definition("sensor_msgs/msg/JointState").value()));
  const auto range = writer.add_topic("/range", "sensor_msgs/msg/Range",
                                      ros_definition_text(bundled_ros_forms("sensor_msgs/msg/Range").back()));
  for (const BagItem& item : items) {
    writer.write(item.topic == "/range" ? range : joints, item.time, item.data);
  }
  writer.commit();
}

class Bag : public testing::ScratchTest {
 protected:
  std::unique_ptr<BagReader> open(std::string_view name) const { return open_bag({path(name)}); }
};

TEST_F(Bag, DatabaseOfHumbleTakesBundledDefinitions) {
  const auto items = sample_items(9);
  testing::write_humble(path("a.db3"), items);
  EXPECT_TRUE(is_bag(path("a.db3")));
  const auto bag = open_bag({path("a.db3")}, {.hashed = true});
  ASSERT_EQ(bag->topics().size(), 2U);
  EXPECT_EQ(bag->topics()[0].type, "sensor_msgs/msg/JointState");
  EXPECT_EQ(bag->topics()[0].definition->origin, "bundled (Humble)");
  EXPECT_EQ(bag->topics()[1].definition->origin, "bundled (Jazzy)") << "the form with a variance fits";
  EXPECT_EQ(all_items(*bag), items);
  EXPECT_EQ(all_losses(*bag), "");
  EXPECT_EQ(bag->topics()[0].messages, 6U);
  ASSERT_EQ(bag->reports().size(), 1U);
  const BagReport& report = bag->reports()[0];
  EXPECT_EQ(report.storage, "sqlite3");
  EXPECT_EQ(report.messages, 9U);
  EXPECT_EQ(report.bytes, fs::file_size(path("a.db3")));
  files::Xxh64 hash;
  const std::string content = bytes(path("a.db3"));
  hash.update(content.data(), content.size());
  EXPECT_EQ(report.hash, hash.text());
  bag->rewind();
  EXPECT_EQ(all_items(*bag), items);
  EXPECT_EQ(bag->reports()[0].messages, 9U);
  EXPECT_EQ(files(), 1U);
}

TEST_F(Bag, DatabaseOfIronHasItsDefinitions) {
  {
    Sql sql(path("a.db3"));
    testing::humble_tables(sql);
    sql.run(
        "ALTER TABLE topics ADD COLUMN type_description_hash TEXT;"
        "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL, "
        "encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);"
        "UPDATE schema SET schema_version = 4;"
        "INSERT INTO topics VALUES (8, '/own', 'own_msgs/msg/Own', 'cdr', '', '');"
        "INSERT INTO topics VALUES (9, '/lost', 'own_msgs/msg/Lost', 'cdr', '', '');"
        "INSERT INTO topics VALUES (10, '/text', 'own_msgs/msg/Text', 'json', '', '');"
        "INSERT INTO topics VALUES (11, '/idl', 'own_msgs/msg/Idl', 'cdr', '', '');"
        "INSERT INTO message_definitions VALUES (1, 'own_msgs/msg/Own', 'ros2msg', 'float64 x', '');"
        "INSERT INTO message_definitions VALUES (2, 'own_msgs/msg/Idl', 'ros2idl', 'module own_msgs {};', '');"
        "INSERT INTO message_definitions VALUES (3, 'sensor_msgs/msg/Range', 'ros2idl', 'module sensor_msgs {};', "
        "'');");
  }
  const auto bag = open("a.db3");
  ASSERT_EQ(bag->topics().size(), 6U);
  EXPECT_EQ(bag->topics()[2].definition->origin, "the recording");
  EXPECT_EQ(bag->topics()[1].definition->origin, "bundled (Humble)");
  EXPECT_FALSE(bag->topics()[3].definition);
  EXPECT_THAT(bag->topics()[3].no_definition, HasSubstr("'own_msgs/msg/Lost' is not bundled"));
  EXPECT_THAT(bag->topics()[4].no_definition, HasSubstr("'json'"));
  EXPECT_THAT(bag->topics()[5].no_definition, HasSubstr("IDL"));
  fs::create_directories(path("own_msgs/msg"));
  put("own_msgs/msg/Lost.msg", "float32 y\n");
  const auto again = open_bag({path("a.db3")}, {.msg_path = {path("own_msgs")}});
  ASSERT_TRUE(again->topics()[3].definition);
  EXPECT_EQ(again->topics()[3].no_definition, "");
}

TEST_F(Bag, WrittenRecordingsAreReadBackInEveryStorage) {
  const auto items = sample_items(50);
  for (const char* const name : {"a.mcap", "a.db3", "directory", "other/"}) {
    write_items(path(name), items, {.sqlite = std::string(name) == "other/"});
    EXPECT_TRUE(is_bag(path(name))) << name;
    const auto bag = open(name);
    EXPECT_EQ(all_items(*bag), items) << name;
    EXPECT_EQ(all_losses(*bag), "") << name;
    for (const BagTopic& topic : bag->topics()) {
      EXPECT_EQ(topic.definition->origin, "the recording");
    }
  }
  EXPECT_EQ(files(), 4U);
  EXPECT_TRUE(fs::exists(path("directory/directory_0.mcap")));
  EXPECT_TRUE(fs::exists(path("other/other_0.db3")));
  EXPECT_THAT(bytes(path("other/metadata.yaml")), HasSubstr("storage_identifier: sqlite3"));
  EXPECT_THAT(input_error([&] { BagWriter again(path("directory")); }), HasSubstr("is there already"));
}

TEST_F(Bag, NothingAppearsWithoutCommit) {
  for (const char* const name : {"a.mcap", "a.db3", "directory"}) {
    BagWriter writer(path(name));
    const auto topic = writer.add_topic("/x", "std_msgs/msg/Float64", "float64 data\n");
    writer.write(topic, 0, "abc");
    EXPECT_THROW(writer.write(topic + 1, 0, ""), InvalidArgument);
    EXPECT_THROW(writer.write(topic, -1, ""), InvalidArgument);
  }
  EXPECT_EQ(files(), 0U);
  EXPECT_THAT(input_error([&] { BagWriter writer(path("no/such/a.db3")); }), HasSubstr("a.db3: cannot be written"));
  EXPECT_THAT(input_error([&] { BagWriter writer(path("no/such/dir")); }), HasSubstr("dir: cannot be made"));
}

TEST_F(Bag, SplitRecordingInTheOrderOfItsMetadata) {
  const auto items = sample_items(30);
  fs::create_directories(path("bag"));
  for (std::size_t part = 0; part < 3; ++part) {
    const auto first = items.begin() + static_cast<std::ptrdiff_t>(10 * part);
    testing::write_humble(path("bag/b_" + std::to_string(9 + part) + ".db3"), {first, first + 10});
  }
  const auto natural = open("bag");
  EXPECT_EQ(all_items(*natural), items) << "b_9 comes before b_10";
  EXPECT_EQ(natural->topics().size(), 2U);
  natural->rewind();
  EXPECT_EQ(all_items(*natural), items);
  ASSERT_EQ(natural->reports().size(), 3U);
  EXPECT_EQ(natural->reports()[2].messages, 10U);

  put("bag/metadata.yaml",
      "rosbag2_bagfile_information:\n  version: 5\n  message_count: 31\n  relative_file_paths:\n    - b_11.db3\n"
      "    - b_12.db3\n    - b_9.db3\n");
  const auto listed = open("bag");
  std::vector<BagItem> expected(items.begin() + 20, items.end());
  expected.insert(expected.end(), items.begin(), items.begin() + 10);
  EXPECT_EQ(all_items(*listed), expected);
  EXPECT_THAT(all_losses(*listed), HasSubstr("b_12.db3"));
  EXPECT_THAT(all_losses(*listed), HasSubstr("metadata.yaml: 20 messages were read from its files; it says 31"));

  put("bag/metadata.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: [\n");
  const auto damaged = open("bag");
  EXPECT_EQ(all_items(*damaged), items);
  EXPECT_THAT(all_losses(*damaged), HasSubstr("metadata.yaml:"));
}

TEST_F(Bag, PackedFilesAndPackedMessages) {
  auto items = sample_items(20);
  testing::write_humble(path("plain.db3"), items);
  const std::string whole = packed(bytes(path("plain.db3")));
  put("a.db3.zstd", whole);
  EXPECT_TRUE(is_bag(path("a.db3.zstd")));
  const auto bag = open("a.db3.zstd");
  EXPECT_EQ(all_items(*bag), items);
  EXPECT_EQ(bag->reports()[0].bytes, whole.size());
  EXPECT_EQ(bag->reports()[0].storage, "sqlite3");
  EXPECT_EQ(all_losses(*bag), "");

  write_items(path("plain.mcap"), items, {.compression = McapCompression::none});
  put("a.mcap.zstd", packed(bytes(path("plain.mcap"))));
  const auto both = open_bag({path("a.mcap.zstd"), path("a.db3.zstd")});
  EXPECT_EQ(all_items(*both).size(), 40U);
  EXPECT_EQ(both->reports()[1].messages, 20U);

  auto small = items;
  for (BagItem& item : small) {
    item.data = packed(item.data);
  }
  testing::write_humble(path("messages.db3"), small);
  const auto messages = open("messages.db3");
  EXPECT_EQ(messages->topics()[1].definition->origin, "bundled (Jazzy)");
  EXPECT_EQ(all_items(*messages), items);
  small[4].data.resize(small[4].data.size() - 3);
  testing::write_humble(path("damaged.db3"), small);
  const auto damaged = open("damaged.db3");
  items.erase(items.begin() + 4);
  EXPECT_EQ(all_items(*damaged), items);
  EXPECT_THAT(all_losses(*damaged), HasSubstr("1 messages packed with zstd could not be unpacked"));
  EXPECT_THAT(all_losses(*damaged), HasSubstr("on /joint_states at 1004.000000000 s"));
  EXPECT_EQ(damaged->reports()[0].messages, 19U);
}

TEST_F(Bag, ARecordingThatWasNotClosedIsReadWithItsJournal) {
  const auto items = sample_items(12);
  fs::create_directories(path("open"));
  {
    Sql sql(path("source.db3"));
    sql.run("PRAGMA journal_mode=WAL");
    testing::humble_tables(sql);
    testing::insert_items(sql, items);
    fs::copy_file(path("source.db3"), path("open/a.db3"));
    fs::copy_file(path("source.db3-wal"), path("open/a.db3-wal"));
  }
  const std::string before = bytes(path("open/a.db3")) + bytes(path("open/a.db3-wal"));
  const auto bag = open_bag({path("open/a.db3")});
  EXPECT_EQ(all_items(*bag), items);
  EXPECT_EQ(all_losses(*bag), "");
  EXPECT_EQ(bytes(path("open/a.db3")) + bytes(path("open/a.db3-wal")), before);
  std::size_t beside = 0;
  for (const auto& entry : fs::directory_iterator(path("open"))) {
    beside += entry.exists() ? 1 : 0;
  }
  EXPECT_EQ(beside, 2U);
}

TEST_F(Bag, UnusableFilesAreNamed) {
  const auto error = [&](std::string_view name) { return input_error([&] { (void)open_bag({path(name)}); }); };
  put("text.db3", "this is text\n");
  put("empty.db3", "");
  put("short.db3", std::string_view("SQLite format 3\0\x10", 17));
  put("text.zstd", packed("hello, this is text"));
  EXPECT_THAT(error("text.db3"), HasSubstr("text.db3: at byte 0: is no recording"));
  EXPECT_THAT(error("empty.db3"), HasSubstr("empty.db3: is empty"));
  EXPECT_THAT(error("short.db3"), HasSubstr("short.db3: at byte 17"));
  EXPECT_THAT(error("text.zstd"), HasSubstr("inside the zstd file"));
  EXPECT_THAT(error("none.db3"), HasSubstr("none.db3: no such file"));
  EXPECT_FALSE(is_bag(path("text.db3")));
  EXPECT_FALSE(is_bag(path("text.zstd")));
  EXPECT_FALSE(is_bag(path("none.db3")));
  Sql(path("other.db3"))
      .run("CREATE TABLE people(id INTEGER); CREATE VIEW messages AS SELECT 1; CREATE TABLE topics(x)");
  EXPECT_THAT(error("other.db3"),
              HasSubstr("other.db3: is an SQLite database but no recording: it has the tables 'people'"));
  Sql(path("columns.db3")).run("CREATE TABLE topics(id INTEGER); CREATE TABLE messages(id INTEGER)");
  EXPECT_THAT(error("columns.db3"), HasSubstr("columns.db3: its tables are not those of rosbag2"));
  for (const std::string kind :
       {"VIEW message_definitions AS SELECT 1", "VIRTUAL TABLE message_definitions USING fts4(x)"}) {
    Sql sql(path("view.db3"));
    testing::humble_tables(sql);
    sql.run("CREATE " + kind);
    EXPECT_THAT(error("view.db3"), HasSubstr("view.db3: table message_definitions is a v"));
    fs::remove(path("view.db3"));
  }
  fs::create_directories(path("hollow"));
  EXPECT_THAT(error("hollow"), HasSubstr("hollow: holds no recording"));
  EXPECT_FALSE(is_bag(path("hollow")));
  EXPECT_THROW((void)open_bag({}), InvalidArgument);
  put("mixed", "");
  fs::create_directories(path("two"));
  put("two/a.db3", "");
  put("two/a.mcap", "");
  EXPECT_THAT(error("two"), HasSubstr("holds both"));
}

TEST_F(Bag, AnEmptyRecordingIsNoError) {
  testing::write_humble(path("a.db3"), {});
  const auto bag = open("a.db3");
  EXPECT_EQ(all_items(*bag).size(), 0U);
  EXPECT_EQ(all_losses(*bag), "");
}

TEST_F(Bag, RowsThatAreNoMessagesAreCounted) {
  const auto items = sample_items(6);
  {
    Sql sql(path("a.db3"));
    testing::humble_tables(sql);
    testing::insert_items(sql, items);
    sql.insert(99, 5, "xyz");
    sql.run(
        "INSERT INTO messages (topic_id, timestamp, data) VALUES (1, 'noon', x'00'); "
        "INSERT INTO messages (topic_id, timestamp, data) VALUES (1, 7, 'text'); "
        "INSERT INTO messages (topic_id, timestamp, data) VALUES (1, 9223372036854775807, x'00'); "
        "INSERT INTO messages (topic_id, timestamp, data) VALUES (1, -1, x'00'); "
        "DELETE FROM messages WHERE id = 3");
  }
  const auto bag = open("a.db3");
  EXPECT_EQ(all_items(*bag).size(), 5U);
  EXPECT_THAT(all_losses(*bag), HasSubstr("4 rows are left out"));
  EXPECT_THAT(all_losses(*bag), HasSubstr("1 messages on topic 99 are left out"));
  EXPECT_THAT(all_losses(*bag), HasSubstr("1 row numbers between 1 and 11 are not there"));
}

TEST_F(Bag, NamesWithOddCharactersAreOpened) {
  const auto items = sample_items(3);
  testing::write_humble(path("a b?c#d%41.db3"), items);
  EXPECT_EQ(all_items(*open("a b?c#d%41.db3")), items);
}

}  // namespace
}  // namespace wheelwright::logs::bag_test
