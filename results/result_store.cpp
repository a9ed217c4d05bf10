// SPDX-License-Identifier: Apache-2.0
#include "results/result_store.hpp"

#include <cstdint>
#include <system_error>

#include <fmt/format.h>

#include "core/check.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/database.hpp"

namespace wheelwright::results {
namespace {

namespace fs = std::filesystem;
using logs::bag::Database;
using logs::bag::Statement;

constexpr std::int64_t format = 1;
constexpr std::int64_t application = 0x57485231;  // "WHR1", what SQLite's files say of whose they are

// A transaction that is undone where commit() is not reached.
class Transaction {
 public:
  explicit Transaction(Database& database) : database_(database) {}
  ~Transaction() {
    if (!committed_) {
      database_.run("ROLLBACK");
    }
  }
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  [[nodiscard]] bool commit() { return committed_ = database_.run("COMMIT"); }

 private:
  Database& database_;
  bool committed_ = false;
};

}  // namespace

std::string difference(const StoredPlan& there, const StoredPlan& here) {
  const std::map<std::string, std::string> old(there.begin(), there.end());
  const std::map<std::string, std::string> now(here.begin(), here.end());
  std::string text;
  const auto add = [&](const std::string& sentence) { text += (text.empty() ? "" : "; ") + sentence; };
  for (const auto& [name, value] : now) {
    const auto at = old.find(name);
    if (at == old.end()) {
      add(fmt::format("{} is not told there and {} here", name, value));
    } else if (at->second != value) {
      add(fmt::format("{} is {} there and {} here", name, at->second, value));
    }
  }
  for (const auto& [name, value] : old) {
    if (!now.contains(name)) {
      add(fmt::format("{} is {} there and not told here", name, value));
    }
  }
  return text;
}

// The open file.
class SqliteResults::Tables {
 public:
  Tables(const fs::path& file, const StoredPlan& plan, Opening opening)
      : shown_(file.empty() ? "results" : file.string()), database_(file, shown_, Database::Mode::keeping) {
    demand(database_.run("PRAGMA busy_timeout=300; BEGIN EXCLUSIVE"));
    Transaction transaction(database_);
    const std::int64_t tables = number("SELECT count(*) FROM sqlite_master");
    const std::int64_t owner = number("PRAGMA application_id");
    const std::int64_t version = number("PRAGMA user_version");
    if (owner != application && (owner != 0 || tables != 0)) {
      throw InputError(shown_ + ": an SQLite file, but no store of results: give another --out");
    }
    if (tables != 0 && opening == Opening::fresh) {
      demand(database_.run("DROP TABLE IF EXISTS plan; DROP TABLE IF EXISTS results"));
    }
    if (tables == 0 || opening == Opening::fresh) {
      begin(plan);
    } else if (version != format) {
      throw InputError(
          fmt::format("{}: results in format {}: expected {}; give another --out, or --fresh to throw them away",
                      shown_, version, format));
    } else {
      compare(plan);
    }
    demand(transaction.commit());
    // What the system was handed survives the process; the file is sound even without power.
    demand(database_.run("PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL"));
    select_ = prepare("SELECT result FROM results WHERE key=?1");
    insert_ = prepare("INSERT INTO results (key, result) VALUES (?1, ?2) ON CONFLICT DO NOTHING RETURNING 1");
  }

  bool has(std::string_view key) {
    const bool found = look(key);
    select_.reset();
    return found;
  }

  std::optional<std::string> get(std::string_view key) {
    std::optional<std::string> result;
    if (look(key)) {
      result = std::string(select_.blob(0).value_or(""));
    }
    select_.reset();
    return result;
  }

  void put(std::string_view key, std::string_view result, const std::string& from) {
    insert_.set(1, key, true);
    insert_.set(2, result, false);
    const Statement::Result step = insert_.step();
    const bool written = step == Statement::Result::row;
    if (step == Statement::Result::failed) {
      const std::string why = database_.error();
      insert_.reset();
      throw InputError(fmt::format("{}: cannot be written ({}): expected enough room on the disk", shown_, why));
    }
    insert_.reset();
    if (!written && get(key) != result) {
      throw InputError(fmt::format("{}: another result of {} than {}: expected one result for an item", from,
                                   files::shown(key), from == shown_ ? "is there already" : shown_ + " has"));
    }
  }

  void put_all_of(const Tables& other) {
    Statement rows = other.prepare("SELECT key, result FROM results");
    Statement::Result step = rows.step();
    for (; step == Statement::Result::row; step = rows.step()) {
      const std::string key(rows.text(0));
      put(key, rows.blob(1).value_or(""), other.shown_);
    }
    other.demand(step == Statement::Result::done);
  }

  [[nodiscard]] Database& database() { return database_; }
  [[nodiscard]] const std::string& name() const { return shown_; }

  void demand(bool done) const {
    if (done) {
      return;
    }
    if (database_.in_use()) {
      throw InputError(shown_ +
                       ": another process has this store of results open: wait until it has ended, or give "
                       "another --out");
    }
    throw InputError(fmt::format("{}: cannot be used as a store of results ({}): give another --out, or remove it",
                                 shown_, database_.error()));
  }

 private:
  [[nodiscard]] Statement prepare(std::string_view sql) const {
    Statement statement = database_.prepare(sql);
    demand(statement.ok());
    return statement;
  }

  [[nodiscard]] std::int64_t number(std::string_view sql) const {
    Statement statement = prepare(sql);
    demand(statement.step() == Statement::Result::row);
    return statement.integer(0);
  }

  void begin(const StoredPlan& plan) {
    demand(database_.run(
        fmt::format("PRAGMA application_id={}; PRAGMA user_version={};"
                    "CREATE TABLE plan(name TEXT PRIMARY KEY, value TEXT NOT NULL);"
                    "CREATE TABLE results(number INTEGER PRIMARY KEY, key TEXT UNIQUE NOT NULL, result BLOB NOT NULL)",
                    application, format)));
    Statement insert = prepare("INSERT INTO plan (name, value) VALUES (?1, ?2)");
    for (const auto& [name, value] : plan) {
      insert.set(1, name, true);
      insert.set(2, value, true);
      demand(insert.step() == Statement::Result::done);
      insert.reset();
    }
  }

  void compare(const StoredPlan& plan) const {
    StoredPlan there;
    Statement rows = prepare("SELECT name, value FROM plan");
    Statement::Result step = rows.step();
    for (; step == Statement::Result::row; step = rows.step()) {
      const std::string name(rows.text(0));
      there.emplace_back(name, rows.text(1));
    }
    demand(step == Statement::Result::done);
    if (const std::string what = difference(there, plan); !what.empty()) {
      throw InputError(fmt::format(
          "{}: results of another run: {}: expected the same; give another --out, or --fresh to throw them away",
          shown_, what));
    }
  }

  // Leaves select_ at the row.
  bool look(std::string_view key) {
    select_.set(1, key, true);
    const Statement::Result step = select_.step();
    if (step == Statement::Result::failed) {
      const std::string why = database_.error();
      select_.reset();
      throw InputError(fmt::format("{}: cannot be read ({}): give another --out, or remove it", shown_, why));
    }
    return step == Statement::Result::row;
  }

  std::string shown_;
  Database database_;  // closed when its statements are gone
  Statement select_;
  Statement insert_;
};

SqliteResults::SqliteResults(const fs::path& file, const StoredPlan& plan, StoredItems items, Opening opening)
    : file_(file), plan_(plan), items_(std::move(items)) {
  check::that(std::map<std::string, std::string>(plan.begin(), plan.end()).size() == plan.size(), "plan",
              "each name once");
  std::error_code none;
  const bool there = fs::exists(file, none);
  try {
    tables_ = std::make_unique<Tables>(file, plan, opening);
  } catch (const Error&) {
    if (!there && fs::is_regular_file(file, none) && fs::is_empty(file, none)) {
      fs::remove(file, none);
    }
    throw;
  }
}

SqliteResults::~SqliteResults() = default;

bool SqliteResults::has(std::size_t item) { return passing_.contains(item) || tables_->has(items_.key(item)); }

void SqliteResults::put(std::size_t item, std::string_view result) {
  if (items_.passing && items_.passing(item, result)) {
    passing_.emplace(item, result);
  } else {
    tables_->put(items_.key(item), result, tables_->name());
  }
}

std::optional<std::string> SqliteResults::get(std::size_t item) {
  const auto passing = passing_.find(item);
  return passing != passing_.end() ? passing->second : tables_->get(items_.key(item));
}

void SqliteResults::each(const std::function<void(std::size_t, std::string_view)>& take) {
  for (std::size_t item = 0; item < items_.count; ++item) {
    if (const std::optional<std::string> result = get(item)) {
      take(item, *result);
    }
  }
}

void SqliteResults::each_missing(const std::function<void(std::size_t)>& take) {
  for (std::size_t item = 0; item < items_.count; ++item) {
    if (!has(item)) {
      take(item);
    }
  }
}

void SqliteResults::merge(const std::vector<fs::path>& files) {
  tables_->demand(tables_->database().run("BEGIN"));
  Transaction transaction(tables_->database());
  for (const fs::path& file : files) {
    std::error_code error;
    if (!fs::is_regular_file(file, error)) {
      throw InputError(file.string() + ": no such file: expected a store of results");
    }
    tables_->put_all_of(Tables(file, plan_, Opening::resume));
  }
  tables_->demand(transaction.commit());
}

}  // namespace wheelwright::results
