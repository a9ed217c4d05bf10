// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/sim/simulation.hpp>

#include <cmath>
#include <numbers>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/model/effect_geometry.hpp>
#include <wheelwright/model/effect_law.hpp>

namespace wheelwright {
namespace {

enum Stream : std::size_t { clock_stream, angle_stream, speed_stream, effort_stream, position_stream, heading_stream };

const Scenario& validated(const Scenario& scenario) {
  validate(scenario);
  return scenario;
}

}  // namespace

Simulation::Simulation(Scenario scenario, std::size_t block_rows)
    : scenario_(std::move(scenario)),
      block_rows_(block_rows),
      drive_(drive_of(validated(scenario_).robot)),
      late_(effect_value(scenario_.robot, "sensor_time_offset", "dt")),
      encoder_scale_(drive_geometry(scenario_.robot).encoder_scale),
      plant_(drive_, scenario_.parameters, scenario_.faults, DriveEffects(scenario_.robot)),
      drivetrain_(scenario_.robot, scenario_.parameters, late_ > 0.0),
      memory_(late_ + 1.0 / scenario_.rate),
      controller_(drive_, nominal_parameters(scenario_), scenario_.controller, scenario_.torque_limit) {
  check::that(block_rows_ > 0, "block_rows", "at least 1");
  // Rows at 0, 1/rate, … up to the duration; intervals between them.
  const auto steps = static_cast<std::uint64_t>(std::floor(scenario_.duration * scenario_.rate * (1.0 + 1e-12)));
  periods_ = scenario_.sensors.sampling == Sampling::instant ? steps + 1 : steps;
  if (scenario_.robot.effort == EffortKind::current) {
    effort_per_torque_ = 1.0 / (*scenario_.robot.motor->torque_constant * scenario_.robot.motor->gear_ratio);
  }
  if (scenario_.sensors.encoder_counts_per_turn) {
    angle_step_ = 2.0 * std::numbers::pi / *scenario_.sensors.encoder_counts_per_turn;
  }
  make_names();
  rewind();
}

void Simulation::make_names() {
  const Sensors& sensors = scenario_.sensors;
  const auto add = [this](bool wanted, std::initializer_list<const char*> names) {
    if (wanted) {
      names_.insert(names_.end(), names.begin(), names.end());
    }
  };
  add(sensors.angles, {"phi_r", "phi_l"});
  add(sensors.speeds, {"omega_r", "omega_l"});
  add(scenario_.robot.effort == EffortKind::torque, {"tau_r", "tau_l"});
  add(scenario_.robot.effort == EffortKind::current, {"current_r", "current_l"});
  add(sensors.pose, {"x", "y", "theta"});
  add(sensors.commands, {"command_r", "command_l"});
}

void Simulation::make_sensors() {
  const Sensors& sensors = scenario_.sensors;
  noise_.clear();
  noise_.emplace_back(scenario_.seed, clock_stream, scenario_.time_jitter);
  for (const auto& [stream, bound] :
       {std::pair{angle_stream, sensors.wheel_angle}, std::pair{speed_stream, sensors.wheel_speed},
        std::pair{effort_stream, sensors.effort}, std::pair{position_stream, sensors.position},
        std::pair{heading_stream, sensors.heading}}) {
    noise_.emplace_back(scenario_.seed, stream, bound, sensors.noise);
  }
}

void Simulation::rewind() {
  make_sensors();
  controller_.reset();
  DriveState start;
  start.pose = scenario_.initial_pose + scenario_.initial_pose_error;
  plant_.reset(start, 0.0);
  drivetrain_.reset();
  memory_.reset();
  memory_.record(plant_);
  reference_ = scenario_.initial_pose;
  torque_.setZero();
  k_ = 0;
  rows_ = 0;
  gap_ = 0;
  t_ = 0.0;
  segment_starts_ = true;
}

double Simulation::median_step() const { return periods_ < 2 ? 0.0 : 1.0 / scenario_.rate; }

double Simulation::stamp(std::uint64_t k) {
  return noise_[clock_stream].measure(static_cast<double>(k)) / scenario_.rate;
}

bool Simulation::in_gap(double t) {
  while (gap_ < scenario_.gaps.size() && t >= scenario_.gaps[gap_].upper) {
    ++gap_;
  }
  return gap_ < scenario_.gaps.size() && t >= scenario_.gaps[gap_].lower;
}

double Simulation::quantised(double angle) const {
  return angle_step_ > 0.0 ? angle_step_ * std::nearbyint(angle / angle_step_) : angle;
}

WheelMemory::Wheels Simulation::sensed() const {
  WheelMemory::Wheels wheels =
      late_ > 0.0 ? memory_.at(plant_.time() - late_)
                  : WheelMemory::Wheels{plant_.time(), plant_.state().wheel_angle, plant_.wheel_speed()};
  wheels.angle = wheels.angle.cwiseProduct(encoder_scale_);
  wheels.speed = wheels.speed.cwiseProduct(encoder_scale_);
  return wheels;
}

void Simulation::advance(const Eigen::Vector2d& first, const Eigen::Vector2d& last, double h) {
  if (late_ > 0.0) {
    drivetrain_.advance(plant_, first, last, h, [this] { memory_.record(plant_); });
  } else {
    drivetrain_.advance(plant_, first, last, h);
  }
}

Simulation::Row Simulation::drive() {
  const bool held = scenario_.robot.hold == Hold::zero_order;
  const double t = t_, t_next = stamp(k_ + 1);
  const double h = scenario_.time_jitter > 0.0 ? t_next - t : 1.0 / scenario_.rate;

  const ReferenceSpeed reference = reference_speed(scenario_.trajectory, t);
  const TrackingController::Command command =
      controller_.step(reference_, reference, plant_.state().pose, plant_.encoder_speed(), h);
  const Eigen::Vector2d first = held ? command.torque : torque_;
  const Eigen::Vector2d last = command.torque;

  Row row;
  row.command = drive_.wheel_speed(command.speed);
  if (scenario_.sensors.sampling == Sampling::instant) {
    row.t = t;
    const WheelMemory::Wheels wheels = sensed();
    row.angle = wheels.angle;
    row.speed = wheels.speed;
    row.torque = first;
    row.pose = plant_.state().pose;
    advance(first, last, h);
  } else {
    const Eigen::Vector2d before = sensed().angle, middle = 0.5 * (first + last);
    advance(first, middle, 0.5 * h);
    row.t = t + 0.5 * h;
    row.angle = sensed().angle;
    row.pose = plant_.state().pose;
    advance(middle, last, 0.5 * h);
    const Eigen::Vector2d after = sensed().angle;
    row.speed = {(quantised(after[0]) - quantised(before[0])) / h, (quantised(after[1]) - quantised(before[1])) / h};
    row.torque = middle;
  }
  plant_.set_time(t_next);
  reference_ = advance_reference(scenario_.trajectory, reference_, t, h);
  torque_ = last;
  t_ = t_next;
  ++k_;
  return row;
}

void Simulation::write(const Row& row, std::size_t at, LogBlock& block) {
  std::size_t c = 0;
  const auto put = [&](double value) { block.columns[c++][at] = value; };
  const auto effort = [&](double torque) {
    const double measured = noise_[effort_stream].measure(effort_per_torque_ * torque);
    return scenario_.robot.effort_unsigned ? std::abs(measured) : measured;
  };
  block.t[at] = row.t;
  if (scenario_.sensors.angles) {
    put(quantised(noise_[angle_stream].measure(row.angle[0])));
    put(quantised(noise_[angle_stream].measure(row.angle[1])));
  }
  if (scenario_.sensors.speeds) {
    put(noise_[speed_stream].measure(row.speed[0]));
    put(noise_[speed_stream].measure(row.speed[1]));
  }
  put(effort(row.torque[0]));
  put(effort(row.torque[1]));
  if (scenario_.sensors.pose) {
    put(noise_[position_stream].measure(row.pose[0]));
    put(noise_[position_stream].measure(row.pose[1]));
    put(noise_[heading_stream].measure(row.pose[2]));
  }
  if (scenario_.sensors.commands) {
    put(row.command[0]);
    put(row.command[1]);
  }
}

bool Simulation::next(LogBlock& block) {
  block.first_row = rows_;
  block.segment_starts.clear();
  block.t.resize(block_rows_);
  block.columns.resize(names_.size());
  for (std::vector<double>& column : block.columns) {
    column.resize(block_rows_);
  }
  std::size_t filled = 0;
  while (filled < block_rows_ && k_ < periods_) {
    const Row row = drive();
    if (in_gap(row.t)) {
      segment_starts_ = true;
      continue;
    }
    if (std::exchange(segment_starts_, false)) {
      block.segment_starts.push_back(filled);
    }
    write(row, filled++, block);
  }
  block.t.resize(filled);
  for (std::vector<double>& column : block.columns) {
    column.resize(filled);
  }
  rows_ += filled;
  return filled > 0;
}

LogTable simulate(const Scenario& scenario) {
  Simulation simulation(scenario);
  return read_all(simulation);
}

}  // namespace wheelwright
