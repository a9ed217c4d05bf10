// SPDX-License-Identifier: Apache-2.0
#include "array_log.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <wheelwright/files/bytes.hpp>
#include <wheelwright/logs/row_log.hpp>

#include "arrays.hpp"

namespace wheelwright::python {
namespace {

constexpr const char* kName = "arrays";

// Named columns in somebody else's memory, time first.
struct Columns {
  std::vector<std::string> names, header;  // names: time apart; header: as they were given
  std::vector<std::span<const double>> values;
};

class ArrayWalk final : public logs::RowWalk {
 public:
  // `pick` are the columns to read: the time, then those of `names`.
  ArrayWalk(const Columns& columns, std::vector<std::size_t> pick, const std::vector<std::string>& names,
            double longest_step, logs::LogReport* report)
      : columns_(&columns), pick_(std::move(pick)), cleaner_(names, report), row_(pick_.size()) {
    cleaner_.set_longest_step(longest_step);
    cleaner_.begin_file(std::string(kName) + ", row ");
  }

  bool next(logs::RowOutcome& outcome) override {
    if (k_ == columns_->values.front().size()) {
      return false;
    }
    for (std::size_t c = 0; c < row_.size(); ++c) {
      row_[c] = columns_->values[pick_[c]][k_];
    }
    outcome = cleaner_.clean(row_, k_++);
    return true;
  }
  [[nodiscard]] double t() const override { return cleaner_.t(); }
  [[nodiscard]] const double* values() const override { return row_.data() + 1; }
  void describe(logs::LogFileReport& file) const override {
    files::Xxh64 hash;
    for (const std::size_t c : pick_) {
      hash.update(reinterpret_cast<const char*>(columns_->values[c].data()), columns_->values[c].size_bytes());
      file.bytes += columns_->values[c].size_bytes();
    }
    file.hash = hash.text();
    file.packing = "plain";
    file.header = columns_->header;
  }

 private:
  const Columns* columns_;
  std::vector<std::size_t> pick_;
  logs::RowCleaner cleaner_;
  std::vector<double> row_;
  std::size_t k_ = 0;
};

class ArrayFile final : public logs::RowFile {
 public:
  ArrayFile(std::shared_ptr<std::vector<Doubles>> kept, Columns columns)
      : kept_(std::move(kept)), columns_(std::move(columns)) {}
  [[nodiscard]] std::string path() const override { return kName; }
  [[nodiscard]] const std::vector<std::string>& columns() const override { return columns_.names; }
  [[nodiscard]] std::unique_ptr<logs::RowWalk> open(const std::vector<std::string>& names, double longest_step,
                                                    logs::LogReport* report) override {
    std::vector<std::size_t> pick = {0};
    for (const std::string& name : names) {
      const auto at = std::find(columns_.names.begin(), columns_.names.end(), name);
      pick.push_back(static_cast<std::size_t>(at - columns_.names.begin()) + 1);
    }
    return std::make_unique<ArrayWalk>(columns_, std::move(pick), names, longest_step, report);
  }

 private:
  std::shared_ptr<std::vector<Doubles>> kept_;  // what the columns are views of
  Columns columns_;
};

// The names of `columns` as a CSV header writes them.
std::string header_line(const std::vector<std::string>& names) {
  std::string line;
  for (const std::string& name : names) {
    line += line.empty() ? "\"" : ",\"";
    for (const char c : name) {
      line += c == '"' ? std::string("\"\"") : std::string(1, c);
    }
    line += '"';
  }
  return line;
}

}  // namespace

std::unique_ptr<logs::RecordedLog> array_log(const py::dict& columns, const logs::CsvOptions& options) {
  std::vector<std::string> given;
  std::vector<py::handle> arrays;
  for (const auto& [name, array] : columns) {
    given.push_back(py::cast<std::string>(py::str(name)));
    arrays.push_back(array);
  }
  check::that(!given.empty(), "columns", "at least the time and one column");
  const logs::CsvHeader header = logs::read_csv_header(header_line(given), options, kName);
  std::vector<std::pair<std::size_t, std::string>> order;
  for (const auto& [name, field] : header.found) {
    if (name != "t") {
      order.emplace_back(field, name);
    }
  }
  std::sort(order.begin(), order.end());
  order.insert(order.begin(), {header.found.at("t"), "t"});
  const std::shared_ptr<std::vector<Doubles>> kept(new std::vector<Doubles>, [](std::vector<Doubles>* held) {
    const py::gil_scoped_acquire lock;
    delete held;
  });
  Columns out;
  for (const auto& [field, name] : order) {
    const Doubles array = Doubles::ensure(arrays[field]);
    if (!array) {
      throw py::error_already_set();
    }
    check_shape(array, {kept->empty() ? -1 : kept->front().size()}, "column " + given[field]);
    if (!kept->empty()) {
      out.names.push_back(name);
    }
    out.values.emplace_back(array.data(), static_cast<std::size_t>(array.size()));
    kept->push_back(array);
  }
  out.header = std::move(given);
  std::vector<std::unique_ptr<logs::RowFile>> files;
  files.push_back(std::make_unique<ArrayFile>(kept, std::move(out)));
  const py::gil_scoped_release unlocked;
  return std::make_unique<logs::RowLog>(std::move(files), logs::RowLogOptions{options.block_rows, options.min_rows});
}

}  // namespace wheelwright::python
