// SPDX-License-Identifier: Apache-2.0
// What a small hostile file may cost: each of these took minutes, or the memory or the disk of the machine. No test
// measures time; each asks for the limit, or for what is not done again.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <hdf5.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "formats/logs/bag_log.hpp"
#include "formats/logs/database.hpp"
#include "formats/logs/hdf5_log.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/mcap_format.hpp"
#include "tests/logs/bag_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::limits_test {
namespace {

namespace fs = std::filesystem;
using mcap::Op;
using testing::all_items;
using testing::all_losses;
using ::testing::HasSubstr;
using testing::input_error;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::packed;
using testing::sample_items;
using ::testing::SizeIs;

constexpr std::size_t mebibyte = std::size_t{1} << 20;

/// A definition of which each type has two fields of the next, `deep` times; the last has `leaf`.
std::string doubled(int deep, const std::string& leaf) {
  std::string text = "T0 a\nT0 b\n";
  for (int k = 0; k < deep; ++k) {
    const std::string next = "T" + std::to_string(k + 1);
    text += "===\nMSG: a/T" + std::to_string(k) + "\n" + (k + 1 < deep ? next + " a\n" + next + " b\n" : leaf);
  }
  return text;
}

std::string many_fields(std::size_t count) {
  std::string text;
  for (std::size_t k = 0; k < count; ++k) {
    text += "float64 x" + std::to_string(k) + "\n";
  }
  return text;
}

/// A message with `size` zeros, as a record.
std::string zeros(std::size_t size, std::size_t channel = 1) {
  return mcap::Bytes()
      .record(Op::message, mcap::Bytes()
                               .u16(static_cast<std::uint16_t>(channel))
                               .u32(0)
                               .u64(1)
                               .u64(1)
                               .raw(std::string(size, '\0'))
                               .str())
      .str();
}

/// A chunk that holds `records`.
std::string chunk(const std::string& records) {
  const std::string small = packed(records);
  return mcap::Bytes()
      .record(Op::chunk,
              mcap::Bytes().u64(0).u64(1).u64(records.size()).u32(0).text("zstd").u64(small.size()).raw(small).str())
      .str();
}

/// A short message on each of the channels 1 to `count`.
std::string one_each(std::size_t count) {
  std::string records;
  for (std::size_t k = 1; k <= count; ++k) {
    records += zeros(8, k);
  }
  return records;
}

/// An MCAP file whose channels 1 to `channels` have one schema.
std::string mcap_file(const std::string& definition, std::size_t channels, const std::string& records) {
  mcap::Bytes bytes;
  bytes.raw(mcap::magic).record(Op::header, mcap::Bytes().text("ros2").text("").str());
  bytes.record(Op::schema, mcap::write_schema({1, "a/msg/T", "ros2msg", definition}));
  for (std::size_t k = 1; k <= channels; ++k) {
    const auto id = static_cast<std::uint16_t>(k);
    bytes.record(Op::channel, mcap::write_channel({id, 1, "/x" + std::to_string(k), "cdr", {}}));
  }
  bytes.raw(records).record(Op::data_end, mcap::Bytes().u32(0).str());
  return bytes.record(Op::footer, mcap::Bytes().u64(0).u64(0).u32(0).str()).raw(mcap::magic).str();
}

class Limits : public testing::ScratchTest {
 protected:
  std::string table(std::size_t rows) const {
    std::string text = "t,omega,tau\n";
    for (std::size_t k = 0; k < rows; ++k) {
      text += std::to_string(0.01 * static_cast<double>(k)) + ",1.5," + std::to_string(k % 7) + "\n";
    }
    return text;
  }
};

TEST(DefinitionLimits, TypesThatDoubleThirtyTimesAreNotWalkedForTheirTexts) {
  for (const std::string leaf : {"wstring w\n", "string s\n"}) {
    const RosDefinition definition = parse_ros_definition("a/msg/Top", doubled(30, leaf));
    EXPECT_THAT(numeric_paths(definition), IsEmpty()) << leaf;
  }
  const RosDefinition texts = parse_ros_definition("a/msg/Top", doubled(30, "string s\n"));
  EXPECT_THAT(input_error([&] { (void)RosExtractor(texts, {}); }), HasSubstr("more than 100000 parts"));

  const RosDefinition numbers = parse_ros_definition("a/msg/Top", doubled(30, "float64 x\n"));
  EXPECT_THAT(numeric_paths(numbers), SizeIs(10'000));
  EXPECT_THAT(numeric_paths(numbers, 3), SizeIs(3));
  const RosDefinition mixed = parse_ros_definition("a/msg/Top", "T0 a\nT0[] b\nfloat64 c\n===\nMSG: a/T0\nstring s\n");
  EXPECT_EQ(numeric_paths(mixed), std::vector<std::string>{"c"});
}

TEST(DefinitionLimits, ADefinitionHasABoundedText) {
  EXPECT_THAT(parse_ros_definition("a/msg/T", many_fields(60'000)).messages.front().fields, SizeIs(60'000));
  EXPECT_THAT(input_error([] { (void)parse_ros_definition("a/msg/T", many_fields(60'000) + "float64 x7\n"); }),
              HasSubstr("line 60001"));
  EXPECT_THAT(input_error([] { (void)parse_ros_definition("a/msg/T", many_fields(90'000)); }),
              HasSubstr("expected at most 1048576"));
  EXPECT_THAT(input_error([] { (void)parse_ros_definition("a/msg/T", "float64 " + std::string(256, 'x')); }),
              HasSubstr("at most 255"));
}

TEST_F(Limits, ADefinitionThatTopicsShareIsParsedOnce) {
  put("shared.mcap", mcap_file(many_fields(100), 50, one_each(50)));
  const auto bag = open_bag({path("shared.mcap")});
  EXPECT_THAT(all_items(*bag), SizeIs(50));
  ASSERT_THAT(bag->topics(), SizeIs(50));
  for (const BagTopic& topic : bag->topics()) {
    EXPECT_EQ(topic.definition, bag->topics().front().definition);
  }
}

TEST_F(Limits, TheNumbersOfARecordingAreNotListedWithoutEnd) {
  put("wide.mcap", mcap_file(many_fields(9000), 20, one_each(20)));
  const auto bag = open_bag({path("wide.mcap")});
  EXPECT_THAT(all_items(*bag), SizeIs(20));
  std::vector<BagTopicView> views;
  for (const BagTopic& topic : bag->topics()) {
    views.push_back({&topic, false, {}, {}});
  }
  CsvOptions options;
  options.map = {{"omega", "/x20.x8999"}};
  const BagChoice choice = choose_bag_columns(views, options, "wide.mcap");
  EXPECT_THAT(choice.header, SizeIs(20'000));
  EXPECT_THAT(choice.notes, ::testing::Contains(HasSubstr("the first 20000 are listed")));
  EXPECT_THAT(choice.sources, SizeIs(1)) << "what is not listed can be read all the same";
}

TEST_F(Limits, AChunkOfNothingIsLeftOut) {
  put("zeros.mcap", mcap_file("float64 x\n", 1, chunk(zeros(40 * mebibyte)) + chunk(zeros(8))));
  const auto bag = open_bag({path("zeros.mcap")});
  EXPECT_THAT(all_items(*bag), SizeIs(1));
  EXPECT_THAT(all_losses(*bag), HasSubstr("expected at most 33554432, or --trust"));
  EXPECT_THAT(all_items(*open_bag({path("zeros.mcap")}, {.trust = true})), SizeIs(2));
}

TEST_F(Limits, ManyChunksOfNothingAreTooMuch) {
  std::string chunks;
  const std::string one = chunk(zeros(8 * mebibyte));
  for (int k = 0; k < 9; ++k) {
    chunks += one;
  }
  put("zeros.mcap", mcap_file("float64 x\n", 1, chunks));
  EXPECT_THAT(input_error([&] { (void)all_items(*open_bag({path("zeros.mcap")})); }),
              ::testing::AllOf(HasSubstr("zeros.mcap: its chunks"), HasSubstr("expected at most 67108864"),
                               HasSubstr("--trust")));
  EXPECT_THAT(all_items(*open_bag({path("zeros.mcap")}, {.trust = true})), SizeIs(9));

  // Packed once more: the limit is that of the file that is there, not of what comes out of it.
  std::string more;
  for (int k = 0; k < 200; ++k) {
    more += one;
  }
  put("again.mcap.zstd", packed(mcap_file("float64 x\n", 1, more)));
  EXPECT_THAT(input_error([&] { (void)all_items(*open_bag({path("again.mcap.zstd")})); }),
              ::testing::AllOf(HasSubstr("again.mcap.zstd (unpacked): its chunks"),
                               HasSubstr("more than 67108864 bytes come out")));
}

TEST_F(Limits, PackedMessagesOfNothing) {
  const auto write = [&](const std::string& name, const std::vector<std::size_t>& sizes) {
    testing::Sql sql(path(name));
    testing::humble_tables(sql);
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      sql.insert(1, static_cast<std::int64_t>(k), packed(std::string(sizes[k], '\0')));
    }
    return path(name);
  };
  const fs::path large = write("large.db3", {40 * mebibyte, 8});
  const auto bag = open_bag({large});
  EXPECT_THAT(all_items(*bag), SizeIs(1));
  EXPECT_THAT(all_losses(*bag),
              ::testing::AllOf(HasSubstr("1 messages packed with zstd"), HasSubstr("32 MiB"), HasSubstr("--trust")));
  EXPECT_THAT(all_items(*open_bag({large}, {.trust = true})), SizeIs(2));

  const fs::path many = write("many.db3", std::vector<std::size_t>(9, 8 * mebibyte));
  EXPECT_THAT(input_error([&] { (void)all_items(*open_bag({many})); }),
              ::testing::AllOf(HasSubstr("many.db3: its messages"), HasSubstr("expected at most 67108864")));
}

TEST_F(Limits, RowsThatShareTheirPagesAreNotReadForEver) {
  constexpr std::size_t large = 480'000, small = large - std::size_t{100} * 4092;  // as much of both stands in the row
  {
    testing::Sql sql(path("sound.db3"));
    sql.run("PRAGMA page_size=4096; PRAGMA journal_mode=OFF");
    testing::humble_tables(sql);
    for (int k = 0; k < 20; ++k) {
      sql.insert(1, 100 + k, std::string(k == 0 ? large : small, static_cast<char>('a' + k)));
    }
  }
  EXPECT_THAT(all_items(*open_bag({path("sound.db3")})), SizeIs(20));
  std::string file = bytes(path("sound.db3"));
  const auto varint = [](std::size_t value) {
    return std::string{static_cast<char>(value >> 14 | 0x80U), static_cast<char>((value >> 7 & 0x7FU) | 0x80U),
                       static_cast<char>(value & 0x7FU)};
  };
  // Rows say how long they are, how long their data are, and behind what they keep of them on which page these go on.
  std::string chain;
  for (std::size_t k = 0; k < 20; ++k) {
    const std::string header = std::string("\x07\0\x09\x01", 4) + varint(12 + 2 * (k > 0 ? small : large));
    const std::size_t at = file.find(header + static_cast<char>(100 + k));
    ASSERT_NE(at, std::string::npos);
    const std::size_t end = file.find_first_not_of(static_cast<char>('a' + k), at + header.size() + 1);
    chain = k == 0 ? file.substr(end, 4) : chain;
    file.replace(at - 4, 3, varint(8 + large));
    file.replace(at + 4, 3, varint(12 + 2 * large));
    file.replace(end, 4, chain);
  }
  put("shared.db3", file);
  const auto shared = open_bag({path("shared.db3")});
  EXPECT_THAT(all_items(*shared), SizeIs(file.size() / large));
  EXPECT_THAT(all_losses(*shared), HasSubstr("more bytes than its file"));
}

TEST_F(Limits, APackedFileThatFillsTheDiskIsRefused) {
  const std::string nothing(80 * mebibyte, '\n');
  testing::write_humble(path("plain.db3"), sample_items(30));
  put("bomb.db3.zstd", packed(bytes(path("plain.db3")) + nothing));
  EXPECT_THAT(input_error([&] { (void)open_bag({path("bomb.db3.zstd")}); }),
              ::testing::AllOf(HasSubstr("bomb.db3.zstd: more than 67108864 bytes come out of its"),
                               HasSubstr("100 times"), HasSubstr("--trust")));
  EXPECT_EQ(all_items(*open_bag({path("bomb.db3.zstd")}, {.trust = true})), sample_items(30));

  put("bomb.csv.zst", packed(table(100)) + packed(nothing));
  LogOptions options;
  EXPECT_THAT(input_error([&] { (void)open_log({path("bomb.csv.zst")}, options); }),
              HasSubstr("bomb.csv.zst: more than 67108864 bytes come out of its"));
  options.trust = true;
  EXPECT_EQ(open_log({path("bomb.csv.zst")}, options)->report().rows, 100u);
}

TEST_F(Limits, AFrameToBeSkippedMayStandBeforeAPackedLog) {
  const std::string skipped("\x53\x2A\x4D\x18\x05\0\0\0hello", 13);
  testing::write_humble(path("plain.db3"), sample_items(30));
  put("a.db3.zstd", skipped + packed(bytes(path("plain.db3"))));
  EXPECT_TRUE(is_bag(path("a.db3.zstd")));
  EXPECT_EQ(all_items(*open_bag({path("a.db3.zstd")})), sample_items(30));
  put("a.csv.zst", skipped + packed(table(100)));
  EXPECT_EQ(open_log({path("a.csv.zst")})->report().rows, 100u);
}

TEST_F(Limits, EveryBitOfAPackedTableCounts) {
  const auto writer = create_log(path("whole.csv.zst"), {"omega", "tau"});
  LogBlock block;
  block.columns.resize(2);
  for (int k = 0; k < 60; ++k) {
    block.t.push_back(0.01 * k);
    block.columns[0].push_back(1.0 / (k + 3));
    block.columns[1].push_back(k % 7);
  }
  writer->write(block);
  writer->commit();
  const auto read = [&](const std::string& name) {
    const auto log = open_log({path(name)});
    LogBlock all;
    EXPECT_TRUE(log->next(all));
    all.columns.push_back(all.t);
    return all.columns;
  };
  const std::string whole = bytes(path("whole.csv.zst"));
  const auto values = read("whole.csv.zst");
  std::size_t told = 0;
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::string changed = whole;
    changed[bit / 8] = static_cast<char>(changed[bit / 8] ^ (1 << bit % 8));
    put("changed.csv.zst", changed);
    try {
      EXPECT_EQ(read("changed.csv.zst"), values) << "bit " << bit;
    } catch (const InputError&) {
      ++told;
    }
  }
  EXPECT_GT(told, 7 * whole.size()) << "of " << 8 * whole.size();
}

TEST_F(Limits, AFileOfHolesIsNoRecording) {
  testing::write_humble(path("bag.db3"), sample_items(30));
  const std::string whole = bytes(path("bag.db3"));
  const auto refusal = [&](const fs::path& file) { return input_error([&] { (void)open_bag({file}); }); };
  for (const std::uintmax_t size : {std::uintmax_t{20} << 30, (std::uintmax_t{20} << 30) + 1}) {
    put("holes.db3", whole);
    fs::resize_file(path("holes.db3"), size);
    EXPECT_THAT(refusal(path("holes.db3")), ::testing::AllOf(HasSubstr("holes.db3: has " + std::to_string(size)),
                                                             HasSubstr("holes"), HasSubstr("--trust")));
  }
  put("bag.db3-wal", "");
  fs::resize_file(path("bag.db3-wal"), 3'900'000'000);
  EXPECT_THAT(refusal(path("bag.db3")), ::testing::AllOf(HasSubstr("bag.db3-wal"), HasSubstr("holes")));
  fs::remove(path("bag.db3-wal"));

  put("dense.db3", whole + std::string(70 * mebibyte, 'x'));
  EXPECT_EQ(all_items(*open_bag({path("dense.db3")})), sample_items(30)) << "what is stored is read, however large";
}

TEST_F(Limits, AReaderOfDatabasesMayReadOnly) {
  testing::write_humble(path("bag.db3"), sample_items(30));
  for (const auto mode : {bag::Database::Mode::unchanging, bag::Database::Mode::recovering}) {
    bag::Database database(path("bag.db3"), "bag.db3", mode);
    EXPECT_TRUE(database.prepare("SELECT id FROM messages").ok());
    for (const char* const sql : {"SELECT zeroblob(1000000000)", "SELECT load_extension('x')", "DELETE FROM messages",
                                  "CREATE TABLE a(b)", "PRAGMA journal_mode=WAL", "PRAGMA writable_schema=OFF"}) {
      EXPECT_FALSE(database.prepare(sql).ok()) << sql;
    }
    EXPECT_FALSE(database.run("ATTACH '" + path("other.db3").string() + "' AS other"));
    EXPECT_FALSE(fs::exists(path("other.db3")));
  }
}

TEST_F(Limits, PagesThatLeadToEachOtherEnd) {
  constexpr std::size_t page = 512, depth = 15;
  testing::write_humble(path("bag.db3"), sample_items(30), page);
  std::size_t root = 0;
  {
    testing::Sql sql(path("bag.db3"));
    sql.run(
        "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n WHERE k < 9000)"
        " INSERT INTO topics SELECT 100 + k, '/a topic with a long name that fills its page, number ' || k, 'a/msg/B',"
        " 'cdr', '                                                                            ' FROM n");
    bag::Database database(path("bag.db3"), "bag.db3", bag::Database::Mode::recovering);
    bag::Statement place = database.prepare("SELECT rootpage FROM sqlite_master WHERE tbl_name = 'topics'");
    ASSERT_EQ(place.step(), bag::Statement::Result::row);
    root = static_cast<std::size_t>(place.integer(0));
  }
  std::string file = bytes(path("bag.db3"));
  constexpr char interior = 5;
  const auto cells = [&](std::size_t number) {  // and the pointer that stands before them
    const std::size_t at = page * (number - 1);
    std::vector<std::size_t> places = {at + 8};
    const auto word = [&](std::size_t place) {
      return std::size_t{static_cast<unsigned char>(file[place])} << 8 | static_cast<unsigned char>(file[place + 1]);
    };
    for (std::size_t cell = 0; cell < word(at + 3); ++cell) {
      places.push_back(at + word(at + 12 + 2 * cell));
    }
    return places;
  };
  // A row of pages: all that a page leads to becomes the next, and the last leads to one leaf.
  std::vector<std::size_t> pages = {root};
  for (std::size_t number = root + 1; number <= file.size() / page && pages.size() < depth; ++number) {
    if (file[page * (number - 1)] == interior && cells(number).size() > 10) {
      pages.push_back(number);
    }
  }
  ASSERT_THAT(pages, SizeIs(depth));
  for (std::size_t k = 0; k < depth; ++k) {
    const std::string next = k + 1 < depth
                                 ? mcap::Bytes().u32(__builtin_bswap32(static_cast<std::uint32_t>(pages[k + 1]))).str()
                                 : file.substr(cells(pages[k]).at(1), 4);
    for (const std::size_t place : cells(pages[k])) {
      file.replace(place, 4, next);
    }
  }
  put("loop.db3", file);
  const auto bag = open_bag({path("loop.db3")});
  EXPECT_EQ(all_items(*bag), std::vector<testing::BagItem>{}) << "topics 1 and 7 are not in that leaf";
  EXPECT_THAT(all_losses(*bag), HasSubstr("table topics is damaged"));
  EXPECT_THAT(all_losses(*bag), HasSubstr("again and again"));
}

TEST_F(Limits, MetadataThatNameManyMissingFiles) {
  fs::create_directories(path("bag"));
  testing::write_humble(path("bag/own.db3"), sample_items(30));
  const auto name_files = [&](std::size_t count) {
    std::string text = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - own.db3\n";
    for (std::size_t k = 0; k < count; ++k) {
      text += "    - missing" + std::to_string(k) + ".db3\n";
    }
    put("bag/metadata.yaml", text);
  };
  name_files(200);
  const auto bag = open_bag({path("bag")});
  EXPECT_EQ(all_items(*bag), sample_items(30));
  EXPECT_THAT(bag->reports().front().losses, SizeIs(11));
  EXPECT_THAT(all_losses(*bag),
              ::testing::AllOf(HasSubstr("missing9.db3"), Not(HasSubstr("missing10.db3")), HasSubstr("190 more")));
  name_files(10'001);
  const auto more = open_bag({path("bag")});
  EXPECT_EQ(all_items(*more), sample_items(30)) << "all files beside it are read";
  EXPECT_THAT(all_losses(*more), HasSubstr("10002 files: expected at most 10000"));
}

TEST_F(Limits, ADefinitionIsAFile) {
  testing::write_humble(path("bag.db3"), sample_items(3));
  testing::Sql(path("bag.db3")).run("INSERT INTO topics VALUES (9, '/own', 'own/msg/Type', 'cdr', '')");
  fs::create_directories(path("own/msg"));
  ASSERT_EQ(mkfifo(path("own/msg/Type.msg").c_str(), 0600), 0);
  const auto why = [&] {
    return open_bag({path("bag.db3")}, {.msg_path = {path("own")}})->topics().at(2).no_definition;
  };
  EXPECT_THAT(why(), HasSubstr("Type.msg: is a pipe or a device"));
  fs::remove(path("own/msg/Type.msg"));
  fs::create_symlink("Type.msg", path("own/msg/Type.msg"));
  EXPECT_THAT(why(), HasSubstr("Type.msg"));
  fs::remove(path("own/msg/Type.msg"));
  put("own/msg/Type.msg", "");
  fs::create_directory_symlink(path("own"), path("own/again"));
  const auto bag = open_bag({path("bag.db3")}, {.msg_path = {path("own")}});
  EXPECT_TRUE(bag->topics().at(2).definition) << bag->topics().at(2).no_definition;
}

/// A file of HDF5 with columns of `rows` values in chunks of `piece`, packed; the first values are written.
void write_columns(const fs::path& file, hsize_t rows, hsize_t piece, hsize_t written) {
  const hid_t opened = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(1, &rows, nullptr), some = H5Screate_simple(1, &written, nullptr);
  const hid_t how = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(how, 1, &piece);
  H5Pset_deflate(how, 1);
  std::vector<double> values(written);
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k] = 0.01 * static_cast<double>(k);
  }
  const hsize_t first = 0;
  H5Sselect_hyperslab(space, H5S_SELECT_SET, &first, nullptr, &written, nullptr);
  for (const char* const name : {"t", "omega", "tau"}) {
    const hid_t dataset = H5Dcreate2(opened, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, how, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite(dataset, H5T_NATIVE_DOUBLE, some, space, H5P_DEFAULT, values.data()), 0);
    H5Dclose(dataset);
  }
  H5Pclose(how);
  H5Sclose(some);
  H5Sclose(space);
  H5Fclose(opened);
}

TEST_F(Limits, ColumnsOfHdf5AreThoseThatWereWritten) {
  const auto refusal = [&] { return input_error([&] { (void)open_log({path("log.h5")}); }); };
  write_columns(path("log.h5"), hsize_t{1} << 31, 1000, 1000);
  EXPECT_THAT(refusal(), ::testing::AllOf(HasSubstr("log.h5"), HasSubstr("2147483648 values in pieces of 1000"),
                                          HasSubstr("--trust")));
  write_columns(path("log.h5"), hsize_t{1} << 31, hsize_t{1} << 21, 1000);
  EXPECT_THAT(refusal(), ::testing::AllOf(HasSubstr("2 columns of 2147483648 rows"),
                                          HasSubstr("expected at most 67108864"), HasSubstr("--trust")));
  write_columns(path("log.h5"), hsize_t{1} << 23, hsize_t{1} << 23, 1000);
  EXPECT_THAT(refusal(), HasSubstr("pieces of 8388608 values: expected at most 33554432 bytes"));
  write_columns(path("log.h5"), 400'000, 200'000, 400'000);
  EXPECT_EQ(open_log({path("log.h5")})->report().rows, 400'000u) << "pieces larger than the library keeps unasked";
}

TEST_F(Limits, AMemberOfHdf5LiesInItsCompound) {
  struct Row {
    double t, omega, tau;
  };
  const hid_t file = H5Fcreate(path("log.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t type = H5Tcreate(H5T_COMPOUND, sizeof(Row));
  H5Tinsert(type, "t", 0, H5T_IEEE_F64LE);
  H5Tinsert(type, "omega", 8, H5T_IEEE_F64LE);
  H5Tinsert(type, "tau", 16, H5T_IEEE_F64LE);
  std::vector<Row> rows(50);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k] = {0.01 * static_cast<double>(k), 1.0, 2.0};
  }
  const hsize_t count = rows.size();
  const hid_t space = H5Screate_simple(1, &count, nullptr);
  const hid_t dataset = H5Dcreate2(file, "log", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  ASSERT_GE(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows.data()), 0);
  H5Dclose(dataset);
  H5Sclose(space);
  H5Tclose(type);
  H5Fclose(file);
  ASSERT_EQ(open_log({path("log.h5")})->report().rows, 50u);

  // The place of tau stands behind its name, which is padded to eight bytes: 16 becomes a place outside of a row.
  const std::string sound = bytes(path("log.h5")), place("tau\0\0\0\0\0\x10\0\0\0", 12);
  const std::size_t at = sound.find(place);
  ASSERT_NE(at, std::string::npos);
  for (const char byte : {'\x11', '\x18', '\x7F'}) {
    for (const std::size_t digit : {std::size_t{0}, std::size_t{3}}) {
      std::string changed = sound;
      changed[at + 8 + digit] = byte;
      put("changed.h5", changed);
      try {
        const auto log = open_log({path("changed.h5")});
        EXPECT_THAT(log->columns(), Not(::testing::Contains("tau")));
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("changed.h5"));
      }
    }
  }
}

// A full disk while writing ended in a segmentation fault: the library closes at exit what it could not write.
TEST_F(Limits, AFullDiskIsAnErrorAlsoForHdf5) {
  const auto fill = [&] {
    const rlimit limit{200'000, 200'000};
    std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      const auto writer = create_hdf5(path("log.h5"), {"omega"});
      LogBlock block;
      block.columns.resize(1);
      unsigned value = 1;
      for (int k = 0; k < 200'000; ++k) {
        value = value * 1664525U + 1013904223U;
        block.t.push_back(value);
        block.columns[0].push_back(1.0 / value);
      }
      for (int k = 0; k < 3; ++k) {
        writer->write(block);
      }
      writer->commit();
    } catch (const InputError& error) {
      std::cerr << error.what() << (files() > 0 ? ", and left what it had" : ", and left nothing") << std::endl;
    }
    fs::remove_all(directory_);
    std::exit(2);
  };
  // In a process of its own, where this test did not use the library before us.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(fill(), ::testing::ExitedWithCode(2), "log.h5: cannot be written.*left nothing");
}

}  // namespace
}  // namespace wheelwright::logs::limits_test
