// SPDX-License-Identifier: Apache-2.0
#include "monitor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/core/warrant.hpp>

namespace wheelwright_diagnostics {
namespace {

constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
constexpr double kOfSettling = 1.5;     // as commission::BlindWatch
constexpr double kFewestRows = 20.0;    // as there
constexpr double kShareOfAStep = 0.01;  // as commission::hardly_goes_on()
constexpr double kLargest = 1e9;        // a larger value is none: the filter would not forget it
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t kNamesShown = 4;

std::string number(const char* form, double value) {
  char text[64];
  std::snprintf(text, sizeof text, form, value);
  return text;
}

std::string seconds(std::int64_t ns) {
  const std::int64_t ms = ns / 1'000'000 - (ns % 1'000'000 < 0 ? 1 : 0);
  const std::int64_t whole = ms / 1000 - (ms % 1000 < 0 ? 1 : 0);
  char text[64];
  std::snprintf(text, sizeof text, "%lld.%03lld", static_cast<long long>(whole),
                static_cast<long long>(ms - 1000 * whole));
  return text;
}

std::string times(std::size_t count, const std::string& what) {
  return std::to_string(count) + (count == 1 ? " message " : " messages ") + what;
}

std::string some_of(std::span<const std::string> names) {
  std::string text;
  for (std::size_t k = 0; k < std::min(names.size(), kNamesShown); ++k) {
    text += (k > 0 ? ", " : "") + names[k];
  }
  return names.empty() ? "none" : text + (names.size() > kNamesShown ? ", …" : "");
}

}  // namespace

Monitor::Monitor(const wheelwright::OnlineModel& model, const Sides& sides, double now, MonitorOptions options)
    : model_(model), detector_(wheelwright::make_detector(model)), options_(options), heard_(now) {
  using wheelwright::InvalidArgument;
  if (!model.model.on_two_wheels || model.measurement.motion_columns.size() != 2) {
    throw InvalidArgument("model: '" + model.model.name + "': expected a robot on a right and a left wheel");
  }
  if (!model.measurement.heading_column.empty()) {
    throw InvalidArgument("model: it needs the column '" + model.measurement.heading_column +
                          "': expected one that needs joint states only");
  }
  wheelwright::check::non_negative(options.clear_after, "clear_after");
  wheelwright::check::non_negative(options.patience, "patience");
  options_.patience = std::max(options.patience, kFewestRows * model.measurement.nominal_step);
  // The model's order of the sides is that of its columns.
  const std::size_t right = model.model.joints[0].angle == "phi_r" ? 0 : 1;
  for (const bool is_right : {true, false}) {
    const std::vector<std::string>& names = is_right ? sides.right : sides.left;
    if (names.empty()) {
      throw InvalidArgument(std::string(is_right ? "right_joints" : "left_joints") +
                            ": empty: expected the name of one joint or more");
    }
    for (const std::string& name : names) {
      if (std::ranges::find(joints_, name, &Joint::name) != joints_.end()) {
        throw InvalidArgument((is_right ? "right_joints" : "left_joints") + (": '" + name) +
                              "': expected each joint once, on one side");
      }
      Joint joint;
      joint.name = name;
      joint.side = is_right ? right : 1 - right;
      joints_.push_back(std::move(joint));
    }
  }
  angles_ = model.measurement.motion == wheelwright::MotionKind::angle;
  place_.resize(joints_.size());
  motion_.resize(joints_.size());
  sample_.resize(4);
  channels_.resize(model.model.n());
}

bool Monitor::take(const JointMessage& message, double now) {
  std::size_t found = 0;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto at = std::ranges::find(message.names, joints_[j].name);
    place_[j] = at == message.names.end() ? kNowhere : static_cast<std::size_t>(at - message.names.begin());
    found += place_[j] == kNowhere ? 0 : 1;
  }
  if (found == 0) {
    foreign_ = now;
    foreign_names_ = some_of(message.names);
    return false;
  }
  heard_ = now;
  if (spell_ == 0) {
    causes_ = {};
  }
  if (!read(message)) {
    undecided(std::nullopt);
    return false;
  }
  origin_ = origin_ ? origin_ : message.stamp - message.stamp % kSecond;
  if (stamp_ && message.stamp == *stamp_) {
    ++causes_.repeated;
    undecided(std::nullopt);
    return false;
  }
  // One rounding: the double nearest to the decimal number of seconds, as a log in text has it.
  const double t = static_cast<double>(message.stamp - *origin_) / static_cast<double>(kSecond);
  const double before = t_.value_or(t);
  const bool goes_on = t_ && wheelwright::detector::follows(before, t, model_.measurement.nominal_step);
  if (t_ && !goes_on) {
    ++(t < before ? causes_.backwards : causes_.gaps);
  }
  t_ = t;
  stamp_ = message.stamp;
  sample_.assign(4, 0.0);
  std::size_t count[2] = {0, 0};
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const std::size_t side = joints_[j].side;
    sample_[side] += angles_ ? unwrapped(joints_[j], motion_[j], !goes_on) : motion_[j];
    sample_[2 + side] += message.effort[place_[j]];
    ++count[side];
  }
  for (const std::size_t side : {0, 1}) {
    sample_[side] /= static_cast<double>(count[side]);
  }
  const wheelwright::Decision& decision = detector_.step(t, sample_);
  const bool crawls = goes_on && t - before < kShareOfAStep * model_.measurement.nominal_step;
  causes_.crawling += crawls ? 1 : 0;
  if (!decision.valid || crawls) {
    undecided(t);
    return false;
  }
  decided(message, decision, goes_on ? t - before : 0.0);
  return true;
}

bool Monitor::read(const JointMessage& message) {
  const std::span<const double> motion = angles_ ? message.position : message.velocity;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    if (place_[j] == kNowhere) {
      causes_.missing_name = joints_[j].name;
      ++causes_.missing;
      return false;
    }
    if (motion.size() != message.names.size() || message.effort.size() != message.names.size()) {
      causes_.no_values_name = message.effort.size() != message.names.size() ? "effort"
                               : angles_                                     ? "position"
                                                                             : "velocity";
      ++causes_.no_values;
      return false;
    }
    motion_[j] = motion[place_[j]];
    if (!(std::abs(motion_[j]) <= kLargest) || !(std::abs(message.effort[place_[j]]) <= kLargest)) {
      causes_.not_finite_name = joints_[j].name;
      ++causes_.not_finite;
      return false;
    }
  }
  return true;
}

double Monitor::unwrapped(Joint& joint, double angle, bool restarts) const {
  constexpr double kTurn = 2.0 * std::numbers::pi, kSmall = 0.5 * std::numbers::pi, kSlack = 1e-3;
  constexpr std::size_t kFew = 3;
  if (joint.steps == 0 && restarts) {
    joint.least = joint.most = joint.before = angle;
  }
  const double step = angle - joint.before;
  joint.least = std::min(joint.least, angle);
  joint.most = std::max(joint.most, angle);
  if (restarts) {
    joint.turns = 0.0;
  } else if (std::abs(step) > std::numbers::pi && std::abs(std::abs(step) - kTurn) < kSmall && joint.steps >= kFew &&
             joint.largest_step < kSmall && joint.most - joint.least <= kTurn + kSlack) {
    joint.turns -= std::copysign(1.0, step);
  } else {
    joint.largest_step = std::max(joint.largest_step, std::abs(step));
    ++joint.steps;
  }
  joint.before = angle;
  return angle + joint.turns * kTurn;
}

void Monitor::decided(const JointMessage& message, const wheelwright::Decision& decision, double step) {
  spell_ = 0;
  spell_seconds_ = 0.0;
  spell_first_.reset();
  ++instants_;
  decided_at_ = message.stamp;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const wheelwright::detector::ChannelDecision& c = decision.channels[i];
    const double half = 0.5 * c.threshold.width();
    channels_[i] = {
        .residual = c.residual,
        .lower = c.threshold.lower,
        .upper = c.threshold.upper,
        .ratio = half > 0.0 ? std::abs(c.residual - 0.5 * (c.threshold.lower + c.threshold.upper)) / half : 0.0,
        .alarm = c.alarm};
  }
  if (!decision.fault) {
    quiet_ += step;
    if (alarm_ && quiet_ > options_.clear_after) {
      alarm_.reset();
    }
    return;
  }
  quiet_ = 0.0;
  ++alarm_instants_;
  if (!alarm_) {
    const auto first = std::ranges::find(channels_, true, &Channel::alarm);
    alarm_ = {.since = message.stamp, .output = static_cast<std::size_t>(first - channels_.begin()), .channel = *first};
  }
  alarm_->last = message.stamp;
  ++alarm_->instants;
}

void Monitor::undecided(std::optional<double> t) {
  ++spell_;
  spell_first_ = spell_first_ ? spell_first_ : t;
  spell_seconds_ = std::max(spell_seconds_, model_.measurement.nominal_step * static_cast<double>(spell_));
  if (t) {
    spell_seconds_ = std::max(spell_seconds_, std::abs(*t - *spell_first_));
  }
}

bool Monitor::silent(double now) const { return now - heard_ > options_.patience; }

bool Monitor::blind() const {
  const double settling = model_.filter.settle / model_.filter.beta;
  return spell_seconds_ > std::max(kOfSettling * settling, kFewestRows * model_.measurement.nominal_step);
}

Level Monitor::level(double now) const {
  if (silent(now)) {
    return foreign_ && now - *foreign_ <= options_.patience ? Level::warn : Level::stale;
  }
  return alarm_ ? Level::error : blind() || instants_ == 0 ? Level::warn : Level::ok;
}

std::string Monitor::why_blind() const {
  std::string text;
  const auto add = [&](std::size_t count, const std::string& what) {
    text += count == 0 ? "" : (text.empty() ? "" : "; ") + times(count, what);
  };
  add(causes_.missing, "without the joint " + causes_.missing_name);
  add(causes_.no_values, "without one " + causes_.no_values_name + " for each name");
  add(causes_.not_finite, "with a motion or effort of " + causes_.not_finite_name + " that is no finite number");
  add(causes_.repeated, "with the stamp of the one before");
  add(causes_.backwards, "with a stamp that goes back");
  add(causes_.crawling, "less than a hundredth of the model's step after the one before");
  add(causes_.gaps, "more than five steps of the model (" + number("%.3g", model_.measurement.nominal_step) +
                        " s) after the one before");
  return text.empty() ? "the filter settles in " + number("%.3g", model_.filter.settle / model_.filter.beta) +
                            " s of messages " + number("%.3g", model_.measurement.nominal_step) + " s apart"
                      : text;
}

Status Monitor::status(double now) const {
  Status status;
  status.level = level(now);
  const std::string unknown = "nothing is known of faults: ";
  const auto standing = [&] {
    const Channel& c = alarm_->channel;
    return "fault in the " + model_.model.outputs[alarm_->output] + " channel since " + seconds(alarm_->since) +
           " s: residual " + number("%.4g", c.residual) + " outside [" + number("%.4g", c.lower) + ", " +
           number("%.4g", c.upper) + "] " + model_.model.output_units[alarm_->output];
  };
  if (status.level == Level::ok) {
    status.message = "no fault";
  } else if (status.level == Level::error) {
    status.message = standing() + (blind() ? "; since then " + unknown + why_blind() : "");
  } else if (silent(now)) {
    status.message = unknown + "no message with a joint of the wheels for " + number("%.1f", now - heard_) + " s" +
                     (stamp_ ? ", the last row at " + seconds(*stamp_) + " s" : "") +
                     (foreign_ && status.level == Level::warn ? "; others name " + foreign_names_ : "") +
                     (alarm_ ? "; before, " + standing() : "");
  } else {
    status.message = unknown + why_blind();
  }
  for (std::size_t i = 0; i < channels_.size() && instants_ > 0; ++i) {
    const Channel& c = channels_[i];
    const std::string& name = model_.model.outputs[i];
    status.values.emplace_back(name + " residual", number("%.6g", c.residual));
    status.values.emplace_back(name + " lower", number("%.6g", c.lower));
    status.values.emplace_back(name + " upper", number("%.6g", c.upper));
    status.values.emplace_back(name + " ratio", number("%.4g", c.ratio));
    status.values.emplace_back(name + " alarm", c.alarm ? "yes" : "no");
  }
  status.values.emplace_back("instants decided", std::to_string(instants_));
  status.values.emplace_back("instants with an alarm", std::to_string(alarm_instants_));
  status.values.emplace_back("last decision", decided_at_ ? seconds(*decided_at_) : "none");
  status.values.emplace_back("last stamp", stamp_ ? seconds(*stamp_) : "none");
  status.values.emplace_back("warrant", std::string(wheelwright::core::warrant_word(model_.warrant)));
  return status;
}

}  // namespace wheelwright_diagnostics
