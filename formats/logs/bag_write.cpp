// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/bag_write.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fmt/format.h>

#include "core/check.hpp"
#include "core/error.hpp"
#include "core/words.hpp"
#include "formats/files/bytes.hpp"
#include "formats/logs/bag_files.hpp"
#include "formats/logs/database.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/mcap.hpp"
#include "formats/logs/ros_messages.hpp"

namespace wheelwright::logs {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

constexpr std::int64_t ros_second = 1'000'000'000;

void put(Cdr& to, const RosHeader& header) {
  check::that(header.stamp >= 0 && header.stamp / ros_second <= std::numeric_limits<std::int32_t>::max(),
              "RosHeader::stamp", "a time from 0 to 2^31 s");
  to << static_cast<std::int32_t>(header.stamp / ros_second) << static_cast<std::uint32_t>(header.stamp % ros_second)
     << header.frame_id;
}

void put(Cdr& to, const RosPose& pose) { to << pose.position << pose.orientation; }
void put(Cdr& to, const RosTwist& twist) { to << twist.linear << twist.angular; }

bool lower(char c) { return c >= 'a' && c <= 'z'; }

}  // namespace

struct RosEncoder::Impl {
  FastBuffer buffer;

  /// Bytes of what `fields` puts behind the encapsulation.
  template <typename Fields>
  std::string_view encode(const Fields& fields) {
    for (;;) {
      // The library skips what lies between fields for their alignment: it is 0, not what the memory held.
      const std::size_t size = buffer.getBufferSize();
      std::fill_n(buffer.getBuffer(), size, '\0');
      Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
      cdr.serialize_encapsulation();
      fields(cdr);
      if (buffer.getBufferSize() == size) {
        return {buffer.getBuffer(), cdr.getSerializedDataLength()};
      }
    }
  }

  /// Of what `fields` puts behind the message's header.
  template <typename Message, typename Fields>
  std::string_view encode(const Message& message, const Fields& fields) {
    return encode([&](Cdr& cdr) {
      put(cdr, message.header);
      fields(cdr);
    });
  }
};

RosEncoder::RosEncoder() : impl_(std::make_unique<Impl>()) {}
RosEncoder::~RosEncoder() = default;
RosEncoder::RosEncoder(RosEncoder&&) noexcept = default;
RosEncoder& RosEncoder::operator=(RosEncoder&&) noexcept = default;

std::string_view RosEncoder::encode(const RosJointState& message) {
  return impl_->encode(message,
                       [&](Cdr& to) { to << message.name << message.position << message.velocity << message.effort; });
}

std::string_view RosEncoder::encode(const RosPoseStamped& message) {
  return impl_->encode(message, [&](Cdr& to) { put(to, message.pose); });
}

std::string_view RosEncoder::encode(const RosTwist& message) {
  return impl_->encode([&](Cdr& to) { put(to, message); });
}

std::string_view RosEncoder::encode(const RosTwistStamped& message) {
  return impl_->encode(message, [&](Cdr& to) { put(to, message.twist); });
}

std::string_view RosEncoder::encode(const RosOdometry& message) {
  return impl_->encode(message, [&](Cdr& to) {
    to << message.child_frame_id;
    put(to, message.pose);
    to << message.pose_covariance;
    put(to, message.twist);
    to << message.twist_covariance;
  });
}

std::string_view RosEncoder::encode(const RosImu& message) {
  return impl_->encode(message, [&](Cdr& to) {
    to << message.orientation << message.orientation_covariance << message.angular_velocity
       << message.angular_velocity_covariance << message.linear_acceleration << message.linear_acceleration_covariance;
  });
}

std::string_view RosEncoder::encode(const RosColumns& message) {
  return impl_->encode(message, [&](Cdr& to) {
    for (const double value : message.values) {
      to << value;
    }
  });
}

std::string columns_definition(const std::vector<std::string>& names) {
  std::string text = "std_msgs/Header header\n";
  for (auto name = names.begin(); name != names.end(); ++name) {
    check::that(ros_field_name(*name) == *name && *name != "header" && std::find(names.begin(), name, *name) == name,
                "columns_definition: '" + *name + "'", "a name that ROS accepts for a field, and not there before");
    text += "float64 " + *name + "\n";
  }
  const std::string separator = fmt::format("{:=<80}\n", "");
  return text + separator + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + separator +
         "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
}

std::string ros_field_name(std::string_view name) {
  std::string out;
  for (const char c : name) {
    const char small = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    if (lower(small) || core::is_digit(small)) {
      out += small;
    } else if (!out.empty() && out.back() != '_') {
      out += '_';
    }
  }
  if (!out.empty() && out.back() == '_') {
    out.pop_back();
  }
  return out.empty() ? "column" : lower(out.front()) ? out : "column_" + out;
}

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

  files::FileBeside beside_;  // removed last, when the database is closed
  std::unique_ptr<bag::Database> database_;
  bag::Statement message_;
  std::vector<std::string> types_;
};

/// A directory that is made beside its place.
class DirectoryBeside {
 public:
  explicit DirectoryBeside(fs::path path)
      : path_(free(std::move(path))),
        beside_(fs::path(path_) += ".wheelwright-part", files::Temporary::Kind::directory, path_.string(),
                "a name in an existing, writable directory") {}

  [[nodiscard]] const fs::path& temporary() const { return beside_.path(); }

  void commit() {
    if (const std::string why = beside_.move_to(path_); !why.empty()) {
      throw InputError(fmt::format("{}: cannot be put in its place ({})", path_.string(), why));
    }
  }

 private:
  static fs::path free(fs::path path) {
    std::error_code error;
    if (fs::exists(path, error) && !(fs::is_directory(path, error) && fs::is_empty(path, error))) {
      throw InputError(path.string() +
                       ": is there already: expected a new directory for the recording, or a name in .mcap or .db3");
    }
    return path;
  }

  fs::path path_;
  files::Temporary beside_;
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
    files::atomic_write(impl_->directory->temporary() / "metadata.yaml", bag::metadata_text(impl_->bag));
    impl_->directory->commit();
  }
}

namespace {

constexpr double ns_per_s = 1e9;

class BagLogWriter final : public LogWriter {
 public:
  BagLogWriter(std::filesystem::path path, const std::vector<std::string>& names, const LogWriteOptions& options)
      : path_(std::move(path)),
        names_(names),
        left_(names.size(), true),
        bag_(path_, {.compression = options.compression, .sqlite = false}),
        origin_(std::llround(options.time_origin * ns_per_s)) {
    plan_joints();
    plan_pose();
    plan_imu();
    for (std::size_t c = 0; c < names.size(); ++c) {
      if (left_[c]) {
        others_.push_back(c);
      }
    }
    std::vector<std::string> fields;
    for (const std::size_t c : others_) {
      fields.push_back(ros_field_name(names[c]));
    }
    if (!others_.empty()) {
      columns_topic_ = bag_.add_topic(options.columns_topic, RosColumns::type, columns_definition(fields));
    }
  }

  void write(const LogBlock& block) override {
    check_block(block, names_.size());
    for (std::size_t k = 0; k < block.rows(); ++k) {
      if (!(block.t[k] > -1.0 && block.t[k] < 2e9)) {
        throw InputError(
            fmt::format("{}: time {} s: a recording holds times from 0 to 2e9 s", path_.string(), block.t[k]));
      }
      write_row(block, k, origin_ + std::llround(block.t[k] * ns_per_s));
    }
  }

  void commit() override { bag_.commit(); }

 private:
  std::optional<std::size_t> find(const std::string& name) {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) {
      return std::nullopt;
    }
    return static_cast<std::size_t>(found - names_.begin());
  }

  /// All of `names` as columns that are dealt with, or none of them.
  std::vector<std::size_t> take_all(const std::vector<std::string>& names) {
    std::vector<std::size_t> columns;
    for (const std::string& name : names) {
      if (const auto column = find(name)) {
        columns.push_back(*column);
      }
    }
    if (columns.size() != names.size()) {
      return {};
    }
    for (const std::size_t column : columns) {
      left_[column] = false;
    }
    return columns;
  }

  std::size_t add(const std::string& topic, const std::string& type) {
    return bag_.add_topic(topic, type, ros_definition_text(*bundled_ros_definition(type)));
  }

  void plan_joints() {
    const bool axis = find("position") || find("velocity");
    const std::vector<std::vector<std::string>> arrays =
        axis ? std::vector<std::vector<std::string>>{{"position"}, {"velocity"}, {"effort"}}
             : std::vector<std::vector<std::string>>{{"phi_r", "phi_l"}, {"omega_r", "omega_l"}, {"tau_r", "tau_l"}};
    position_ = take_all(arrays[0]);
    velocity_ = take_all(arrays[1]);
    effort_ = take_all(arrays[2]);
    if (!position_.empty() || !velocity_.empty() || !effort_.empty()) {
      joints_topic_ = add("/joint_states", RosJointState::type);
      joints_.name = axis ? std::vector<std::string>{"axis"} : std::vector<std::string>{"right_wheel", "left_wheel"};
    }
  }

  void plan_pose() {
    pose_ = take_all({"x", "y", "theta"});
    if (!pose_.empty()) {
      pose_topic_ = add("/pose", RosPoseStamped::type);
      pose_message_.header.frame_id = "world";
    }
  }

  void plan_imu() {
    imu_ = take_all({"gyro_z", "accel_x"});
    if (!imu_.empty()) {
      imu_topic_ = add("/imu", RosImu::type);
      imu_message_.header.frame_id = "base_link";
    }
  }

  void write_row(const LogBlock& block, std::size_t row, std::int64_t time) {
    const auto value = [&](std::size_t column) { return block.columns[column][row]; };
    const auto fill = [&](const std::vector<std::size_t>& columns, std::vector<double>& to) {
      to.clear();
      for (const std::size_t column : columns) {
        to.push_back(value(column));
      }
    };
    if (joints_topic_) {
      joints_.header.stamp = time;
      fill(position_, joints_.position);
      fill(velocity_, joints_.velocity);
      fill(effort_, joints_.effort);
      bag_.write(*joints_topic_, time, encoder_.encode(joints_));
    }
    if (pose_topic_) {
      pose_message_.header.stamp = time;
      pose_message_.pose.position = {value(pose_[0]), value(pose_[1]), 0.0};
      const double half = 0.5 * value(pose_[2]);
      pose_message_.pose.orientation = {0.0, 0.0, std::sin(half), std::cos(half)};
      bag_.write(*pose_topic_, time, encoder_.encode(pose_message_));
    }
    if (imu_topic_) {
      imu_message_.header.stamp = time;
      imu_message_.angular_velocity[2] = value(imu_[0]);
      imu_message_.linear_acceleration[0] = value(imu_[1]);
      bag_.write(*imu_topic_, time, encoder_.encode(imu_message_));
    }
    if (columns_topic_) {
      columns_.header.stamp = time;
      fill(others_, columns_.values);
      bag_.write(*columns_topic_, time, encoder_.encode(columns_));
    }
  }

  std::filesystem::path path_;
  std::vector<std::string> names_;
  std::vector<bool> left_;  ///< columns that no message has yet
  BagWriter bag_;
  RosEncoder encoder_;
  std::int64_t origin_;
  std::optional<std::size_t> joints_topic_, pose_topic_, imu_topic_, columns_topic_;
  std::vector<std::size_t> position_, velocity_, effort_, pose_, imu_, others_;
  RosJointState joints_;
  RosPoseStamped pose_message_;
  RosImu imu_message_;
  RosColumns columns_;
};

}  // namespace

std::unique_ptr<LogWriter> create_bag(const std::filesystem::path& path, const std::vector<std::string>& names,
                                      const LogWriteOptions& options) {
  check_column_names(names);
  return std::make_unique<BagLogWriter>(path, names, options);
}

}  // namespace wheelwright::logs
