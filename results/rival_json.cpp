// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/rival_json.hpp>

#include <algorithm>
#include <optional>
#include <set>

#include <nlohmann/json.hpp>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/json.hpp>

namespace wheelwright::results {
namespace {

const Effect* find(const std::vector<Effect>& catalogue, const std::string& name) {
  const auto found = std::ranges::find(catalogue, name, &Effect::name);
  return found == catalogue.end() ? nullptr : &*found;
}

std::optional<double> estimate(const files::JsonPlace& parameters, const std::string& name) {
  return parameters.has(name) ? std::optional(parameters.at(name).at("estimate").number()) : std::nullopt;
}

// Takes what `parameters` has of the cause, by "prefix + parameter".
void take(gap::RivalCause& cause, const Effect& effect, const files::JsonPlace& parameters, const std::string& prefix) {
  for (std::size_t c = 0; c < effect.parameters.size(); ++c) {
    cause.coefficients[c] = estimate(parameters, prefix + effect.parameters[c].name).value_or(cause.coefficients[c]);
  }
  for (std::size_t s = 0; s < effect.shapes.size(); ++s) {
    cause.shape[s] = estimate(parameters, prefix + effect.shapes[s].name).value_or(cause.shape[s]);
  }
}

void take_noise(const files::JsonPlace& root, const Model& model, gap::PlannedNoise& noise) {
  if (!root.has("filter") || !root.at("filter").has("beta") || !root.has("shrink")) {
    return;
  }
  std::vector<double> floors;
  const files::JsonPlace figures = root.at("shrink").at("torque_rms");
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

}  // namespace

std::vector<gap::Rival> rivals_of_gap(const std::filesystem::path& file, const std::vector<Effect>& catalogue,
                                      const gap::Drive& drive, gap::PlannedNoise& noise) {
  const Json json = files::read_json(file);
  const files::JsonPlace root(json, file.string());
  if (root.at("schema").text() != "wheelwright/gap/1") {
    root.at("schema").fail("wheelwright/gap/1, a result of wheelwright gap");
  }
  take_noise(root, drive.model, noise);
  const files::JsonPlace causes = root.at("causes"), credible = root.at("credible_set");
  std::set<std::string> best;
  for (std::size_t k = 0; k < causes.size(); ++k) {
    best.insert(causes.at(k).at("effect").text());
  }
  std::vector<gap::Rival> rivals;
  for (std::size_t i = 0; i < credible.size(); ++i) {
    const std::vector<std::string> effects = credible.at(i).at("effects").texts();
    const bool known = std::ranges::all_of(effects, [&](const std::string& name) {
      const Effect* effect = find(catalogue, name);
      return effect != nullptr && gap::applicability(*effect, drive).applies;
    });
    if (effects.empty() || !known) {
      continue;
    }
    gap::Rival rival = gap::typical_rival(effects, catalogue, drive);
    if (credible.at(i).has("parameters")) {
      for (gap::RivalCause& cause : rival.causes) {
        take(cause, *find(catalogue, cause.effect), credible.at(i).at("parameters"), cause.effect + ".");
      }
    } else if (std::set<std::string>(effects.begin(), effects.end()) == best) {
      for (std::size_t k = 0; k < causes.size(); ++k) {
        const std::string name = causes.at(k).at("effect").text();
        take(*std::ranges::find(rival.causes, name, &gap::RivalCause::effect), *find(catalogue, name),
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

void add_rivals(Json& result, const std::vector<gap::Rival>& rivals, const std::vector<Effect>& catalogue) {
  for (const gap::Rival& rival : rivals) {
    std::vector<std::string> effects;
    Json parameters = Json::object();
    for (const gap::RivalCause& cause : rival.causes) {
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

}  // namespace wheelwright::results
