// SPDX-License-Identifier: Apache-2.0
// Files that are written whole or not at all: what a killed program left is cleared away, what lives is left alone, and
// pipes, devices and links stay what they are.
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/temporary.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::files::temporary_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Temporaries : public testing::ScratchTest {
 protected:
  /// What stands in the directory of the test.
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : fs::directory_iterator(directory_)) {
      all.push_back(entry.path().filename());
    }
    return all;
  }

  /// Runs `work` in a process that is killed afterwards, as a full machine kills.
  template <typename Work>
  static void killed_after(const Work& work) {
    const pid_t child = fork();
    if (child == 0) {
      work();
      kill(getpid(), SIGKILL);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
  }
};

TEST_F(Temporaries, WhatAKilledWriterLeftIsRemovedByTheNext) {
  killed_after([&] {
    auto* file = new AtomicFile(path("log.csv"));
    file->write("half a log");
  });
  ASSERT_EQ(names().size(), 1u);
  EXPECT_FALSE(fs::exists(path("log.csv")));
  atomic_write(path("log.csv"), "a log");
  EXPECT_THAT(names(), ::testing::ElementsAre("log.csv"));
  EXPECT_EQ(bytes(path("log.csv")), "a log");
}

// A simulation that was killed leaves its part under a name that nobody writes again.
TEST_F(Temporaries, WhatAKilledWriterLeftUnderAnotherNameIsRemovedToo) {
  killed_after([&] { (new AtomicFile(path("monday.csv")))->write("half a log"); });
  AtomicFile living(path("tuesday.csv"));
  living.write("Tuesday");
  put("notes.wheelwright-parts", "mine");
  atomic_write(path("wednesday.csv"), "a log");
  living.commit();
  EXPECT_THAT(names(), ::testing::UnorderedElementsAre("tuesday.csv", "wednesday.csv", "notes.wheelwright-parts"));
}

// A recording or a result of many files, of which the next wrote one.
TEST_F(Temporaries, ADirectoryOfAKilledProgramIsRemovedByTheNextFile) {
  const auto make = [&](const std::string& name) {
    return new Temporary(path(name), Temporary::Kind::directory, "it", "room");
  };
  killed_after([&] {
    atomic_write(make("bag.wheelwright-part")->path() / "bag_0.mcap", "half");
    atomic_write(make(".wheelwright-part")->path() / "model.json", "half");
  });
  ASSERT_EQ(names().size(), 2u);
  const std::unique_ptr<Temporary> living(make("other.wheelwright-part"));
  put("other.wheelwright-part0/model.json", "mine");
  fs::create_directories(path("monday/other.wheelwright-part1"));
  atomic_write(path("log.csv"), "a log");
  EXPECT_THAT(names(), ::testing::UnorderedElementsAre("log.csv", "other.wheelwright-part0", "monday"));
  EXPECT_TRUE(fs::exists(path("other.wheelwright-part0/model.json")));
  EXPECT_TRUE(fs::exists(path("monday/other.wheelwright-part1")));
}

TEST_F(Temporaries, ADirectoryOfAKilledProgramIsRemovedByTheNext) {
  const auto make = [&] { return new Temporary(path("copy-"), Temporary::Kind::private_directory, "it", "room"); };
  killed_after([&] { atomic_write(make()->path() / "large.db3", "bytes"); });
  ASSERT_TRUE(fs::exists(path("copy-0/large.db3")));
  const std::unique_ptr<Temporary> next(make());
  EXPECT_EQ(next->path(), path("copy-0"));
  EXPECT_TRUE(fs::is_empty(path("copy-0")));
}

// A directory that was made and has no lock yet looks dead to whoever comes between.
TEST_F(Temporaries, OfProgramsThatMakeThemAtOnceNoneFails) {
  constexpr int kPrograms = 6, kTimes = 1500;
  std::vector<pid_t> children;
  for (int program = 0; program < kPrograms; ++program) {
    children.push_back(fork());
    if (children.back() == 0) {
      bool fails = false;
      for (int k = 0; k < kTimes && !fails; ++k) {
        try {
          const Temporary mine(path("copy-"), Temporary::Kind::private_directory, "it", "room");
          fails = !fs::is_directory(mine.path());
        } catch (const Error&) {
          fails = true;
        }
      }
      _exit(fails ? 1 : 0);
    }
  }
  for (const pid_t child : children) {
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
}

TEST_F(Temporaries, OfWritersThatLiveEachKeepsItsOwn) {
  AtomicFile first(path("log.csv"));
  first.write("first");
  AtomicFile second(path("log.csv"));
  second.write("second");
  EXPECT_EQ(names().size(), 2u);
  first.commit();
  EXPECT_EQ(bytes(path("log.csv")), "first");
  second.commit();
  EXPECT_EQ(bytes(path("log.csv")), "second");
  EXPECT_THAT(names(), ::testing::ElementsAre("log.csv"));
}

// One that failed in the middle left a result without a part of it, and the next run was refused for the rest.
TEST_F(Temporaries, FilesThatBelongTogetherArePutTogether) {
  const auto gather = [&] {
    auto from = std::make_unique<Temporary>(path("gathered"), Temporary::Kind::directory, "it", "room");
    for (const std::string name : {"page.html", "result.json", "rows.csv"}) {
      atomic_write(from->path() / name, "new");
    }
    return from;
  };
  const std::vector<std::string> all = {"page.html", "rows.csv", "result.json"};
  put("rows.csv", "old");
  put("extra.yaml", "old");
  fs::create_directory(path("result.json"));
  EXPECT_THAT(move_together(gather()->path(), directory_, all, {"extra.yaml"}), HasSubstr("result.json: cannot be"));
  EXPECT_THAT(names(), ::testing::UnorderedElementsAre("extra.yaml", "rows.csv", "result.json"));
  EXPECT_EQ(bytes(path("rows.csv")), "old");
  EXPECT_EQ(bytes(path("extra.yaml")), "old");

  fs::remove(path("result.json"));
  EXPECT_EQ(move_together(gather()->path(), directory_, all, {"extra.yaml", "none.yaml"}), "");
  EXPECT_THAT(names(), ::testing::UnorderedElementsAreArray(all));
  EXPECT_EQ(bytes(path("rows.csv")), "new");
}

// Where the names of a directory cannot be brought to disk because it may not be read, what was written stands.
TEST_F(Temporaries, ADirectoryThatMayNotBeReadIsWrittenInto) {
  fs::create_directory(path("drop"));
  fs::permissions(path("drop"), fs::perms::owner_write | fs::perms::owner_exec);
  atomic_write(path("drop/log.csv"), "a log");
  EXPECT_EQ(bytes(path("drop/log.csv")), "a log");
  EXPECT_EQ(sync_directory(path("drop")), "");
  EXPECT_EQ(sync_directory(""), "");
  EXPECT_NE(sync_directory(path("none")), "");
  fs::permissions(path("drop"), fs::perms::owner_all);
}

TEST_F(Temporaries, WhatIsNoFileOfOursIsLeftAlone) {
  ASSERT_EQ(mkfifo(path("log.csv.wheelwright-part0").c_str(), 0600), 0);
  put("somewhere", "dear");
  fs::create_directory(path("folder"));
  put("folder/file", "dear");
  fs::create_symlink(path("somewhere"), path("log.csv.wheelwright-part1"));
  fs::create_directory_symlink(path("folder"), path("log.csv.wheelwright-part2"));
  atomic_write(path("log.csv"), "a log");
  EXPECT_TRUE(fs::is_fifo(path("log.csv.wheelwright-part0")));
  EXPECT_TRUE(fs::is_symlink(path("log.csv.wheelwright-part1")));
  EXPECT_TRUE(fs::is_symlink(path("log.csv.wheelwright-part2")));
  EXPECT_EQ(bytes(path("somewhere")), "dear");
  EXPECT_EQ(bytes(path("folder/file")), "dear");
}

TEST_F(Temporaries, APipeIsWrittenToAndStaysOne) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] {
    const auto source = open_stream(open(path("pipe").c_str(), O_RDONLY), "pipe");
    std::string buffer(4096, '\0');
    while (const std::size_t size = source->read(buffer.data(), buffer.size())) {
      got += buffer.substr(0, size);
    }
  });
  atomic_write(path("pipe"), "rows");
  reader.join();
  EXPECT_EQ(got, "rows");
  EXPECT_TRUE(fs::is_fifo(path("pipe")));
  EXPECT_THAT(testing::input_error([&] { FileBeside file(path("pipe")); }), HasSubstr("pipe: is a pipe or a device"));
}

TEST_F(Temporaries, ADeviceAndAStreamOfOurOwnAreWrittenTo) {
  atomic_write("/dev/null", "gone");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  put("out", "");
  const int out = open(path("out").c_str(), O_WRONLY);
  ASSERT_EQ(write(out, "before ", 7), 7);
  atomic_write("/proc/self/fd/" + std::to_string(out), "the log ");
  ASSERT_EQ(write(out, "after", 5), 5);
  close(out);
  EXPECT_EQ(bytes(path("out")), "before the log after");
}

TEST_F(Temporaries, ALinkStaysOneAndWhatItLeadsToIsReplaced) {
  fs::create_directory(path("data"));
  put("data/log.csv", "old");
  fs::create_symlink("data/log.csv", path("near"));
  fs::create_symlink(path("near"), path("far"));
  atomic_write(path("far"), "new");
  EXPECT_TRUE(fs::is_symlink(path("far")));
  EXPECT_TRUE(fs::is_symlink(path("near")));
  EXPECT_EQ(bytes(path("data/log.csv")), "new");

  fs::create_symlink("data/later.csv", path("dangling"));
  EXPECT_THAT(testing::input_error([&] { atomic_write(path("dangling"), "made"); }), HasSubstr("which is not there"));
  EXPECT_FALSE(fs::exists(path("data/later.csv")));

  fs::create_symlink("loop", path("loop"));
  EXPECT_THAT(testing::input_error([&] { atomic_write(path("loop"), "x"); }), HasSubstr("loop: is a link"));
}

TEST_F(Temporaries, ADirectoryIsLockedForOneOrForThoseWhoShare) {
  using Kind = PathLock::Kind;
  {
    const PathLock alone(directory_, Kind::alone);
    EXPECT_FALSE(alone.taken());
    EXPECT_TRUE(PathLock(directory_, Kind::alone).taken());
    EXPECT_TRUE(PathLock(directory_, Kind::shared).taken());
  }
  {
    const PathLock one(directory_, Kind::shared), other(directory_, Kind::shared);
    EXPECT_FALSE(one.taken() || other.taken());
    EXPECT_TRUE(PathLock(directory_, Kind::alone).taken());
  }
  killed_after([&] { new PathLock(directory_, Kind::alone); });
  EXPECT_FALSE(PathLock(directory_, Kind::alone).taken());
  EXPECT_TRUE(names().empty());

  fs::create_directory(path("out"));
  const PathLock lost(path("out"), Kind::alone);
  EXPECT_FALSE(lost.gone());
  fs::remove(path("out"));
  EXPECT_TRUE(lost.gone());
  EXPECT_FALSE(PathLock(path("out"), Kind::alone).taken()) << "what is not there has no lock";
}

TEST_F(Temporaries, ALineWithoutEndIsRefusedBeforeItFillsTheMemory) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  std::thread writer([&] {
    signal(SIGPIPE, SIG_IGN);
    const std::string piece(65536, '1');
    for (int k = 0; k < 16 && write(ends[1], piece.data(), piece.size()) > 0; ++k) {
    }
    close(ends[1]);
  });
  {
    LineReader lines(open_stream(ends[0], "standard input"), "standard input");
    std::string_view line;
    EXPECT_THAT(testing::input_error([&] { lines.next(line); }),
                HasSubstr("standard input:1: a line of more than 262144 bytes"));
  }
  close(ends[0]);
  writer.join();
}

}  // namespace
}  // namespace wheelwright::files::temporary_test
