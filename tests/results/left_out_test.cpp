// SPDX-License-Identifier: Apache-2.0
// Parameters of which a log shows noise alone are left out of the proof, and the model says so.
#include "detector/detector_options.hpp"
#include "results/model_check.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "commission/commission.hpp"
#include "results/model_json.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::results::left_out_test {
namespace {

using ::testing::HasSubstr;

class SteadyCircle : public ::testing::Test {
 protected:
  SteadyCircle() {
    testing_support::Random random(2);
    constexpr double kCount = 2.0 * std::numbers::pi / 4096.0;
    log_.names = {"phi_r", "phi_l", "tau_r", "tau_l"};
    log_.columns.resize(4);
    for (int k = 0; k < 4000; ++k) {
      log_.t.push_back(0.01 * k);
      log_.columns[0].push_back(std::round((0.1 + 0.0610513 * k) / kCount) * kCount);
      log_.columns[1].push_back(std::round((0.2 + 0.0415131 * k) / kCount) * kCount);
      log_.columns[2].push_back(0.16 + 0.02 * random.symmetric());
      log_.columns[3].push_back(0.03 + 0.02 * random.symmetric());
    }
    Robot robot;
    robot.wheel_radius = 0.0975;
    robot.track_width = 0.381;
    robot.parameters = {"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};
    robot.encoder_counts_per_turn = 4096.0;
    TableSource source(log_);
    model_ = to_json(commission_robot(source, robot), logs::LogReport{}, "test");
  }

  ModelCheck check(const Json& model) const {
    const ModelClaims claims = claims_from_json(model, "model.json");
    TableSource source(log_);
    logs::LogReport report;
    report.rows = log_.rows();
    report.segments = 1;
    return check_model(claims, source, report);
  }

  LogTable log_;
  Json model_;
};

TEST_F(SteadyCircle, WhatIsProvedAndOnWhatGround) {
  ASSERT_EQ(model_["noise"]["left_out"], Json({"r_mass", "r_yaw_inertia"}));
  const ModelCheck result = check(model_);
  EXPECT_TRUE(result.proved()) << ::testing::PrintToString(result.failures);
  EXPECT_THAT(result.premises, ::testing::Contains(HasSubstr("what the log shows of r_mass is noise alone")));
  for (const std::size_t j : {0U, 1U}) {
    EXPECT_TRUE(model_["parameters"][j]["lower_is_prior"]);
    EXPECT_TRUE(model_["parameters"][j]["upper_is_prior"]);
  }
  EXPECT_LT(model_["parameters"][2]["upper"].get<double>(), 1.1 * model_["parameters"][2]["lower"].get<double>());
}

TEST_F(SteadyCircle, WithoutThatGroundNothingIsProved) {
  Json model = model_;
  model["noise"].erase("left_out");
  EXPECT_FALSE(check(model).proved());
}

TEST_F(SteadyCircle, DeclaredNoiseLeavesNothingOut) {
  Json model = model_;
  model["noise"]["outputs"][0]["origin"] = "declared";
  EXPECT_THROW((void)claims_from_json(model, "model.json"), InputError);
}

}  // namespace
}  // namespace wheelwright::results::left_out_test
