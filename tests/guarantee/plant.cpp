// SPDX-License-Identifier: Apache-2.0
#include "tests/guarantee/plant.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace wheelwright::guarantee {
namespace {

constexpr int kCuts = 8;           // of a piece, between which a wheel stops at most once
constexpr int kMostEvents = 4000;  // in one piece
constexpr int kHalvings = 200;
constexpr double kRounding = 1e-13;         // of a wheel's speed, against the faster one
constexpr double kLeast = 1e-12;            // of what is left of a piece, between two events; doubled from one to the
                                            // next where rounding lets none of the ways last ...
constexpr double kLasts = 1e-6;             // ... for so much of it
constexpr double kBreakaway = 1.0 + 1e-12;  // sticking over sliding friction: keeps rounding from deciding

}  // namespace

Plant::Weights Plant::Mode::weights(double s) const {
  if (s == h) {
    return last;
  }
  const double rate = friction / inertia;
  const double z = rate * s;
  Weights w{};
  w.decay = std::exp(-z);
  if (z < 0.5) {  // s^k Σ (−z)^i / (i + k)!
    double term[3] = {1.0, 0.5, 1.0 / 6.0};
    double sum[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < 24; ++i) {
      for (int k = 0; k < 3; ++k) {
        sum[k] += term[k];
        term[k] *= -z / static_cast<double>(i + k + 2);
      }
    }
    w.once = s * sum[0];
    w.twice = s * s * sum[1];
    w.thrice = s * s * s * sum[2];
  } else {
    w.once = -std::expm1(-z) / rate;
    w.twice = (s - w.once) / rate;
    w.thrice = (0.5 * s * s - w.twice) / rate;
  }
  h = s;
  last = w;
  return w;
}

Plant::Plant(const Truth& t) : joints_(t.axis ? 1 : 2), coulomb_(t.coulomb) {
  if (t.axis) {
    alone_ = {t.mass, t.viscous_linear};
    sum_ = difference_ = alone_;
  } else {
    const double r2 = t.radius * t.radius;
    sum_ = {0.5 * r2 * t.mass, 0.5 * r2 * t.viscous_linear};
    difference_ = {2.0 * r2 * t.yaw_inertia / (t.track * t.track), 2.0 * r2 * t.viscous_yaw / (t.track * t.track)};
    alone_ = {0.5 * (sum_.inertia + difference_.inertia), 0.5 * (sum_.friction + difference_.friction)};
  }
}

Plant::Sides Plant::after(double s, const Pair& effort, const Pair& slope) const {
  Sides result{};
  const auto solve = [s](const Mode& mode, double speed, double drive, double rise, double& v, double& x, double& a) {
    const Weights w = mode.weights(s);
    v = speed * w.decay + (drive * w.once + rise * w.twice) / mode.inertia;
    x = speed * w.once + (drive * w.twice + rise * w.thrice) / mode.inertia;
    a = (drive + rise * s - mode.friction * v) / mode.inertia;
  };
  Pair net{};
  for (std::size_t j = 0; j < joints_; ++j) {
    net[j] = effort[j] - coulomb_ * slipping_[j];
  }
  double a = 0.0;
  if (joints_ == 1) {
    if (slipping_[0] != 0) {
      solve(alone_, speed_[0], net[0], slope[0], result.speed[0], result.turned[0], a);
      result.rise[0] = a;
    } else {
      result.reaction[0] = effort[0] + slope[0] * s;
    }
    return result;
  }
  if (slipping_[0] != 0 && slipping_[1] != 0) {
    double p = 0.0, q = 0.0, p_turned = 0.0, q_turned = 0.0, p_rise = 0.0, q_rise = 0.0;
    solve(sum_, speed_[0] + speed_[1], net[0] + net[1], slope[0] + slope[1], p, p_turned, p_rise);
    solve(difference_, speed_[0] - speed_[1], net[0] - net[1], slope[0] - slope[1], q, q_turned, q_rise);
    result.speed = {0.5 * (p + q), 0.5 * (p - q)};
    result.turned = {0.5 * (p_turned + q_turned), 0.5 * (p_turned - q_turned)};
    result.rise = {0.5 * (p_rise + q_rise), 0.5 * (p_rise - q_rise)};
    return result;
  }
  for (std::size_t j = 0; j < 2; ++j) {
    const std::size_t other = 1 - j;
    if (slipping_[j] != 0) {
      solve(alone_, speed_[j], net[j], slope[j], result.speed[j], result.turned[j], a);
      result.rise[j] = a;
      const double passed_on =
          0.5 * ((sum_.inertia - difference_.inertia) * a + (sum_.friction - difference_.friction) * result.speed[j]);
      result.reaction[other] = effort[other] + slope[other] * s - passed_on;
    } else if (slipping_[other] == 0) {
      result.reaction[j] = effort[j] + slope[j] * s;
    }
  }
  return result;
}

bool Plant::holds(const Sides& sides) const {
  const double rounding = kRounding * std::max(std::abs(sides.speed[0]), std::abs(sides.speed[1]));
  for (std::size_t j = 0; j < joints_; ++j) {
    if (slipping_[j] == 0 ? std::abs(sides.reaction[j]) > coulomb_ * kBreakaway
                          : sides.speed[j] * slipping_[j] < -rounding) {
      return false;
    }
  }
  return true;
}

// Whether the wheels at rest do next what slipping_ says of them.
bool Plant::consistent(const Pair& effort, const Pair& slope) const {
  const Sides now = after(0.0, effort, slope);
  for (std::size_t j = 0; j < joints_; ++j) {
    if (speed_[j] != 0.0) {
      continue;
    }
    if (slipping_[j] == 0 ? std::abs(now.reaction[j]) > coulomb_ * kBreakaway : now.rise[j] * slipping_[j] <= 0.0) {
      return false;
    }
  }
  return true;
}

void Plant::choose_slipping(const Pair& effort, const Pair& slope) {
  constexpr std::array<int, 3> kWays = {0, 1, -1};
  const auto ways = [&](std::size_t j) { return j < joints_ && speed_[j] == 0.0 ? 3 : 1; };
  for (std::size_t j = 0; j < joints_; ++j) {
    slipping_[j] = speed_[j] > 0.0 ? 1 : -1;
  }
  for (int first = 0; first < ways(0); ++first) {
    for (int second = 0; second < ways(1); ++second) {
      if (ways(0) == 3) slipping_[0] = kWays[static_cast<std::size_t>(first)];
      if (ways(1) == 3) slipping_[1] = kWays[static_cast<std::size_t>(second)];
      if (consistent(effort, slope)) {
        return;
      }
    }
  }
  for (std::size_t j = 0; j < joints_; ++j) {  // on the very edge of breaking loose
    slipping_[j] = speed_[j] != 0.0 ? slipping_[j] : 0;
  }
}

void Plant::take(const Sides& sides) {
  const double rounding = kRounding * std::max(std::abs(sides.speed[0]), std::abs(sides.speed[1]));
  for (std::size_t j = 0; j < joints_; ++j) {
    angle_[j] += static_cast<long double>(sides.turned[j]);
    speed_[j] = coulomb_ > 0.0 && std::abs(sides.speed[j]) <= rounding ? 0.0 : sides.speed[j];
  }
}

void Plant::advance(double h, const Pair& effort, const Pair& slope) {
  if (coulomb_ == 0.0) {
    slipping_ = {1, 1};
    take(after(h, effort, slope));
    return;
  }
  double left = h, least = kLeast;
  Pair now = effort;
  for (int events = 0; left > 0.0; ++events) {
    if (events > kMostEvents) {
      throw std::runtime_error("plant: more events in a piece than there can be");
    }
    choose_slipping(now, slope);
    double good = 0.0, bad = -1.0;
    for (int cut = 1; cut <= kCuts; ++cut) {
      const double s = cut == kCuts ? left : left * cut / kCuts;
      if (!holds(after(s, now, slope))) {
        bad = s;
        break;
      }
      good = s;
    }
    if (bad < 0.0) {
      take(after(left, now, slope));
      return;
    }
    for (int k = 0; k < kHalvings; ++k) {
      const double middle = 0.5 * (good + bad);
      if (!(middle > good && middle < bad)) {
        break;
      }
      (holds(after(middle, now, slope)) ? good : bad) = middle;
    }
    least = good > kLasts * left ? kLeast : std::min(1.0, 2.0 * least);
    bad = std::max(bad, least * left);
    Sides sides = after(bad, now, slope);
    for (std::size_t j = 0; j < joints_; ++j) {
      if (slipping_[j] != 0 && sides.speed[j] * slipping_[j] < 0.0) {
        sides.speed[j] = 0.0;
      }
    }
    take(sides);
    now = {now[0] + slope[0] * bad, now[1] + slope[1] * bad};
    left -= bad;
  }
}

}  // namespace wheelwright::guarantee
