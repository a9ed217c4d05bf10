// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "core/error.hpp"
#include "tests/world/case.hpp"

namespace wheelwright::reality {
namespace {

/// Streams of draws of a case.
enum Stream : std::uint64_t {
  of_robot = 1,
  of_baseline,
  of_real,
  of_fresh,
  of_kind,
  of_noise = 10,
  of_logger = 20,
  of_effect = 100,
  of_law = 1000
};

constexpr double short_drive = 45.0;  // s, to find severities

Drive first_part(const Drive& drive, double duration) {
  const auto count = std::min(drive.v1.size(), static_cast<std::size_t>(duration / Drive::step));
  Drive part;
  part.v1.assign(drive.v1.begin(), drive.v1.begin() + static_cast<std::ptrdiff_t>(count));
  part.v2.assign(drive.v2.begin(), drive.v2.begin() + static_cast<std::ptrdiff_t>(count));
  return part;
}

Kind draw_kind(Random& random) {
  const double u = random.uniform(0.0, 1.0);
  return u < 0.55 ? Kind::single : u < 0.75 ? Kind::pair : u < 0.85 ? Kind::none : Kind::outside;
}

const Entry& draw_entry(Random& random, Kind kind) {
  std::vector<const Entry*> able;
  const bool several = kind == Kind::pair || kind == Kind::triple;
  for (const Entry& entry : catalogue()) {
    const bool wanted = kind == Kind::outside ? entry.kind == Class::outside
                        : several             ? entry.kind == Class::structural
                                              : entry.kind != Class::outside;
    if (wanted) {
      able.push_back(&entry);
    }
  }
  return *able[random.below(able.size())];
}

/// Pairs of which one would hide the other, or that both have the rotor to themselves.
bool alike(const Subject& a, const Subject& b) {
  const auto family = [](const Subject& subject) {
    const std::string_view name = subject.entry->name;
    if (name == "delay" || name == "sensor_time_offset") {
      return std::string_view("actuator_lag");
    }
    if (name == "longitudinal_slip" && subject.law != nullptr) {
      return std::string_view("backlash");
    }
    return name == "coulomb_asymmetric" ? std::string_view("coulomb") : name;
  };
  return family(a) == family(b);
}

/// Makes the effect of a cause as its stream has it; a case uses the same one in every drive.
struct Source {
  const Request& request;
  std::uint64_t index;
  const RobotDesign& robot;

  [[nodiscard]] Effect make(const Subject& subject, std::uint64_t stream, double severity) const {
    return subject.make(robot, Random(request.seed, index, stream), severity);
  }
};

/// A severity and the gap that it makes.
struct Size {
  double severity = 0.0;
  Gap gap;
};

Gap gap_of(const Source& source, const Subject& subject, std::uint64_t stream, double severity, const Drive& drive,
           double beta) {
  std::vector<Effect> effects;
  effects.push_back(source.make(subject, stream, severity));
  const Record record = run_world(source.robot, effects, drive);
  return measure_gap(source.robot, signals_of(source.robot, record), beta);
}

/// The severity at which the gap is `target` per cent, within a tenth; none where the effect cannot reach `least`.
std::optional<Size> find_severity(const Source& source, const Subject& subject, std::uint64_t stream,
                                  const Drive& drive, double beta, double target, double least) {
  const Entry& entry = *subject.entry;
  const Drive part = entry.slow ? drive : first_part(drive, short_drive);
  double severity = std::min(target / 15.0, entry.largest);
  double low = 0.0;
  double high = entry.largest;
  Size best;
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 7; ++k) {
    double factor = 0.2;
    try {
      const Gap made = gap_of(source, subject, stream, severity, part, beta);
      const double gap = entry.kind == Class::parametric ? made.before : made.after;
      factor = target / std::max(gap, 1e-3);
      if (gap >= least && std::abs(std::log(factor)) < nearest) {
        nearest = std::abs(std::log(factor));
        best = {severity, made};
      }
    } catch (const Error&) {
      // Beyond what the robot stands.
    }
    (factor > 1.0 ? low : high) = severity;
    if (nearest < 0.12 || low >= entry.largest) {
      break;
    }
    // In proportion, but no further than the middle towards what was too large or too small.
    const double next = severity * std::clamp(factor, 0.2, 4.0);
    severity = next > low && next < high ? next : low > 0.0 ? std::sqrt(low * high) : 0.3 * high;
    severity = std::min(severity, entry.largest);
  }
  return best.severity > 0.0 ? std::optional(best) : std::nullopt;
}

/// Chooses the filter that the gap is measured with, and better sensors where noise would hide everything.
double settle_sensors(RobotDesign& robot, const Record& record, Random random, double largest, double& floor) {
  const Signals clean = signals_of(robot, record);
  for (;;) {
    const Signals log = signals_of(robot, sense(robot, record, random));
    for (const double beta : {20.0, 10.0, 5.0}) {
      floor = noise_floor(robot, clean, log, beta);
      if (floor <= largest) {
        return beta;
      }
    }
    if (robot.counts < 65536.0) {
      robot.counts *= 2.0;
    } else {
      robot.torque_noise *= 0.7;
    }
  }
}

}  // namespace

std::vector<Subject> subjects(std::string_view effect) {
  std::vector<Subject> all;
  for (const Entry& entry : catalogue()) {
    if (entry.kind == Class::outside || (!effect.empty() && effect != entry.name)) {
      continue;
    }
    const std::size_t before = all.size();
    for (const Law& law : laws()) {
      if (law.effect == entry.name) {
        all.push_back({&entry, &law});
      }
    }
    if (all.size() == before) {
      all.push_back({&entry, nullptr});
    }
  }
  return all;
}

namespace {

/// No severity makes a gap that stands out of the noise, or the one that does is more than the robot stands on some
/// drive.
class Unfit : public Error {
 public:
  using Error::Error;
};

/// `item` separates the draws of this case, and `subject` is what is withheld where every law is taken in turn.
Case draw_case(const Request& request, std::uint64_t item, const Subject* fixed) {
  const auto stream = [&](std::uint64_t number) { return Random(request.seed, item, number); };
  Case result;
  Random robot_draws = stream(of_robot);
  Lot lot;
  lot.noise = request.hard ? 3.0 : 1.0;
  lot.imperfect = request.hard || request.wide;
  if (request.wide) {
    lot.least = 0.5;
    lot.most = 500.0;
  }
  result.robot = draw_robot(robot_draws, lot);
  RobotDesign& robot = result.robot;
  const auto drive_of = [&](std::uint64_t number) {
    Random draws = stream(number);
    return draw_drive(robot, draws, request.duration);
  };
  const Drive real_drive = drive_of(of_real);

  std::vector<Effect> nothing;
  const Record baseline = run_world(robot, nothing, drive_of(of_baseline));
  double floor = 0.0;
  const double beta = settle_sensors(robot, baseline, stream(of_noise), request.hard ? 2.5 : 4.0, floor);
  result.healthy = measure_gap(robot, signals_of(robot, baseline), beta);

  Random draws = stream(of_kind);
  const Kind drawn = draw_kind(draws);
  Kind kind = request.kind == Kind::mixed ? drawn : request.kind;
  if (!request.effect.empty() || fixed != nullptr) {
    kind = Kind::single;
  }
  const std::size_t wanted = kind == Kind::none ? 0 : kind == Kind::pair ? 2 : kind == Kind::triple ? 3 : 1;
  const Source source{request, item, robot};
  std::vector<std::uint64_t> streams;
  for (std::uint64_t attempt = 0; result.causes.size() < wanted; ++attempt) {
    if (attempt == (fixed != nullptr ? 4U : 40U)) {
      throw Unfit(fmt::format("reality: no effect is large enough in case {}", item));
    }
    Subject subject;
    if (fixed != nullptr) {
      subject = *fixed;
    } else {
      subject.entry = request.effect.empty() ? &draw_entry(draws, kind) : &find_entry(request.effect);
      subject.law = request.laws.draw(subject.entry->name, stream(of_law + attempt));
    }
    const Entry& entry = *subject.entry;
    const double share = request.hard ? 1.0 / 3.0 : 1.0;
    const double least = std::max(3.0 * floor, request.low * share);
    const double target = draws.log_uniform(least, std::max(request.high * share, 1.2 * least));
    const double free = draws.log_uniform(0.4, 1.6) * share;
    if (std::any_of(result.causes.begin(), result.causes.end(),
                    [&](const Cause& cause) { return alike(cause.of, subject); })) {
      continue;
    }
    const std::uint64_t draw = of_effect + attempt;
    std::optional<Size> size;
    if (entry.kinematic) {
      const double severity = std::min(free, entry.largest);
      size = Size{severity, gap_of(source, subject, draw, severity, first_part(real_drive, short_drive), beta)};
    } else {
      size = find_severity(source, subject, draw, real_drive, beta, target, 0.9 * least);
    }
    if (size) {
      result.causes.push_back({subject, size->severity, size->gap.before, size->gap.after,
                               source.make(subject, draw, size->severity).parameters});
      streams.push_back(draw);
    }
  }

  const auto run = [&](const Drive& drive) {
    std::vector<Effect> effects;
    for (std::size_t k = 0; k < wanted; ++k) {
      effects.push_back(source.make(result.causes[k].of, streams[k], result.causes[k].severity));
    }
    try {
      return run_world(robot, effects, drive);
    } catch (const Error& error) {
      throw Unfit(error.what());
    }
  };
  const Record real = run(real_drive);
  const Record fresh = run(drive_of(of_fresh));
  const Signals clean = signals_of(robot, real);
  result.baseline = sense(robot, baseline, stream(of_noise));
  result.real = sense(robot, real, stream(of_noise + 1));
  result.fresh = sense(robot, fresh, stream(of_noise + 2));
  result.gap = measure_gap(robot, clean, beta);

  std::vector<std::string> truth;
  bool parametric = wanted > 0;
  for (const Cause& cause : result.causes) {
    truth.emplace_back(cause.of.entry->name);
    parametric = parametric && cause.of.entry->kind == Class::parametric;
  }
  const double real_floor = noise_floor(robot, clean, signals_of(robot, result.real), beta);
  result.oracle = ask_oracle(robot, clean, truth, parametric, std::max(real_floor, 0.05), beta);
  if (request.ordinary) {
    Random logger_draws = stream(of_logger);
    const Logger logger = draw_logger(logger_draws);
    std::uint64_t number = of_logger;
    for (LogTable* log : {&result.baseline, &result.real, &result.fresh}) {
      *log = write_down(logger, *log, 1.0 / robot.rate, stream(++number));
    }
  }
  return result;
}

}  // namespace

Case make_case(const Request& request, std::uint64_t index) {
  const std::vector<Subject> all = request.each ? subjects(request.effect) : std::vector<Subject>();
  // Some robots cannot show some effects: a light rotor its play. Another robot is drawn then.
  constexpr std::uint64_t robots = 8;
  for (std::uint64_t k = 0;; ++k) {
    try {
      return draw_case(request, index + (k << 32), request.each ? &all[index % all.size()] : nullptr);
    } catch (const Unfit&) {
      if (k + 1 == robots) {
        throw;
      }
    }
  }
}

std::string designers_xml(const RobotDesign& robot) {
  Body body = robot.body;
  body.radius.fill(robot.radius);
  body.half_track = robot.half_track;
  body.friction.fill(0.0);
  body.motor = "gear=\"1\"";
  return engine_xml(body, 0.001);
}

std::string robot_yaml(const RobotDesign& robot, const std::string& name) {
  return fmt::format(
      "name: {}\nmodel: differential_drive\nwheel_radius: {:.6g}\ntrack_width: {:.6g}\nlever_arm: half_track\n"
      "effort: {{kind: torque, hold: first_order}}\nnominal: {{mass: {:.6g}, yaw_inertia: {:.6g}}}\nnoise: estimate\n"
      "filter: auto\nencoder_counts_per_turn: {:.0f}\nlimits: {{effort: {:.4g}}}\n",
      name, robot.radius, 2.0 * robot.half_track, robot.mass, robot.yaw_inertia, robot.counts, robot.effort_limit);
}

}  // namespace wheelwright::reality
