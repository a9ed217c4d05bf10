// SPDX-License-Identifier: Apache-2.0
#include "results/result_store.hpp"

#include <csignal>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/support/scratch.hpp"

namespace wheelwright::results::result_store_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::input_error;
using Opening = SqliteResults::Opening;

const StoredPlan kPlan = {{"study.yaml", "xxh64:0"}, {"--beta", "40"}};

StoredItems items(std::size_t count, const std::string& before = "robot ") {
  return {count, [before](std::size_t item) { return before + std::to_string(item); }};
}

class ResultStoreTest : public testing::ScratchTest {
 protected:
  using Results = std::vector<std::pair<std::size_t, std::string>>;

  static Results all(SqliteResults& store) {
    Results results;
    store.each([&](std::size_t item, std::string_view text) { results.emplace_back(item, text); });
    return results;
  }

  // What SQLite itself makes of a statement on a file.
  static void run(const std::filesystem::path& file, const char* sql) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
    sqlite3_close(database);
  }

  std::filesystem::path file() const { return path("results.sqlite"); }
};

// A limit of the size of files left a store without a byte, and with it its folder.
TEST_F(ResultStoreTest, OneThatCannotBeBegunLeavesNothing) {
  const pid_t child = fork();
  if (child == 0) {
    const rlimit none{.rlim_cur = 0, .rlim_max = 0};
    std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &none);
    const bool said = !input_error([&] { SqliteResults(file(), kPlan, items(4)); }).empty();
    _exit(said && std::filesystem::is_empty(directory_) ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

// The store is opened where it stands. A journal beside it, as a killed run leaves one, may name a file that SQLite
// deletes when it has played the journal back.
TEST_F(ResultStoreTest, AJournalThatNamesAnotherFileIsRefused) {
  { SqliteResults(file(), kPlan, items(4)).put(3, "three"); }
  const auto victim = put("victim.txt", "dear to somebody");
  put("results.sqlite-journal", victim.string() + std::string("\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", 8));
  EXPECT_THAT(input_error([&] { SqliteResults(file(), kPlan, items(4)); }),
              AllOf(HasSubstr("results.sqlite-journal: names another file"), HasSubstr("remove it")));
  EXPECT_TRUE(std::filesystem::exists(victim));
  std::filesystem::remove(path("results.sqlite-journal"));
  EXPECT_TRUE(SqliteResults(file(), kPlan, items(4)).has(3));
}

TEST_F(ResultStoreTest, GivesBackEveryByteInTheOrderOfItems) {
  const std::string bytes("a\0b\n\xff", 5);
  {
    SqliteResults store(file(), kPlan, items(4));
    store.put(3, bytes);
    store.put(1, "");
    EXPECT_TRUE(store.has(1));
    EXPECT_FALSE(store.has(0));
  }
  EXPECT_EQ(files(), 1U);  // the log is in the file again
  SqliteResults store(file(), kPlan, items(4));
  EXPECT_EQ(all(store), (Results{{1, ""}, {3, bytes}}));
  EXPECT_EQ(store.get(3), bytes);
  EXPECT_EQ(store.get(2), std::nullopt);
  std::vector<std::size_t> missing;
  store.each_missing([&](std::size_t item) { missing.push_back(item); });
  EXPECT_EQ(missing, (std::vector<std::size_t>{0, 2}));
}

TEST_F(ResultStoreTest, WithoutAFileItLeavesNothing) {
  SqliteResults store({}, kPlan, items(2));
  store.put(0, "x");
  EXPECT_EQ(all(store), (Results{{0, "x"}}));
  EXPECT_EQ(files(), 0U);
}

TEST_F(ResultStoreTest, AnItemIsItsKey) {
  {
    SqliteResults store(file(), kPlan, items(3));
    store.put(0, "zero");
    store.put(2, "two");
  }
  // Another one in front, and the last one changed.
  const std::vector<std::string> keys = {"new", "robot 0", "robot 1", "robot 2, other log"};
  SqliteResults store(file(), kPlan, {4, [&](std::size_t item) { return keys[item]; }});
  EXPECT_EQ(all(store), (Results{{1, "zero"}}));
}

TEST_F(ResultStoreTest, OneResultForAKey) {
  SqliteResults store(file(), kPlan, items(2));
  store.put(0, "x");
  store.put(0, "x");
  EXPECT_THAT(input_error([&] { store.put(0, "y"); }), AllOf(HasSubstr("results.sqlite"), HasSubstr("robot 0")));
  EXPECT_EQ(store.get(0), "x");
}

TEST_F(ResultStoreTest, WhatPassesIsThereAndNotKept) {
  StoredItems some = items(2);
  some.passing = [](std::size_t, std::string_view result) { return result.starts_with("for now"); };
  {
    SqliteResults store(file(), kPlan, some);
    store.put(0, "for now");
    store.put(1, "one");
    EXPECT_TRUE(store.has(0));
    EXPECT_EQ(all(store), (Results{{0, "for now"}, {1, "one"}}));
    EXPECT_EQ(store.passing().size(), 1U);
  }
  SqliteResults store(file(), kPlan, some);
  EXPECT_EQ(all(store), (Results{{1, "one"}}));
  store.put(0, "zero");
  EXPECT_EQ(store.get(0), "zero");
}

TEST_F(ResultStoreTest, AnotherPlanIsRefusedAndNamed) {
  { SqliteResults(file(), kPlan, items(2)).put(0, "x"); }
  const StoredPlan reordered = {kPlan[1], kPlan[0]};
  EXPECT_TRUE(SqliteResults(file(), reordered, items(2)).has(0));
  const StoredPlan other = {{"study.yaml", "xxh64:0"}, {"--beta", "30"}, {"--alpha", "10"}};
  EXPECT_THAT(input_error([&] { SqliteResults(file(), other, items(2)); }),
              AllOf(HasSubstr("results.sqlite"), HasSubstr("--beta is 40 there and 30 here"),
                    HasSubstr("--alpha is not told there and 10 here"), HasSubstr("--out"), HasSubstr("--fresh"),
                    ::testing::Not(HasSubstr("study.yaml"))));
  EXPECT_TRUE(SqliteResults(file(), kPlan, items(2)).has(0));  // nothing was changed
  EXPECT_FALSE(SqliteResults(file(), other, items(2), Opening::fresh).has(0));
  EXPECT_THAT(input_error([&] { SqliteResults(file(), kPlan, items(2)); }), HasSubstr("--beta is 30 there"));
  EXPECT_THROW(SqliteResults(file(), {{"a", "1"}, {"a", "1"}}, items(2)), InvalidArgument);
}

TEST_F(ResultStoreTest, ForeignFilesAreLeftAlone) {
  run(file(), "CREATE TABLE t(x); INSERT INTO t VALUES (1)");
  put("text", std::string(5000, 'x'));
  std::filesystem::create_directory(path("directory"));
  for (const char* const name : {"results.sqlite", "text", "directory"}) {
    const std::string before = bytes(path(name));
    for (const Opening opening : {Opening::resume, Opening::fresh}) {
      EXPECT_THAT(input_error([&] { SqliteResults(path(name), kPlan, items(2), opening); }),
                  AllOf(HasSubstr(path(name).string()), ::testing::AnyOf(HasSubstr("--out"), HasSubstr("opened"))));
    }
    EXPECT_EQ(bytes(path(name)), before);
  }
  EXPECT_THAT(input_error([&] { SqliteResults(path("no/such/place"), kPlan, items(2)); }), HasSubstr("no/such/place"));
}

TEST_F(ResultStoreTest, AnotherFormatIsRefused) {
  { SqliteResults(file(), kPlan, items(2)).put(0, "x"); }
  run(file(), "PRAGMA user_version=2");
  EXPECT_THAT(input_error([&] { SqliteResults(file(), kPlan, items(2)); }),
              AllOf(HasSubstr("format 2: expected 1"), HasSubstr("--fresh")));
  EXPECT_FALSE(SqliteResults(file(), kPlan, items(2), Opening::fresh).has(0));
  EXPECT_FALSE(SqliteResults(file(), kPlan, items(2)).has(0));
}

TEST_F(ResultStoreTest, DamageIsAnErrorThatNamesTheFile) {
  {
    SqliteResults store(file(), kPlan, items(200));
    for (std::size_t item = 0; item < 200; ++item) {
      store.put(item, std::string(100, 'x'));
    }
  }
  const std::string sound = bytes(file());
  for (std::size_t from = 0; from + 64 <= sound.size(); from += 512) {
    std::string damaged = sound;
    damaged.replace(from, 64, 64, '\xa5');
    put("results.sqlite", damaged);
    try {
      SqliteResults store(file(), kPlan, items(200));
      store.each([](std::size_t, std::string_view) {});
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("results.sqlite"));
    }
  }
  for (const std::size_t size : {std::size_t{99}, std::size_t{4096}, sound.size() - 4096}) {
    put("results.sqlite", sound.substr(0, size));
    EXPECT_THAT(input_error([&] {
                  SqliteResults store(file(), kPlan, items(200));
                  store.each([](std::size_t, std::string_view) {});
                }),
                HasSubstr("results.sqlite"))
        << size;
  }
}

TEST_F(ResultStoreTest, OneProcessAtATime) {
  SqliteResults store(file(), kPlan, items(2));
  EXPECT_THAT(input_error([&] { SqliteResults(file(), kPlan, items(2)); }),
              AllOf(HasSubstr("results.sqlite"), HasSubstr("another process")));
  EXPECT_THAT(input_error([&] { SqliteResults(file(), kPlan, items(2), Opening::fresh); }),
              HasSubstr("another process"));
  store.put(1, "still mine");
  EXPECT_EQ(store.get(1), "still mine");
}

// A child puts items and tells each behind its put; it is killed while it does.
TEST_F(ResultStoreTest, WhatWasPutIsThereAfterAKill) {
  std::size_t told = 0;
  for (int round = 0; round < 5; ++round) {
    int pipe_ends[2];
    ASSERT_EQ(pipe(pipe_ends), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      close(pipe_ends[0]);
      try {
        SqliteResults store(file(), kPlan, items(1'000'000));
        for (std::size_t item = told; item < 1'000'000; ++item) {
          if (!store.has(item)) {
            store.put(item, std::to_string(item) + std::string(item % 3 == 0 ? 6000 : 60, 'x'));
          }
          if (write(pipe_ends[1], &item, sizeof item) != sizeof item) {
            break;
          }
        }
      } catch (...) {
      }
      _exit(1);
    }
    close(pipe_ends[1]);
    std::size_t item = 0;
    for (int k = 0; k < 300 + 41 * round && read(pipe_ends[0], &item, sizeof item) == sizeof item; ++k) {
      told = item;
    }
    kill(child, SIGKILL);
    while (read(pipe_ends[0], &item, sizeof item) == sizeof item) {
      told = item;
    }
    close(pipe_ends[0]);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    SqliteResults store(file(), kPlan, items(1'000'000));
    for (std::size_t k = 0; k <= told; ++k) {
      ASSERT_EQ(store.get(k), std::to_string(k) + std::string(k % 3 == 0 ? 6000 : 60, 'x'));
    }
    EXPECT_FALSE(store.has(told + 2));
  }
  EXPECT_GT(told, 1000U);
}

TEST_F(ResultStoreTest, ShardsMergedAreTheWhole) {
  std::vector<std::filesystem::path> parts;
  for (std::size_t index = 0; index < 7; ++index) {
    parts.push_back(path("shard-" + std::to_string(index)));
    SqliteResults store(parts.back(), kPlan, items(50));
    study::run_work({50, [](std::size_t item) { return std::to_string(item * item); }}, store, {1, {index, 7}, {}});
  }
  SqliteResults whole(file(), kPlan, items(50));
  whole.put(3, "9");  // the same result may be there already
  whole.merge(parts);
  const Results merged = all(whole);
  ASSERT_EQ(merged.size(), 50U);
  for (std::size_t item = 0; item < 50; ++item) {
    EXPECT_EQ(merged[item], std::pair(item, std::to_string(item * item)));
  }
}

TEST_F(ResultStoreTest, AMergeThatFailsChangesNothing) {
  { SqliteResults(path("a"), kPlan, items(3)).put(0, "zero"); }
  {
    SqliteResults b(path("b"), kPlan, items(3));
    b.put(1, "one");
    b.put(0, "another zero");
  }
  { SqliteResults(path("c"), {{"--beta", "1"}}, items(3)).put(2, "two"); }
  SqliteResults whole(file(), kPlan, items(3));
  EXPECT_THAT(input_error([&] {
                whole.merge({path("a"), path("b")});
              }),
              AllOf(HasSubstr(path("b").string()), HasSubstr("robot 0")));
  EXPECT_THAT(input_error([&] {
                whole.merge({path("a"), path("c")});
              }),
              AllOf(HasSubstr(path("c").string()), HasSubstr("--beta is 1 there and 40 here")));
  EXPECT_THAT(input_error([&] { whole.merge({path("a"), path("none")}); }), HasSubstr(path("none").string()));
  EXPECT_FALSE(std::filesystem::exists(path("none")));
  EXPECT_TRUE(all(whole).empty());
  whole.merge({path("a")});
  EXPECT_EQ(all(whole), (Results{{0, "zero"}}));
}

}  // namespace
}  // namespace wheelwright::results::result_store_test
