// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/error.hpp"
#include "tests/world/law.hpp"

namespace wheelwright::reality {

const std::vector<Law>& laws() {
  static const std::vector<Law> all = [] {
    std::vector<Law> sorted;
    std::vector<Law> table = friction_laws();
    const std::vector<Law> more = drive_laws();
    table.insert(table.end(), more.begin(), more.end());
    for (const Entry& entry : catalogue()) {
      std::copy_if(table.begin(), table.end(), std::back_inserter(sorted),
                   [&](const Law& law) { return law.effect == entry.name; });
    }
    return sorted;
  }();
  return all;
}

LawChoice::LawChoice(std::string_view text) {
  if (text == "given") {
    return;
  }
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::string_view word = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
    const std::size_t before = able_.size();
    for (const Law& law : drawn_laws()) {
      if (word == "drawn") {
        able_.push_back(&law);
      }
    }
    for (const Law& law : laws()) {
      const bool named = word == "all" || (word == "other" && !law.formula) || word == law.name ||
                         (word.size() == law.effect.size() + law.name.size() + 1 && word.starts_with(law.effect) &&
                          word.ends_with(law.name));
      if (named) {
        able_.push_back(&law);
      }
    }
    if (able_.size() == before) {
      throw InvalidArgument(fmt::format(
          "--laws: no law '{}'; given, all, other, drawn, a law or effect/law of `wheelwright-reality laws`", word));
    }
  }
}

const Law* LawChoice::draw(std::string_view effect, Random random) const {
  std::vector<const Law*> fit;
  std::copy_if(able_.begin(), able_.end(), std::back_inserter(fit),
               [&](const Law* law) { return law->effect == effect; });
  return fit.empty() ? nullptr : fit[random.below(fit.size())];
}

double Table::operator()(double x) const {
  const auto right = static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), x) - at.begin());
  if (right == 0 || right == at.size()) {
    return right == 0 ? value.front() : value.back();
  }
  const double part = (x - at[right - 1]) / (at[right] - at[right - 1]);
  return value[right - 1] + part * (value[right] - value[right - 1]);
}

Friction static_friction(Curve level) {
  return [level = std::move(level)](double speed, double) { return level(std::abs(speed)) * soft_sign(speed, creep); };
}

Friction lugre(Curve g, double stiffness, double damping) {
  return [g = std::move(g), stiffness, damping, z = 0.0](double speed, double step) mutable {
    const double before = z;
    z = (z + step * speed) / (1.0 + step * stiffness * std::abs(speed) / g(std::abs(speed)));
    return stiffness * z + damping * (z - before) / step;
  };
}

Friction dahl(double c, double stiffness, double exponent) {
  return [=, share = 0.0](double speed, double step) mutable {
    const double hand = speed < 0.0 ? -1.0 : 1.0;
    const double moved = stiffness / c * std::abs(speed) * step;
    double rest = 1.0 - hand * share;
    if (exponent == 1.0) {
      rest *= std::exp(-moved);
    } else if (rest > 0.0) {
      const double power = 1.0 - exponent;
      const double base = std::pow(rest, power) - power * moved;
      rest = base > 0.0 ? std::pow(base, 1.0 / power) : 0.0;
    }
    share = hand * (1.0 - rest);
    return c * share;
  };
}

double PlayOperator::operator()(double input) {
  state = std::clamp(state, input - half, input + half);
  return state;
}

double MagicFormula::operator()(double slip) const {
  const double x = b * slip;
  return d * std::sin(c * std::atan(x - e * (x - std::atan(x))));
}

double BrushTyre::operator()(double slip) const {
  const double u = std::abs(slip) * stiffness / (3.0 * limit);
  return std::copysign(u < 1.0 ? limit * (3.0 * u - 3.0 * u * u + u * u * u) : limit, slip);
}

double Gear::step(double torque, double wheel_speed, double load, double step) {
  constexpr int substeps = 10;
  const double h = step / substeps;
  const double both = 1.0 / (1.0 / rotor + 1.0 / wheel);
  double impulse = 0.0;
  for (int k = 0; k < substeps; ++k) {
    double passed = 0.0;
    const double hand = offset >= 0.5 * gap ? 1.0 : offset <= -0.5 * gap ? -1.0 : 0.0;
    const double approach = hand * (speed - wheel_speed);
    if (hand != 0.0 && approach > 0.0) {
      passed = hand * both * approach * (1.0 + (approach > slow ? restitution : 0.0));
    }
    if (hand != 0.0 && approach <= slow) {
      // At rest against the stop: both are accelerated alike as long as it is pushed.
      const double push = hand * both * (torque / rotor - load);
      passed += push > 0.0 ? hand * push * h : 0.0;
    }
    speed += (h * torque - passed) / rotor;
    wheel_speed += h * load + passed / wheel;
    offset = std::clamp(offset + h * (speed - wheel_speed), -0.5 * gap, 0.5 * gap);
    impulse += passed;
  }
  return impulse / step;
}

}  // namespace wheelwright::reality
