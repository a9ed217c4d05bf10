// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "commission/doctor/log_health.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kLagLongest = 0.5;      // s, to either side
constexpr double kLagBlock = 1.0;        // s, over which errors may depend on each other
constexpr double kLagSure = 5.0;         // standard errors
constexpr double kLagMatters = 1.0;      // of a step: speeds that are differenced are half of one late
constexpr double kLagFits = 0.5;         // least share of the gyro's variation that the wheels must explain
constexpr std::size_t kLagSmoothed = 2;  // rows to either side: interpolation averages what noise is left
constexpr std::size_t kLagRows = 60000;  // looked at
constexpr std::size_t kLagBlocks = 10;   // blocks
constexpr int kLagSteps = 8;             // of Gauss and Newton

// Means over 2 kLagSmoothed + 1 rows: of both signals alike, so that no lag comes of it.
std::vector<double> smoothed_rows(const HealthView& view, const std::vector<double>& values) {
  std::vector<double> out(values.size());
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first; k < last; ++k) {
      const std::size_t half = std::min({kLagSmoothed, k - first, last - 1 - k});
      double sum = 0.0;
      for (std::size_t i = k - half; i <= k + half; ++i) {
        sum += values[i];
      }
      out[k] = sum / static_cast<double>(2 * half + 1);
    }
  }
  return out;
}

std::vector<double> joint_speed_of(const HealthView& view, const JointView& joint) {
  if (joint.speed != nullptr) {
    return *joint.speed;
  }
  const std::vector<double>&t = view.log->t, &angle = *joint.angle;
  std::vector<double> out(t.size(), 0.0);
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first; k < last && last - first > 1; ++k) {
      const std::size_t a = k > first ? k - 1 : k, b = k + 1 < last ? k + 1 : k;
      out[k] = (angle[b] - angle[a]) / (t[b] - t[a]);
    }
  }
  return out;
}

// Rows of gyro = gain·wheels(t − lag) + bias by least squares, and what a further lag would add to them.
struct LagFit {
  double left = 0.0, all = 0.0;             // squares
  double more = 0.0, error = 0.0;           // s: a further lag, with its standard error
  std::array<double, 2> parts{}, errors{};  // the same of the first and the last third
  std::size_t blocks = 0;
};

struct YawSignals {
  std::vector<double> wheels, gyro;
};

std::optional<LagFit> fit_lag(const HealthView& view, const YawSignals& signals, double lag) {
  const std::vector<double>& t = view.log->t;
  struct Row {
    double t, wheels, slope, gyro;
  };
  std::vector<Row> rows;
  const std::size_t stride = 1 + t.size() / kLagRows;
  for (const auto& [first, last] : view.segments) {
    std::size_t at = first;
    for (std::size_t k = first; k < last; k += stride) {
      const double wanted = t[k] - lag;
      while (at + 1 < last && t[at + 1] < wanted) {
        ++at;
      }
      if (at + 1 >= last || wanted < t[at]) {
        continue;
      }
      const double h = t[at + 1] - t[at], share = (wanted - t[at]) / h;
      rows.push_back({t[k], signals.wheels[at] + share * (signals.wheels[at + 1] - signals.wheels[at]),
                      (signals.wheels[at + 1] - signals.wheels[at]) / h, signals.gyro[k]});
    }
  }
  if (rows.size() < kLagBlocks * 10) {
    return std::nullopt;
  }
  const auto n = static_cast<double>(rows.size());
  double w = 0.0, s = 0.0, g = 0.0;
  for (const Row& row : rows) {
    w += row.wheels / n;
    s += row.slope / n;
    g += row.gyro / n;
  }
  double ww = 0.0, wg = 0.0, ws = 0.0, gg = 0.0;
  for (const Row& row : rows) {
    ww += (row.wheels - w) * (row.wheels - w);
    wg += (row.wheels - w) * (row.gyro - g);
    ws += (row.wheels - w) * (row.slope - s);
    gg += (row.gyro - g) * (row.gyro - g);
  }
  if (!(ww > 0.0) || !(gg > 0.0)) {
    return std::nullopt;
  }
  LagFit fit{.all = gg};
  const double gain = wg / ww;
  struct Sum {
    double score = 0.0, square = 0.0, variance = 0.0, open = 0.0;  // open: score of the block so far
  };
  std::array<Sum, 3> sums;  // the whole, the first and the last third
  double begun = rows.front().t;
  const auto close = [&] {
    for (Sum& sum : sums) {
      sum.variance += sum.open * sum.open;
      sum.open = 0.0;
    }
    ++fit.blocks;
  };
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Row& row = rows[k];
    if (std::abs(row.t - begun) > kLagBlock) {
      close();
      begun = row.t;
    }
    const double residual = row.gyro - g - gain * (row.wheels - w);
    const double more = -gain * (row.slope - s - ws / ww * (row.wheels - w));
    fit.left += residual * residual;
    const auto add = [&](Sum& sum) {
      sum.score += more * residual;
      sum.square += more * more;
      sum.open += more * residual;
    };
    add(sums[0]);
    if (3 * k < rows.size()) {
      add(sums[1]);
    } else if (3 * k >= 2 * rows.size()) {
      add(sums[2]);
    }
  }
  close();
  const auto lag_of = [](const Sum& sum) { return sum.square > 0.0 ? sum.score / sum.square : 0.0; };
  const auto error_of = [](const Sum& sum) { return sum.square > 0.0 ? std::sqrt(sum.variance) / sum.square : 1.0; };
  fit.more = lag_of(sums[0]);
  fit.error = error_of(sums[0]);
  for (std::size_t part = 0; part < 2; ++part) {
    fit.parts[part] = lag_of(sums[part + 1]);
    fit.errors[part] = error_of(sums[part + 1]);
  }
  return fit;
}

}  // namespace

void check_gyro_delay(const HealthView& view, std::vector<LogFinding>& findings) {
  const std::vector<double>* gyro = view.column("gyro_z");
  if (gyro == nullptr || view.joints.size() != 2 || !view.has_motion() || !(view.step > 0.0)) {
    return;
  }
  YawSignals signals{joint_speed_of(view, view.joints[0]), smoothed_rows(view, *gyro)};
  const std::vector<double> left = joint_speed_of(view, view.joints[1]);
  for (std::size_t k = 0; k < left.size(); ++k) {
    signals.wheels[k] -= left[k];
  }
  signals.wheels = smoothed_rows(view, signals.wheels);
  double lag = 0.0, least = 0.0;
  const double stride = std::max(view.step, 0.01);
  std::optional<LagFit> fit;
  for (double tried = -kLagLongest; tried <= kLagLongest; tried += stride) {
    const std::optional<LagFit> at = fit_lag(view, signals, tried);
    if (at && (!fit || at->left / at->all < least)) {
      fit = at;
      least = at->left / at->all;
      lag = tried;
    }
  }
  if (!fit || 1.0 - least < kLagFits || std::abs(lag) > kLagLongest - 2.0 * stride) {
    return;
  }
  for (int step = 0; fit && step < kLagSteps; ++step) {
    lag += std::clamp(fit->more, -stride, stride);
    fit = fit_lag(view, signals, lag);
  }
  if (!fit || fit->blocks < kLagBlocks || std::abs(lag) > kLagLongest) {
    return;
  }
  const auto about = [&](const char* id, std::string sentence, std::string next, double value) {
    findings.push_back({.id = id,
                        .topic = FindingTopic::time,
                        .severity = FindingSeverity::warning,
                        .sentence = std::move(sentence),
                        .next = std::move(next),
                        .columns = {"gyro_z"},
                        .value = value,
                        .unit = "s"});
  };
  if (std::abs(lag) > kLagSure * fit->error && std::abs(lag) > kLagMatters * view.step) {
    about(
        "time.gyro_delay",
        fmt::format("The gyro comes {:.3g} ± {:.1g} s {} the wheels (95 %).", std::abs(lag), 2.0 * fit->error,
                    lag > 0.0 ? "after" : "before"),
        fmt::format("Stamp gyro and wheels by one clock where they are measured, or move the gyro's stamps by {:.4g} s "
                    "before the logs are joined: bounds of yaw gains widen by what the yaw rate changes in that time.",
                    -lag),
        lag);
  }
  const double drift = fit->parts[1] - fit->parts[0], error = std::hypot(fit->errors[0], fit->errors[1]);
  if (std::abs(drift) > kLagSure * error && std::abs(drift) > kLagMatters * view.step) {
    about(
        "time.gyro_drift",
        fmt::format("From the first to the last third of the log the gyro falls {:.3g} ± {:.1g} s {} the wheels: their "
                    "clocks drift.",
                    std::abs(drift), 2.0 * error, drift > 0.0 ? "behind" : "ahead of"),
        "Stamp both by one clock, or commission shorter logs.", drift);
  }
}

}  // namespace wheelwright::doctor
