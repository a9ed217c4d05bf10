// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/study_json.hpp>

#include <utility>

#include <nlohmann/json.hpp>
#include <wheelwright/files/json_number.hpp>
#include <wheelwright/results/warrant_json.hpp>

namespace wheelwright {
namespace {

Json inputs_json(const Study& study) {
  Json list = Json::array();
  for (const StudyInput& input : study.inputs) {
    list.push_back({{"name", input.name},
                    {"unit", input.unit},
                    {"lower", input.lower},
                    {"upper", input.upper},
                    {"nominal", input.nominal},
                    {"scale", input.logarithmic ? "log" : "linear"}});
  }
  return list;
}

Json one_at_a_time_json(const Study& study, std::size_t q, const StudyResult& result) {
  const OneAtATime& found = result.one_at_a_time[q];
  Json inputs = Json::array();
  for (const std::size_t i : found.order) {
    const InputCurve& curve = found.inputs[i];
    Json points = Json::array();
    for (Eigen::Index k = 0; k < curve.coordinates.size(); ++k) {
      points.push_back({value(study.inputs[i], curve.coordinates[k]), or_null(curve.values[k])});
    }
    inputs.push_back({{"input", study.inputs[i].name},
                      {"low", or_null(curve.low)},
                      {"high", or_null(curve.high)},
                      {"swing", or_null(curve.swing)},
                      {"curve", std::move(points)}});
  }
  return {{"nominal", or_null(found.nominal)}, {"inputs", std::move(inputs)}};
}

Json morris_json(const Study& study, const std::vector<ElementaryEffects>& found) {
  Json inputs = Json::array();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const ElementaryEffects& e = found[i];
    inputs.push_back({{"input", study.inputs[i].name},
                      {"mean", or_null(e.mean)},
                      {"mean_absolute", or_null(e.mean_absolute)},
                      {"lower", or_null(e.lower)},
                      {"upper", or_null(e.upper)},
                      {"deviation", or_null(e.deviation)},
                      {"effects", e.effects}});
  }
  return {{"inputs", std::move(inputs)}};
}

Json index_json(const SobolIndex& index) {
  return {{"estimate", or_null(index.estimate)}, {"lower", or_null(index.lower)}, {"upper", or_null(index.upper)}};
}

Json sobol_json(const Study& study, const SobolIndices& found) {
  Json inputs = Json::array();
  for (std::size_t i = 0; i < found.first.size(); ++i) {
    inputs.push_back({{"input", study.inputs[i].name},
                      {"first", index_json(found.first[i])},
                      {"total", index_json(found.total[i])}});
  }
  return {{"status", to_string(found.status)},
          {"mean", or_null(found.mean)},
          {"variance", or_null(found.variance)},
          {"inputs", std::move(inputs)},
          {"interactions", index_json(found.interactions)},
          {"base_points", found.base_points},
          {"left_out", or_null(found.left_out)}};
}

Json grid_json(const Study& study, const StudyResult& result) {
  const Grid& grid = *study.methods.grid;
  Json levels = Json::array();
  for (std::size_t i = 0; i < study.inputs.size(); ++i) {
    Json values = Json::array();
    for (const double u : grid_coordinates(grid, static_cast<Eigen::Index>(i))) {
      values.push_back(grid.levels[i] == 1 ? study.inputs[i].nominal : value(study.inputs[i], u));
    }
    levels.push_back({{"input", study.inputs[i].name}, {"values", std::move(values)}});
  }
  Json points = Json::array();
  for (Eigen::Index row = 0; row < result.grid.rows(); ++row) {
    Json values = Json::array();
    for (Eigen::Index q = 0; q < result.grid.cols(); ++q) {
      values.push_back(or_null(result.grid(row, q)));
    }
    points.push_back(std::move(values));
  }
  return {{"levels", std::move(levels)}, {"points", std::move(points)}};
}

Json one_sided_json(const OneSided& derivative) {
  return {{"left", or_null(derivative.left)}, {"right", or_null(derivative.right)}};
}

Json local_json(const LocalSensitivity& local) {
  Json inputs = Json::array();
  for (const LocalDerivative& input : local.inputs) {
    Json parameters = Json::array();
    for (std::size_t j = 0; j < input.parameters.size(); ++j) {
      const ParameterDerivative& d = input.parameters[j];
      parameters.push_back({{"parameter", local.parameters[j]},
                            {"unit", local.units[j]},
                            {"lower", one_sided_json(d.lower)},
                            {"upper", one_sided_json(d.upper)},
                            {"width", one_sided_json(d.width)},
                            {"elasticity", d.elasticity ? or_null(*d.elasticity) : Json(nullptr)},
                            {"differentiable", d.differentiable},
                            {"why_not", d.why_not}});
    }
    inputs.push_back(
        {{"input", input.input}, {"unit", input.unit}, {"value", input.value}, {"parameters", std::move(parameters)}});
  }
  return {{"warrant", warrant_word(local.warrant)}, {"inputs", std::move(inputs)}, {"notes", local.notes}};
}

}  // namespace

Json to_json(const StudyFile& file, const StudyResult& result, const std::optional<LocalSensitivity>& local,
             const std::string& name, const std::string& software) {
  const Study& study = file.study;
  Json quantities = Json::array();
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    Json one = {{"name", study.quantities[q].name}, {"unit", study.quantities[q].unit}};
    if (!result.one_at_a_time.empty()) {
      one["one_at_a_time"] = one_at_a_time_json(study, q, result);
    }
    if (!result.morris.empty()) {
      one["morris"] = morris_json(study, result.morris[q]);
    }
    if (!result.sobol.empty()) {
      one["sobol"] = sobol_json(study, result.sobol[q]);
    }
    quantities.push_back(std::move(one));
  }
  Json without = Json::array();
  for (const StudyFinding& finding : result.findings) {
    without.push_back({{"sentence", finding.sentence}, {"points", finding.points}});
  }
  Json sources = Json::array();
  for (const auto& source : file.sources) {
    sources.push_back(source.string());
  }
  Json out = {{"schema", kSensitivitySchema},
              {"software", software},
              {"name", study.name},
              {"study", name},
              {"sources", std::move(sources)},
              {"robot", study.subject.robot.name},
              {"points", result.points},
              {"inputs", inputs_json(study)},
              {"quantities", std::move(quantities)},
              {"without_model", std::move(without)},
              {"notes", file.notes}};
  if (local) {
    out["local"] = local_json(*local);
  }
  if (study.methods.grid) {
    out["grid"] = grid_json(study, result);
  }
  return out;
}

}  // namespace wheelwright
