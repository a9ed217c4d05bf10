// SPDX-License-Identifier: Apache-2.0
// Reading and cleaning a CSV log against reading the same bytes and doing nothing with them.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/logs/csv.hpp"
#include "tests/benchmarks/bench.hpp"
#include "tests/benchmarks/temporary_file.hpp"

namespace wheelwright::bench::csv_bench {
namespace {

constexpr std::size_t rows = 1000000;
constexpr int repetitions = 5;

/// A log of a differential-drive robot at 100 Hz with pose, as loggers print it.
void write_log(const std::filesystem::path& path) {
  files::AtomicFile file(path);
  std::string text = "t,omega_r,omega_l,tau_r,tau_l,x,y,theta\n";
  for (std::size_t k = 0; k < rows; ++k) {
    const double t = 0.01 * static_cast<double>(k);
    text += fmt::format("{:.3f},{:.4f},{:.4f},{:.3f},{:.3f},{:.4f},{:.4f},{:.4f}\n", t, 5.0 * std::sin(0.7 * t),
                        5.0 * std::cos(0.9 * t), 2.0 * std::cos(0.7 * t), 2.0 * std::sin(1.1 * t), std::sin(0.1 * t),
                        std::cos(0.1 * t), std::remainder(0.3 * t, 6.283185307179586));
    if (text.size() > (std::size_t{1} << 20)) {
      file.write(text);
      text.clear();
    }
  }
  file.write(text);
  file.commit();
}

void read_bare(const std::filesystem::path& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) {
    throw Error(path.string() + ": cannot be opened");
  }
  std::setvbuf(file.get(), nullptr, _IONBF, 0);
  std::vector<char> buffer(std::size_t{1} << 18);
  while (std::fread(buffer.data(), 1, buffer.size(), file.get()) > 0) {
    DoNotOptimize(buffer);
  }
}

void walk(LogSource& log) {
  log.rewind();
  LogBlock block;
  double sum = 0.0;
  while (log.next(block)) {
    sum += block.columns.front().front();
  }
  DoNotOptimize(sum);
}

void csv_against_bare_read(Form form) {
  const TemporaryFile file("csv");
  write_log(file.path);
  const double megabytes = 1e-6 * static_cast<double>(std::filesystem::file_size(file.path));
  const auto measure = [&](const char* name, const Work& ours) {
    const auto note = [&](double seconds) { return fmt::format("{:.0f} MB/s", megabytes / seconds); };
    compare(
        form, {name, rows, 0, 1, "bare read", note}, ours, [&] { read_bare(file.path); }, repetitions);
  };
  CsvLog log({file.path});
  measure("logs/csv walk", [&] { walk(log); });
  measure("logs/csv open and walk", [&] {
    CsvLog fresh({file.path});
    walk(fresh);
  });
}

const bool registered = register_bench("logs/csv", csv_against_bare_read);

}  // namespace
}  // namespace wheelwright::bench::csv_bench
