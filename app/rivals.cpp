// SPDX-License-Identifier: Apache-2.0
#include "rivals.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include <nlohmann/json.hpp>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/json.hpp>

#include "units.hpp"

namespace wheelwright::app {
namespace {

const Effect* find(const std::vector<Effect>& catalogue, const std::string& name) {
  const auto found = std::ranges::find(catalogue, name, &Effect::name);
  return found == catalogue.end() ? nullptr : &*found;
}

std::optional<double> estimate(const JsonPlace& parameters, const std::string& name) {
  return parameters.has(name) ? std::optional(parameters.at(name).at("estimate").number()) : std::nullopt;
}

// Takes what `parameters` has of the cause, by "prefix + parameter".
void take(RivalCause& cause, const Effect& effect, const JsonPlace& parameters, const std::string& prefix) {
  for (std::size_t c = 0; c < effect.parameters.size(); ++c) {
    cause.coefficients[c] = estimate(parameters, prefix + effect.parameters[c].name).value_or(cause.coefficients[c]);
  }
  for (std::size_t s = 0; s < effect.shapes.size(); ++s) {
    cause.shape[s] = estimate(parameters, prefix + effect.shapes[s].name).value_or(cause.shape[s]);
  }
}

void take_noise(const JsonPlace& root, const Model& model, PlannedNoise& noise) {
  if (!root.has("filter") || !root.at("filter").has("beta") || !root.has("shrink")) {
    return;
  }
  std::vector<double> floors;
  const JsonPlace figures = root.at("shrink").at("torque_rms");
  for (const std::string& output : model.outputs) {
    if (figures.has(output) && figures.at(output).has("floor") && figures.at(output).at("floor").number() > 0.0) {
      floors.push_back(figures.at(output).at("floor").number());
    }
  }
  if (floors.size() == model.n()) {
    noise.output = floors;
    noise.beta = root.at("filter").at("beta").number();
  }
}

void resize(Rival& rival, const std::vector<Effect>& catalogue, const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string what = text.substr(0, equals), effect = what.substr(0, what.find('.'));
  if (equals == std::string::npos) {
    throw InputError("--size " + text + ": expected EFFECT=VALUE or EFFECT.PARAMETER=VALUE");
  }
  const auto value = [&](const std::string& unit) {
    return quantity(text.substr(equals + 1), unit.empty() ? "1" : unit, "--size " + text);
  };
  for (RivalCause& cause : rival.causes) {
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
      const auto coefficient = std::ranges::find(known.parameters, name, &EffectParameter::name);
      const auto shape = std::ranges::find(known.shapes, name, &ShapeParameter::name);
      if (coefficient != known.parameters.end()) {
        cause.coefficients[static_cast<std::size_t>(coefficient - known.parameters.begin())] = value(coefficient->unit);
      } else if (shape != known.shapes.end()) {
        cause.shape[static_cast<std::size_t>(shape - known.shapes.begin())] = value(shape->unit);
      } else {
        std::string names;
        for (const EffectParameter& p : known.parameters) names += " " + p.name;
        for (const ShapeParameter& p : known.shapes) names += " " + p.name;
        throw InputError("--size " + text + ": " + effect + " has no parameter '" + name + "': expected one of" +
                         names);
      }
    }
  }
}

}  // namespace

std::vector<Rival> rivals_of_gap(const std::filesystem::path& file, const std::vector<Effect>& catalogue,
                                 const Drive& drive, PlannedNoise& noise) {
  const Json json = read_json(file);
  const JsonPlace root(json, file.string());
  if (root.at("schema").text() != "wheelwright/gap/1") {
    root.at("schema").fail("wheelwright/gap/1, a result of wheelwright gap");
  }
  take_noise(root, drive.model, noise);
  const JsonPlace causes = root.at("causes"), credible = root.at("credible_set");
  std::set<std::string> best;
  for (std::size_t k = 0; k < causes.size(); ++k) {
    best.insert(causes.at(k).at("effect").text());
  }
  std::vector<Rival> rivals;
  for (std::size_t i = 0; i < credible.size(); ++i) {
    const std::vector<std::string> effects = credible.at(i).at("effects").texts();
    const bool known = std::ranges::all_of(effects, [&](const std::string& name) {
      const Effect* effect = find(catalogue, name);
      return effect != nullptr && applicability(*effect, drive).applies;
    });
    if (effects.empty() || !known) {
      continue;
    }
    Rival rival = typical_rival(effects, catalogue, drive);
    if (credible.at(i).has("parameters")) {
      for (RivalCause& cause : rival.causes) {
        take(cause, *find(catalogue, cause.effect), credible.at(i).at("parameters"), cause.effect + ".");
      }
    } else if (std::set<std::string>(effects.begin(), effects.end()) == best) {
      for (std::size_t k = 0; k < causes.size(); ++k) {
        const std::string name = causes.at(k).at("effect").text();
        take(*std::ranges::find(rival.causes, name, &RivalCause::effect), *find(catalogue, name),
             causes.at(k).at("parameters"), "");
      }
    }
    rivals.push_back(std::move(rival));
  }
  if (rivals.size() < 2) {
    throw InputError(file.string() + ": /credible_set: expected at least two sets of causes to tell apart");
  }
  return rivals;
}

std::vector<Rival> rivals_named(const std::vector<std::string>& names, const std::vector<std::string>& sizes,
                                const std::vector<Effect>& catalogue, const Drive& drive) {
  std::vector<Rival> rivals;
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
    rivals.push_back(typical_rival(effects, catalogue, drive));
  }
  for (const std::string& size : sizes) {
    if (!all.contains(size.substr(0, size.find_first_of(".=")))) {
      throw InputError("--size " + size + ": expected an effect that is named with --between");
    }
    for (Rival& rival : rivals) {
      resize(rival, catalogue, size);
    }
  }
  return rivals;
}

void add_rivals(Json& result, const std::vector<Rival>& rivals, const std::vector<Effect>& catalogue) {
  for (const Rival& rival : rivals) {
    std::vector<std::string> effects;
    Json parameters = Json::object();
    for (const RivalCause& cause : rival.causes) {
      const Effect& effect = *std::ranges::find(catalogue, cause.effect, &Effect::name);
      const auto add = [&](const auto& parameter, double value) {
        parameters[effect.name + "." + parameter.name] = {{"estimate", value}, {"unit", parameter.unit}};
      };
      for (std::size_t c = 0; c < cause.coefficients.size(); ++c) {
        add(effect.parameters[c], cause.coefficients[c]);
      }
      for (std::size_t s = 0; s < cause.shape.size(); ++s) {
        add(effect.shapes[s], cause.shape[s]);
      }
      effects.push_back(cause.effect);
    }
    std::ranges::sort(effects);
    for (Json& member : result["credible_set"]) {
      auto own = member["effects"].get<std::vector<std::string>>();
      std::ranges::sort(own);
      if (own == effects) {
        member["parameters"] = parameters;
      }
    }
  }
}

}  // namespace wheelwright::app
