// SPDX-License-Identifier: Apache-2.0
#include "tests/guarantee/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "tests/guarantee/dice.hpp"

namespace wheelwright::guarantee {
namespace {

constexpr double kWithin = 1.0 - 1e-9;  // errors stay this far inside their bounds, for roundings
constexpr std::size_t kMostLost = 3;    // rows in a row
constexpr std::size_t kFine = 16;       // knots of a smooth effort in a step
constexpr double kMemory = 8.0;         // of a filter, time constants

std::vector<double> grid(const Case& c, std::size_t rows, Dice& dice) {
  std::vector<double> t{0.0};
  const double h = 1.0 / c.rate;
  for (std::size_t k = 1; k < rows; ++k) {
    switch (c.stamps) {
      case Stamps::even: t.push_back(static_cast<double>(k) / c.rate); break;
      case Stamps::jittered: t.push_back(t.back() + h * (1.0 + c.jitter * dice.uniform(-1.0, 1.0))); break;
      case Stamps::two_three: t.push_back(static_cast<double>(5 * (k / 2) + 2 * (k % 2)) * 0.4 / c.rate); break;
      case Stamps::tenth_twice: t.push_back(static_cast<double>(k + k / 10) / 1.1 / c.rate); break;
    }
  }
  return t;
}

std::vector<double> controller_ticks(double rate, double end, Dice& dice) {
  std::vector<double> t{0.0};
  const double offset = dice.uniform(0.05, 0.95);
  for (std::size_t k = 0; t.back() <= end; ++k) {
    t.push_back((static_cast<double>(k) + offset) / rate);
  }
  return t;
}

std::vector<double> fine_knots(const std::vector<double>& stamps) {
  std::vector<double> t;
  for (std::size_t k = 0; k + 1 < stamps.size(); ++k) {
    for (std::size_t i = 0; i < kFine; ++i) {
      t.push_back(stamps[k] + (stamps[k + 1] - stamps[k]) * static_cast<double>(i) / kFine);
    }
  }
  t.push_back(stamps.back());
  return t;
}

// What a filter that is turned against is taken to do with its samples.
enum class Kernel {
  angles,       ///< f₂″, with the newest sample's own weight
  mean_speeds,  ///< slopes of the mean speeds of the intervals, linear between their middles
  speeds,       ///< f₂′
};

// Weights of the motion samples first … last in the filtered acceleration after sample `last`.
std::vector<double> weights(const std::vector<double>& t, std::size_t first, std::size_t last, double beta,
                            Kernel kernel) {
  std::vector<double> w(last - first + 1);
  const auto f2 = [&](double since) { return since > 0.0 ? since * std::exp(-beta * since) : 0.0; };
  if (kernel == Kernel::mean_speeds) {
    const auto middle = [&](std::size_t k) { return 0.5 * (t[k - 1] + t[k]); };
    const double end = middle(last);
    // Weight of the slope between the middles of the intervals before and after sample k.
    const auto slope = [&](std::size_t k) {
      return k < last && k > first ? f2(end - 0.5 * (middle(k) + middle(k + 1))) : 0.0;
    };
    for (std::size_t k = first + 2; k <= last; ++k) {  // mean speed of the interval that ends at k
      const double of_speed = (slope(k - 1) - slope(k)) / (t[k] - t[k - 1]);
      w[k - first] += of_speed;
      w[k - 1 - first] -= of_speed;
    }
    return w;
  }
  for (std::size_t k = first; k <= last; ++k) {
    const double since = beta * (t[last] - t[k]);
    w[k - first] = kernel == Kernel::angles ? (k == last || since > 2.0 ? 1.0 : -1.0) : (since < 1.0 ? 1.0 : -1.0);
  }
  return w;
}

// Which side each sample's motion error takes to turn the rows at some instants one way, and the effort's.
struct Sides {
  std::vector<double> motion, effort;
};

Sides turned_against(const std::vector<double>& t, const std::vector<double>& speed, double beta, Kernel kernel,
                     double way) {
  const std::size_t n = t.size();
  std::vector<double> filtered(n, 0.0);  // of the acceleration
  double z1 = speed[0], z2 = speed[0];
  for (std::size_t k = 1; k < n; ++k) {
    const double decay = std::exp(-beta * (t[k] - t[k - 1]));
    z1 = decay * z1 + (1.0 - decay) * speed[k];
    z2 = decay * z2 + (1.0 - decay) * z1;
    filtered[k] = z1 - z2;
  }
  Sides sides{std::vector<double>(n, way), std::vector<double>(n, way)};
  for (std::size_t first = 0; first < n;) {
    // The largest between one and two lengths of the filter's memory from here.
    std::size_t target = first;
    for (std::size_t i = first; i < n && t[i] < t[first] + 2.0 * kMemory / beta; ++i) {
      const bool early = t[target] < t[first] + kMemory / beta;
      target = early || std::abs(filtered[i]) > std::abs(filtered[target]) ? i : target;
    }
    const double push = filtered[target] < 0.0 ? -way : way;
    const std::vector<double> w = weights(t, first, target, beta, kernel);
    for (std::size_t k = first; k <= target; ++k) {
      sides.motion[k] = w[k - first] < 0.0 ? push : -push;
      sides.effort[k] = push;
    }
    first = target + 1;
  }
  return sides;
}

double error(Noise noise, Dice& dice, double side) {
  switch (noise) {
    case Noise::uniform: return dice.uniform(-1.0, 1.0);
    case Noise::two_point: return dice.sign();
    case Noise::plus: return 1.0;
    case Noise::minus: return -1.0;
    case Noise::clipped_bell: return std::clamp(3.0 * dice.bell(), -1.0, 1.0);
    case Noise::against_heavy:
    case Noise::against_light: return side;
  }
  return 0.0;
}

std::vector<std::string> columns(const Case& c) {
  const bool angles = c.sense == Sense::angle || c.sense == Sense::encoder;
  if (c.truth.axis) {
    return {angles ? "position" : "velocity", "effort"};
  }
  return angles ? std::vector<std::string>{"phi_r", "phi_l", "tau_r", "tau_l"}
                : std::vector<std::string>{"omega_r", "omega_l", "tau_r", "tau_l"};
}

// What else there is to a recording.
struct Extra {
  Scene* exact = nullptr;                // takes the exact speeds
  std::uint64_t take = 0;                // of the same drive, with errors of its own
  const Breakdown* breakdown = nullptr;  // what breaks
};

// One drive and its log; `stray` grows to what a smooth effort strays from linear between stamps.
LogTable record(const Case& c, const Order& order, Noise noise, std::size_t rows, std::uint64_t salt, double& stray,
                const Extra& extra = {}) {
  Dice drive_dice(c.seed * 0x2545f4914f6cdd1du + salt);
  const std::vector<double> all = grid(c, rows + 1, drive_dice);
  const double end = all.back();
  Order asked = order;
  asked.between = c.changes == Changes::linear || c.changes == Changes::smooth ? Between::linear : Between::held;
  std::vector<double> ticks = all;
  if (c.changes == Changes::between || c.broken == Broken::unlogged_commands) {
    ticks = controller_ticks(c.controller_rate, end, drive_dice);
  } else if (c.changes == Changes::smooth) {
    ticks = fine_knots(all);
  }

  std::vector<double> kept;
  std::size_t missing = 0;
  int left = 0;  // of a burst
  for (std::size_t k = 1; k + 1 < all.size(); ++k) {
    if (left > 0) {
      ++missing;
      --left;
    } else if (missing < kMostLost && kept.size() > 1 && drive_dice.chance(c.lost)) {
      ++missing;
      left = c.burst - 1;
    } else {
      kept.push_back(all[k]);
      missing = 0;
    }
  }

  Dice dice(drive_dice.bits() + extra.take);

  // Instants to look at: the rows, or for mean speeds both ends of each.
  const double half = 0.5 / c.rate;
  const bool backward = c.broken == Broken::backward_speeds;
  std::vector<double> looks;
  if (c.sense == Sense::mean_speed) {
    for (const double t : kept) {
      looks.push_back(backward ? t - 2.0 * half : t - half);
      looks.push_back(backward ? t : t + half);
    }
    // Row by row, ends of neighbours coincide but for rounding: look in order.
    std::sort(looks.begin(), looks.end());
  } else {
    looks = kept;
  }
  const History h = drive(c.truth, asked, ticks, looks);

  const std::size_t joints = c.truth.axis ? 1 : 2;
  const std::size_t n = kept.size();
  const auto at = [&](std::size_t row, bool late) -> std::size_t {
    return c.sense == Sense::mean_speed ? 2 * row + (late ? 1 : 0) : row;
  };
  Sides sides{std::vector<double>(n, 1.0), std::vector<double>(n, 1.0)};
  const bool turn = dice.chance(0.4) && joints == 2;  // against the yaw inertia
  if (noise == Noise::against_heavy || noise == Noise::against_light) {
    std::vector<double> speed(n);
    for (std::size_t k = 0; k < n; ++k) {
      const Pair& v = h.speed[at(k, true)];
      speed[k] = joints == 1 ? v[0] : (turn ? v[0] - v[1] : v[0] + v[1]);
    }
    const Kernel kernel = c.sense != Sense::angle ? Kernel::speeds
                          : dice.chance(0.5)      ? Kernel::angles
                                                  : Kernel::mean_speeds;
    const double way = noise == Noise::against_heavy ? 1.0 : -1.0;
    sides = turned_against(kept, speed, c.beta.value_or(kTurn * order.bandwidth), kernel, way);
  }

  LogTable log;
  log.names = columns(c);
  log.t = kept;
  log.columns.assign(2 * joints, std::vector<double>(n));
  const double count = c.counts ? kTurn / *c.counts : 0.0;
  const double offset = dice.share();  // of the angles from a count
  const auto breaks = [&](std::size_t j, std::size_t k) {
    return extra.breakdown != nullptr && j == 0 && kept[k] >= extra.breakdown->onset;
  };
  std::array<std::optional<double>, 2> whole;  // angles from which a broken encoder counts
  double widest = 0.0;
  for (const Pair& e : h.effort) widest = std::max({widest, std::abs(e[0]), std::abs(e[1])});
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t j = 0; j < joints; ++j) {
      const double of_turn = turn && j == 1 ? -1.0 : 1.0;
      double& motion = log.columns[j][k];
      const double off = kWithin * c.motion_bound * error(noise, dice, of_turn * sides.motion[k]);
      double angle = h.angle[at(k, true)][j], speed = h.speed[at(k, true)][j];
      if (breaks(j, k) && extra.breakdown->kind == Breakdown::Kind::encoder_scale) {
        whole[j] = whole[j].value_or(angle);
        angle += extra.breakdown->size * (angle - *whole[j]);
        speed += extra.breakdown->size * speed;
      }
      switch (c.sense) {
        case Sense::angle: motion = angle + off; break;
        case Sense::encoder: motion = std::round(angle / count + offset) * count; break;
        case Sense::speed: motion = speed + off; break;
        case Sense::whole_rpm: motion = std::round(speed / (kTurn / 60.0)) * (kTurn / 60.0); break;
        case Sense::mean_speed: {
          const double counted = std::floor(h.angle[at(k, true)][j] / count + offset) -
                                 std::floor(h.angle[at(k, false)][j] / count + offset);
          motion = counted * count * c.rate;
          break;
        }
      }
      if (c.broken == Broken::wrapped_angles) {
        motion -= kTurn * std::floor(motion / kTurn);
      }
      double when = kept[k];
      if (c.broken == Broken::late_efforts || c.delay_declared) {
        when -= c.delay;
      } else if (c.broken == Broken::torque_late) {
        when = k > 0 ? kept[k - 1] : 0.0;
      }
      double effort = h.effort_at(when)[j];
      if (breaks(j, k) && extra.breakdown->kind == Breakdown::Kind::effort_loss) {
        effort /= 1.0 - extra.breakdown->size;
      } else if (breaks(j, k) && extra.breakdown->kind == Breakdown::Kind::effort_bias) {
        effort += extra.breakdown->size;
      }
      effort += kWithin * c.effort_bound * error(noise, dice, of_turn * sides.effort[k]);
      if (c.broken == Broken::clipped_effort) {
        effort = std::clamp(effort, -0.6 * widest, 0.6 * widest);
      }
      log.columns[joints + j][k] = effort;
    }
    if (c.broken == Broken::stamps_off) {
      const double least = k > 0 ? log.t[k - 1] + 0.01 / c.rate : -1.0;
      log.t[k] = std::max(least, kept[k] + c.delay * dice.uniform(-1.0, 1.0));
    }
  }

  if (extra.exact != nullptr) {
    extra.exact->exact_t = fine_knots(all);
    for (const Pair& v : drive(c.truth, asked, ticks, extra.exact->exact_t).speed) {
      extra.exact->exact_speed.push_back(joints == 1 ? v[0] : 0.5 * c.truth.radius * (v[0] + v[1]));
      double sign = 0.0, resting = 0.0;
      for (std::size_t j = 0; j < joints; ++j) {
        sign += double(v[j] > 0.0) - double(v[j] < 0.0);
        resting += v[j] == 0.0 ? 1.0 : 0.0;
      }
      extra.exact->exact_sign.push_back(sign);
      extra.exact->exact_resting.push_back(resting);
    }
  }
  if (c.changes == Changes::smooth) {
    std::size_t k = 0;
    for (std::size_t i = 0; i < h.ticks.size(); ++i) {
      while (k + 2 < n && kept[k + 1] <= h.ticks[i]) ++k;
      if (h.ticks[i] < kept[k] || h.ticks[i] > kept[k + 1]) continue;
      const double share = (h.ticks[i] - kept[k]) / (kept[k + 1] - kept[k]);
      const Pair before = h.effort_at(kept[k]), after = h.effort_at(kept[k + 1]);
      for (std::size_t j = 0; j < joints; ++j) {
        stray = std::max(stray, std::abs(h.effort[i][j] - before[j] - share * (after[j] - before[j])));
      }
    }
  }
  return log;
}

}  // namespace

Scene play(const Case& c, bool exact) {
  Scene s;
  double stray = 0.0;
  s.learned = record(c, c.learn, c.noise, c.rows, 1, stray, {.exact = exact ? &s : nullptr});
  s.watched = record(c, c.watch, c.noise_watch, c.watch_rows, 2, stray);

  const Truth& t = c.truth;
  Robot& r = s.robot;
  r.model = t.axis ? "single_axis" : "differential_drive";
  r.wheel_radius = t.axis ? 0.0 : t.radius;
  r.wheel_directions_checked = !t.axis;
  r.track_width = t.axis ? 0.0 : t.track;
  const bool held = c.changes == Changes::at_samples || c.changes == Changes::between;
  r.hold = held != (c.broken == Broken::hold_wrong) ? Hold::zero_order : Hold::first_order;
  r.effort_changes = c.changes == Changes::between ? model::EffortChanges::between : model::EffortChanges::at_samples;
  if (c.broken == Broken::unlogged_commands) {
    r.effort_changes = model::EffortChanges::between;
  }
  // Whose efforts are in time says so; who does not know that they are late says nothing.
  if (c.broken == Broken::none) {
    r.effort_time_origin = model::EffortTimeOrigin::declared;
  }
  if (c.delay_declared) {
    r.effort_delay = {0.0, c.delay * (1.0 + 1e-9)};
  }
  switch (c.sense) {
    case Sense::angle: (t.axis ? r.noise.position : r.noise.wheel_angle).value = c.motion_bound; break;
    case Sense::speed:
    case Sense::whole_rpm: r.noise.wheel_speed.value = c.motion_bound; break;
    case Sense::encoder:
    case Sense::mean_speed: break;
  }
  if (c.counts && c.declare_counts) {
    r.encoder_counts_per_turn = c.counts;
  }
  r.speed_source = c.speed_source;
  r.noise.effort.value = c.effort_bound + stray;
  if (c.beta) {
    r.filter = {.order = 2, .alpha = c.beta, .beta = c.beta};
  }
  const std::string mass = t.axis ? "inertia" : "mass";
  if (c.prior) {
    r.prior[mass] = {t.mass / *c.prior, t.mass * *c.prior};
    if (!t.axis) {
      r.prior["yaw_inertia"] = {t.yaw_inertia / *c.prior, t.yaw_inertia * *c.prior};
      r.prior["viscous_linear"] = {0.0, t.viscous_linear * *c.prior};
      r.prior["viscous_yaw"] = {0.0, t.viscous_yaw * *c.prior};
    } else {
      r.prior["viscous"] = {0.0, t.viscous_linear * *c.prior};
    }
    if (t.coulomb > 0.0 && c.broken != Broken::hidden_friction) {
      r.prior["coulomb"] = {0.0, t.coulomb * *c.prior};
    }
  }
  s.truth = t.axis ? std::map<std::string, double>{{"inertia", t.mass}, {"viscous", t.viscous_linear}}
                   : std::map<std::string, double>{{"mass", t.mass},
                                                   {"yaw_inertia", t.yaw_inertia},
                                                   {"viscous_linear", t.viscous_linear},
                                                   {"viscous_yaw", t.viscous_yaw}};
  s.truth["coulomb"] = t.coulomb;
  s.truth["offset"] = 0.0;
  if (c.declare_parameters) {
    std::vector<std::string> names =
        t.axis ? std::vector<std::string>{"inertia", "viscous"}
               : std::vector<std::string>{"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};
    if (t.coulomb > 0.0 && c.broken != Broken::hidden_friction) {
      names.emplace_back("coulomb");
    }
    r.parameters = names;
  }
  return s;
}

LogTable watch_broken(const Case& c, const Breakdown& breakdown) {
  double unused = 0.0;
  return record(c, c.watch, c.noise_watch, c.watch_rows, 2, unused, {.take = 1, .breakdown = &breakdown});
}

void reach_for(const Truth& t, double angle, Order& order) {
  const double w = kTurn * order.bandwidth;
  const double r2 = 0.5 * t.radius * t.radius;
  const double speed = w * angle;
  const double turn = 4.0 / (t.track * t.track);
  const double heavy = t.axis ? t.mass : r2 * t.mass;
  const double thick = t.axis ? t.viscous_linear : r2 * t.viscous_linear;
  order.reach[0] = std::hypot(w * heavy, thick) * speed + 1.5 * t.coulomb;
  order.reach[1] =
      t.axis ? 0.0 : 0.7 * std::hypot(w * r2 * turn * t.yaw_inertia, r2 * turn * t.viscous_yaw) * speed + t.coulomb;
  order.speed = speed;
}

}  // namespace wheelwright::guarantee
