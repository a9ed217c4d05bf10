// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/ros_extractor.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/logs/ros_path.hpp>
#include <wheelwright/logs/ros_plan.hpp>
#include <wheelwright/logs/ros_walk.hpp>

namespace wheelwright {
namespace {

/// The path to the seconds and to the nanoseconds of the stamp; empty where the type has none.
std::vector<ros::Path> stamp_paths(const RosDefinition& definition) {
  const auto find = [&](std::size_t message, std::string_view name) -> std::optional<std::size_t> {
    const auto& fields = definition.messages[message].fields;
    for (std::size_t k = 0; k < fields.size(); ++k) {
      if (fields[k].name == name && fields[k].kind == RosKind::message && fields[k].shape == RosShape::single) {
        return k;
      }
    }
    return std::nullopt;
  };
  ros::Path path;
  std::size_t message = 0;
  if (const auto header = find(0, "header")) {
    path.push_back({*header, {}, {}});
    message = definition.messages[0].fields[*header].message;
    if (!find(message, "stamp")) {
      path.clear();
      message = 0;
    }
  }
  const auto stamp = find(message, "stamp");
  if (!stamp) {
    return {};
  }
  path.push_back({*stamp, {}, {}});
  const auto& fields = definition.messages[definition.messages[message].fields[*stamp].message].fields;
  const RosField seconds{"sec", RosKind::int32}, nanoseconds{"nanosec", RosKind::uint32};
  if (fields.size() != 2 || !(fields[0] == seconds) || !(fields[1] == nanoseconds)) {
    return {};
  }
  std::vector<ros::Path> both(2, path);
  both[0].push_back({0, {}, {}});
  both[1].push_back({1, {}, {}});
  return both;
}

}  // namespace

struct RosExtractor::Impl {
  Impl(const RosDefinition& type, const std::vector<std::string>& paths) : definition(type), count(paths.size()) {
    std::vector<ros::Path> found;
    for (const std::string& path : paths) {
      found.push_back(ros::find_path(definition, path));
    }
    for (ros::Path& path : stamp_paths(definition)) {
      found.push_back(std::move(path));
      stamped = true;
    }
    plan = ros::make_plan(definition, found);
    places.resize(plan.names.size());
  }

  RosDefinition definition;
  std::size_t count;
  ros::MessagePlan plan;
  std::vector<std::size_t> places;
  std::array<double, 2> time{};
  bool stamped = false;
  std::optional<std::int64_t> stamp;
  std::string error;
};

RosExtractor::RosExtractor(const RosDefinition& definition, const std::vector<std::string>& paths)
    : impl_(std::make_unique<Impl>(definition, paths)) {}
RosExtractor::~RosExtractor() = default;
RosExtractor::RosExtractor(RosExtractor&&) noexcept = default;
RosExtractor& RosExtractor::operator=(RosExtractor&&) noexcept = default;

bool RosExtractor::read(std::string_view cdr, std::span<double> values) {
  Impl& own = *impl_;
  if (values.size() != own.count) {
    check::that(false, "RosExtractor::read", fmt::format("as many values as paths, {}", own.count));
  }
  std::fill(values.begin(), values.end(), kNan);
  own.stamp.reset();
  own.error.clear();
  const ros::WalkTargets to{.values = values, .more = own.time};
  if (!ros::walk(own.plan, own.definition.name(), cdr, own.places, to, own.error)) {
    std::fill(values.begin(), values.end(), kNan);
    return false;
  }
  if (own.stamped) {
    const auto time = static_cast<std::int64_t>(own.time[0]) * 1'000'000'000 + static_cast<std::int64_t>(own.time[1]);
    if (time != 0) {
      own.stamp = time;
    }
  }
  return true;
}

std::optional<std::int64_t> RosExtractor::stamp() const { return impl_->stamp; }
const std::string& RosExtractor::error() const { return impl_->error; }

std::optional<std::vector<std::string>> read_names(const RosDefinition& definition, std::string_view cdr) {
  const RosMessage& message = definition.messages.front();
  const auto names = ros::names_of(message, message.fields.size());
  if (!names) {
    return std::nullopt;
  }
  const ros::MessagePlan plan = ros::make_plan(definition, {});
  const ros::Block& steps = plan.blocks.front();
  const auto step = std::find_if(steps.begin(), steps.end(), [&](const ros::Step& one) {
    return one.code == ros::Step::Code::texts && one.field == &message.fields[*names];
  });
  if (step == steps.end()) {
    return std::nullopt;
  }
  std::vector<std::size_t> places;
  std::string error;
  std::vector<std::string> found;
  const ros::WalkTargets to{.strings = &found, .strings_step = static_cast<std::size_t>(step - steps.begin())};
  return ros::walk(plan, definition.name(), cdr, places, to, error) ? std::optional(std::move(found)) : std::nullopt;
}

}  // namespace wheelwright
