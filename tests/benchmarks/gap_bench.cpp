// SPDX-License-Identifier: Apache-2.0
// The whole gap diagnosis of a simulated drive with a healthy baseline log, next to what one would write first: least
// squares by Eigen's QR on every row, for every effect at every shape and every pair, with random ten-fold
// cross-validation.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/QR>

#include "gap/diagnose.hpp"
#include "gap/prepared.hpp"
#include "model/sim/simulation.hpp"
#include "tests/benchmarks/bench.hpp"

namespace wheelwright::bench::gap_bench {
namespace {

constexpr double kRate = 200.0;  // Hz
constexpr std::size_t kFolds = 10;

Robot plain_robot() {
  Robot robot;
  robot.wheel_radius = 0.0975;
  robot.track_width = 0.381;
  robot.nominal = {{"mass", 21.0}, {"yaw_inertia", 0.9}, {"viscous_linear", 4.0}, {"viscous_yaw", 0.145}};
  return robot;
}

/// A multi-sine drive with noise on everything, of a robot whose centre of mass lies `ahead` of the axle.
LogTable drive(double duration, double ahead, std::uint64_t seed) {
  Scenario s;
  s.robot = plain_robot();
  if (ahead > 0.0) {
    s.robot.effects = {{"com_longitudinal", {{"a", {ahead, ahead}}}}};
  }
  s.parameters = {.mass = 21.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.145};
  s.trajectory = {.kind = sim::Trajectory::Kind::multi_sine, .speed = 0.8, .yaw_rate = 1.6, .period = 8.0};
  s.duration = duration;
  s.rate = kRate;
  s.sensors.wheel_speed = 0.01;
  s.sensors.effort = 0.05;
  s.sensors.position = s.sensors.heading = 0.002;
  s.sensors.angles = s.sensors.commands = false;
  s.seed = seed;
  Simulation simulation(s);
  return read_all(simulation);
}

/// All rows of all spaces, whitened, with the columns of `members` beside θ; the last column is the response.
Eigen::MatrixXd stacked(const gap::GapProblem& problem, const std::vector<std::size_t>& members) {
  const gap::Subset subset = gap::subset_of(problem.table, members, gap::BaseModel::refitted);
  const auto n = static_cast<Eigen::Index>(subset.columns.size());
  Eigen::Index total = 0;
  for (const gap::RowSpace& space : problem.rows.spaces) total += space.t.size();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(total, n + 1);
  Eigen::Index at = 0;
  for (const gap::RowSpace& space : problem.rows.spaces) {
    const Eigen::Index m = space.t.size();
    for (Eigen::Index j = 0; j < n; ++j) {
      const Eigen::VectorXd& column = space.columns[subset.columns[static_cast<std::size_t>(j)]];
      if (column.size() > 0) rows.col(j).segment(at, m) = column / space.floor;
    }
    Eigen::VectorXd response = space.response;
    for (const std::size_t c : subset.fixed) {
      if (space.columns[c].size() > 0) response -= space.columns[c];
    }
    rows.col(n).segment(at, m) = response / space.floor;
    at += m;
  }
  return rows;
}

double cross_validated(const gap::GapProblem& problem, const std::vector<std::size_t>& members,
                       const std::vector<Eigen::Index>& order) {
  const Eigen::MatrixXd rows = stacked(problem, members);
  const Eigen::Index n = rows.cols() - 1;
  double sum = 0.0;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<Eigen::Index> train, test;
    for (std::size_t k = 0; k < order.size(); ++k) {
      (k % kFolds == fold ? test : train).push_back(order[k]);
    }
    const Eigen::MatrixXd X = rows(train, Eigen::all);
    const Eigen::VectorXd fit = X.leftCols(n).colPivHouseholderQr().solve(X.col(n));
    const Eigen::MatrixXd Z = rows(test, Eigen::all);
    sum += (Z.col(n) - Z.leftCols(n) * fit).squaredNorm();
  }
  return sum / static_cast<double>(rows.rows());
}

/// The best single effect or pair of a plain search; rows and columns are given to it.
std::vector<std::size_t> plain_search(const gap::GapProblem& problem) {
  Eigen::Index total = 0;
  for (const gap::RowSpace& space : problem.rows.spaces) total += space.t.size();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(total));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::shuffle(order.begin(), order.end(), std::mt19937_64(1));
  const double infinity = std::numeric_limits<double>::infinity();
  std::vector<std::pair<double, std::size_t>> single(problem.table.names.size(), {infinity, 0});
  for (std::size_t c = 0; c < problem.table.candidates.size(); ++c) {
    auto& best = single[problem.table.candidates[c].effect];
    best = std::min(best, {cross_validated(problem, {c}, order), c});
  }
  double least = infinity;
  std::vector<std::size_t> chosen;
  for (std::size_t a = 0; a < single.size(); ++a) {
    for (std::size_t b = a + 1; b < single.size(); ++b) {
      if (!std::isfinite(single[a].first + single[b].first)) {
        continue;
      }
      const std::vector<std::size_t> pair{std::min(single[a].second, single[b].second),
                                          std::max(single[a].second, single[b].second)};
      const double error = cross_validated(problem, pair, order);
      if (error < least) {
        least = error;
        chosen = pair;
      }
    }
  }
  return chosen;
}

/// Seconds that the plain search takes.
double plain_seconds(TableSource& log, TableSource& baseline) {
  gap::PreparedGap prepared = gap::prepare_gap(log, &baseline, plain_robot(), {});
  prepared.row_options.row_step = 1e-9;
  const gap::GapProblem problem =
      gap::make_problem(prepared.drive, prepared.floor, prepared.healthy, prepared.trusted, prepared.catalogue,
                        gap::all_shapes(prepared.catalogue, prepared.drive), prepared.row_options);
  const auto start = std::chrono::steady_clock::now();
  DoNotOptimize(plain_search(problem));
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A drive with a healthy baseline.
struct Logs {
  LogTable real, base;
  TableSource log{real}, baseline{base};
  explicit Logs(double duration) : real(drive(duration, 0.03, 2)), base(drive(duration, 0.0, 1)) {}
};

void catalogue(Form form) {
  Logs shorter(120.0), longer(240.0);
  const double of_plain = plain_seconds(shorter.log, shorter.baseline);  // a quarter of a minute: once is enough
  for (const bool shrink : {false, true}) {
    for (const int threads : {1, 2}) {
      const auto first_cause = [&](Logs& logs) {
        gap::DiagnoseOptions options;
        options.shrink = shrink;
        options.threads = static_cast<std::size_t>(threads);
        const Diagnosis diagnosis = diagnose(logs.log, &logs.baseline, plain_robot(), options);
        return diagnosis.causes.empty() ? std::string("nothing") : diagnosis.causes.front().effect;
      };
      const auto take = [&](Logs& logs, const char* peer, const Work& theirs) {
        std::string found;
        const auto note = [&](double) {
          return fmt::format("{:.0f} s at {:.0f} Hz, finds {}", static_cast<double>(logs.real.rows()) / kRate, kRate,
                             found);
        };
        compare(
            form, {shrink ? "gap/catalogue and shrink" : "gap/catalogue", logs.real.rows(), 4, threads, peer, note},
            [&] { found = first_cause(logs); }, theirs, 3);
      };
      take(shorter, "eigen qr, random 10-fold", [&] { return of_plain; });
      take(longer, "the same at 120 s", [&] { DoNotOptimize(first_cause(shorter)); });
    }
  }
}

const bool registered = register_bench("gap/catalogue", catalogue);

}  // namespace
}  // namespace wheelwright::bench::gap_bench
