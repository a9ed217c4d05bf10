// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/joint_states.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include <fmt/format.h>

namespace wheelwright::logs {
namespace {

constexpr std::size_t most_numbers = 4'000'000;  ///< that are kept of a topic
constexpr std::uint32_t most_joints = 10'000;
constexpr double stretch = 0.5;  ///< s

/// Reads CDR from front to back; every read past the end makes it bad.
class MessageBytes {
 public:
  explicit MessageBytes(std::string_view bytes)
      : body_(bytes.size() > 4 ? bytes.substr(4) : std::string_view()),
        swap_(bytes.size() > 4 && (bytes[1] == 0) == (std::endian::native == std::endian::little)),
        good_(bytes.size() > 4 && bytes[0] == 0 && (bytes[1] == 0 || bytes[1] == 1)) {}

  [[nodiscard]] bool good() const { return good_; }

  template <typename Number>
  Number number() {
    at_ = (at_ + sizeof(Number) - 1) / sizeof(Number) * sizeof(Number);
    std::array<char, sizeof(Number)> bytes{};
    good_ = good_ && at_ <= body_.size() && body_.size() - at_ >= bytes.size();
    if (good_) {
      std::memcpy(bytes.data(), body_.data() + at_, bytes.size());
      at_ += bytes.size();
    }
    if (swap_) {
      std::ranges::reverse(bytes);
    }
    return std::bit_cast<Number>(bytes);
  }

  void text(std::string& out) {
    const auto length = number<std::uint32_t>();
    good_ = good_ && length <= body_.size() - at_;
    out.assign(good_ && length > 0 ? body_.substr(at_, length - 1) : std::string_view());
    at_ += good_ ? length : 0;
  }

  /// The length of a list; bad beyond most_joints.
  std::size_t length() {
    const auto count = number<std::uint32_t>();
    good_ = good_ && count <= most_joints;
    return good_ ? count : 0;
  }

 private:
  std::string_view body_;
  bool swap_;
  bool good_;
  std::size_t at_ = 0;
};

bool changes(const std::vector<double>& values) {
  double first = std::numeric_limits<double>::quiet_NaN();
  for (const double v : values) {
    if (std::isfinite(v)) {
      if (std::isfinite(first) && v != first) {
        return true;
      }
      first = v;
    }
  }
  return false;
}

}  // namespace

namespace {

bool same(const RosDefinition& a, std::size_t of_a, const RosDefinition& b, std::size_t of_b) {
  return std::ranges::equal(a.messages[of_a].fields, b.messages[of_b].fields,
                            [&](const RosField& x, const RosField& y) {
                              return x.name == y.name && x.kind == y.kind && x.shape == y.shape &&
                                     (x.kind != RosKind::message || same(a, x.message, b, y.message));
                            });
}

}  // namespace

bool is_joint_state(const RosDefinition& definition) {
  static const RosDefinition bundled = *bundled_ros_definition("sensor_msgs/msg/JointState");
  return definition.name() == bundled.name() && same(definition, 0, bundled, 0);
}

bool read_joint_message(std::string_view cdr, JointMessage& message) {
  MessageBytes in(cdr);
  const auto seconds = in.number<std::int32_t>();
  const auto nanoseconds = in.number<std::uint32_t>();
  message.stamp = std::int64_t{seconds} * 1'000'000'000 + nanoseconds;
  in.text(message.frame);
  message.names.resize(in.length());
  for (std::string& name : message.names) {
    in.text(name);
  }
  for (std::vector<double>& list : message.numbers) {
    list.resize(in.length());
    for (double& number : list) {
      number = in.number<double>();
    }
  }
  return in.good();
}

std::array<bool, 3> JointMessage::filled() const {
  return {!numbers[0].empty(), !numbers[1].empty(), !numbers[2].empty()};
}

const std::vector<double>* JointPublisher::numbers(std::size_t array, const std::string& joint) const {
  const auto at = std::ranges::find(names, joint);
  return at == names.end() ? nullptr : &series[array * names.size() + static_cast<std::size_t>(at - names.begin())];
}

void JointSurvey::add(const JointMessage& message, double time) {
  const std::size_t number = messages++;
  const bool any = std::ranges::any_of(message.numbers, [](const auto& list) { return !list.empty(); });
  if (message.names.empty()) {
    if (any && unnamed++ == 0) {
      for (std::size_t a = 0; a < joint_arrays.size(); ++a) {
        unnamed_lengths[a] = message.numbers[a].size();
      }
    }
    return;
  }
  auto own = std::ranges::find_if(publishers, [&](const JointPublisher& p) {
    return p.names == message.names && p.frame == message.frame && p.filled == message.filled();
  });
  if (own == publishers.end()) {
    JointPublisher fresh;
    fresh.frame = message.frame;
    fresh.names = message.names;
    fresh.filled = message.filled();
    fresh.series.resize(joint_arrays.size() * message.names.size());
    own = publishers.insert(publishers.end(), std::move(fresh));
  }
  const std::size_t joints = own->names.size();
  for (std::size_t a = 0; a < joint_arrays.size(); ++a) {
    const std::size_t length = message.numbers[a].size();
    if (length != 0 && length != joints && own->uneven[a]++ == 0) {
      own->uneven_length[a] = length;
      own->uneven_message[a] = number + 1;
    }
  }
  if (own->times.size() * own->series.size() > most_numbers) {
    return;
  }
  own->order.push_back(number);
  own->times.push_back(time);
  for (std::size_t a = 0; a < joint_arrays.size(); ++a) {
    const std::vector<double>& list = message.numbers[a];
    for (std::size_t j = 0; j < joints; ++j) {
      own->series[a * joints + j].push_back(list.size() == joints ? list[j] : std::numeric_limits<double>::quiet_NaN());
    }
  }
}

const JointPublisher* JointSurvey::publisher_of(const std::vector<std::string>& joints) const {
  const JointPublisher* best = nullptr;
  for (const JointPublisher& p : publishers) {
    const bool all = std::ranges::all_of(
        joints, [&](const std::string& joint) { return std::ranges::find(p.names, joint) != p.names.end(); });
    if (all && (best == nullptr || p.times.size() > best->times.size())) {
      best = &p;
    }
  }
  return best;
}

JointMotion motion_of(const JointPublisher& publisher, const std::string& joint) {
  JointMotion out;
  const std::vector<double>*angle = publisher.numbers(0, joint), *speed = publisher.numbers(1, joint),
        *effort = publisher.numbers(2, joint);
  if (angle == nullptr) {
    return out;
  }
  out.angle_moves = changes(*angle);
  out.speed_moves = changes(*speed);
  out.effort_varies = changes(*effort);
  out.has_effort = std::ranges::any_of(*effort, [](double v) { return std::isfinite(v); });
  double at = 0.0, least = 0.0, most = 0.0, begun_at = 0.0;
  double begun = publisher.times.empty() ? 0.0 : publisher.times.front();
  for (std::size_t k = 1; k < publisher.times.size(); ++k) {
    const double h = publisher.times[k] - publisher.times[k - 1];
    double step = out.angle_moves ? (*angle)[k] - (*angle)[k - 1] : 0.5 * ((*speed)[k] + (*speed)[k - 1]) * h;
    if (out.angle_moves && std::abs(step) > std::numbers::pi) {  // wrapped
      step = std::remainder(step, 2.0 * std::numbers::pi);
    }
    if (out.angle_moves && step != 0.0 && std::isfinite(step)) {
      out.quantum = out.quantum > 0.0 ? std::min(out.quantum, std::abs(step)) : std::abs(step);
    }
    at += std::isfinite(step) && h > 0.0 && h < 1.0 ? step : 0.0;
    least = std::min(least, at);
    most = std::max(most, at);
    if (publisher.times[k] - begun >= stretch) {
      out.turned.push_back(at - begun_at);
      begun = publisher.times[k];
      begun_at = at;
    }
  }
  out.travel = most - least;
  return out;
}

double apart_in_motion(const JointMotion& a, const JointMotion& b) {
  if (std::max(a.travel, b.travel) < std::numbers::pi) {
    return 0.0;
  }
  double apart = 0.0, together = 0.0;
  for (std::size_t k = 0; k < std::min(a.turned.size(), b.turned.size()); ++k) {
    apart += std::pow(a.turned[k] - b.turned[k], 2) - 0.5 * (a.quantum * a.quantum + b.quantum * b.quantum);
    together += std::pow(0.5 * (std::abs(a.turned[k]) + std::abs(b.turned[k])), 2);
  }
  return together > 0.0 ? std::sqrt(std::max(apart, 0.0) / together) : 0.0;
}

bool is_copy(const JointPublisher& publisher, const std::string& a, const std::string& b) {
  bool compared = false;
  for (std::size_t array = 0; array < joint_arrays.size(); ++array) {
    const std::vector<double>*of_a = publisher.numbers(array, a), *of_b = publisher.numbers(array, b);
    if (of_a == nullptr || of_b == nullptr) {
      return false;
    }
    for (std::size_t k = 0; k < of_a->size(); ++k) {
      if (std::isfinite((*of_a)[k]) && std::isfinite((*of_b)[k]) && (*of_a)[k] != (*of_b)[k]) {
        return false;
      }
    }
    compared = compared || (changes(*of_a) && changes(*of_b));
  }
  return compared;
}

bool JointExclusion::holds(const JointMessage& message) const {
  return message.frame == frame && message.names == names && message.filled() == filled &&
         (!numbers || message.numbers == *numbers);
}

std::optional<std::pair<std::string, std::vector<std::string>>> joint_place(std::string_view text) {
  for (const char* const array : joint_arrays) {
    const std::string_view name = array;
    if (text.size() <= name.size() + 2 || !text.starts_with(name) || text[name.size()] != '[' || text.back() != ']') {
      continue;
    }
    std::vector<std::string> joints;
    std::string_view rest = text.substr(name.size() + 1, text.size() - name.size() - 2);
    for (bool more = true; more;) {
      const std::size_t comma = rest.find(',');
      std::string_view joint = rest.substr(0, comma);
      joint = joint.substr(std::min(joint.find_first_not_of(' '), joint.size()));
      joint = joint.substr(0, joint.find_last_not_of(' ') + 1);
      if (joint.empty()) {
        return std::nullopt;
      }
      joints.emplace_back(joint);
      more = comma != std::string_view::npos;
      rest = more ? rest.substr(comma + 1) : std::string_view();
    }
    return std::pair{std::string(name), joints};
  }
  return std::nullopt;
}

std::string joint_place_text(std::string_view array, const std::vector<std::string>& joints) {
  return fmt::format("{}[{}]", array, fmt::join(joints, ","));
}

}  // namespace wheelwright::logs
