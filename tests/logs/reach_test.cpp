// SPDX-License-Identifier: Apache-2.0
// What a recording may reach: itself, and the files of its directory. It deletes nothing, runs nothing, follows
// nothing.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <hdf5.h>
#include <sqlite3.h>

#include "formats/logs/database.hpp"
#include "formats/logs/log_file.hpp"
#include "tests/logs/bag_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::reach_test {
namespace {

namespace fs = std::filesystem;
using testing::all_items;
using testing::all_losses;
using testing::BagItem;
using testing::sample_items;

/// Fails unless `action` throws an InputError that has each of `parts` in its message.
template <typename Action>
void expect_refusal(const Action& action, const std::vector<std::string>& parts) {
  const std::string message = testing::input_error(action);
  for (const std::string& part : parts) {
    EXPECT_THAT(message, ::testing::HasSubstr(part));
  }
}

class Reach : public testing::ScratchTest {
 protected:
  /// A recording whose last transaction was not finished, with its rollback journal beside it.
  fs::path unfinished() const {
    const fs::path live = path("live.db3"), bag = path("bag.db3");
    testing::write_humble(live, sample_items(40), 512);
    testing::Sql sql(live);
    sql.run("PRAGMA journal_mode=DELETE; PRAGMA cache_size=1; BEGIN IMMEDIATE");
    for (int k = 0; k < 50; ++k) {
      testing::insert_items(sql, sample_items(40));
    }
    fs::copy_file(live, bag);
    fs::copy_file(path("live.db3-journal"), path("bag.db3-journal"));
    sql.run("ROLLBACK");
    return bag;
  }

  /// The end of a journal that says it belongs to a transaction of which `name` is the super-journal.
  static std::string super_journal(const std::string& name) {
    const auto number = [](std::uint32_t value) {
      std::string bytes;
      for (int shift = 24; shift >= 0; shift -= 8) {
        bytes += static_cast<char>(value >> shift & 0xFF);
      }
      return bytes;
    };
    std::uint32_t sum = 0;
    for (const char c : name) {
      sum += static_cast<std::uint32_t>(static_cast<signed char>(c));
    }
    return number(0x40000000U / 512 + 1) + name + number(static_cast<std::uint32_t>(name.size())) + number(sum) +
           std::string("\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", 8);
  }

  static void append(const fs::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary | std::ios::app) << bytes;
  }

  /// A directory with metadata that name `files`.
  fs::path bag_of(const std::vector<std::string>& files) const {
    fs::create_directories(path("bag"));
    std::string text = "rosbag2_bagfile_information:\n  relative_file_paths:\n";
    for (const std::string& file : files) {
      text += "    - " + file + "\n";
    }
    std::ofstream(path("bag/metadata.yaml")) << text;
    return path("bag");
  }
};

TEST_F(Reach, AJournalThatNamesAnotherFileDoesNotDeleteIt) {
  const fs::path bag = unfinished(), victim = put("victim.txt", "dear to somebody");
  append(path("bag.db3-journal"), super_journal(victim.string()));
  const auto reader = open_bag({bag});
  EXPECT_EQ(all_items(*reader), sample_items(40));
  EXPECT_TRUE(fs::exists(victim));
  EXPECT_TRUE(fs::exists(path("bag.db3-journal")));

  // SQLite itself, given the same files, deletes it.
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(bag.c_str(), &database), SQLITE_OK);
  sqlite3_exec(database, "SELECT count(*) FROM messages", nullptr, nullptr, nullptr);
  sqlite3_close(database);
  EXPECT_FALSE(fs::exists(victim));
}

// A store of results is opened for writing where it stands, not as a copy: `fleet --out` with such a journal beside its
// results.sqlite deleted any file.
TEST_F(Reach, AJournalBesideADatabaseOfOursDeletesNothing) {
  const fs::path store = unfinished(), victim = put("victim.txt", "dear to somebody");
  const std::string journal = bytes(path("bag.db3-journal")), before = bytes(store);
  for (const auto mode : {bag::Database::Mode::keeping, bag::Database::Mode::writing}) {
    put("bag.db3-journal", journal + super_journal(victim.string()));
    expect_refusal([&] { (void)bag::Database(store, "store", mode); },
                   {"bag.db3-journal", "names another file", "remove it"});
    EXPECT_TRUE(fs::exists(victim));
    EXPECT_TRUE(fs::exists(path("bag.db3-journal")));
    EXPECT_EQ(bytes(store), before);

    // Also where the database is a link: SQLite looks for journals where it leads.
    fs::create_directories(path("elsewhere"));
    fs::remove(path("elsewhere/link.db3"));
    fs::create_symlink(store, path("elsewhere/link.db3"));
    expect_refusal([&] { (void)bag::Database(path("elsewhere/link.db3"), "store", mode); }, {"bag.db3-journal"});
  }
  // The journal of a killed run names none, and is played back.
  put("bag.db3-journal", journal);
  bag::Database database(store, "store", bag::Database::Mode::keeping);
  bag::Statement count = database.prepare("SELECT count(*) FROM messages");
  ASSERT_EQ(count.step(), bag::Statement::Result::row);
  EXPECT_EQ(count.integer(0), 40);
}

// SQLite empties a journal and writes a log ahead where a link leads.
TEST_F(Reach, AJournalOfADatabaseOfOursIsNoLink) {
  for (const std::string ending : {"-journal", "-wal"}) {
    testing::write_humble(path("store.db3"), sample_items(3));
    const fs::path victim = put("victim.txt", "dear to somebody"), beside = path("store.db3" + ending);
    for (const bool hard : {false, true}) {
      fs::remove(beside);
      hard ? fs::create_hard_link(victim, beside) : fs::create_symlink(victim, beside);
      expect_refusal([&] { (void)bag::Database(path("store.db3"), "store", bag::Database::Mode::keeping); },
                     {"store.db3" + ending, "link"});
      EXPECT_EQ(bytes(victim), "dear to somebody");
    }
    fs::remove(beside);
    fs::remove(path("store.db3"));
  }
}

TEST_F(Reach, AJournalIsNoLinkAndNotWithoutEnd) {
  const fs::path bag = unfinished();
  fs::rename(path("bag.db3-journal"), path("elsewhere"));
  fs::create_symlink(path("elsewhere"), path("bag.db3-journal"));
  expect_refusal([&] { (void)open_bag({bag}); }, {"bag.db3-journal", "is a link", "--trust"});
  EXPECT_EQ(all_items(*open_bag({bag}, {.trust = true})), sample_items(40));

  fs::remove(path("bag.db3-journal"));
  put("bag.db3-wal", "");
  fs::resize_file(path("bag.db3-wal"), std::uintmax_t{1} << 40);
  expect_refusal([&] { (void)open_bag({bag}); }, {"bag.db3-wal", "1099511627776 bytes", "--trust"});
}

TEST_F(Reach, NothingThatADatabaseSaysIsRun) {
  {
    testing::Sql sql(path("generated.db3"));
    sql.run(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,"
        " data BLOB AS (zeroblob(1000000000)));"
        "INSERT INTO topics VALUES (1, '/a', 'std_msgs/msg/Bool', 'cdr'); INSERT INTO messages VALUES (1, 1, 1)");
  }
  expect_refusal([&] { (void)open_bag({path("generated.db3")}); }, {"generated.db3", "data", "messages", "generated"});
  {
    testing::Sql sql(path("virtual.db3"));
    sql.run(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
        "CREATE VIRTUAL TABLE messages USING rtree_i32(id, topic_id, timestamp)");
  }
  expect_refusal([&] { (void)open_bag({path("virtual.db3")}); }, {"virtual.db3", "messages"});
}

TEST_F(Reach, MetadataStayInTheirDirectory) {
  const auto items = sample_items(12), secret = sample_items(5);
  const fs::path bag = bag_of({"../outside/secret.db3", "own.db3"});
  fs::create_directories(path("outside"));
  testing::write_humble(path("outside/secret.db3"), secret);
  testing::write_humble(path("bag/own.db3"), items);
  const auto reader = open_bag({bag});
  EXPECT_EQ(all_items(*reader), items);
  EXPECT_THAT(all_losses(*reader), ::testing::HasSubstr("secret.db3"));

  bag_of({path("outside/secret.db3").string(), "own.db3"});
  EXPECT_EQ(all_items(*open_bag({bag})), items);
  bag_of({"inside/../../outside/secret.db3", "own.db3"});
  fs::create_directories(path("bag/inside"));
  EXPECT_EQ(all_items(*open_bag({bag})), items);
}

TEST_F(Reach, LinksStayInTheirDirectory) {
  const auto items = sample_items(12);
  fs::create_directories(path("outside"));
  testing::write_humble(path("outside/secret.db3"), items);
  const fs::path bag = bag_of({"own.db3"});
  fs::create_symlink(path("outside/secret.db3"), path("bag/own.db3"));
  expect_refusal([&] { (void)open_bag({bag}); }, {"own.db3", "link", "secret.db3", "--trust"});
  EXPECT_EQ(all_items(*open_bag({bag}, {.trust = true})), items);
  fs::remove(path("bag/metadata.yaml"));
  expect_refusal([&] { (void)open_bag({bag}); }, {"own.db3", "link"});

  // A link to the directory, and one within it, lead nowhere else.
  fs::remove(path("bag/own.db3"));
  fs::rename(path("outside/secret.db3"), path("bag/real.db3"));
  bag_of({"own.db3"});
  fs::create_symlink("real.db3", path("bag/own.db3"));
  fs::create_directory_symlink(path("bag"), path("linked"));
  EXPECT_EQ(all_items(*open_bag({path("linked")})), items);
}

TEST_F(Reach, AFileNamedOftenIsReadOnce) {
  const auto items = sample_items(12);
  const fs::path bag = bag_of({"own.db3", "own.db3", "./own.db3"});
  testing::write_humble(path("bag/own.db3"), items);
  const auto reader = open_bag({bag});
  EXPECT_EQ(all_items(*reader), items);
  EXPECT_THAT(all_losses(*reader), ::testing::HasSubstr("read once"));
}

TEST_F(Reach, ARecordingOfTenThousandTopicsIsNone) {
  {
    testing::Sql sql(path("topics.db3"));
    sql.run(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
        "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n WHERE k <= 10000)"
        " INSERT INTO topics SELECT k, '/t' || k, 'a/msg/B', 'cdr' FROM n");
  }
  expect_refusal([&] { (void)open_bag({path("topics.db3")}); }, {"topics.db3", "more than 10000 topics"});
}

// A message that names all topics had 50 MB.
TEST_F(Reach, ATopicWithoutEndIsNone) {
  for (const std::string column : {"name", "type"}) {
    const fs::path file = path(column + ".db3");
    testing::write_humble(file, sample_items(3));
    EXPECT_EQ(all_items(*open_bag({file})), sample_items(3));
    testing::Sql(file).run("UPDATE topics SET " + column + " = '/' || hex(zeroblob(2000))");
    expect_refusal([&] { (void)open_bag({file}); }, {column + ".db3", " bytes", "at most 1000"});
  }
}

TEST_F(Reach, APackedRecordingIsKnownByItsContent) {
  // Frames of one byte each, as a hostile or careless writer makes them.
  testing::write_humble(path("plain.db3"), sample_items(3));
  const std::string plain = bytes(path("plain.db3"));
  std::string packed;
  for (std::size_t k = 0; k < 40; ++k) {
    packed += testing::packed(plain.substr(k, 1));
  }
  put("bag.db3.zst", packed + testing::packed(plain.substr(40)));
  EXPECT_TRUE(is_bag(path("bag.db3.zst")));
  EXPECT_EQ(all_items(*open_bag({path("bag.db3.zst")})), sample_items(3));
}

/// A file of HDF5 with times and torques of an axis; `make_speed` adds the speed.
template <typename Make>
void write_hdf5(const fs::path& file, const Make& make_speed) {
  const hid_t opened = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t rows = 50;
  const hid_t space = H5Screate_simple(1, &rows, nullptr);
  std::vector<double> values(rows);
  for (std::size_t k = 0; k < rows; ++k) {
    values[k] = 0.01 * static_cast<double>(k);
  }
  for (const char* const name : {"t", "tau"}) {
    const hid_t dataset = H5Dcreate2(opened, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    H5Dclose(dataset);
  }
  const hid_t how = H5Pcreate(H5P_DATASET_CREATE);
  make_speed(opened, space, how);
  H5Pclose(how);
  H5Sclose(space);
  H5Fclose(opened);
}

TEST_F(Reach, Hdf5StaysInItsFile) {
  const std::string secret(400, 's');
  const fs::path outside = put("secret", secret);
  write_hdf5(path("external.h5"), [&](hid_t file, hid_t space, hid_t how) {
    H5Pset_external(how, outside.c_str(), 0, 400);
    H5Dclose(H5Dcreate2(file, "omega", H5T_IEEE_F64LE, space, H5P_DEFAULT, how, H5P_DEFAULT));
  });
  LogOptions speed;
  speed.map = {{"omega", "omega"}};
  expect_refusal([&] { (void)open_log({path("external.h5")}, speed); },
                 {"external.h5", "omega", "another file", "--trust"});

  write_hdf5(path("other.h5"), [](hid_t file, hid_t space, hid_t how) {
    const hid_t dataset = H5Dcreate2(file, "omega", H5T_IEEE_F64LE, space, H5P_DEFAULT, how, H5P_DEFAULT);
    const std::vector<double> ones(50, 1.0);
    H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, ones.data());
    H5Dclose(dataset);
  });
  write_hdf5(path("virtual.h5"), [&](hid_t file, hid_t space, hid_t how) {
    H5Pset_virtual(how, space, path("other.h5").c_str(), "/omega", space);
    H5Dclose(H5Dcreate2(file, "omega", H5T_IEEE_F64LE, space, H5P_DEFAULT, how, H5P_DEFAULT));
  });
  expect_refusal([&] { (void)open_log({path("virtual.h5")}, speed); }, {"virtual.h5", "omega", "virtual", "--trust"});
  LogOptions trusting = speed;
  trusting.trust = true;
  const auto log = open_log({path("virtual.h5")}, trusting);
  LogBlock block;
  ASSERT_TRUE(log->next(block));
  const auto names = log->columns();
  const auto omega = std::ranges::find(names, std::string("omega")) - names.begin();
  EXPECT_EQ(block.columns.at(static_cast<std::size_t>(omega)).front(), 1.0);
}

TEST_F(Reach, Hdf5WithoutEndIsRefused) {
  LogOptions speed;
  speed.map = {{"omega", "omega"}};
  write_hdf5(path("rows.h5"), [](hid_t file, hid_t, hid_t how) {
    const hsize_t rows = hsize_t{1} << 62, piece = 100;
    H5Pset_chunk(how, 1, &piece);
    const hid_t space = H5Screate_simple(1, &rows, nullptr);
    H5Dclose(H5Dcreate2(file, "omega", H5T_IEEE_F64LE, space, H5P_DEFAULT, how, H5P_DEFAULT));
    H5Sclose(space);
  });
  expect_refusal([&] { (void)open_log({path("rows.h5")}, speed); }, {"rows.h5", "omega", "4611686018427387904"});
  write_hdf5(path("nothing.h5"), [](hid_t file, hid_t space, hid_t how) {
    const hsize_t piece = 10;
    H5Pset_chunk(how, 1, &piece);
    H5Dclose(H5Dcreate2(file, "omega", H5T_IEEE_F64LE, space, H5P_DEFAULT, how, H5P_DEFAULT));
  });
  expect_refusal([&] { (void)open_log({path("nothing.h5")}, speed); }, {"nothing.h5", "omega", "none of which"});
  write_hdf5(path("chunk.h5"), [](hid_t file, hid_t, hid_t how) {
    const hsize_t rows = hsize_t{1} << 27;
    H5Pset_chunk(how, 1, &rows);
    const hid_t space = H5Screate_simple(1, &rows, nullptr);
    H5Dclose(H5Dcreate2(file, "omega", H5T_IEEE_F64LE, space, H5P_DEFAULT, how, H5P_DEFAULT));
    H5Sclose(space);
  });
  expect_refusal([&] { (void)open_log({path("chunk.h5")}, speed); }, {"chunk.h5", "omega", "pieces of 134217728"});

  // The library divides by what a chunk without dimensions has none of.
  write_hdf5(path("sound.h5"), [](hid_t opened, hid_t space, hid_t how) {
    const hsize_t piece = 10;
    H5Pset_chunk(how, 1, &piece);
    const hid_t dataset = H5Dcreate2(opened, "omega", H5T_IEEE_F64LE, space, H5P_DEFAULT, how, H5P_DEFAULT);
    const std::vector<double> ones(50, 1.0);
    H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, ones.data());
    H5Dclose(dataset);
  });
  const std::string sound = bytes(path("sound.h5")), sizes("\x0a\0\0\0\x08\0\0\0", 8);
  const std::size_t layout = sound.find(sizes) - 11;
  ASSERT_EQ(sound.substr(layout, 3), "\x03\x02\x02");  // version 3, chunked, one dimension and the element
  for (const char dimensions : {'\0', '\1'}) {
    std::string changed = sound;
    changed[layout + 2] = dimensions;
    put("flat.h5", changed);
    expect_refusal([&] { (void)open_log({path("flat.h5")}, speed); }, {"flat.h5", "omega", "chunks of 0 dimensions"});
    EXPECT_EQ(open_log({path("flat.h5")})->report().rows, 50u) << "what is not wanted does no harm";
  }

  const hid_t file = H5Fcreate(path("deep.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  hid_t group = file;
  for (int k = 0; k < 200; ++k) {
    const hid_t below = H5Gcreate2(group, "g", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (group != file) {
      H5Gclose(group);
    }
    group = below;
  }
  H5Gclose(group);
  H5Fclose(file);
  expect_refusal([&] { (void)open_log({path("deep.h5")}); }, {"deep.h5", "too deep"});
}

}  // namespace
}  // namespace wheelwright::logs::reach_test
