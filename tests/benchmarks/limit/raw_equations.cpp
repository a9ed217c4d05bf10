// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/limit/raw_equations.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "core/check.hpp"

namespace wheelwright::bench {

using core::RowMatrix;

namespace {

// Weights of the errors of three consecutive samples (those of instant i−1, i, i+1 of the motion) in one equation.
struct Stencil {
  std::array<double, 3> slope{}, level{};
};

Stencil stencil(const filter::Measurement& measurement, const detector::ReferenceMotion& motion, std::size_t i) {
  const std::array<double, 2> shares = motion.shares(i);
  const double length = shares[0] + shares[1];
  if (measurement.motion == MotionKind::speed) {
    return {{0.0, -1.0 / length, 1.0 / length}, {0.0, 0.5, 0.5}};
  }
  const double a = 1.0 / motion.step[i], b = 1.0 / motion.step[i + 1];
  return {{a / length, -(a + b) / length, b / length}, {-0.5 * a, 0.5 * (a - b), 0.5 * b}};
}

// Weights of the efforts of samples of instant i−1, i, i+1 in equation i.
std::array<double, 3> effort_weights(const filter::Measurement& measurement, const detector::ReferenceMotion& motion,
                                     std::size_t i) {
  const bool held = measurement.hold == Hold::zero_order, curved = measurement.changes == model::EffortChanges::between;
  if (measurement.motion == MotionKind::mean_speed) {
    return held ? std::array{0.125, 0.75, 0.125} : std::array{0.0, 0.5, 0.5};
  }
  if (measurement.motion == MotionKind::speed) {
    const double curve = curved ? 1.0 / 12.0 : 0.0;
    return held ? std::array{0.0, 1.0, 0.0} : std::array{-curve, 0.5 + 2.0 * curve, 0.5 - curve};
  }
  const double a = motion.step[i], b = motion.step[i + 1], sum = a + b;
  if (held) {
    return {a / sum, b / sum, 0.0};
  }
  const double least = std::min(a, b), curve = curved ? least * least * least / (3.0 * sum * sum) : 0.0;
  return {a / (3.0 * sum) - curve / a, 2.0 / 3.0 + curve * (1.0 / a + 1.0 / b), b / (3.0 * sum) - curve / b};
}

std::vector<model::TermValue> function_values(const Term& term, const filter::SignalErrors& errors,
                                              const detector::ReferenceMotion& motion, std::size_t first,
                                              std::size_t last) {
  const auto c = static_cast<std::size_t>(motion.speed.rows()), j = static_cast<std::size_t>(motion.joint_speed.rows());
  const std::vector<double> joint_error(j, errors.joint_sample);
  std::vector<model::TermValue> values;
  for (std::size_t i = first; i <= last; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    model::TermValue value = term.function({{motion.speed.col(at).data(), c},
                                            {errors.speed_sample.data(), c},
                                            {motion.joint_speed.col(at).data(), j},
                                            joint_error,
                                            motion.heading[i],
                                            errors.heading});
    values.push_back({term.scale * value.value, std::abs(term.scale) * value.error});
  }
  return values;
}

void add_functions(RawEquations& e, const Term& term, const std::vector<model::TermValue>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    ErrorSource source{.bound = values[i].error};
    for (const std::size_t k : {i - 1, i}) {  // i − 1 wraps around where there is none
      if (k < e.count()) {
        const std::size_t row = k * e.outputs + term.output;
        e.Y(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(term.parameter)) += 0.5 * values[i].value;
        source.entries.push_back({row, term.parameter, 0.5});
      }
    }
    if (source.bound > 0.0) {
      e.function.push_back(std::move(source));
    }
  }
}

}  // namespace

RawEquations raw_equations(const Model& model, const filter::Measurement& measurement,
                           const filter::SensorErrors& sensors, const detector::ReferenceMotion& motion,
                           std::size_t first, std::size_t last) {
  check::that(measurement.correction.empty(), "measurement",
              "efforts as the wheels get them: raw equations do not correct saturation, dead zones, gains or lags");
  check::that(first < last && last < motion.instants() &&
                  std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), first) ==
                      std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), last),
              "stretch", "two instants of one segment, one after the other");
  const filter::SignalErrors errors = filter::propagate(model, {}, measurement, sensors);
  const std::size_t n = model.n(), p = model.p(), joints = model.joints.size(), count = last - first;
  RawEquations e{.outputs = n, .parameters = p, .first = first};
  for (std::size_t k = 0; k < count; ++k) {
    const std::array<double, 2> shares = motion.shares(first + k);
    e.length.push_back(shares[0] + shares[1]);
  }
  e.Y = RowMatrix::Zero(static_cast<Eigen::Index>(count * n), static_cast<Eigen::Index>(p));
  // Samples are numbered from the one before the first instant.
  e.joint.assign(joints * (count + 2), {.bound = sensors.motion});
  e.effort.assign(joints * (count + 2), {.bound = sensors.effort});
  std::vector<Stencil> stencils;
  for (std::size_t k = 0; k < count; ++k) {
    stencils.push_back(stencil(measurement, motion, first + k));
    const std::array<double, 3> taps = effort_weights(measurement, motion, first + k);
    for (std::size_t q = 0; q < 3; ++q) {
      for (std::size_t j = 0; j < joints; ++j) {
        for (std::size_t i = 0; i < n; ++i) {
          const double weight = taps[q] * model.input(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
          if (weight != 0.0) {
            e.effort[j * (count + 2) + k + q].entries.push_back({k * n + i, 0, weight});
          }
        }
      }
    }
  }
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::function) {
      add_functions(e, term, function_values(term, errors, motion, first, last));
      continue;
    }
    const bool slope = term.kind == Term::Kind::acceleration;
    const auto c = static_cast<Eigen::Index>(term.coordinate);
    const double bound = model.motion.row(c).cwiseAbs().sum() * sensors.motion;
    std::vector<ErrorSource> own(count + 2, {.bound = bound});
    for (std::size_t k = 0; k < count; ++k) {
      const auto at = static_cast<Eigen::Index>(first + k);
      const double begin = motion.speed(c, at), end = motion.speed(c, at + 1);
      const std::size_t row = k * n + term.output;
      e.Y(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(term.parameter)) +=
          term.scale * (slope ? (end - begin) / e.length[k] : 0.5 * (begin + end));
      for (std::size_t q = 0; q < 3; ++q) {
        const double weight = term.scale * (slope ? stencils[k].slope[q] : stencils[k].level[q]);
        if (weight == 0.0) {
          continue;
        }
        own[k + q].entries.push_back({row, term.parameter, weight});
        for (std::size_t j = 0; j < joints; ++j) {
          e.joint[j * (count + 2) + k + q].entries.push_back(
              {row, term.parameter, weight * model.motion(c, static_cast<Eigen::Index>(j))});
        }
      }
    }
    e.column.insert(e.column.end(), own.begin(), own.end());
  }
  const auto idle = [](const ErrorSource& source) { return source.bound <= 0.0 || source.entries.empty(); };
  std::erase_if(e.joint, idle);
  std::erase_if(e.column, idle);
  std::erase_if(e.effort, idle);
  return e;
}

Eigen::VectorXd raw_efforts(const RawEquations& equations, const Model& model, const filter::Measurement& measurement,
                            const detector::ReferenceMotion& motion, const Eigen::MatrixXd& effort) {
  Eigen::VectorXd u = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(equations.rows()));
  const auto n = static_cast<Eigen::Index>(equations.outputs);
  for (std::size_t k = 0; k < equations.count(); ++k) {
    const std::array<double, 3> taps = effort_weights(measurement, motion, equations.first + k);
    // A mean speed's instant comes with the sample after it.
    const std::size_t late = measurement.motion == MotionKind::mean_speed ? 1 : 0;
    const std::size_t sample = motion.sample[equations.first + k] - late;
    for (std::size_t q = 0; q < 3; ++q) {
      if (taps[q] != 0.0) {
        const std::size_t row = sample + q - 1;
        check::that(static_cast<Eigen::Index>(row) < effort.cols(), "effort", "a column for each row of the log");
        u.segment(static_cast<Eigen::Index>(k) * n, n) +=
            taps[q] * model.input * effort.col(static_cast<Eigen::Index>(row));
      }
    }
  }
  return u;
}

Eigen::MatrixXd read_efforts(LogSource& log, const filter::Measurement& measurement) {
  check::that(!measurement.effort_unsigned, "effort", "signed, for raw equations");
  std::vector<std::size_t> pick;
  for (const auto& name : measurement.effort_columns) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "'");
    pick.push_back(*column);
  }
  std::vector<double> values;
  log.rewind();
  LogBlock block;
  while (log.next(block)) {
    for (std::size_t k = 0; k < block.rows(); ++k) {
      for (const std::size_t c : pick) {
        values.push_back(block.columns[c][k]);
      }
    }
  }
  log.rewind();
  const auto joints = static_cast<Eigen::Index>(pick.size());
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), joints, static_cast<Eigen::Index>(values.size()) / joints);
}

detector::FaultSignals raw_signature(const RawEquations& equations, const FaultType& fault, const Model& model,
                                     const detector::ReferenceMotion& motion, std::size_t onset) {
  check::that(!fault.held_effort, "fault '" + fault.name + "'", "one whose signature needs no filter");
  const std::size_t last = equations.first + equations.count();
  check::that(onset >= equations.first && onset < last, "onset", "an instant inside the stretch");
  // A filter that forgets nothing integrates: its rows differ by the integral over the interval.
  constexpr double kForgetsNothing = 1e-14;  // 1/s
  detector::FaultFilter integral(fault, model, {.order = 1, .alpha = 1.0, .beta = kForgetsNothing}, motion);
  const auto rows = static_cast<Eigen::Index>(equations.rows()), p = static_cast<Eigen::Index>(equations.parameters),
             n = static_cast<Eigen::Index>(equations.outputs);
  detector::FaultSignals mean{RowMatrix::Zero(rows, p), RowMatrix::Zero(rows, p), RowMatrix::Zero(rows, p),
                              Eigen::VectorXd::Zero(rows)};
  detector::FaultSignals before{RowMatrix::Zero(n, p), RowMatrix::Zero(n, p), RowMatrix::Zero(n, p),
                                Eigen::VectorXd::Zero(n)};
  if (fault.profile.jumps()) {
    const Eigen::VectorXd v = motion.speed.col(static_cast<Eigen::Index>(onset));
    Eigen::VectorXd moved = Eigen::VectorXd::Zero(v.size()), seen = moved;
    if (fault.motion.size() > 0) {
      moved += fault.motion * v;
    }
    if (fault.slip.size() > 0) {
      moved += fault.slip;
    }
    if (fault.seen.size() > 0) {
      seen += fault.seen * v;
    }
    for (const Term& term : model.terms) {
      if (term.kind == Term::Kind::acceleration) {
        const auto i = static_cast<Eigen::Index>(term.output), j = static_cast<Eigen::Index>(term.parameter),
                   c = static_cast<Eigen::Index>(term.coordinate);
        before.g1(i, j) += term.scale * moved[c];
        before.s(i, j) += term.scale * seen[c];
      }
    }
    if (onset > equations.first) {
      const std::size_t k = onset - 1 - equations.first;
      mean.g1.middleRows(static_cast<Eigen::Index>(k) * n, n) = before.g1 / equations.length[k];
      mean.s.middleRows(static_cast<Eigen::Index>(k) * n, n) = before.s / equations.length[k];
    }
  }
  integral.begin(onset);
  while (integral.instant() < last && integral.next()) {
    const std::size_t k = integral.instant() - 1 - equations.first;
    const double length = equations.length[k];
    for (Eigen::Index i = 0; i < n; ++i) {
      const detector::FaultRow row = integral.row(static_cast<std::size_t>(i));
      const Eigen::Index at = static_cast<Eigen::Index>(k) * n + i;
      const auto rate = [&](std::span<const double> now, RowMatrix& was, RowMatrix& to) {
        const Eigen::Map<const Eigen::RowVectorXd> values(now.data(), p);
        to.row(at) = (values - was.row(i)) / length;
        was.row(i) = values;
      };
      rate(row.g1, before.g1, mean.g1);
      rate(row.g2, before.g2, mean.g2);
      rate(row.s, before.s, mean.s);
      mean.c[at] = (row.c - before.c[i]) / length;
      before.c[i] = row.c;
    }
  }
  return mean;
}

}  // namespace wheelwright::bench
