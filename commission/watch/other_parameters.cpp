// SPDX-License-Identifier: Apache-2.0
#include "commission/watch/other_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "bounds/feasible_set.hpp"
#include "commission/physical.hpp"
#include "core/words.hpp"
#include "detector/online_model.hpp"
#include "model/filter/row_stream.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kMostChange = 2.0;  // of a length, either way
constexpr double kMostBias = 1.0;    // rad/s, of a gyro

using Status = bounds::FeasibleSet::Status;

// Bounds of parameters, scaled, that have nothing in common.
void add_change(const std::string& name, const std::string& unit, const Interval& before, const Interval& now,
                double scale, double offset, std::vector<ChangedParameter>& changes) {
  if (now.lower > before.upper || now.upper < before.lower) {
    const auto scaled = [&](const Interval& x) { return Interval{scale * x.lower - offset, scale * x.upper - offset}; };
    changes.push_back({name, unit, scaled(before), scaled(now)});
  }
}

bool explains_torque(LogSource& log, const OnlineModel& model, std::vector<ChangedParameter>& changes) {
  filter::TorqueRows rows(log, detector::make_filter(model));
  Box box{model::prior_box(model.robot, model.model).bounds};
  for (std::size_t j = 0; j < box.sides.size(); ++j) {
    box.sides[j] = {std::min(box.sides[j].lower, model.box.sides[j].lower),
                    std::max(box.sides[j].upper, model.box.sides[j].upper)};
  }
  const bounds::FeasibleSet set = bounds::feasible_set(rows, box);
  if (set.status == Status::empty) {
    return false;
  }
  const auto scales = physical_scales(model.robot, model.model);
  for (std::size_t j = 0; j < box.sides.size(); ++j) {
    const model::Parameter& parameter = model.model.parameters[j];
    const PhysicalScale scale = scales ? (*scales)[j] : PhysicalScale{};
    add_change(scales ? parameter.physical : parameter.name,
               scales ? parameter.physical_unit : parameter_unit(model.robot, parameter), model.box.sides[j],
               set.hull.sides[j], scale.scale, scale.offset, changes);
  }
  return true;
}

bool explains_motion(LogSource& log, const detector::KinematicModel& model, std::vector<ChangedParameter>& changes) {
  filter::OdometryRows rows(log, detector::make_filter(model));
  const std::vector<std::string> names = model.measurement.parameters(), units = model.measurement.parameter_units();
  Box box = model.box;
  for (std::size_t j = 0; j < names.size(); ++j) {
    Interval& side = box.sides[j];
    if (names[j] == "gyro_bias") {
      side = {side.lower - kMostBias, side.upper + kMostBias};
    } else {
      side = {side.lower > 0.0 ? side.lower / kMostChange : kMostChange * side.lower,
              side.upper > 0.0 ? kMostChange * side.upper : side.upper / kMostChange};
    }
  }
  const bounds::FeasibleSet set = bounds::feasible_set(rows, box);
  if (set.status == Status::empty) {
    return false;
  }
  for (std::size_t j = 0; j < names.size(); ++j) {
    add_change(names[j], units[j], model.box.sides[j], set.hull.sides[j], 1.0, 0.0, changes);
  }
  return true;
}

// Outward, with digits that tell the two ends apart.
std::string range_words(const Interval& range) {
  const double size = std::max({std::abs(range.lower), std::abs(range.upper), 1e-12});
  const int decimals = std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 9);
  const double unit = std::pow(10.0, -decimals);
  return fmt::format("{:.{}f} to {:.{}f}", std::floor(range.lower / unit) * unit, decimals,
                     std::ceil(range.upper / unit) * unit, decimals);
}

}  // namespace

std::optional<OtherParameters> explained_by_other_parameters(LogSource& log, const OnlineModel& model,
                                                             const Detection& detection,
                                                             const KinematicWatch& kinematic) {
  OtherParameters other;
  if (!detection.events.empty()) {
    if (!explains_torque(log, model, other.changes)) {
      return std::nullopt;
    }
    other.residuals.emplace_back("torque");
  }
  if (kinematic.detection && !kinematic.detection->events.empty()) {
    if (!explains_motion(log, *model.kinematic, other.changes)) {
      return std::nullopt;
    }
    other.residuals.emplace_back("kinematic");
  }
  log.rewind();
  return other.residuals.empty() ? std::nullopt : std::optional(std::move(other));
}

std::string sentence(const OtherParameters& other) {
  std::vector<std::string> parts;
  for (const ChangedParameter& change : other.changes) {
    std::string name = change.name;
    std::ranges::replace(name, '_', ' ');
    const std::string unit = change.unit == "1" || change.unit.empty() ? "" : " " + change.unit;
    parts.push_back(
        fmt::format("{} {}{} ({} before)", name, range_words(change.now), unit, range_words(change.before)));
  }
  return fmt::format(
      "other constant parameters explain the whole drive{}{}: another ground or load than the model was learnt on, or "
      "a fault that looks alike, as one from before the first row; compare with the log that it was learnt on by "
      "`wheelwright gap`",
      parts.empty() ? "" : ": ", core::enumerated(parts));
}

}  // namespace wheelwright::commission
