// SPDX-License-Identifier: Apache-2.0
/// \file
/// Small recordings for tests: databases made with plain SQL, as rosbag2 of several distributions makes them.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <zstd.h>

#include "formats/logs/bag.hpp"
#include "tests/logs/ros_cdr.hpp"

namespace wheelwright::testing {

/// A message of a recording with its own data.
struct BagItem {
  std::string topic;
  std::int64_t time = 0;
  std::string data;

  bool operator==(const BagItem&) const = default;
};

/// Everything that a reader hands out.
inline std::vector<BagItem> all_items(logs::BagReader& reader) {
  std::vector<BagItem> items;
  logs::BagMessage message;
  while (reader.next(message)) {
    items.push_back({reader.topics()[message.topic].name, message.log_time, std::string(message.data)});
  }
  return items;
}

/// Losses according to its reports.
inline std::string all_losses(const logs::BagReader& reader) {
  std::string text;
  for (const logs::BagReport& report : reader.reports()) {
    for (const std::string& loss : report.losses) {
      text += loss + "\n";
    }
  }
  return text;
}

/// Joint states on "/joint_states" and every third time a distance on "/range"; message k at second 1000 + k.
inline std::vector<BagItem> sample_items(std::size_t count) {
  std::vector<BagItem> items;
  for (std::size_t k = 0; k < count; ++k) {
    const std::int64_t time = (1000 + static_cast<std::int64_t>(k)) * 1'000'000'000;
    HandCdr cdr(true);
    cdr.put(static_cast<std::int32_t>(1000 + k)).put(std::uint32_t{1}).put("base");
    if (k % 3 == 2) {
      cdr.put(std::uint8_t{1}).put(0.5F).put(0.1F).put(9.0F).put(static_cast<float>(k)).put(0.25F);
      items.push_back({"/range", time, cdr.str()});
    } else {
      cdr.list(std::vector<std::string>{"left", "right"}).list(std::vector<double>{1.0 * static_cast<double>(k), 2.0});
      cdr.list(std::vector<double>{3.0, 4.0 + static_cast<double>(k)}).list(std::vector<double>{});
      items.push_back({"/joint_states", time, cdr.str()});
    }
  }
  return items;
}

/// `bytes` as a zstd frame.
inline std::string packed(const std::string& bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
  return out;
}

/// A database that is being made.
class Sql {
 public:
  explicit Sql(const std::filesystem::path& path) {
    if (sqlite3_open(path.c_str(), &database_) != SQLITE_OK) {
      throw std::runtime_error("cannot open a database");
    }
  }
  ~Sql() { sqlite3_close(database_); }
  Sql(const Sql&) = delete;
  Sql& operator=(const Sql&) = delete;

  void run(const std::string& sql) {
    if (sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
      throw std::runtime_error(sqlite3_errmsg(database_));
    }
  }
  void insert(std::int64_t topic, std::int64_t time, const std::string& data) {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database_, "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", -1, &statement,
                       nullptr);
    sqlite3_bind_int64(statement, 1, topic);
    sqlite3_bind_int64(statement, 2, time);
    sqlite3_bind_blob(statement, 3, data.data(), static_cast<int>(data.size()), SQLITE_STATIC);
    if (sqlite3_step(statement) != SQLITE_DONE) {
      throw std::runtime_error(sqlite3_errmsg(database_));
    }
    sqlite3_finalize(statement);
  }

 private:
  sqlite3* database_ = nullptr;
};

/// The tables of Humble's storage: no definitions.
inline void humble_tables(Sql& sql) {
  sql.run(
      "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
      "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);"
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT "
      "NOT "
      "NULL, offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB "
      "NOT NULL);"
      "CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
      "INSERT INTO schema VALUES (3, 'humble');"
      "INSERT INTO topics VALUES (1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr', '');"
      "INSERT INTO topics VALUES (7, '/range', 'sensor_msgs/msg/Range', 'cdr', '');");
}

/// Puts messages into a database with humble_tables().
inline void insert_items(Sql& sql, const std::vector<BagItem>& items) {
  for (const BagItem& item : items) {
    sql.insert(item.topic == "/range" ? 7 : 1, item.time, item.data);
  }
}

/// A database as Humble writes it, in pages of `page` bytes.
inline void write_humble(const std::filesystem::path& path, const std::vector<BagItem>& items, int page = 4096) {
  Sql sql(path);
  sql.run("PRAGMA page_size=" + std::to_string(page) + "; PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; BEGIN;");
  humble_tables(sql);
  insert_items(sql, items);
  sql.run("COMMIT");
}

}  // namespace wheelwright::testing
