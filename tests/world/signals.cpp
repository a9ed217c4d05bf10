// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/world/signals.hpp"

namespace wheelwright::reality {
namespace {

double rounded(double value, double unit) { return std::round(value / unit) * unit; }

/// The decimal unit below a twentieth of `noise`.
double resolution(double noise) { return std::pow(10.0, std::floor(std::log10(noise / 20.0))); }

void add_body(Signals& g, const RobotDesign& robot) {
  const double r = robot.radius;
  const double track = 2.0 * robot.half_track;
  g.s = g.torque[right] + g.torque[left];
  g.d = g.torque[right] - g.torque[left];
  g.v1 = 0.5 * r * (g.speed[right] + g.speed[left]);
  g.v2 = r / track * (g.speed[right] - g.speed[left]);
  g.a1 = 0.5 * r * (g.acceleration[right] + g.acceleration[left]);
  g.a2 = r / track * (g.acceleration[right] - g.acceleration[left]);
}

Eigen::VectorXd copy(const std::vector<double>& values, Eigen::Index rows) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), rows);
}

}  // namespace

LogTable sense(const RobotDesign& robot, const Record& record, Random random) {
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l", "x", "y", "theta"};
  log.columns.assign(log.names.size(), {});
  log.t = record.t;
  for (double& t : log.t) {
    t = rounded(t, 1e-6);
  }
  const double count = 2.0 * std::numbers::pi / robot.counts;
  const double unit = resolution(robot.torque_noise);
  const Pair start{random.uniform(0.0, 1.0), random.uniform(0.0, 1.0)};
  for (std::size_t k = 0; k < record.rows(); ++k) {
    for (std::size_t i = 0; i < 2; ++i) {
      const double from = std::floor(record.angle[i][k] / count + start[i]);
      const double to = std::floor(record.angle[i][k + 1] / count + start[i]);
      log.columns[i].push_back(rounded((to - from) * count / record.period, 1e-6));
      log.columns[2 + i].push_back(rounded(record.torque[i][k] + robot.torque_noise * random.normal(), unit));
    }
    log.columns[4].push_back(rounded(record.x[k] + robot.position_noise * random.normal(), 1e-5));
    log.columns[5].push_back(rounded(record.y[k] + robot.position_noise * random.normal(), 1e-5));
    const double heading = record.heading[k] + robot.heading_noise * random.normal();
    log.columns[6].push_back(rounded(std::remainder(heading, 2.0 * std::numbers::pi), 1e-5));
  }
  return log;
}

Logger draw_logger(Random& random) {
  Logger logger;
  logger.jitter = random.uniform(0.0, 0.2);
  logger.lost = random.log_uniform(0.0005, 0.02);
  logger.burst = random.log_uniform(1.0, 8.0);
  const std::size_t rows = 2 + random.below(3);
  logger.smoothing = random.below(4) == 0 ? rows : 1;
  return logger;
}

LogTable write_down(const Logger& logger, const LogTable& log, double period, Random random) {
  LogTable written;
  written.names = log.names;
  written.columns.assign(log.columns.size(), {});
  // Two states (Gilbert 1960): rows are written, or lost until the burst ends.
  const double begins = logger.lost / (logger.burst * (1.0 - logger.lost));
  bool losing = false;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    losing = random.uniform(0.0, 1.0) < (losing ? 1.0 - 1.0 / logger.burst : begins);
    const double late = logger.jitter * period * random.uniform(-1.0, 1.0);
    if (losing && k > 0 && k + 1 < log.rows()) {
      continue;
    }
    written.t.push_back(rounded(log.t[k] + late, 1e-6));
    for (std::size_t c = 0; c < log.columns.size(); ++c) {
      const std::size_t rows = c < 2 ? std::min(logger.smoothing, k + 1) : 1;
      double sum = 0.0;
      for (std::size_t n = 0; n < rows; ++n) {
        sum += log.columns[c][k - n];
      }
      written.columns[c].push_back(rows > 1 ? rounded(sum / static_cast<double>(rows), 1e-6) : sum);
    }
  }
  return written;
}

Signals signals_of(const RobotDesign& robot, const Record& record) {
  Signals g;
  const auto rows = static_cast<Eigen::Index>(record.rows());
  g.period = record.period;
  g.t = copy(record.t, rows);
  for (std::size_t i = 0; i < 2; ++i) {
    g.speed[i] = copy(record.speed[i], rows);
    g.acceleration[i] = copy(record.acceleration[i], rows);
    g.torque[i] = copy(record.torque[i], rows);
    g.angle[i] = copy(record.angle[i], rows) + 0.5 * g.period * g.speed[i];
  }
  g.x = copy(record.x, rows);
  g.y = copy(record.y, rows);
  g.heading = copy(record.heading, rows);
  add_body(g, robot);
  return g;
}

Signals signals_of(const RobotDesign& robot, const LogTable& log) {
  Signals g;
  const auto rows = static_cast<Eigen::Index>(log.rows());
  g.period = 1.0 / robot.rate;
  g.t = copy(log.t, rows);
  for (std::size_t i = 0; i < 2; ++i) {
    g.speed[i] = copy(log.columns[i], rows);
    g.torque[i] = copy(log.columns[2 + i], rows);
    g.acceleration[i] = Eigen::VectorXd::Zero(rows);
    g.acceleration[i].segment(1, rows - 2) = (g.speed[i].tail(rows - 2) - g.speed[i].head(rows - 2)) / (2.0 * g.period);
  }
  g.x = copy(log.columns[4], rows);
  g.y = copy(log.columns[5], rows);
  g.heading = copy(log.columns[6], rows);
  add_body(g, robot);
  return g;
}

Eigen::VectorXd low_pass(const Eigen::VectorXd& u, double period, double beta) {
  const double part = 1.0 - std::exp(-beta * period);
  Eigen::VectorXd out(u.size());
  double first = 0.0;
  double second = 0.0;
  for (Eigen::Index k = 0; k < u.size(); ++k) {
    first += part * (u[k] - first);
    second += part * (first - second);
    out[k] = second;
  }
  return out;
}

}  // namespace wheelwright::reality
