// SPDX-License-Identifier: Apache-2.0
// The cost of every stage from log to decision on the log of the simulated robot, next to a bare read of the same rows;
// least squares next to factorising the whole matrix, in Eigen and in numpy; the memory of commissioning.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <Eigen/QR>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/commission/detector_walk.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/filter/row_stream.hpp>
#include <wheelwright/identify/least_squares.hpp>
#include <wheelwright/logs/csv.hpp>
#include <wheelwright/sim/simulation.hpp>

#include "bench.hpp"

namespace wheelwright::bench::pipeline_bench {
namespace {

constexpr int repetitions = 3;

/// The drive of the examples at 100 Hz, `rows` long.
Scenario drive(std::size_t rows) {
  Scenario s;
  s.robot.wheel_radius = 0.0975;
  s.robot.track_width = 0.381;
  s.robot.hold = Hold::zero_order;
  s.robot.encoder_counts_per_turn = 4096.0;
  s.robot.noise.effort.value = 0.02;
  s.parameters = {.mass = 21.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};
  s.trajectory = {.kind = sim::Trajectory::Kind::commissioning, .speed = 0.6, .yaw_rate = 1.2, .period = 12.0};
  s.rate = 100.0;
  s.duration = static_cast<double>(rows - 1) / s.rate;
  s.sensors.encoder_counts_per_turn = 4096.0;
  s.sensors.effort = 0.02;
  s.sensors.speeds = s.sensors.pose = s.sensors.commands = false;
  return s;
}

/// A path in the directory for temporary files that is gone when this is.
struct Temporary {
  std::filesystem::path path;
  explicit Temporary(std::string_view ending)
      : path(std::filesystem::temp_directory_path() /
             fmt::format("wheelwright-bench-{}{}", std::random_device{}(), ending)) {}
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

void read_bare(const LogTable& table) {
  double sum = 0.0;
  for (const double t : table.t) sum += t;
  for (const auto& column : table.columns) {
    for (const double value : column) sum += value;
  }
  keep(sum);
}

void read_bare(const RegressionBlock& block) { keep(block.Y.sum() + block.dY.sum() + block.y.sum() + block.dy.sum()); }

template <typename Source, typename Block>
void walk(Source& source, Block& block) {
  source.rewind();
  while (source.next(block)) {
    keep(block.t);
  }
}

Measurement against(std::string name, std::size_t rows, int p, const std::function<void()>& ours, std::string peer,
                    const std::function<void()>& theirs) {
  const auto [seconds, peer_seconds] = interleaved_medians(ours, theirs, repetitions);
  return {std::move(name),
          rows,
          p,
          1,
          seconds,
          std::move(peer),
          peer_seconds,
          fmt::format("{:.0f} ns a row", 1e9 * seconds / static_cast<double>(rows))};
}

/// What the stages share: a log in memory, the model commissioned on it, and its filtered rows.
struct World {
  static constexpr std::size_t rows = 1000000;
  Scenario scenario = drive(rows);
  LogTable table = sim::simulate(scenario);
  Commissioning result;

  World() {
    const LogTable learning = core::slice(table, 0, 20000);
    TableSource log(learning);
    result = commission_robot(log, scenario.robot);
  }
  [[nodiscard]] RegressorFilter filter() const {
    return {result.model.model, result.model.filter, result.model.measurement, result.model.errors};
  }
};

std::vector<Measurement> filter_rows() {
  const World w;
  TableSource log(w.table);
  TorqueRows stream(log, w.filter());
  RegressionBlock block;
  return {against(
      "filter/rows", World::rows, 4, [&] { walk(stream, block); }, "bare read", [&] { read_bare(w.table); })};
}

/// Seconds that numpy.linalg.lstsq takes on `rows`, median of `repetitions`; nothing where there is no numpy.
std::optional<double> numpy_seconds(const RegressionBlock& rows) {
  const Temporary data(".raw");
  {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(data.path.c_str(), "wb"), &std::fclose);
    if (!file) {
      throw Error(data.path.string() + ": cannot be written");
    }
    const auto write = [&](const double* from, Eigen::Index count) {
      const auto n = static_cast<std::size_t>(count);
      if (std::fwrite(from, sizeof(double), n, file.get()) != n) {
        throw Error(data.path.string() + ": cannot be written");
      }
    };
    write(rows.Y.data(), rows.Y.size());
    write(rows.y.data(), rows.y.size());
  }
  const std::string command = fmt::format(
      "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 /usr/bin/python3 -c '"
      "import numpy, time\n"
      "data = numpy.fromfile(\"{0}\")\n"
      "Y = data[:{1} * {2}].reshape({1}, {2})\n"
      "y = data[{1} * {2}:]\n"
      "seconds = []\n"
      "for _ in range({3} + 1):\n"
      "    start = time.perf_counter()\n"
      "    numpy.linalg.lstsq(Y, y, rcond=None)\n"
      "    seconds.append(time.perf_counter() - start)\n"
      "print(sorted(seconds[1:])[{3} // 2])' 2>/dev/null",
      data.path.string(), rows.Y.rows(), rows.Y.cols(), repetitions);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> python(popen(command.c_str(), "r"), &pclose);
  double seconds = 0.0;
  if (!python || std::fscanf(python.get(), "%lf", &seconds) != 1) {
    return std::nullopt;
  }
  return seconds;
}

std::vector<Measurement> least_squares_peers() {
  const World w;
  TableSource log(w.table);
  TorqueRows stream(log, w.filter());
  core::RegressionTable rows(read_all(stream));
  const auto instants = rows.block().instants();
  const auto ours = [&] { keep(least_squares(rows).estimate); };
  std::vector<Measurement> result;
  result.push_back(against("identify/least_squares", instants, 4, ours, "bare read", [&] { read_bare(rows.block()); }));
  const Eigen::MatrixXd Y = rows.block().Y;
  result.push_back(against("identify/least_squares", instants, 4, ours, "eigen qr", [&] {
    keep(Eigen::VectorXd(Eigen::HouseholderQR<Eigen::MatrixXd>(Y).solve(rows.block().y)));
  }));
  if (const auto seconds = numpy_seconds(rows.block())) {
    result.push_back(result.back());
    result.back().peer = "numpy lstsq";
    result.back().peer_seconds = *seconds;
  } else {
    fmt::print(stderr, "identify/least_squares: /usr/bin/python3 has no numpy, which is left out\n");
  }
  return result;
}

std::vector<Measurement> bounds_set() {
  const World w;
  TableSource log(w.table);
  TorqueRows stream(log, w.filter());
  core::RegressionTable rows(read_all(stream));
  Box prior;
  prior.sides = model::prior_box(w.scenario.robot, w.result.model.model).bounds;
  return {against(
      "bounds/feasible_set", rows.block().instants(), 4, [&] { keep(feasible_set(rows, prior).hull); }, "bare read",
      [&] { read_bare(rows.block()); })};
}

std::vector<Measurement> detector_step() {
  const World w;
  std::vector<Measurement> result;
  const auto measure = [&](const char* name, detector::DetectorOptions options) {
    Detector detector = make_detector(w.result.model, std::move(options));
    std::vector<const double*> columns;
    for (const auto& column : w.result.model.measurement.columns()) {
      columns.push_back(w.table.column(column).data());
    }
    std::vector<double> sample(columns.size());
    const auto ours = [&] {
      detector.restart();
      for (std::size_t k = 0; k < World::rows; ++k) {
        for (std::size_t c = 0; c < columns.size(); ++c) sample[c] = columns[c][k];
        keep(detector.step(w.table.t[k], sample).fault);
      }
    };
    result.push_back(against(name, World::rows, 4, ours, "bare read", [&] { read_bare(w.table); }));
  };
  measure("detector/step", {});
  measure("detector/step box", {.set = detector::ParameterSetKind::box});
  return result;
}

std::vector<Measurement> commission_all() {
  const World w;
  TableSource log(w.table);
  return {against(
      "commission/all", World::rows, 4, [&] { keep(commission_robot(log, w.scenario.robot).parameters); }, "bare read",
      [&] { read_bare(w.table); })};
}

/// What a child process used.
struct Usage {
  double seconds = 0.0;    ///< of processor time
  double megabytes = 0.0;  ///< of resident memory, at its peak
};

/// A line such as "VmHWM:   1234 kB" of the process's own status, in MB.
double status_megabytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string word;
  double kilobytes = 0.0;
  while (status >> word) {
    if (word == key && status >> kilobytes) {
      return 1.024e-3 * kilobytes;
    }
  }
  throw Error("/proc/self/status has no " + key);
}

/// Does `work` in a process of its own. Memory is what is added to that of a process that does nothing: what this one
/// has left behind is given back first, and the peak is counted anew (proc(5), clear_refs).
Usage usage_of(const std::function<void()>& work) {
  std::fflush(nullptr);
  const Temporary answer(".txt");
  const pid_t child = fork();
  if (child == 0) {
    try {
      malloc_trim(0);
      std::ofstream("/proc/self/clear_refs") << "5";
      const double before = status_megabytes("VmRSS:");
      work();
      std::ofstream(answer.path) << status_megabytes("VmHWM:") - before;
      _exit(0);
    } catch (...) {
      _exit(1);
    }
  }
  int status = 0;
  rusage usage{};
  Usage result;
  if (child < 0 || wait4(child, &status, 0, &usage) != child || status != 0 ||
      !(std::ifstream(answer.path) >> result.megabytes)) {
    throw Error("commission/file: the process that was to be measured failed");
  }
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  result.seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  return result;
}

void write_log(const std::filesystem::path& path, const Scenario& scenario) {
  std::ofstream out(path);
  Simulation log(scenario);
  std::string text = "t";
  for (const auto& name : log.columns()) text += "," + name;
  LogBlock block;
  while (log.next(block)) {
    for (std::size_t k = 0; k < block.rows(); ++k) {
      fmt::format_to(std::back_inserter(text), "\n{}", block.t[k]);
      for (const auto& column : block.columns) fmt::format_to(std::back_inserter(text), ",{}", column[k]);
    }
    out << text;
    text.clear();
  }
  out << '\n';
}

void read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> buffer(std::size_t{1} << 18);
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || file.gcount() > 0) {
    keep(buffer);
  }
}

/// From a file, and from one four times as long: what commissioning holds must not grow with it.
std::vector<Measurement> commission_file() {
  std::vector<Measurement> result;
  for (const std::size_t rows : {1000000, 4000000}) {
    const Temporary file(".csv");
    const Scenario scenario = drive(rows);
    write_log(file.path, scenario);
    const Usage ours = usage_of([&] {
      CsvLog source({file.path});
      keep(commission_robot(source, scenario.robot).parameters);
    });
    const Usage bare = usage_of([&] { read_file(file.path); });
    result.push_back({"commission/file", rows, 4, 1, ours.seconds, "bare read of the file", bare.seconds,
                      fmt::format("{:.1f} MB at the peak, {:.0f} ns a row", ours.megabytes,
                                  1e9 * ours.seconds / static_cast<double>(rows))});
  }
  return result;
}

const bool registered =
    register_bench("filter/rows", filter_rows) && register_bench("identify/least_squares", least_squares_peers) &&
    register_bench("bounds/feasible_set", bounds_set) && register_bench("detector/step", detector_step) &&
    register_bench("commission/all", commission_all) && register_bench("commission/file", commission_file);

}  // namespace
}  // namespace wheelwright::bench::pipeline_bench
