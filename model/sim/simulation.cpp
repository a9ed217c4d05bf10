// SPDX-License-Identifier: Apache-2.0
#include "model/sim/simulation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "model/effect_law.hpp"

namespace wheelwright::sim {
namespace {

using std::numbers::pi;
constexpr double first_zero_of_j0 = 2.404825557695773;
constexpr double soft_start = 1.0;  // s

// A function of time and its derivative.
struct Signal {
  double value = 0.0;
  double rate = 0.0;
};

Signal operator*(Signal a, Signal b) { return {a.value * b.value, a.rate * b.value + a.value * b.rate}; }
Signal operator*(double a, Signal b) { return {a * b.value, a * b.rate}; }
Signal operator+(Signal a, Signal b) { return {a.value + b.value, a.rate + b.rate}; }

Signal sine(double w, double t, double phase = 0.0) { return {std::sin(w * t + phase), w * std::cos(w * t + phase)}; }

// 0 → 1 over `length`, 3s² − 2s³.
Signal smooth_step(double t, double length) {
  if (t <= 0.0) {
    return {0.0, 0.0};
  }
  if (t >= length) {
    return {1.0, 0.0};
  }
  const double s = t / length;
  return {s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / length};
}

// max(0, sin)²: half of the period at rest.
Signal go_and_stop(double w, double t) {
  const Signal s = sine(w, t);
  return s.value > 0.0 ? s * s : Signal{};
}

struct Pair {
  Signal v1, v2;
};

Pair steady(const Trajectory& r, Trajectory::Kind kind, double t) {
  const double w = 2.0 * pi / r.period;
  const Signal one{1.0, 0.0};
  switch (kind) {
    case Trajectory::Kind::straight: return {r.speed * (0.6 * one + 0.4 * sine(w, t)), {}};
    case Trajectory::Kind::circle: return {r.speed * one, r.yaw_rate * one};
    case Trajectory::Kind::figure_eight: return {r.speed * one, first_zero_of_j0 * w * sine(w, t, pi / 2.0)};
    case Trajectory::Kind::multi_sine:
      return {r.speed * (0.5 * sine(w, t) + 0.3 * sine(2.7 * w, t) + 0.2 * sine(5.9 * w, t)),
              r.yaw_rate * (0.5 * sine(1.3 * w, t) + 0.3 * sine(3.1 * w, t) + 0.2 * sine(6.7 * w, t))};
    case Trajectory::Kind::spin: return {{}, r.yaw_rate * (0.7 * sine(w, t) + 0.3 * sine(3.3 * w, t))};
    case Trajectory::Kind::stops: {
      const Signal go = go_and_stop(w, t);
      return {r.speed * go, r.yaw_rate * (go * sine(0.43 * w, t))};
    }
    case Trajectory::Kind::commissioning:
    case Trajectory::Kind::table: break;
  }
  // One stage after the other, each from standstill to standstill.
  constexpr std::array stages = {Trajectory::Kind::straight, Trajectory::Kind::figure_eight,
                                 Trajectory::Kind::multi_sine, Trajectory::Kind::spin, Trajectory::Kind::stops};
  const double number = std::floor(t / r.period);
  const double local = t - number * r.period;
  Pair pair = steady(r, stages[static_cast<std::size_t>(std::fmod(number, static_cast<double>(stages.size())))], local);
  const double ramp = 0.15 * r.period;
  const Signal end = smooth_step(local - (r.period - ramp), ramp);
  const Signal window = smooth_step(local, ramp) * Signal{1.0 - end.value, -end.rate};
  return {window * pair.v1, window * pair.v2};
}

ReferenceSpeed looked_up(const SpeedTable& table, double t) {
  const auto next = std::upper_bound(table.t.begin(), table.t.end(), t);
  if (next == table.t.begin() || next == table.t.end()) {
    const bool at_end = next == table.t.end() && !table.t.empty() && t == table.t.back();
    return {at_end ? table.speed.back() : Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  }
  const auto k = static_cast<std::size_t>(next - table.t.begin());
  const double length = table.t[k] - table.t[k - 1];
  const Eigen::Vector2d slope = (table.speed[k] - table.speed[k - 1]) / length;
  return {table.speed[k - 1] + (t - table.t[k - 1]) * slope, slope};
}

}  // namespace

void validate(const Trajectory& trajectory) {
  check::non_negative(trajectory.speed, "trajectory.speed");
  check::non_negative(trajectory.yaw_rate, "trajectory.yaw_rate");
  check::positive(trajectory.period, "trajectory.period");
  if (trajectory.kind != Trajectory::Kind::table) {
    return;
  }
  const SpeedTable& table = trajectory.table;
  check::that(table.t.size() >= 2 && table.speed.size() == table.t.size(), "trajectory.table",
              "two rows or more, each with a time and two speeds");
  for (std::size_t k = 0; k < table.t.size(); ++k) {
    check::that(std::isfinite(table.t[k]) && table.speed[k].allFinite(), "trajectory.table", "finite numbers");
    check::that(k == 0 || table.t[k] > table.t[k - 1], "trajectory.table", "increasing times");
  }
}

ReferenceSpeed reference_speed(const Trajectory& trajectory, double t) {
  if (trajectory.kind == Trajectory::Kind::table) {
    return looked_up(trajectory.table, t);
  }
  const Pair pair = steady(trajectory, trajectory.kind, t);
  const Signal start = smooth_step(t, soft_start);
  const Signal v1 = start * pair.v1, v2 = start * pair.v2;
  return {{v1.value, v2.value}, {v1.rate, v2.rate}};
}

Eigen::Vector3d advance_reference(const Trajectory& trajectory, const Eigen::Vector3d& pose, double t, double h) {
  const Eigen::Vector2d twist = reference_speed(trajectory, t + 0.5 * h).speed;
  const double half_turn = 0.5 * h * twist[1];
  const double chord =
      h * twist[0] * (std::abs(half_turn) < 1e-4 ? 1.0 - half_turn * half_turn / 6.0 : std::sin(half_turn) / half_turn);
  return {pose[0] + chord * std::cos(pose[2] + half_turn), pose[1] + chord * std::sin(pose[2] + half_turn),
          pose[2] + 2.0 * half_turn};
}

TrackingController::TrackingController(const DifferentialDrive& drive, const model::DriveParameters& nominal,
                                       const ControllerGains& gains, std::optional<double> torque_limit)
    : drive_(drive), nominal_(nominal), gains_(gains), torque_limit_(torque_limit) {}

TrackingController::Command TrackingController::step(const Eigen::Vector3d& reference_pose,
                                                     const ReferenceSpeed& reference, const Eigen::Vector3d& pose,
                                                     const Eigen::Vector2d& v, double h) {
  const double c = std::cos(pose[2]), s = std::sin(pose[2]);
  const Eigen::Vector3d world = reference_pose - pose;
  const double x = c * world[0] + s * world[1], y = -s * world[0] + c * world[1], turn = world[2];
  const double sinc = std::abs(turn) < 1e-4 ? 1.0 - turn * turn / 6.0 : std::sin(turn) / turn;

  Command command;
  command.speed = {reference.speed[0] * std::cos(turn) + gains_.along * x,
                   reference.speed[1] + gains_.across * reference.speed[0] * sinc * y + gains_.heading * turn};

  const Eigen::Vector2d error = command.speed - v;
  const Eigen::Vector2d acceleration = reference.acceleration + gains_.speed * error + gains_.integral * integral_;
  const double along_x = c * c;
  const double viscous = nominal_.viscous_x * along_x + nominal_.viscous_y * (1.0 - along_x);
  const double force = nominal_.mass * acceleration[0] + viscous * command.speed[0];
  const double moment = nominal_.yaw_inertia * acceleration[1] + nominal_.viscous_yaw * command.speed[1];
  const double half_sum = 0.5 * drive_.wheel_radius * force;
  const double half_difference = 0.5 * drive_.wheel_radius * moment / drive_.lever_arm();
  command.torque = {half_sum + half_difference, half_sum - half_difference};

  const bool saturated = torque_limit_ && command.torque.cwiseAbs().maxCoeff() > *torque_limit_;
  if (saturated) {
    command.torque = command.torque.cwiseMin(*torque_limit_).cwiseMax(-*torque_limit_);
  } else {
    integral_ += h * error;  // held while saturated, so that it does not wind up
  }
  return command;
}

namespace {

void validate_sensors(const Sensors& sensors) {
  check::non_negative(sensors.wheel_speed, "sensors.wheel_speed");
  check::non_negative(sensors.wheel_angle, "sensors.wheel_angle");
  check::non_negative(sensors.effort, "sensors.effort");
  check::non_negative(sensors.position, "sensors.position");
  check::non_negative(sensors.heading, "sensors.heading");
  if (sensors.encoder_counts_per_turn) {
    check::positive(*sensors.encoder_counts_per_turn, "sensors.encoder_counts_per_turn");
  }
  check::that(sensors.angles || sensors.speeds, "sensors", "angles or speeds of the wheels, or both");
}

void validate_gains(const ControllerGains& gains) {
  check::non_negative(gains.along, "controller.along");
  check::non_negative(gains.across, "controller.across");
  check::non_negative(gains.heading, "controller.heading");
  check::non_negative(gains.speed, "controller.speed");
  check::non_negative(gains.integral, "controller.integral");
}

}  // namespace

DifferentialDrive drive_of(const Robot& robot) {
  return {robot.wheel_radius, robot.track_width, robot.lever_arm_is_track, robot.anisotropic_friction};
}

void validate(const Scenario& scenario) {
  check::that(model::on_two_wheels(scenario.robot), "robot.model is '" + scenario.robot.model + "'",
              "differential_drive, which is what can be simulated");
  static_cast<void>(model::make_model(scenario.robot));
  check::that(scenario.robot.effort != model::EffortKind::voltage, "robot.effort",
              "torque or current: voltages cannot be simulated");
  const bool constant_known = scenario.robot.motor && scenario.robot.motor->torque_constant;
  check::that(scenario.robot.effort == model::EffortKind::torque || constant_known, "robot.motor.torque_constant",
              "a number > 0 where the effort is a current");
  model::validate(scenario.parameters);
  model::validate(nominal_parameters(scenario));
  const double b = model::effect_value(scenario.robot, "com_lateral", "b");
  check::that(scenario.parameters.mass * b * b < scenario.parameters.yaw_inertia, "effects.com_lateral.b",
              "a centre of mass with m b² below the yaw inertia about the axle");
  validate(scenario.trajectory);
  validate_gains(scenario.controller);
  model::validate(scenario.faults, drive_of(scenario.robot));
  validate_sensors(scenario.sensors);
  if (scenario.torque_limit) {
    check::positive(*scenario.torque_limit, "torque_limit");
  }
  check::that(scenario.initial_pose.allFinite(), "initial_pose", "finite numbers");
  check::that(scenario.initial_pose_error.allFinite(), "initial_pose_error", "finite numbers");
  check::positive(scenario.duration, "duration");
  check::positive(scenario.rate, "rate");
  check::that(scenario.duration * scenario.rate <= 1e8, "duration", "10⁸ samples at most");
  check::that(scenario.time_jitter >= 0.0 && scenario.time_jitter < 0.5, "time_jitter", "a share in [0, 0.5)");
  double last = 0.0;
  for (std::size_t k = 0; k < scenario.gaps.size(); ++k) {
    const Interval& gap = scenario.gaps[k];
    const std::string name = "gaps[" + std::to_string(k) + "]";
    check::that(gap.lower >= last, name, "gaps after 0, in order of time, that do not overlap");
    check::that(gap.upper - gap.lower > 6.0 / scenario.rate, name, "a length of more than 6 sampling periods");
    check::finite(gap.upper, name + ".upper");
    last = gap.upper;
  }
}

model::DriveParameters nominal_parameters(const Scenario& scenario) {
  model::DriveParameters nominal = scenario.parameters;
  const auto take = [&scenario](const char* name, double& value) {
    if (const auto found = scenario.robot.nominal.find(name); found != scenario.robot.nominal.end()) {
      value = found->second;
    }
  };
  take("mass", nominal.mass);
  take("yaw_inertia", nominal.yaw_inertia);
  take("viscous_linear", nominal.viscous_x);
  take("viscous_linear", nominal.viscous_y);
  take("viscous_x", nominal.viscous_x);
  take("viscous_y", nominal.viscous_y);
  take("viscous_yaw", nominal.viscous_yaw);
  return nominal;
}

Eigen::VectorXd true_parameters(const Scenario& scenario, const Model& model) {
  const model::DriveParameters& truth = scenario.parameters;
  const double yaw_convention = drive_of(scenario.robot).lever_arm() / (0.5 * scenario.robot.track_width);
  Eigen::VectorXd theta(static_cast<Eigen::Index>(model.p()));
  for (std::size_t j = 0; j < model.p(); ++j) {
    const model::Parameter& parameter = model.parameters[j];
    double physical = 0.0;
    if (parameter.physical == "mass") {
      physical = truth.mass;
    } else if (parameter.physical == "yaw_inertia") {
      physical = yaw_convention * truth.yaw_inertia;
    } else if (parameter.physical == "viscous_linear") {
      check::that(truth.viscous_x == truth.viscous_y, "parameters", "isotropic friction for a model of viscous_linear");
      physical = truth.viscous_x;
    } else if (parameter.physical == "viscous_x") {
      physical = truth.viscous_x;
    } else if (parameter.physical == "viscous_y") {
      physical = truth.viscous_y;
    } else if (parameter.physical == "viscous_yaw") {
      physical = yaw_convention * truth.viscous_yaw;
    } else if (const auto of_effect = model::effect_truth(scenario.robot, parameter.physical, truth.mass)) {
      physical = *of_effect;
    } else {
      throw InvalidArgument("model: a differential drive has no parameter '" + parameter.physical + "'");
    }
    theta[static_cast<Eigen::Index>(j)] = parameter.per_physical * physical;
  }
  return theta;
}

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
      late_(model::effect_value(scenario_.robot, "sensor_time_offset", "dt")),
      encoder_scale_(model::drive_geometry(scenario_.robot).encoder_scale),
      plant_(drive_, scenario_.parameters, scenario_.faults, DriveEffects(scenario_.robot)),
      drivetrain_(scenario_.robot, scenario_.parameters, late_ > 0.0),
      memory_(late_ + 1.0 / scenario_.rate),
      controller_(drive_, nominal_parameters(scenario_), scenario_.controller, scenario_.torque_limit) {
  check::that(block_rows_ > 0, "block_rows", "at least 1");
  // Rows at 0, 1/rate, … up to the duration; intervals between them.
  const auto steps = static_cast<std::uint64_t>(std::floor(scenario_.duration * scenario_.rate * (1.0 + 1e-12)));
  periods_ = scenario_.sensors.sampling == Sampling::instant ? steps + 1 : steps;
  if (scenario_.robot.effort == model::EffortKind::current) {
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
  add(scenario_.robot.effort == model::EffortKind::torque, {"tau_r", "tau_l"});
  add(scenario_.robot.effort == model::EffortKind::current, {"current_r", "current_l"});
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

}  // namespace wheelwright::sim
