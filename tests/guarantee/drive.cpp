// SPDX-License-Identifier: Apache-2.0
#include "tests/guarantee/drive.hpp"

#include <algorithm>
#include <cmath>

#include "tests/guarantee/dice.hpp"

namespace wheelwright::guarantee {
namespace {

constexpr std::size_t kSines = 5;

// A signal of about size one for sum and difference each.
class Signal {
 public:
  Signal(const Order& order, double duration, std::uint64_t seed)
      : motion_(order.motion), top_(order.bandwidth), duration_(duration), dice_(seed) {
    for (std::size_t k = 0; k < kSines; ++k) {
      frequency_[k] = k == 0 ? top_ : top_ * dice_.decade(0.05, 1.0);
      phase_[k] = dice_.uniform(0.0, kTurn);
      weight_[k] = dice_.uniform(0.3, 1.0);
    }
    scale_ = 0.0;
    for (const double w : weight_) scale_ += w;
  }

  // To be asked for ascending times.
  double at(double t) {
    switch (motion_) {
      case Motion::multisine:
      case Motion::speed_loop: return sines(t);
      case Motion::saturated: return std::clamp(3.0 * sines(t), -0.7, 0.7);
      case Motion::chirp: {  // up and down again, from a twentieth of the bandwidth
        const double half = 0.5 * duration_;
        const double s = t < half ? t / half : 2.0 - t / half;
        const double low = 0.05 * top_;
        // ∫ low + (top − low) s² dt
        const double part = half * s * s * s / 3.0;
        const double turns = low * t + (top_ - low) * (t < half ? part : 2.0 * half / 3.0 - part);
        return std::sin(kTurn * turns + phase_[0]);
      }
      case Motion::staircase:
      case Motion::random_steps: break;
    }
    const double hold = 0.5 / top_;
    while (t >= until_) {
      until_ += motion_ == Motion::staircase ? hold * static_cast<double>(1 + dice_.below(8)) : hold;
      level_ = dice_.uniform(-1.0, 1.0);
    }
    return level_;
  }

 private:
  double sines(double t) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < kSines; ++k) sum += weight_[k] * std::sin(kTurn * frequency_[k] * t + phase_[k]);
    return sum / scale_ * 1.6;
  }

  Motion motion_;
  double top_, duration_, scale_ = 1.0, until_ = 0.0, level_ = 0.0;
  std::array<double, kSines> frequency_{}, phase_{}, weight_{};
  Dice dice_;
};

}  // namespace

Pair History::effort_at(double time) const {
  const auto next = std::upper_bound(ticks.begin(), ticks.end(), time);
  if (next == ticks.begin()) {
    return {0.0, 0.0};
  }
  const auto k = static_cast<std::size_t>(next - ticks.begin()) - 1;
  if (between == Between::held || k + 1 == ticks.size()) {
    return effort[k];
  }
  const double share = (time - ticks[k]) / (ticks[k + 1] - ticks[k]);
  return {effort[k][0] + share * (effort[k + 1][0] - effort[k][0]),
          effort[k][1] + share * (effort[k + 1][1] - effort[k][1])};
}

History drive(const Truth& truth, const Order& order, const std::vector<double>& ticks,
              const std::vector<double>& instants) {
  History h;
  h.ticks = ticks;
  h.between = order.between;
  h.effort.reserve(ticks.size());
  h.angle.reserve(instants.size());
  h.speed.reserve(instants.size());
  h.t = instants;
  const double duration = instants.back() - ticks.front();
  Signal sum(order, duration, order.seed), difference(order, duration, order.seed ^ 0xabcdef12345u);
  Plant plant(truth);
  const auto ask = [&](double t, const Pair& speed) -> Pair {
    const double s = sum.at(t - ticks.front());
    if (truth.axis) {
      return {order.motion == Motion::speed_loop ? order.gain * (order.speed * s - speed[0]) : order.reach[0] * s, 0.0};
    }
    const double d = difference.at(t - ticks.front());
    if (order.motion == Motion::speed_loop) {
      return {order.gain * (order.speed * (s + 0.5 * d) - speed[0]),
              order.gain * (order.speed * (s - 0.5 * d) - speed[1])};
    }
    return {order.reach[0] * s + order.reach[1] * d, order.reach[0] * s - order.reach[1] * d};
  };
  std::size_t look = 0;
  double now = ticks.front();
  h.effort.push_back(ask(now, plant.speed()));
  for (std::size_t k = 0; look < instants.size(); ++k) {
    const bool last = k + 1 == ticks.size();
    const double end = last ? instants.back() : ticks[k + 1];
    Pair slope{0.0, 0.0};
    if (order.between == Between::linear && !last) {  // the next effort is settled at the beginning of the piece
      h.effort.push_back(ask(end, plant.speed()));
      for (std::size_t j = 0; j < 2; ++j) slope[j] = (h.effort[k + 1][j] - h.effort[k][j]) / (end - ticks[k]);
    }
    const auto go_to = [&](double t) {
      if (t > now) {
        const double since = now - ticks[k];
        plant.advance(t - now, {h.effort[k][0] + slope[0] * since, h.effort[k][1] + slope[1] * since}, slope);
        now = t;
      }
    };
    while (look < instants.size() && (last || instants[look] < end)) {
      go_to(instants[look]);
      h.angle.push_back(plant.angle());
      h.speed.push_back(plant.speed());
      ++look;
    }
    go_to(end);
    if (order.between == Between::held && !last) {
      h.effort.push_back(ask(now, plant.speed()));
    }
    if (last) {
      break;
    }
  }
  h.effort.resize(ticks.size(), h.effort.back());
  return h;
}

}  // namespace wheelwright::guarantee
