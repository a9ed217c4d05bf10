// SPDX-License-Identifier: Apache-2.0
#include "model/filter/measurement.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "core/statistics.hpp"
#include "core/words.hpp"
#include "model/filter/encoder.hpp"

namespace wheelwright::filter {

double FilterDesign::static_gain() const { return std::pow(alpha / beta, order); }

double FilterDesign::delay() const { return order / beta; }

void validate(const FilterDesign& design) {
  check::that(design.order == 1 || design.order == 2, "filter order", "1 or 2");
  check::positive(design.alpha, "filter alpha");
  check::positive(design.beta, "filter beta");
  check::non_negative(design.settle, "filter settle");
}

namespace {

constexpr std::size_t kMostSpeeds = 200000;   // enough to find an encoder; longer logs are not searched further
constexpr double kHalf = 0.5 * (1.0 - 1e-6);  // of a quantum: what rounding to it makes wrong, as printed
constexpr double kEvenSteps = 0.02;           // steps further apart than this share are not one sampling interval

template <typename Pick>
bool has_all(const LogSource& log, const Model& model, Pick pick) {
  return std::ranges::all_of(model.joints,
                             [&](const model::Joint& joint) { return log.find(pick(joint)).has_value(); });
}

// Speeds of all joints and whether the steps are even enough to speak of a sampling interval.
struct SpeedSample {
  std::vector<double> speeds;
  bool even = true;
};

// The step than which one in a hundred is shorter.
double shortest_step_of(LogSource& log) {
  std::vector<double> steps;
  log.rewind();
  LogBlock block;
  while (steps.size() < kMostSpeeds && log.next(block)) {
    for (std::size_t k = 1; k < block.rows(); ++k) {
      if (!std::binary_search(block.segment_starts.begin(), block.segment_starts.end(), k)) {
        steps.push_back(block.t[k] - block.t[k - 1]);
      }
    }
  }
  log.rewind();
  if (steps.empty()) {
    return 0.0;
  }
  const std::size_t rank = steps.size() / 100;
  return core::order_statistic(std::move(steps), rank);
}

SpeedSample sample_speeds(LogSource& log, const std::vector<std::string>& columns) {
  SpeedSample sample;
  std::vector<std::size_t> pick;
  for (const auto& column : columns) {
    pick.push_back(*log.find(column));
  }
  const double nominal = log.median_step();
  std::size_t uneven = 0;
  std::size_t steps = 0;
  log.rewind();
  LogBlock block;
  while (sample.speeds.size() < kMostSpeeds && log.next(block)) {
    for (const std::size_t c : pick) {
      sample.speeds.insert(sample.speeds.end(), block.columns[c].begin(), block.columns[c].end());
    }
    for (std::size_t k = 1; k < block.rows(); ++k) {
      ++steps;
      const double steps_on = (block.t[k] - block.t[k - 1]) / nominal;  // 2 where a row is lost
      uneven += std::abs(steps_on - std::max(1.0, std::round(steps_on))) > kEvenSteps ? 1 : 0;
    }
  }
  log.rewind();
  sample.even = uneven * 1000 <= steps;
  return sample;
}

}  // namespace

double Measurement::longest_step() const {
  constexpr double kHole = 1.75, kLeast = 1.35, kUnlike = 1.05;  // nominal steps
  constexpr double kTwo = 1.96;                                  // shortest steps: two of them, and rounding
  if (motion == MotionKind::mean_speed) {
    return kUnlike * nominal_step;
  }
  return shortest_step > 0.0 ? std::clamp(kTwo * shortest_step, kLeast * nominal_step, kHole * nominal_step)
                             : kHole * nominal_step;
}

Interval Measurement::sharpening() const {
  const auto at = [&](double time) { return time > 0.0 ? 1.0 / std::expm1(nominal_step / time) : 0.0; };
  return {at(smoothing.lower), at(smoothing.upper)};
}

std::vector<std::string> Measurement::columns() const {
  std::vector<std::string> all = motion_columns;
  all.insert(all.end(), effort_columns.begin(), effort_columns.end());
  if (!heading_column.empty()) {
    all.push_back(heading_column);
  }
  return all;
}

Measurement find_measurement(LogSource& log, const Robot& robot, const Model& model, int order) {
  Measurement m;
  m.hold = robot.hold;
  m.changes = robot.effort_changes;
  m.delay = robot.effort_delay;
  m.smoothing = robot.effort_smoothing;
  m.clock_drift = robot.clock ? robot.clock->drift : 0.0;
  m.effort_unsigned = robot.effort_unsigned;
  m.nominal_step = log.median_step();
  m.shortest_step = shortest_step_of(log);

  std::vector<std::string> angles, speeds;
  for (const model::Joint& joint : model.joints) {
    angles.push_back(joint.angle);
    speeds.push_back(joint.speed);
    m.effort_columns.push_back(model::effort_column(joint, robot.effort));
  }
  const bool have_angles = has_all(log, model, [](const model::Joint& j) { return j.angle; });
  const bool have_speeds = has_all(log, model, [](const model::Joint& j) { return j.speed; });
  if (!have_angles && !have_speeds) {
    throw InputError("the log has columns t, " + core::listed(log.columns()) +
                     ": expected the motion of every joint, " + core::listed(speeds) + " or " + core::listed(angles) +
                     " (use --map to rename columns)");
  }
  if (order == 1 && !have_speeds) {
    throw InvalidArgument("filter order is 1, which works on speeds, but the log has angles only (" +
                          core::listed(angles) + "): expected order 2, or a log with " + core::listed(speeds));
  }
  if (!has_all(log, model, [&](const model::Joint& j) { return model::effort_column(j, robot.effort); })) {
    throw InputError("the log has columns t, " + core::listed(log.columns()) +
                     ": expected the effort of every joint, " + core::listed(m.effort_columns) +
                     " (effort.kind in the robot file says which effort is used; --map " + "renames columns)");
  }
  m.motion = order == 2 && have_angles ? MotionKind::angle : MotionKind::speed;
  m.motion_columns = m.motion == MotionKind::angle ? angles : speeds;
  if (m.motion == MotionKind::speed && order == 2 && robot.speed_source != model::SpeedSource::measured) {
    const SpeedSample sample = sample_speeds(log, speeds);
    const auto encoder =
        sample.even ? find_encoder(sample.speeds, m.nominal_step, robot.encoder_counts_per_turn) : std::nullopt;
    const auto& declared = robot.noise.wheel_speed.value;
    const bool told = robot.encoder_counts_per_turn || robot.speed_source == model::SpeedSource::encoder_difference;
    if (encoder && !told && declared && *declared >= kHalf * encoder->speed_step) {
      m.unused_count = encoder->speed_step;
    } else if (encoder) {
      m.motion = MotionKind::mean_speed;
      m.count = encoder->speed_step;
    } else if (robot.speed_source == model::SpeedSource::encoder_difference) {
      m.motion = MotionKind::mean_speed;
    }
  }
  m.correction = effort_correction(robot, m.motion != MotionKind::angle);
  if (m.motion == MotionKind::speed) {
    m.cut = robot.speed_cut;
  }
  if (model.heading_used && log.find("theta")) {
    m.heading_column = "theta";
  }
  return m;
}

double uncut(double speed, const std::optional<model::SpeedCut>& cut) {
  if (!cut) {
    return speed;
  }
  const double half = 0.5 * cut->unit;
  return speed + (cut->down ? half : std::abs(speed) < half ? 0.0 : std::copysign(half, speed));
}

}  // namespace wheelwright::filter
