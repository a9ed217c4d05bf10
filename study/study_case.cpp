// SPDX-License-Identifier: Apache-2.0
#include "study/study_case.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "core/check.hpp"
#include "core/random.hpp"
#include "model/sim/simulation.hpp"

namespace wheelwright::study {

void validate(const StudyInput& input) {
  const std::string of = "input " + input.name + ": ";
  check::that(std::isfinite(input.lower) && std::isfinite(input.upper) && input.lower < input.upper, of + "range",
              "finite, the lower end below the upper");
  check::that(input.lower <= input.nominal && input.nominal <= input.upper, of + "nominal", "inside the range");
  check::that(!input.logarithmic || input.lower > 0.0, of + "range", "above 0 on a logarithmic scale");
}

double value(const StudyInput& input, double u) {
  if (u <= 0.0) {
    return input.lower;
  }
  if (u >= 1.0) {
    return input.upper;
  }
  return input.logarithmic ? input.lower * std::pow(input.upper / input.lower, u)
                           : input.lower + u * (input.upper - input.lower);
}

double coordinate(const StudyInput& input, double x) {
  return input.logarithmic ? std::log(x / input.lower) / std::log(input.upper / input.lower)
                           : (x - input.lower) / (input.upper - input.lower);
}

namespace {

struct NoisySensor {
  const char* name;
  const char* unit;
  model::NoiseBound model::SensorNoise::*declared;
  double sim::Sensors::*simulated;
};

constexpr NoisySensor kNoisySensors[] = {
    {"wheel_speed", "rad/s", &model::SensorNoise::wheel_speed, &sim::Sensors::wheel_speed},
    {"wheel_angle", "rad", &model::SensorNoise::wheel_angle, &sim::Sensors::wheel_angle},
    {"effort", "", &model::SensorNoise::effort, &sim::Sensors::effort},
    {"position", "m", &model::SensorNoise::position, &sim::Sensors::position},
    {"heading", "rad", &model::SensorNoise::heading, &sim::Sensors::heading},
};

const NoisySensor& noisy_sensor(const std::string& name) {
  for (const NoisySensor& sensor : kNoisySensors) {
    if (name.substr(name.find('.') + 1) == sensor.name) {
      return sensor;
    }
  }
  throw InvalidArgument("input " + name +
                        ": expected wheel_speed, wheel_angle, effort, position or heading behind the dot");
}

struct Truth {
  const char* name;
  double model::DriveParameters::*value;
};

constexpr Truth kTruths[] = {
    {"mass", &model::DriveParameters::mass},
    {"yaw_inertia", &model::DriveParameters::yaw_inertia},
    {"viscous_linear", &model::DriveParameters::viscous_x},
    {"viscous_yaw", &model::DriveParameters::viscous_yaw},
};

const Truth& truth_of(const std::string& name) {
  for (const Truth& truth : kTruths) {
    if (name.substr(name.find('.') + 1) == truth.name) {
      return truth;
    }
  }
  throw InvalidArgument("input " + name + ": expected mass, yaw_inertia, viscous_linear or viscous_yaw behind the dot");
}

// The kind of an input; "prior.mass" is of the kind "prior.NAME".
const StudyInputKind& kind_of(const std::string& name) {
  const std::string family = name.substr(0, name.find('.'));
  std::string all;
  for (const StudyInputKind& kind : study_input_kinds()) {
    const std::size_t dot = kind.name.find('.');
    const bool open = dot != std::string::npos && (kind.name.ends_with(".NAME") || kind.name.ends_with(".SENSOR"));
    if (open ? name.size() > dot + 1 && name.find('.') == dot && family == kind.name.substr(0, dot)
             : name == kind.name) {
      return kind;
    }
    all += (all.empty() ? "" : ", ") + kind.name;
  }
  throw InvalidArgument("input " + name + ": expected one of " + all);
}

void demand_scenario(const StudyCase& subject, const StudyInputKind& kind) {
  check::that(!kind.simulated || subject.scenario.has_value(), "input " + kind.name,
              "a study of a scenario: a recorded drive cannot be driven otherwise");
}

Interval& prior_of(StudyCase& subject, const std::string& name) {
  const std::string parameter = name.substr(name.find('.') + 1);
  const auto at = subject.robot.prior.find(parameter);
  if (at == subject.robot.prior.end()) {
    throw InvalidArgument("input " + name + ": expected a prior for " + parameter + " in the robot file");
  }
  return at->second;
}

// `factor` times as wide, about the geometric mean where both ends are above 0, else about the middle.
Interval widened(const Interval& prior, double factor) {
  if (prior.lower > 0.0) {
    const double middle = std::sqrt(prior.lower * prior.upper);
    const double reach = std::pow(prior.upper / prior.lower, 0.5 * factor);
    return {middle / reach, middle * reach};
  }
  const double middle = 0.5 * (prior.lower + prior.upper), half = 0.5 * factor * (prior.upper - prior.lower);
  return {prior.lower >= 0.0 ? std::max(middle - half, 0.0) : middle - half, middle + half};
}

std::size_t whole(double x, const std::string& name) {
  check::that(x >= 0.0 && x < 9e15, "input " + name, "a number >= 0");
  return static_cast<std::size_t>(std::llround(x));
}

std::vector<std::size_t> effort_columns(const LogTable& log, model::EffortKind kind) {
  const std::string prefix = kind == model::EffortKind::torque    ? "tau"
                             : kind == model::EffortKind::current ? "current"
                                                                  : "voltage";
  std::vector<std::size_t> columns;
  for (std::size_t c = 0; c < log.names.size(); ++c) {
    if (log.names[c].starts_with(prefix) || log.names[c] == "effort") {
      columns.push_back(c);
    }
  }
  return columns;
}

// Efforts of `count` different instants become wrong by ten times their root mean square.
void put_outliers(LogTable& log, model::EffortKind kind, std::size_t count, std::uint64_t seed) {
  const std::vector<std::size_t> columns = effort_columns(log, kind);
  if (count == 0 || columns.empty()) {
    return;
  }
  check::that(count <= log.rows(), "input outliers", "no more instants than the drive has");
  std::mt19937_64 generator(seed ^ 0x9e3779b97f4a7c15ULL);
  // Floyd's sampling without replacement.
  std::vector<std::size_t> rows;
  for (std::size_t j = log.rows() - count; j < log.rows(); ++j) {
    const auto at = std::min(static_cast<std::size_t>(core::uniform(generator) * static_cast<double>(j + 1)), j);
    rows.push_back(std::ranges::find(rows, at) == rows.end() ? at : j);
  }
  for (const std::size_t row : rows) {
    std::vector<double>& effort = log.columns[columns[generator() % columns.size()]];
    double square = 0.0;
    for (const double value : effort) {
      square += value * value;
    }
    const double size = 10.0 * std::sqrt(square / static_cast<double>(effort.size()));
    effort[row] += (generator() & 1U) != 0U ? size : -size;
  }
}

LogTable cut(const LogTable& log, double seconds) {
  const auto end = std::upper_bound(log.t.begin(), log.t.end(), log.t.front() + seconds);
  return core::slice(log, 0, static_cast<std::size_t>(end - log.t.begin()));
}

LogTable thinned(const LogTable& log, const Robot& robot, double rate) {
  const double step = core::median_step(log.t);
  const auto every = static_cast<std::size_t>(std::max(1.0, std::round(1.0 / (rate * step))));
  if (every == 1) {
    return log;
  }
  const bool angles = std::ranges::any_of(
      log.names, [](const std::string& name) { return name.starts_with("phi") || name == "position"; });
  check::that(angles || robot.speed_source == model::SpeedSource::measured, "input rate",
              "a log with wheel angles, or speed_source: measured in the robot file: means over a step cannot be "
              "thinned");
  LogTable out;
  out.names = log.names;
  out.columns.resize(log.columns.size());
  std::size_t segment = 0, since = 0;
  for (std::size_t row = 0; row < log.rows(); ++row) {
    if (segment < log.segment_starts.size() && log.segment_starts[segment] == row) {
      ++segment;
      since = 0;
      out.segment_starts.push_back(out.rows());
    }
    if (since++ % every == 0) {
      out.t.push_back(log.t[row]);
      for (std::size_t c = 0; c < log.columns.size(); ++c) {
        out.columns[c].push_back(log.columns[c][row]);
      }
    }
  }
  return out;
}

}  // namespace

const std::vector<StudyInputKind>& study_input_kinds() {
  static const std::vector<StudyInputKind> kinds = {
      {"noise.SENSOR", "", "bound on a sensor's noise, in the world and in the robot file"},
      {"declared.SENSOR", "", "bound on a sensor's noise as the robot file has it"},
      {"filter.alpha", "1/s", "filter constant α"},
      {"filter.beta", "1/s", "filter constant β; α follows it where the robot file gives none"},
      {"wheel_radius", "m", "wheel radius as the robot file has it"},
      {"track_width", "m", "track width as the robot file has it"},
      {"encoder_counts_per_turn", "1", "counts a turn of the wheel"},
      {"prior.NAME", "1",
       "width of the robot file's prior for NAME, as a factor (ratio of its ends where they are > 0)"},
      {"rate", "Hz", "samples a second; a recorded log is thinned"},
      {"duration", "s", "length of the drive, from its beginning"},
      {"outliers", "1", "instants at which an effort is wrong by ten times its root mean square"},
      {"outliers_allowed", "1", "instants that the feasible set may leave out"},
      {"excitation", "1", "speeds of the trajectory, as a factor", true},
      {"truth.NAME", "", "the true mass, yaw_inertia, viscous_linear or viscous_yaw", true},
      {"seed", "1", "seed of the noise: what luck is worth", true},
  };
  return kinds;
}

std::string unit_of_input(const std::string& name) {
  const StudyInputKind& kind = kind_of(name);
  if (kind.name.ends_with(".SENSOR")) {
    return noisy_sensor(name).unit;
  }
  if (kind.name == "truth.NAME") {
    static const std::pair<const char*, const char*> units[] = {
        {"mass", "kg"}, {"yaw_inertia", "kg·m²"}, {"viscous_linear", "N·s/m"}, {"viscous_yaw", "N·m·s/rad"}};
    return std::ranges::find(units, std::string_view(truth_of(name).name),
                             [](const auto& unit) { return std::string_view(unit.first); })
        ->second;
  }
  return kind.unit;
}

std::optional<double> nominal_of_input(const StudyCase& subject, const std::string& name) {
  const StudyInputKind& kind = kind_of(name);
  demand_scenario(subject, kind);
  const Robot& robot = subject.robot;
  if (kind.name == "declared.SENSOR") {
    return (robot.noise.*noisy_sensor(name).declared).value;
  }
  if (kind.name == "noise.SENSOR") {
    const NoisySensor& sensor = noisy_sensor(name);
    return subject.scenario ? subject.scenario->sensors.*sensor.simulated : (robot.noise.*sensor.declared).value;
  }
  if (kind.name == "prior.NAME") {
    StudyCase copy = subject;
    static_cast<void>(prior_of(copy, name));
    return 1.0;
  }
  if (kind.name == "truth.NAME") {
    return subject.scenario->parameters.*truth_of(name).value;
  }
  if (name == "filter.alpha") {
    return robot.filter.alpha ? robot.filter.alpha : robot.filter.beta;
  }
  if (name == "filter.beta") {
    return robot.filter.beta;
  }
  if (double Robot::*const geometry = length_of(name)) {
    const double length = robot.*geometry;
    return length > 0.0 ? std::optional(length) : std::nullopt;
  }
  if (name == "encoder_counts_per_turn") {
    return subject.scenario && subject.scenario->sensors.encoder_counts_per_turn
               ? subject.scenario->sensors.encoder_counts_per_turn
               : robot.encoder_counts_per_turn;
  }
  if (name == "rate") {
    return subject.scenario ? subject.scenario->rate : 1.0 / core::median_step(subject.log->t);
  }
  if (name == "duration") {
    return subject.scenario ? subject.scenario->duration : subject.log->t.back() - subject.log->t.front();
  }
  if (name == "excitation") {
    return 1.0;
  }
  if (name == "seed") {
    return static_cast<double>(subject.scenario->seed);
  }
  return static_cast<double>(name == "outliers" ? subject.outliers : subject.outliers_allowed);
}

void set_input(StudyCase& subject, const std::string& name, double x) {
  const StudyInputKind& kind = kind_of(name);
  demand_scenario(subject, kind);
  check::finite(x, "input " + name);
  Robot& robot = subject.robot;
  if (kind.name.ends_with(".SENSOR")) {
    const NoisySensor& sensor = noisy_sensor(name);
    (robot.noise.*sensor.declared).value = check::non_negative(x, "input " + name);
    if (subject.scenario && kind.name == "noise.SENSOR") {
      subject.scenario->sensors.*sensor.simulated = x;
    }
  } else if (kind.name == "prior.NAME") {
    Interval& prior = prior_of(subject, name);
    prior = widened(prior, check::positive(x, "input " + name));
  } else if (kind.name == "truth.NAME") {
    model::DriveParameters& truth = subject.scenario->parameters;
    truth.*truth_of(name).value = x;
    if (name == "truth.viscous_linear") {
      truth.viscous_y = x;
    }
  } else if (name == "filter.alpha" || name == "filter.beta") {
    (name == "filter.alpha" ? robot.filter.alpha : robot.filter.beta) = check::positive(x, "input " + name);
  } else if (double Robot::*const geometry = length_of(name)) {
    robot.*geometry = check::positive(x, "input " + name);
  } else if (name == "encoder_counts_per_turn") {
    robot.encoder_counts_per_turn = static_cast<double>(std::max<std::size_t>(whole(x, name), 1));
    if (subject.scenario) {
      subject.scenario->sensors.encoder_counts_per_turn = robot.encoder_counts_per_turn;
    }
  } else if (name == "rate" || name == "duration") {
    check::positive(x, "input " + name);
    if (subject.scenario) {
      (name == "rate" ? subject.scenario->rate : subject.scenario->duration) = x;
    } else {
      (name == "rate" ? subject.rate : subject.duration) = x;
    }
  } else if (name == "excitation") {
    check::that(subject.scenario->trajectory.kind != sim::Trajectory::Kind::table, "input excitation",
                "a trajectory that is not of kind table");
    subject.scenario->trajectory.speed *= check::positive(x, "input " + name);
    subject.scenario->trajectory.yaw_rate *= x;
  } else if (name == "seed") {
    subject.seed = whole(x, name);
  } else {
    (name == "outliers" ? subject.outliers : subject.outliers_allowed) = whole(x, name);
  }
}

LogTable drive_of_case(const StudyCase& subject) {
  LogTable log;
  if (subject.scenario) {
    Scenario scenario = *subject.scenario;
    scenario.seed = subject.seed.value_or(scenario.seed);
    log = sim::simulate(scenario);
  } else {
    check::that(subject.log != nullptr && subject.log->rows() > 1, "log", "a recorded log, or a scenario");
    log = subject.duration ? cut(*subject.log, *subject.duration) : *subject.log;
    if (subject.rate) {
      log = thinned(log, subject.robot, *subject.rate);
    }
  }
  put_outliers(log, subject.robot.effort, subject.outliers,
               subject.seed.value_or(subject.scenario ? subject.scenario->seed : 1));
  return log;
}

double Robot::*length_of(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, double Robot::*>, 2> lengths{
      {{"wheel_radius", &Robot::wheel_radius}, {"track_width", &Robot::track_width}}};
  const auto found = std::ranges::find(lengths, name, &std::pair<std::string_view, double Robot::*>::first);
  return found != lengths.end() ? found->second : nullptr;
}

}  // namespace wheelwright::study
