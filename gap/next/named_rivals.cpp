// SPDX-License-Identifier: Apache-2.0
#include "gap/next/named_rivals.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "commission/design/stages.hpp"
#include "core/error.hpp"
#include "gap/next/further_drive.hpp"

namespace wheelwright::gap {
namespace {

void resize(Rival& rival, const std::vector<Effect>& catalogue, const NamedSize& size) {
  const std::string effect = size.what.substr(0, size.what.find('.'));
  const auto value = [&](const std::string& unit) { return size.value(unit.empty() ? "1" : unit); };
  for (RivalCause& cause : rival.causes) {
    if (cause.effect != effect) {
      continue;
    }
    const Effect& known = *find_effect(catalogue, effect);
    if (size.what == effect && !cause.coefficients.empty()) {
      const double scale = value(known.parameters[0].unit) / cause.coefficients[0];
      std::ranges::for_each(cause.coefficients, [scale](double& c) { c *= scale; });
    } else if (size.what == effect) {
      cause.shape[0] = value(known.shapes[0].unit);
    } else {
      const std::string name = size.what.substr(effect.size() + 1);
      const auto coefficient = std::ranges::find(known.parameters, name, &EffectParameter::name);
      const auto shape = std::ranges::find(known.shapes, name, &ShapeParameter::name);
      if (coefficient != known.parameters.end()) {
        cause.coefficients[static_cast<std::size_t>(coefficient - known.parameters.begin())] = value(coefficient->unit);
      } else if (shape != known.shapes.end()) {
        cause.shape[static_cast<std::size_t>(shape - known.shapes.begin())] = value(shape->unit);
      } else {
        std::string names;
        for (const EffectParameter& p : known.parameters) {
          names += " " + p.name;
        }
        for (const ShapeParameter& p : known.shapes) {
          names += " " + p.name;
        }
        throw InputError(size.label + ": " + effect + " has no parameter '" + name + "': expected one of" + names);
      }
    }
  }
}

}  // namespace

std::vector<Rival> rivals_named(const std::vector<std::string>& names, const std::string& label,
                                const std::vector<NamedSize>& sizes, const std::vector<Effect>& catalogue,
                                const Drive& drive) {
  std::vector<Rival> rivals;
  std::set<std::string> all;
  for (const std::string& name : names) {
    std::vector<std::string> effects;
    for (std::size_t from = 0; from <= name.size();) {
      const std::size_t plus = std::min(name.find('+', from), name.size());
      effects.push_back(name.substr(from, plus - from));
      if (find_effect(catalogue, effects.back()) == nullptr) {
        throw InputError(label + name + ": '" + effects.back() + "' is no effect of the catalogue");
      }
      all.insert(effects.back());
      from = plus + 1;
    }
    rivals.push_back(typical_rival(effects, catalogue, drive));
  }
  for (const NamedSize& size : sizes) {
    if (!all.contains(size.what.substr(0, size.what.find('.')))) {
      throw InputError(size.label + ": expected an effect that is named with " +
                       label.substr(0, label.find_last_not_of(' ') + 1));
    }
    for (Rival& rival : rivals) {
      resize(rival, catalogue, size);
    }
  }
  return rivals;
}

Drive ordinary_drive(const design::DesignSubject& subject, const design::MotionLimits& limits) {
  const design::StageFamily family(subject, limits, 2);
  std::vector<double> x(family.dimension(), 0.5);
  x[0] = 1.0;
  x[1] = x.size() > 4 ? 1.0 : 0.5;
  x[family.dimension() / 2] = x.size() > 4 ? 1.0 : 0.0;
  x[family.dimension() / 2 + 1] = x.size() > 4 ? 0.0 : 0.5;
  return planned_drive(family.plan(x, subject.step), subject);
}

}  // namespace wheelwright::gap
