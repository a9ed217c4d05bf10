// SPDX-License-Identifier: Apache-2.0
#include "commission/doctor/health_efforts.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "commission/setting_rows.hpp"
#include "core/check.hpp"
#include "core/error.hpp"
#include "core/words.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kLeastFrozen = 0.3;  // s, of a stretch that is looked at
constexpr std::size_t kLeastFrozenRows = 6;
constexpr double kTimesUsual = 5.0;         // as many rows as a value usually lasts
constexpr std::size_t kFewestChanges = 20;  // elsewhere, that show how long a value usually lasts
constexpr double kTimesWorst = 4.0;         // of a mean square: twice as far off as the worst stretch elsewhere
constexpr double kMaterialShare = 0.1;      // of the efforts' root mean square
constexpr std::size_t kFewestWindows = 8;   // of the rest, that a stretch is compared with
constexpr double kDoubtOfFit = 4.0;         // standard errors of what the fit says of an instant
constexpr double kRiskOfFit = 1e-3;         // for fit_log; not used further
constexpr double kMostOfCopy = 1e-3;        // root mean square of what a copy leaves, over the effort
constexpr double kOwnWay = 0.1;             // share of a wheel's motion that is not the other's, of equal efforts
constexpr double kOwnWayScaled = 0.3;       // likewise, of efforts of a fixed ratio: modes of a drive differ in time

struct Frozen {
  std::size_t joint;
  ValueRun run;
};

// Stretches in which an effort stands still in motion, which it usually does not.
std::vector<Frozen> standing_efforts(const HealthView& view) {
  const std::vector<double>& t = view.log->t;
  std::vector<Frozen> found;
  for (std::size_t j = 0; j < view.joints.size(); ++j) {
    std::vector<ValueRun> runs;
    for (const ValueRun& run : value_runs(view, *view.joints[j].effort)) {
      if (mostly_moves(view, run)) {
        runs.push_back(run);
      }
    }
    const auto is_long = [&](const ValueRun& run) {
      return run.rows() >= kLeastFrozenRows && t[run.last - 1] - t[run.first] >= kLeastFrozen;
    };
    std::size_t changes = 0, rows = 0;
    for (const ValueRun& run : runs) {
      changes += is_long(run) ? 0 : 1;
      rows += is_long(run) ? 0 : run.rows();
    }
    if (changes < kFewestChanges) {
      continue;
    }
    const double usual = static_cast<double>(rows) / static_cast<double>(changes);
    for (const ValueRun& run : runs) {
      if (is_long(run) && static_cast<double>(run.rows()) > kTimesUsual * usual) {
        found.push_back({j, run});
      }
    }
  }
  return found;
}

// The log without these stretches: what follows each begins a segment.
LogTable without(const HealthView& view, std::span<const Frozen> stretches) {
  std::vector<bool> out(view.log->rows(), false);
  for (const Frozen& f : stretches) {
    std::fill(out.begin() + static_cast<std::ptrdiff_t>(f.run.first),
              out.begin() + static_cast<std::ptrdiff_t>(f.run.last), true);
  }
  LogTable rest;
  rest.names = view.log->names;
  rest.columns.resize(view.log->columns.size());
  for (const auto& [first, last] : view.segments) {
    bool starts = true;
    for (std::size_t k = first; k < last; ++k) {
      if (out[k]) {
        starts = true;
        continue;
      }
      if (starts) {
        rest.segment_starts.push_back(rest.rows());
        starts = false;
      }
      rest.t.push_back(view.log->t[k]);
      for (std::size_t c = 0; c < rest.columns.size(); ++c) {
        rest.columns[c].push_back(view.log->columns[c][k]);
      }
    }
  }
  return rest;
}

// Mean over the outputs of the squared residual at each instant, each output over its own scale; of outputs whose
// parameters the fit knows, and what is beyond the doubt of the fit.
struct Residuals {
  std::vector<std::size_t> sample;
  std::vector<double> by_rest;    // scale: the residual's root mean square in the rest
  std::vector<double> by_effort;  // scale: the share of the efforts that is material
};

Residuals residuals_of(const LogTable& log, const commission::Setting& s, const commission::Fit& fit) {
  TableSource source(log);
  TorqueRows rows = commission::make_rows(source, s, commission::errors_of_fit(s));
  Residuals out;
  const std::size_t n = s.model.n();
  std::vector<bool> known(n, true);
  for (const Term& term : s.model.terms) {
    const identify::Excitation seen = fit.excitation[term.parameter].state;
    known[term.output] =
        known[term.output] && (term.kind == Term::Kind::acceleration ? seen == identify::Excitation::identified
                                                                     : seen != identify::Excitation::not_excited);
  }
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    const Eigen::VectorXd error = block.y - block.Y * fit.estimate;
    for (std::size_t k = 0; k < block.instants(); ++k) {
      double by_rest = 0.0, by_effort = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        if (!known[i]) {
          continue;
        }
        const identify::OutputResidual& of_rest = fit.residuals.outputs[i];
        const auto row = static_cast<Eigen::Index>(k * n + i);
        const double variance = block.Y.row(row).dot(fit.residuals.covariance * block.Y.row(row).transpose());
        const double e = std::max(0.0, std::abs(error[row]) - kDoubtOfFit * std::sqrt(std::max(0.0, variance)));
        const double usual = of_rest.rms, material = kMaterialShare * of_rest.torque_rms;
        by_rest += usual > 0.0 ? e * e / (usual * usual) : 0.0;
        by_effort += material > 0.0 ? e * e / (material * material) : 0.0;
      }
      out.sample.push_back(block.sample[k]);
      out.by_rest.push_back(by_rest / static_cast<double>(n));
      out.by_effort.push_back(by_effort / static_cast<double>(n));
    }
  });
  return out;
}

double mean_of(const std::vector<double>& values, std::size_t first, std::size_t last) {
  double sum = 0.0;
  for (std::size_t k = first; k < last; ++k) {
    sum += values[k];
  }
  return last > first ? sum / static_cast<double>(last - first) : 0.0;
}

// The largest mean of `length` values in a row, in half steps of it; of fewer where that leaves too few windows.
double worst_window(const std::vector<double>& values, std::size_t length) {
  length = std::max<std::size_t>(1, std::min(length, values.size() / kFewestWindows));
  double worst = 0.0;
  for (std::size_t k = 0; k + length <= values.size(); k += std::max<std::size_t>(1, length / 2)) {
    worst = std::max(worst, mean_of(values, k, k + length));
  }
  return worst;
}

// Rows at which all joints have moved for as long as the filter delays: at rest dry friction takes any value.
std::vector<bool> all_moving(const HealthView& view, double delay) {
  constexpr double kSlow = 0.05;  // of a joint's top speed
  std::vector<bool> moving(view.log->rows(), false);
  const std::vector<double>& t = view.log->t;
  for (const auto& [first, last] : view.segments) {
    double rested = first < last ? t[first] - 2.0 * delay : 0.0;
    for (std::size_t k = first; k < last; ++k) {
      const bool slow =
          std::ranges::any_of(view.joints, [&](const JointView& j) { return std::abs(j.smooth[k]) <= kSlow * j.top; });
      rested = slow ? t[k] : rested;
      moving[k] = t[k] - rested > delay;
    }
  }
  return moving;
}

struct Judged {
  std::vector<Frozen> frozen;
  double worst_ratio = 0.0;  // root mean square of the residual in a frozen stretch, over that of the rest
};

// Which of `standing` the model of the rest does not explain. Throws where that has none.
Judged judge(const HealthView& view, const std::vector<Frozen>& standing) {
  const LogTable rest = without(view, standing);
  Robot robot = view.robot;
  robot.parameters = model::possible_parameters(robot);
  TableSource source(rest);
  commission::Setting s = commission::settle(source, robot);
  const commission::Fit fit = commission::fit_log(source, s, commission::Part::everything, kRiskOfFit);
  check::that(std::ranges::any_of(
                  fit.excitation,
                  [](const identify::ExcitationFinding& e) { return e.state == identify::Excitation::identified; }),
              "log", "a parameter that the rest of it shows");
  const std::vector<double> usual = residuals_of(rest, s, fit).by_rest;
  const Residuals all = residuals_of(*view.log, s, fit);
  const std::vector<double>& t = view.log->t;
  const std::vector<bool> moving = all_moving(view, s.filter.delay());
  Judged judged;
  for (const Frozen& f : standing) {
    std::vector<double> by_rest, by_effort;
    // What the filter has of the stretch goes on for as long as it delays.
    for (auto k = static_cast<std::size_t>(std::ranges::lower_bound(all.sample, f.run.first) - all.sample.begin());
         k < all.sample.size(); ++k) {
      const std::size_t row = all.sample[k];
      if (row >= f.run.last && !(t[row] - t[f.run.last - 1] < s.filter.delay() && t[row] > t[f.run.last - 1])) {
        break;
      }
      if (moving[row]) {
        by_rest.push_back(all.by_rest[k]);
        by_effort.push_back(all.by_effort[k]);
      }
    }
    const double here = mean_of(by_rest, 0, by_rest.size());
    if (here > kTimesWorst * worst_window(usual, by_rest.size()) && mean_of(by_effort, 0, by_effort.size()) > 1.0) {
      judged.frozen.push_back(f);
      judged.worst_ratio = std::max(judged.worst_ratio, std::sqrt(here));
    }
  }
  return judged;
}

// "60:119.99", rounded outward to ms: as an argument of the program, within which all of the stretch lies.
std::string as_argument(const Interval& stretch) {
  return fmt::format("--without {:.13g}:{:.13g}", std::floor(1e3 * stretch.lower) * 1e-3,
                     std::ceil(1e3 * stretch.upper) * 1e-3);
}

LogFinding of_frozen(const HealthView& view, const std::vector<Frozen>& frozen, const std::string& why) {
  LogFinding f{.id = "signals.effort_frozen", .topic = FindingTopic::signals, .severity = FindingSeverity::fatal};
  f.refuses = true;
  std::vector<bool> flagged(view.log->rows(), false);
  std::vector<std::string> values;
  for (std::size_t j = 0; j < view.joints.size(); ++j) {
    std::vector<double> of_joint;
    for (const Frozen& one : frozen) {
      if (one.joint == j) {
        std::fill(flagged.begin() + static_cast<std::ptrdiff_t>(one.run.first),
                  flagged.begin() + static_cast<std::ptrdiff_t>(one.run.last), true);
        of_joint.push_back(one.run.value);
      }
    }
    if (of_joint.empty()) {
      continue;
    }
    f.columns.push_back(view.joints[j].effort_name);
    values.push_back(std::ranges::all_of(of_joint, [&](double v) { return v == of_joint.front(); })
                         ? fmt::format("{} stays at {:.4g}", f.columns.back(), of_joint.front())
                         : fmt::format("{} keeps one value in each", f.columns.back()));
  }
  set_stretches(f, view, flagged, 2.0 * view.step);
  double seconds = 0.0;
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first + 1; k < last; ++k) {
      seconds += flagged[k] && flagged[k - 1] ? view.log->t[k] - view.log->t[k - 1] : 0.0;
    }
  }
  f.value = seconds;
  f.unit = std::string("s");
  f.sentence = fmt::format(
      "Efforts stand still for {:.3g} s in {} stretch{} while the robot moves as they cannot move "
      "it: {}{}.",
      seconds, f.stretches, f.stretches == 1 ? "" : "es", core::listed(values), why);
  const std::string options = without_arguments(f);
  f.next = fmt::format(
      "Find out why the efforts stopped (a driver that was switched off, a message that was not sent "
      "anew), and leave these stretches out: `wheelwright convert LOG rest.csv{}`{}, then use "
      "rest.csv.",
      options, f.stretches > f.when.size() ? " and the others" : "");
  return f;
}

}  // namespace

std::string without_arguments(const LogFinding& finding) {
  std::string options;
  for (const Interval& stretch : finding.when) {
    options += " " + as_argument(stretch);
  }
  return options;
}

std::vector<ValueRun> value_runs(const HealthView& view, const std::vector<double>& column) {
  std::vector<ValueRun> runs;
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first; k < last; ++k) {
      if (k > first && column[k] == runs.back().value) {
        runs.back().last = k + 1;
      } else {
        runs.push_back({k, k + 1, column[k]});
      }
    }
  }
  return runs;
}

bool mostly_moves(const HealthView& view, const ValueRun& run) {
  std::size_t moving = 0;
  for (std::size_t k = run.first; k < run.last; ++k) {
    moving += view.moving[k] ? 1U : 0U;
  }
  return 2 * moving >= run.rows();
}

std::optional<LogTable> check_frozen_efforts(const HealthView& view, std::vector<LogFinding>& findings) {
  const std::vector<Frozen> standing = standing_efforts(view);
  if (standing.empty() || view.robot.effort_unsigned) {
    return std::nullopt;
  }
  Judged judged;
  std::string why;
  try {
    judged = judge(view, standing);
    why = fmt::format(" (what a model of the rest leaves there is {:.2g} times what it leaves elsewhere)",
                      judged.worst_ratio);
  } catch (const Error&) {
    // One stretch that is most of the motion leaves nothing to judge it by, or to make a model of.
    const auto moving = static_cast<double>(std::ranges::count(view.moving, true));
    std::ranges::copy_if(standing, std::back_inserter(judged.frozen),
                         [&](const Frozen& f) { return static_cast<double>(f.run.rows()) > 0.5 * moving; });
    why = ", and the rest of the log is too little for a model";
  }
  if (judged.frozen.empty()) {
    return std::nullopt;
  }
  findings.push_back(of_frozen(view, judged.frozen, why));
  return without(view, judged.frozen);
}

void check_copied_efforts(const HealthView& view, std::vector<LogFinding>& findings) {
  if (view.joints.size() != 2) {
    return;
  }
  const JointView &a = view.joints[0], &b = view.joints[1];
  double aa = 0.0, ab = 0.0, bb = 0.0, vv = 0.0, vw = 0.0, ww = 0.0;
  for (std::size_t k = 0; k < view.log->rows(); ++k) {
    if (view.moving[k]) {
      const double x = (*a.effort)[k], y = (*b.effort)[k], v = a.smooth[k], w = b.smooth[k];
      aa += x * x;
      ab += x * y;
      bb += y * y;
      vv += v * v;
      vw += v * w;
      ww += w * w;
    }
  }
  if (!(aa * bb * vv * ww > 0.0)) {
    return;
  }
  const double ratio = ab / aa;
  double left = 0.0;
  for (std::size_t k = 0; k < view.log->rows(); ++k) {
    const double e = (*b.effort)[k] - ratio * (*a.effort)[k];
    left += view.moving[k] ? e * e : 0.0;
  }
  const bool equal = std::abs(std::abs(ratio) - 1.0) < kMostOfCopy;
  const double own_way = std::sqrt(std::max(0.0, 1.0 - vw * vw / (vv * ww)));
  if (left > kMostOfCopy * kMostOfCopy * bb || own_way < (equal ? kOwnWay : kOwnWayScaled)) {
    return;
  }
  LogFinding f{.id = "signals.effort_copied", .topic = FindingTopic::signals, .severity = FindingSeverity::fatal};
  f.refuses = true;
  f.columns = {a.effort_name, b.effort_name};
  f.value = ratio;
  f.unit = std::string("1");
  f.sentence = fmt::format(
      "{} is {} {} in every row, although {:.0f} % of the motion of its wheel is not that of the "
      "other: one was copied from the other, or both were made of one value.",
      b.effort_name, equal && ratio > 0.0 ? "equal to" : fmt::format("{:.4g} times", ratio), a.effort_name,
      100.0 * own_way);
  f.next =
      "Log the effort of each wheel by itself, or read the right column (--map): from their sum alone no mass and "
      "no yaw inertia is found.";
  findings.push_back(f);
}

}  // namespace wheelwright::doctor
