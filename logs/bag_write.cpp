// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/bag_write.hpp>

#include <algorithm>
#include <limits>
#include <map>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/files/atomic_file.hpp>
#include <wheelwright/logs/bag_database.hpp>
#include <wheelwright/logs/bag_metadata.hpp>
#include <wheelwright/logs/mcap_writer.hpp>

namespace wheelwright {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_topics = std::numeric_limits<std::uint16_t>::max();

/// What a publisher offered, as rosbag2 writes it down: the last 10 messages, reliable, volatile, no deadlines.
constexpr const char* offered_qos =
    "- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n  deadline:\n    sec: 9223372036\n    nsec: "
    "854775807\n"
    "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n  liveliness_lease_duration:\n"
    "    sec: 9223372036\n    nsec: 854775807\n  avoid_ros_namespace_conventions: false";

}  // namespace

class BagWriter::Sink {
 public:
  virtual ~Sink() = default;
  virtual void add_topic(const std::string& name, const std::string& type, const std::string& definition) = 0;
  virtual void write(std::size_t topic, std::int64_t time, std::string_view cdr) = 0;
  virtual void commit() = 0;
};

namespace {

class McapSink final : public BagWriter::Sink {
 public:
  McapSink(const fs::path& path, McapCompression compression)
      : writer_(path, {.compression = compression, .profile = "ros2"}) {}

  void add_topic(const std::string& name, const std::string& type, const std::string& definition) override {
    const auto [place, added] = schemas_.try_emplace({type, definition}, std::uint16_t{0});
    if (added) {
      place->second = writer_.add_schema(type, "ros2msg", definition);
    }
    channels_.push_back({writer_.add_channel(place->second, name, "cdr", {{"offered_qos_profiles", offered_qos}}), 0});
  }

  void write(std::size_t topic, std::int64_t time, std::string_view cdr) override {
    auto& [channel, sequence] = channels_[topic];
    const auto at = static_cast<std::uint64_t>(time);
    writer_.write({channel, sequence++, at, at, cdr});
  }

  void commit() override { writer_.commit(); }

 private:
  McapWriter writer_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> schemas_;
  std::vector<std::pair<std::uint16_t, std::uint32_t>> channels_;  ///< their ids and next sequence numbers
};

/// A database that is written beside its place.
class SqliteSink final : public BagWriter::Sink {
 public:
  explicit SqliteSink(fs::path path)
      : beside_(std::move(path)),
        database_(
            std::make_unique<bag::Database>(beside_.path(), beside_.place().string(), bag::Database::Mode::writing)) {
    demand(database_->run("PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; BEGIN;" + std::string(tables)));
    message_ = database_->prepare("INSERT INTO messages (topic_id, timestamp, data) VALUES (?1, ?2, ?3)");
    demand(message_.ok());
  }

  void add_topic(const std::string& name, const std::string& type, const std::string& definition) override {
    insert(
        "INSERT INTO topics (name, type, serialization_format, offered_qos_profiles, type_description_hash) "
        "VALUES (?1, ?2, ?3, ?4, '')",
        {name, type, "cdr", offered_qos});
    if (std::find(types_.begin(), types_.end(), type) == types_.end()) {
      types_.push_back(type);
      insert(
          "INSERT INTO message_definitions (topic_type, encoding, encoded_message_definition, type_description_hash) "
          "VALUES (?1, ?2, ?3, '')",
          {type, "ros2msg", definition});
    }
  }

  void write(std::size_t topic, std::int64_t time, std::string_view cdr) override {
    message_.reset();
    message_.set(1, static_cast<std::int64_t>(topic) + 1);
    message_.set(2, time);
    message_.set(3, cdr, false);
    demand(message_.step() == bag::Statement::Result::done);
  }

  void commit() override {
    message_ = {};
    demand(database_->run("CREATE INDEX timestamp_idx ON messages (timestamp ASC); COMMIT;"));
    demand(database_->close());
    beside_.put();
  }

 private:
  /// Tables of storage version 4 (Iron), which every distribution reads.
  static constexpr std::string_view tables =
      "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
      "INSERT INTO schema (schema_version, ros_distro) VALUES (4, 'unknown');"
      "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);"
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);"
      "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL, "
      "encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
      "data BLOB NOT NULL);";

  void insert(std::string_view sql, const std::vector<std::string>& texts) {
    bag::Statement statement = database_->prepare(sql);
    demand(statement.ok());
    for (std::size_t k = 0; k < texts.size(); ++k) {
      statement.set(static_cast<int>(k) + 1, texts[k], true);
    }
    demand(statement.step() == bag::Statement::Result::done);
  }

  void demand(bool done) const {
    if (!done) {
      throw InputError(fmt::format("{}: cannot be written ({}): expected enough room on the disk",
                                   beside_.place().string(), database_->error()));
    }
  }

  FileBeside beside_;  // removed last, when the database is closed
  std::unique_ptr<bag::Database> database_;
  bag::Statement message_;
  std::vector<std::string> types_;
};

/// A directory that is made beside its place.
class DirectoryBeside {
 public:
  explicit DirectoryBeside(fs::path path) : path_(std::move(path)) {
    std::error_code error;
    if (fs::exists(path_, error) && !(fs::is_directory(path_, error) && fs::is_empty(path_, error))) {
      throw InputError(path_.string() +
                       ": is there already: expected a new directory for the recording, or a name in .mcap or .db3");
    }
    for (int attempt = 0; attempt < 1000 && !error; ++attempt) {
      temporary_ = path_;
      temporary_ += ".part" + std::to_string(attempt);
      if (fs::create_directory(temporary_, error)) {
        return;
      }
    }
    throw InputError(fmt::format("{}: cannot be made ({}): expected a name in an existing, writable directory",
                                 path_.string(), error.message()));
  }
  ~DirectoryBeside() {
    std::error_code ignored;
    fs::remove_all(temporary_, ignored);
  }
  DirectoryBeside(const DirectoryBeside&) = delete;
  DirectoryBeside& operator=(const DirectoryBeside&) = delete;

  [[nodiscard]] const fs::path& temporary() const { return temporary_; }

  void commit() {
    std::error_code error;
    fs::rename(temporary_, path_, error);
    if (error) {
      throw InputError(fmt::format("{}: cannot be put in its place ({})", path_.string(), error.message()));
    }
  }

 private:
  fs::path path_;
  fs::path temporary_;
};

fs::path without_slash(const fs::path& path) { return path.has_filename() ? path : path.parent_path(); }

}  // namespace

struct BagWriter::Impl {
  Impl(const fs::path& given, BagWriterOptions options) {
    const fs::path path = without_slash(given);
    const bool mcap = path.extension() == ".mcap", sqlite = path.extension() == ".db3";
    fs::path file = path;
    bag.storage = sqlite || (!mcap && options.sqlite) ? "sqlite3" : "mcap";
    if (!mcap && !sqlite) {
      directory = std::make_unique<DirectoryBeside>(path);
      bag.file = fmt::format("{}_0.{}", path.filename().string(), options.sqlite ? "db3" : "mcap");
      file = directory->temporary() / bag.file;
    }
    if (bag.storage == "mcap") {
      sink = std::make_unique<McapSink>(file, options.compression);
    } else {
      sink = std::make_unique<SqliteSink>(file);
    }
  }

  std::unique_ptr<DirectoryBeside> directory;
  bag::WrittenBag bag;
  std::unique_ptr<Sink> sink;
};

BagWriter::BagWriter(const fs::path& path, BagWriterOptions options) : impl_(std::make_unique<Impl>(path, options)) {}
BagWriter::~BagWriter() = default;
BagWriter::BagWriter(BagWriter&&) noexcept = default;
BagWriter& BagWriter::operator=(BagWriter&&) noexcept = default;

std::size_t BagWriter::add_topic(const std::string& name, const std::string& type, const std::string& definition) {
  auto& topics = impl_->bag.topics;
  check::that(topics.size() < most_topics, "BagWriter::add_topic", "at most 65 535 topics");
  impl_->sink->add_topic(name, type, definition);
  topics.push_back({name, type, offered_qos, 0});
  return topics.size() - 1;
}

void BagWriter::write(std::size_t topic, std::int64_t log_time, std::string_view cdr) {
  bag::WrittenBag& bag = impl_->bag;
  if (topic >= bag.topics.size() || log_time < 0) {
    check::that(topic < bag.topics.size(), "BagWriter::write", "a topic that has been added");
    check::that(false, "BagWriter::write", "a time that is not negative");
  }
  impl_->sink->write(topic, log_time, cdr);
  bag.first = bag.messages == 0 ? log_time : std::min(bag.first, log_time);
  bag.last = bag.messages == 0 ? log_time : std::max(bag.last, log_time);
  ++bag.messages;
  ++bag.topics[topic].messages;
}

void BagWriter::commit() {
  impl_->sink->commit();
  if (impl_->directory) {
    atomic_write(impl_->directory->temporary() / "metadata.yaml", bag::metadata_text(impl_->bag));
    impl_->directory->commit();
  }
}

}  // namespace wheelwright
