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

#include "commission/commission.hpp"
#include "commission/watch/detector_walk.hpp"
#include "core/error.hpp"
#include "detector/online_model.hpp"
#include "formats/logs/csv.hpp"
#include "identify/least_squares.hpp"
#include "model/filter/row_stream.hpp"
#include "model/sim/simulation.hpp"
#include "tests/benchmarks/bench.hpp"

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
  DoNotOptimize(sum);
}

void read_bare(const RegressionBlock& block) {
  DoNotOptimize(block.Y.sum() + block.dY.sum() + block.y.sum() + block.dy.sum());
}

template <typename Source, typename Block>
void walk(Source& source, Block& block) {
  source.rewind();
  while (source.next(block)) {
    DoNotOptimize(block.t);
  }
}

void against(Form form, const char* name, std::size_t rows, const Work& ours, const char* peer, const Work& theirs) {
  const auto note = [&](double seconds) {
    return fmt::format("{:.0f} ns a row", 1e9 * seconds / static_cast<double>(rows));
  };
  compare(form, {name, rows, 4, 1, peer, note}, ours, theirs, repetitions);
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

void filter_rows(Form form) {
  const World w;
  TableSource log(w.table);
  TorqueRows stream(log, w.filter());
  RegressionBlock block;
  against(
      form, "filter/rows", World::rows, [&] { walk(stream, block); }, "bare read", [&] { read_bare(w.table); });
}

/// The numbers of Y, row by row, and those of y.
void write_raw(const std::filesystem::path& path, const RegressionBlock& rows) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "wb"), &std::fclose);
  if (!file) {
    throw Error(path.string() + ": cannot be written");
  }
  const auto write = [&](const double* from, Eigen::Index count) {
    const auto n = static_cast<std::size_t>(count);
    if (std::fwrite(from, sizeof(double), n, file.get()) != n) {
      throw Error(path.string() + ": cannot be written");
    }
  };
  write(rows.Y.data(), rows.Y.size());
  write(rows.y.data(), rows.y.size());
}

/// Seconds that numpy.linalg.lstsq takes, called a second time, on `rows` as write_raw() wrote them into `data`;
/// nothing where there is no numpy.
std::optional<double> numpy_seconds(const std::filesystem::path& data, const RegressionBlock& rows) {
  const std::string command = fmt::format(
      "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 /usr/bin/python3 -c '"
      "import numpy, time\n"
      "data = numpy.fromfile(\"{0}\")\n"
      "Y = data[:{1} * {2}].reshape({1}, {2})\n"
      "y = data[{1} * {2}:]\n"
      "for _ in range(2):\n"
      "    start = time.perf_counter()\n"
      "    numpy.linalg.lstsq(Y, y, rcond=None)\n"
      "    seconds = time.perf_counter() - start\n"
      "print(seconds)' 2>/dev/null",
      data.string(), rows.Y.rows(), rows.Y.cols());
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> python(popen(command.c_str(), "r"), &pclose);
  double seconds = 0.0;
  if (!python || std::fscanf(python.get(), "%lf", &seconds) != 1) {
    return std::nullopt;
  }
  return seconds;
}

void least_squares_peers(Form form) {
  const World w;
  TableSource log(w.table);
  TorqueRows stream(log, w.filter());
  core::RegressionTable rows(read_all(stream));
  const auto instants = rows.block().instants();
  const auto ours = [&] { DoNotOptimize(least_squares(rows).estimate); };
  const auto measure = [&](const char* peer, const Work& theirs) {
    against(form, "identify/least_squares", instants, ours, peer, theirs);
  };
  measure("bare read", [&] { read_bare(rows.block()); });
  const Eigen::MatrixXd Y = rows.block().Y;
  measure("eigen qr",
          [&] { DoNotOptimize(Eigen::VectorXd(Eigen::HouseholderQR<Eigen::MatrixXd>(Y).solve(rows.block().y))); });
  const Temporary data(".raw");
  write_raw(data.path, rows.block());
  const auto numpy = [&] { return numpy_seconds(data.path, rows.block()); };
  if (numpy()) {
    measure("numpy lstsq", [&] { return numpy().value(); });
  } else {
    fmt::print(stderr, "identify/least_squares: /usr/bin/python3 has no numpy, which is left out\n");
  }
}

void bounds_set(Form form) {
  const World w;
  TableSource log(w.table);
  TorqueRows stream(log, w.filter());
  core::RegressionTable rows(read_all(stream));
  Box prior;
  prior.sides = model::prior_box(w.scenario.robot, w.result.model.model).bounds;
  against(
      form, "bounds/feasible_set", rows.block().instants(), [&] { DoNotOptimize(feasible_set(rows, prior).hull); },
      "bare read", [&] { read_bare(rows.block()); });
}

void detector_step(Form form) {
  const World w;
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
        DoNotOptimize(detector.step(w.table.t[k], sample).fault);
      }
    };
    against(form, name, World::rows, ours, "bare read", [&] { read_bare(w.table); });
  };
  measure("detector/step", {});
  measure("detector/step box", {.set = detector::ParameterSetKind::box});
}

void commission_all(Form form) {
  const World w;
  TableSource log(w.table);
  against(
      form, "commission/all", World::rows, [&] { DoNotOptimize(commission_robot(log, w.scenario.robot).parameters); },
      "bare read", [&] { read_bare(w.table); });
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
    DoNotOptimize(buffer);
  }
}

/// From a file, and from one four times as long: what commissioning holds must not grow with it.
void commission_file(Form form) {
  for (const std::size_t rows : {1000000, 4000000}) {
    const Temporary file(".csv");
    const Scenario scenario = drive(rows);
    write_log(file.path, scenario);
    Usage usage;
    const auto ours = [&] {
      usage = usage_of([&] {
        CsvLog source({file.path});
        DoNotOptimize(commission_robot(source, scenario.robot).parameters);
      });
      return usage.seconds;
    };
    const auto note = [&](double seconds) {
      return fmt::format("{:.1f} MB at the peak, {:.0f} ns a row", usage.megabytes,
                         1e9 * seconds / static_cast<double>(rows));
    };
    compare(
        form, {"commission/file", rows, 4, 1, "bare read of the file", note}, ours,
        [&] { return usage_of([&] { read_file(file.path); }).seconds; }, 1);
  }
}

const bool registered =
    register_bench("filter/rows", filter_rows) && register_bench("identify/least_squares", least_squares_peers) &&
    register_bench("bounds/feasible_set", bounds_set) && register_bench("detector/step", detector_step) &&
    register_bench("commission/all", commission_all) && register_bench("commission/file", commission_file);

}  // namespace
}  // namespace wheelwright::bench::pipeline_bench
