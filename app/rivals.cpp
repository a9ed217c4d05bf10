// SPDX-License-Identifier: Apache-2.0
#include "rivals.hpp"

#include <algorithm>
#include <set>

#include <wheelwright/core/error.hpp>

#include "units.hpp"

namespace wheelwright::app {
namespace {

const Effect* find(const std::vector<Effect>& catalogue, const std::string& name) {
  const auto found = std::ranges::find(catalogue, name, &Effect::name);
  return found == catalogue.end() ? nullptr : &*found;
}

void resize(gap::Rival& rival, const std::vector<Effect>& catalogue, const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string what = text.substr(0, equals), effect = what.substr(0, what.find('.'));
  if (equals == std::string::npos) {
    throw InputError("--size " + text + ": expected EFFECT=VALUE or EFFECT.PARAMETER=VALUE");
  }
  const auto value = [&](const std::string& unit) {
    return quantity(text.substr(equals + 1), unit.empty() ? "1" : unit, "--size " + text);
  };
  for (gap::RivalCause& cause : rival.causes) {
    if (cause.effect != effect) {
      continue;
    }
    const Effect& known = *find(catalogue, effect);
    if (what == effect && !cause.coefficients.empty()) {
      const double scale = value(known.parameters[0].unit) / cause.coefficients[0];
      std::ranges::for_each(cause.coefficients, [scale](double& c) { c *= scale; });
    } else if (what == effect) {
      cause.shape[0] = value(known.shapes[0].unit);
    } else {
      const std::string name = what.substr(effect.size() + 1);
      const auto coefficient = std::ranges::find(known.parameters, name, &gap::EffectParameter::name);
      const auto shape = std::ranges::find(known.shapes, name, &gap::ShapeParameter::name);
      if (coefficient != known.parameters.end()) {
        cause.coefficients[static_cast<std::size_t>(coefficient - known.parameters.begin())] = value(coefficient->unit);
      } else if (shape != known.shapes.end()) {
        cause.shape[static_cast<std::size_t>(shape - known.shapes.begin())] = value(shape->unit);
      } else {
        std::string names;
        for (const gap::EffectParameter& p : known.parameters) names += " " + p.name;
        for (const gap::ShapeParameter& p : known.shapes) names += " " + p.name;
        throw InputError("--size " + text + ": " + effect + " has no parameter '" + name + "': expected one of" +
                         names);
      }
    }
  }
}

}  // namespace

std::vector<gap::Rival> rivals_named(const std::vector<std::string>& names, const std::vector<std::string>& sizes,
                                     const std::vector<Effect>& catalogue, const gap::Drive& drive) {
  std::vector<gap::Rival> rivals;
  std::set<std::string> all;
  for (const std::string& name : names) {
    std::vector<std::string> effects;
    for (std::size_t from = 0; from <= name.size();) {
      const std::size_t plus = std::min(name.find('+', from), name.size());
      effects.push_back(name.substr(from, plus - from));
      if (find(catalogue, effects.back()) == nullptr) {
        throw InputError("--between " + name + ": '" + effects.back() + "' is no effect of the catalogue");
      }
      all.insert(effects.back());
      from = plus + 1;
    }
    rivals.push_back(gap::typical_rival(effects, catalogue, drive));
  }
  for (const std::string& size : sizes) {
    if (!all.contains(size.substr(0, size.find_first_of(".=")))) {
      throw InputError("--size " + size + ": expected an effect that is named with --between");
    }
    for (gap::Rival& rival : rivals) {
      resize(rival, catalogue, size);
    }
  }
  return rivals;
}

}  // namespace wheelwright::app
