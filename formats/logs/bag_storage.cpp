// SPDX-License-Identifier: Apache-2.0
// Databases of rosbag2's storage "sqlite3": tables topics and messages, since Iron also message_definitions.
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/bag.hpp"
#include "formats/logs/database.hpp"
#include "formats/logs/mcap.hpp"
#include "formats/logs/mcap_format.hpp"
#include "formats/logs/row_log.hpp"

namespace wheelwright::logs::bag {
namespace {

class McapSource final : public Source {
 public:
  McapSource(const std::filesystem::path& path, std::string shown, const SourceOptions& options)
      : reader_(path, {.hashed = options.hashed, .trust = options.trust, .stored = options.stored, .shown = shown}),
        shown_(std::move(shown)) {
    for (const auto& [id, channel] : reader_.channels()) {
      topic_of(id);
    }
  }

  [[nodiscard]] const std::vector<SourceTopic>& topics() const override { return topics_; }

  bool next(BagMessage& message) override {
    McapMessage found;
    while (reader_.next(found)) {
      if (found.log_time >= static_cast<std::uint64_t>(farthest_time)) {
        ++late_;
        continue;
      }
      message = {topic_of(found.channel_id), static_cast<std::int64_t>(found.log_time), found.data};
      ++messages_;
      return true;
    }
    return false;
  }

  void rewind() override {
    reader_.rewind();
    late_ = messages_ = 0;
  }

  [[nodiscard]] BagReport report() const override {
    McapReport own = reader_.report();
    own.path = shown_;
    BagReport report{shown_, "mcap", own.file_size, own.hash, messages_, sentences(own)};
    if (late_ > 0) {
      report.losses.push_back(
          fmt::format("{}: {} messages have a log time of 2^62 ns or more and are left out", shown_, late_));
    }
    return report;
  }

 private:
  std::size_t topic_of(std::uint16_t channel) {
    const auto [place, added] = places_.try_emplace(channel, topics_.size());
    if (added) {
      const McapChannel& own = reader_.channels().at(channel);
      const McapSchema* const schema = reader_.schema_of(own);
      topics_.push_back({own.topic, schema != nullptr ? full_ros_name(schema->name) : "", own.message_encoding,
                         schema != nullptr ? schema->encoding : "", schema != nullptr ? text_of(*schema) : nullptr});
    }
    return place->second;
  }

  std::shared_ptr<const std::string> text_of(const McapSchema& schema) {
    auto& text = texts_[schema.id];
    if (text == nullptr) {
      text = std::make_shared<const std::string>(schema.text);
    }
    return text;
  }

  McapReader reader_;
  std::string shown_;
  std::vector<SourceTopic> topics_;
  std::map<std::uint16_t, std::size_t> places_;
  std::map<std::uint16_t, std::shared_ptr<const std::string>> texts_;  ///< of the schemas
  std::uint64_t late_ = 0;
  std::uint64_t messages_ = 0;
};

}  // namespace

std::unique_ptr<Source> open_mcap(const std::filesystem::path& path, const std::string& shown,
                                  const SourceOptions& options) {
  return std::make_unique<McapSource>(path, shown, options);
}

namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_losses = 1000;
constexpr std::size_t most_unknown = 100;
constexpr std::uint64_t always_stepped = 20'000'000, steps_a_byte = 10;
constexpr std::size_t most_asked = 100;  ///< first messages, each of which may cost a walk through the table
constexpr std::int64_t any_other = std::numeric_limits<std::int64_t>::min();
constexpr const char* from_row =
    "SELECT rowid, topic_id, timestamp, data FROM messages WHERE rowid >= ?1 ORDER BY rowid";

/// A number that hardly any other (row, time) has; sums of it do not depend on the order.
std::uint64_t mixed(std::int64_t row, std::int64_t time) {
  std::uint64_t x = static_cast<std::uint64_t>(row) * 0x9E3779B97F4A7C15ULL ^ static_cast<std::uint64_t>(time);
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

class SqliteSource final : public Source {
 public:
  SqliteSource(const fs::path& path, std::string shown, const SourceOptions& options)
      : shown_(std::move(shown)),
        file_(path, shown_, options.trust),
        database_(file_.path(), shown_, file_.has_journal() ? Database::Mode::recovering : Database::Mode::unchanging) {
    bytes_ = fs::file_size(path);
    read_bytes_ = bytes_;
    for (const char* const ending : {"-wal", "-journal"}) {
      std::error_code none;
      const std::uintmax_t more = fs::file_size(fs::path(path) += ending, none);
      read_bytes_ += none ? 0 : more;
    }
    bound();
    if (options.hashed) {
      mcap::WindowedFile file(path, true);
      file.leave(file.size());
      hash_ = file.hash();
    }
    if (!file_.defect().empty()) {
      lose(file_.defect());
    }
    check_tables();
    check_columns();
    read_topics();
    read_definitions();
    found_ = losses_;
    rewind();
  }

  [[nodiscard]] const std::vector<SourceTopic>& topics() const override { return topics_; }

  bool next(BagMessage& message) override {
    while (!finished_) {
      switch (rows_.step()) {
        case Statement::Result::row:
          if (take(message)) {
            return true;
          }
          break;
        case Statement::Result::done: finish(); break;
        case Statement::Result::failed: resume(database_.error()); break;
      }
    }
    return false;
  }

  void rewind() override {
    bound();
    losses_ = found_;
    messages_ = met_ = sum_ = foreign_ = handed_ = 0;
    unknown_.clear();
    first_row_ = last_row_ = last_time_ = 0;
    damaged_ = !found_.empty();
    finished_ = false;
    begin(std::numeric_limits<std::int64_t>::min());
  }

  [[nodiscard]] BagReport report() const override {
    BagReport report{shown_, "sqlite3", bytes_, hash_, messages_, losses_};
    if (foreign_ > 0) {
      report.losses.push_back(fmt::format(
          "{}: table messages: {} rows are left out, whose topic or time is no integer, whose time is not one "
          "from 0 to 2^62 ns, or whose data are no bytes",
          shown_, foreign_));
    }
    for (const auto& [topic, count] : unknown_) {
      report.losses.push_back(
          fmt::format("{}: table messages: {} messages on {} are left out: it is not in table topics", shown_, count,
                      topic == any_other ? "topics with other numbers" : fmt::format("topic {}", topic)));
    }
    return report;
  }

  [[nodiscard]] std::optional<std::string> first_message(std::size_t topic) override {
    if (++asked_ > most_asked) {
      return std::nullopt;
    }
    std::optional<std::string> message = message_of(topic);
    bound();  // what this took is not taken from reading
    return message;
  }

 private:
  std::optional<std::string> message_of(std::size_t topic) const {
    for (const auto& [id, place] : places_) {
      if (place == topic) {
        Statement statement = database_.prepare("SELECT data FROM messages WHERE topic_id = ?1 LIMIT 1");
        if (statement.ok()) {
          statement.set(1, id);
          if (statement.step() == Statement::Result::row) {
            const auto data = statement.blob(0);
            return data ? std::optional<std::string>(*data) : std::nullopt;
          }
        }
      }
    }
    return std::nullopt;
  }

  /// A row of rosbag2 has more bytes than reading it takes steps.
  void bound() { database_.bound(always_stepped + steps_a_byte * read_bytes_); }

  void lose(std::string what) {
    damaged_ = true;
    if (losses_.size() < most_losses) {
      losses_.push_back(shown_ + ": " + std::move(what));
    }
  }

  void check_tables() {
    Statement tables = database_.prepare("SELECT name FROM sqlite_master WHERE type = 'table' AND rootpage > 0");
    std::vector<std::string> names;
    Statement::Result result = Statement::Result::failed;
    while (tables.ok() && (result = tables.step()) == Statement::Result::row) {
      names.emplace_back(tables.text(0));
    }
    const auto has = [&](const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
    if (has("topics") && has("messages")) {
      defined_ = has("message_definitions");
      if (result == Statement::Result::failed) {
        lose(fmt::format("its list of tables is damaged ({})", database_.error()));
      }
      return;
    }
    if (result == Statement::Result::failed) {
      throw InputError(fmt::format("{}: its list of tables cannot be read ({}): expected a whole SQLite database",
                                   shown_, database_.error()));
    }
    std::transform(names.begin(), names.end(), names.begin(),
                   [](const std::string& name) { return files::shown(name); });
    throw InputError(
        fmt::format("{}: is an SQLite database but no recording: it has {}: expected the tables topics and "
                    "messages, as rosbag2 writes them",
                    shown_, names.empty() ? "no tables" : "the tables " + core::listed(names)));
  }

  /// Reading a table must not compute what its file says.
  void check_columns() {
    for (const char* const table : {"topics", "messages", "message_definitions"}) {
      Statement kind = database_.prepare(fmt::format("PRAGMA main.table_list('{}')", table));
      while (kind.ok() && kind.step() == Statement::Result::row) {
        if (kind.text(2) == "virtual" || kind.text(2) == "view") {
          throw InputError(fmt::format("{}: table {} is a {}: expected a plain table, as rosbag2 writes it", shown_,
                                       table, kind.text(2) == "view" ? "view" : "virtual table"));
        }
      }
      Statement columns = database_.prepare(fmt::format("PRAGMA main.table_xinfo('{}')", table));
      while (columns.ok() && columns.step() == Statement::Result::row) {
        if (columns.integer(6) != 0) {
          throw InputError(
              fmt::format("{}: column {} of table {} is generated: expected plain columns, as rosbag2 "
                          "writes them",
                          shown_, files::shown(std::string(columns.text(1))), table));
        }
      }
    }
  }

  void read_topics() {
    Statement rows = database_.prepare("SELECT id, name, type, serialization_format FROM topics");
    if (!rows.ok() || !database_.prepare(from_row).ok()) {
      throw InputError(
          fmt::format("{}: its tables are not those of rosbag2 ({}): expected topics (id, name, type, "
                      "serialization_format) and messages (id, topic_id, timestamp, data)",
                      shown_, database_.error()));
    }
    Statement::Result result;
    while ((result = rows.step()) == Statement::Result::row) {
      if (places_.try_emplace(rows.integer(0), topics_.size()).second) {
        topics_.push_back(
            {std::string(rows.text(1)), full_ros_name(rows.text(2)), std::string(rows.text(3)), "", nullptr});
      }
    }
    if (result == Statement::Result::failed) {
      lose(fmt::format("table topics is damaged behind its {} first rows ({})", topics_.size(), database_.error()));
    }
  }

  void read_definitions() {
    if (!defined_) {
      return;
    }
    Statement rows =
        database_.prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions");
    struct Definition {
      std::string encoding;
      std::shared_ptr<const std::string> text;
    };
    std::map<std::string, Definition> found;
    Statement::Result result = Statement::Result::failed;
    while (rows.ok() && (result = rows.step()) == Statement::Result::row) {
      found[full_ros_name(rows.text(0))] = {std::string(rows.text(1)),
                                            std::make_shared<const std::string>(rows.text(2))};
    }
    for (SourceTopic& topic : topics_) {
      if (const auto definition = found.find(topic.type); definition != found.end()) {
        topic.schema_encoding = definition->second.encoding;
        topic.schema = definition->second.text;
      }
    }
    if (result == Statement::Result::failed) {
      lose(fmt::format("table message_definitions cannot be read ({})", database_.error()));
    }
  }

  void begin(std::int64_t row) {
    rows_ = {};
    database_.forget();
    rows_ = database_.prepare(from_row);
    if (!rows_.ok()) {
      lose(fmt::format("table messages cannot be read ({})", database_.error()));
      finished_ = true;
      return;
    }
    rows_.set(1, row);
  }

  /// Hands out the row that the statement is at; false where it cannot be used.
  bool take(BagMessage& message) {
    const std::int64_t row = rows_.integer(0);
    if (met_ > 0 && row <= last_row_) {
      resume(fmt::format("row {} comes behind row {}", row, last_row_));
      return false;
    }
    first_row_ = met_ == 0 ? row : first_row_;
    last_row_ = row;
    ++met_;
    const auto data = rows_.blob(3);
    if (!rows_.is_integer(1) || !rows_.is_integer(2) || !data) {
      ++foreign_;
      return false;
    }
    handed_ += data->size();
    if (handed_ > read_bytes_) {
      lose(
          fmt::format("table messages: up to row {} it has more bytes than its file: its rows share them; the rest is "
                      "not read",
                      row));
      finished_ = true;
      return false;
    }
    const std::int64_t time = rows_.integer(2);
    sum_ += mixed(row, time);
    last_time_ = time;
    if (time < 0 || time >= farthest_time) {
      ++foreign_;
      return false;
    }
    const auto topic = places_.find(rows_.integer(1));
    if (topic == places_.end()) {
      ++unknown_[unknown_.size() < most_unknown || unknown_.contains(rows_.integer(1)) ? rows_.integer(1) : any_other];
      return false;
    }
    message = {topic->second, time, *data};
    ++messages_;
    return true;
  }

  /// The first row from `row` on, where there is one that can be read; `failed` where it cannot.
  Statement::Result probe(std::int64_t row, std::int64_t& found) {
    database_.forget();
    Statement statement = database_.prepare(from_row);
    if (!statement.ok()) {
      return Statement::Result::failed;
    }
    statement.set(1, row);
    const auto result = statement.step();
    found = result == Statement::Result::row ? statement.integer(0) : 0;
    return result == Statement::Result::row && found < row ? Statement::Result::failed : result;
  }

  /// Goes on behind a place that cannot be read, at the first row that can, and reports what is between.
  void resume(const std::string& why) {
    rows_ = {};
    const std::string place = met_ == 0 ? std::string("table messages: at its beginning")
                                        : fmt::format("table messages: behind message {} (row {}, time {})", met_,
                                                      last_row_, shown_time(last_time_));
    const std::int64_t before = met_ == 0 ? 0 : last_row_;
    std::int64_t found = 0, unreadable = before, readable = 0;
    bool end = losses_.size() + 1 >= most_losses;
    for (int doubling = 0; !end && readable == 0; ++doubling) {
      const std::int64_t step = std::int64_t{1} << std::min(doubling, 62);
      if (doubling > 62 || before > std::numeric_limits<std::int64_t>::max() - step) {
        end = true;
        break;
      }
      switch (probe(before + step, found)) {
        case Statement::Result::row: readable = before + step; break;
        case Statement::Result::done: end = true; break;
        case Statement::Result::failed: unreadable = before + step; break;
      }
    }
    if (end) {
      lose(fmt::format("{}: {}; nothing behind it can be read", place, why));
      finished_ = true;
      return;
    }
    while (readable - unreadable > 1) {
      const std::int64_t middle = unreadable + (readable - unreadable) / 2;
      (probe(middle, found) == Statement::Result::row ? readable : unreadable) = middle;
    }
    probe(readable, found);
    lose(fmt::format("{}: {}; reading goes on at row {}", place, why, found));
    begin(readable);
  }

  /// Compares what was read with the index of times, which a recording has beside its table.
  void finish() {
    finished_ = true;
    if (damaged_) {
      return;
    }
    const auto rows = static_cast<std::uint64_t>(last_row_ - first_row_) + 1;
    if (met_ > 0 && rows != met_) {
      lose(fmt::format("table messages: {} row numbers between {} and {} are not there: rows were deleted, or lost",
                       rows - met_, first_row_, last_row_));
    }
    Statement index = database_.prepare("SELECT rowid, timestamp FROM messages INDEXED BY timestamp_idx");
    if (!index.ok()) {
      return;
    }
    std::uint64_t count = 0, sum = 0;
    Statement::Result result;
    while ((result = index.step()) == Statement::Result::row && count <= met_) {
      ++count;
      sum += index.is_integer(1) ? mixed(index.integer(0), index.integer(1)) : 0;
    }
    if (result == Statement::Result::failed) {
      lose(fmt::format("its index of times is damaged ({}): the messages were read without it", database_.error()));
    } else if (count != met_ || sum != sum_) {
      lose(fmt::format("its index of times has {} messages, of which {} were read{}: something was changed",
                       count > met_ ? "more" : std::to_string(count), met_, count == met_ ? ", with other times" : ""));
    }
  }

  std::string shown_;
  DatabaseFile file_;
  Database database_;
  std::uint64_t bytes_ = 0;
  std::uint64_t read_bytes_ = 0;  ///< with those of journals
  std::string hash_;
  bool defined_ = false;
  std::vector<SourceTopic> topics_;
  std::size_t asked_ = 0;                       ///< for first messages
  std::map<std::int64_t, std::size_t> places_;  ///< of topics by their id
  std::vector<std::string> found_;              ///< losses that were found on opening

  Statement rows_;
  std::vector<std::string> losses_;
  std::uint64_t messages_ = 0;  ///< handed out
  std::uint64_t met_ = 0;       ///< rows
  std::uint64_t sum_ = 0;       ///< of mixed() over them
  std::uint64_t foreign_ = 0;   ///< rows with columns of other types
  std::uint64_t handed_ = 0;    ///< bytes of all messages
  std::map<std::int64_t, std::uint64_t> unknown_;
  std::int64_t first_row_ = 0, last_row_ = 0, last_time_ = 0;
  bool damaged_ = false;
  bool finished_ = false;
};

}  // namespace

std::unique_ptr<Source> open_sqlite(const fs::path& path, const std::string& shown, const SourceOptions& options) {
  return std::make_unique<SqliteSource>(path, shown, options);
}

}  // namespace wheelwright::logs::bag
