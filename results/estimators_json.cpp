// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/estimators_json.hpp>

#include <vector>

#include <nlohmann/json.hpp>

namespace wheelwright {

Json numbers(const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); }

Json candidates_json(const EstimatorChoice& choice) {
  Json list = Json::array();
  for (const EstimatorCandidate& c : choice.candidates) {
    Json candidate = {{"estimator", to_string(c.estimate.estimator)},
                      {"origin", c.origin},
                      {"usable", c.estimate.usable},
                      {"reason", c.estimate.reason},
                      {"estimate", numbers(c.estimate.theta)},
                      {"standard_error", numbers(c.estimate.standard_error)},
                      {"freedom", c.estimate.freedom}};
    if (c.strength.size() > 0) {
      candidate["instrument_strength"] = numbers(c.strength);
      candidate["instrument_relevance"] = numbers(c.relevance);
    }
    list.push_back(candidate);
  }
  return list;
}

Json endogeneity_json(const EstimatorChoice& choice) {
  if (!choice.tested_against || !choice.test.made) {
    return nullptr;
  }
  return {{"against", to_string(choice.candidates[*choice.tested_against].estimate.estimator)},
          {"F", choice.test.statistic},
          {"p_value", choice.test.p_value}};
}

}  // namespace wheelwright
