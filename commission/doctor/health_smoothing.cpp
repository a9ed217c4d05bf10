// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "commission/contradictions.hpp"
#include "commission/doctor/log_health.hpp"
#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "commission/speed_smoothing.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kAlikeParameters = 0.005;  // share by which a delay and a filter, not told apart, may move parameters
constexpr double kNoRisk = 1e-3;            // for fit_log; not used further

std::string as_sentence(std::string text) {
  text.front() =
      static_cast<char>(text.front() >= 'a' && text.front() <= 'z' ? text.front() - 'a' + 'A' : text.front());
  return text + ".";
}

// Whether the efforts are in time once they have passed through `filter`, and declared errors explain the log.
bool comes_in_time(const HealthView& view, const model::SpeedFilter& filter) {
  TableSource log(*view.log);
  Robot robot = view.robot;
  robot.speed_filter = filter;
  const commission::Setting s = commission::settle(log, robot);
  const commission::Fit fit = commission::fit_log(log, s, commission::Part::everything, kNoRisk);
  const auto timing = commission::effort_timing(log, s, fit);
  return (!timing || !commission::is_latency(*timing, view.step)) &&
         (!s.noise_complete || commission::within_declared(log, s, fit, std::nullopt).a_set);
}

}  // namespace

bool check_smoothing(const HealthView& view, const commission::Setting& s, const commission::Fit& fit,
                     const commission::EffortTiming& timing, bool refused, std::vector<LogFinding>& findings) {
  TableSource log(*view.log);
  const auto smoothing = commission::smoothing_behind(log, s, fit, timing);
  if (!smoothing) {
    return false;
  }
  LogFinding f{.id = "signals.speed_filter",
               .topic = FindingTopic::signals,
               .severity = refused ? FindingSeverity::fatal : FindingSeverity::warning,
               .columns = s.measurement.motion_columns,
               .value = smoothing->time,
               .unit = "s"};
  f.sentence = as_sentence(commission::late_speeds(*smoothing));
  f.next = as_sentence(commission::way_out(*smoothing));
  const bool plain = s.measurement.delay == Interval{} && !smoothing->dry_friction &&
                     (smoothing->told || smoothing->differs < kAlikeParameters);
  if (plain && comes_in_time(view, smoothing->filter)) {
    f.severity = FindingSeverity::warning;
    f.speed_filter = smoothing->filter;
    f.next = fmt::format(
        "Every command passes the efforts through `{}`{}, and calls nothing guaranteed. Write that into the robot "
        "file, "
        "with what is known of the driver's filter; best, log angles or speeds that are not smoothed.",
        commission::declaration(smoothing->filter), smoothing->told ? "" : ", which stands between all of these");
  }
  findings.push_back(std::move(f));
  return true;
}

}  // namespace wheelwright::doctor
