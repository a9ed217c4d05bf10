// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/bag_log.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/joint_choice.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/logs/ros_messages.hpp"

namespace wheelwright::logs {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t most_listed = 20'000;  ///< numbers of a recording that are named in its report

std::int64_t quantile_of(std::vector<std::int64_t> values, double share) {
  if (values.empty()) {
    return 0;
  }
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Median of stamp − time of recording, ns.
std::int64_t offset_of(const TopicTimes& times) {
  std::vector<std::int64_t> offsets;
  for (std::size_t k = 0; k < times.stamps.size(); ++k) {
    offsets.push_back(times.stamps[k].value_or(0) - times.log_times[k]);
  }
  return quantile_of(std::move(offsets), 0.5);
}

double in_seconds(std::int64_t ns) { return static_cast<double>(ns) / static_cast<double>(kSecond); }

}  // namespace

BagClocks bag_clocks(const std::vector<TopicTimes>& topics) {
  BagClocks result;
  std::int64_t first_offset = 0;
  for (const TopicTimes& times : topics) {
    TopicClock clock;
    std::vector<std::optional<std::int64_t>> stamps = times.stamps;
    clock.zero_is_time = stamps.size() > 1 && !stamps[0] && stamps[1] && *stamps[1] < 60 * kSecond;
    if (clock.zero_is_time) {
      stamps[0] = 0;
    }
    clock.stamped = !stamps.empty() && std::ranges::all_of(stamps, [](const auto& stamp) { return stamp.has_value(); });
    std::vector<std::int64_t> steps;
    for (std::size_t k = 1; k < times.log_times.size(); ++k) {
      const std::int64_t step =
          clock.stamped ? *stamps[k] - *stamps[k - 1] : times.log_times[k] - times.log_times[k - 1];
      if (step > 0) {
        steps.push_back(step);
      }
    }
    clock.median_step = quantile_of(steps, 0.5);
    if (!clock.stamped) {
      for (std::int64_t& step : steps) {
        step = std::abs(step - clock.median_step);
      }
      clock.jitter = quantile_of(std::move(steps), 0.99);
      result.notes.push_back(fmt::format(
          "{}: its messages have no time stamp of their own, so the time of recording is used; it jitters by "
          "{:.3g} s, which the noise bounds should allow for",
          times.topic, in_seconds(clock.jitter)));
    }
    const std::int64_t offset = clock.stamped ? offset_of(times) : 0;
    if (result.clocks.empty()) {
      first_offset = offset;
    } else if (!clock.stamped) {
      clock.shift = first_offset;
    } else if (std::abs(offset - first_offset) > kSecond) {
      clock.shift = first_offset - offset;
      result.notes.push_back(fmt::format(
          "{}: its time stamps are of another clock than those of {} ({:.6g} s apart); they were shifted so that both "
          "lie alike to the times of recording, which is as good as the transport is even",
          times.topic, topics.front().topic, in_seconds(offset - first_offset)));
    }
    result.clocks.push_back(clock);
  }
  return result;
}

std::string_view pose_of(std::string_view type) {
  return type == "geometry_msgs/msg/PoseStamped"                                                    ? "pose"
         : type == "geometry_msgs/msg/PoseWithCovarianceStamped" || type == "nav_msgs/msg/Odometry" ? "pose.pose"
                                                                                                    : "";
}

std::vector<std::string> quaternion_fields(const std::string& orientation) {
  std::vector<std::string> fields;
  for (const char c : std::string_view("xyzw")) {
    fields.push_back(fmt::format("{}.{}", orientation, c));
  }
  return fields;
}

namespace {

bool contains(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

/// What could be read, and how gladly: of two offers of a column the one with the smaller rank is taken.
struct Offer {
  std::size_t topic = 0;
  BagColumn column;
  int rank = 0;
  bool other_joints = false;  ///< of joints that may be no wheels
};

class Chooser {
 public:
  Chooser(const std::vector<BagTopicView>& topics, const CsvOptions& options, const std::string& path)
      : topics_(topics), options_(options), path_(path) {}

  BagChoice choose() {
    for (std::size_t k = 0; k < topics_.size(); ++k) {
      list_fields(k);
    }
    for (const auto& [name, field] : options_.map) {
      if (!factor_alone(field)) {
        take_mapped(name, field);
      }
    }
    for (std::size_t k = 0; k < topics_.size(); ++k) {
      offer_from(k);
    }
    leave_other_axes();
    leave_other_joints();
    take_offers();
    for (BagSource& source : choice_.sources) {
      joints_of_topic(source.topic).settle(source);
    }
    std::erase_if(choice_.sources, [](const BagSource& source) { return source.columns.empty(); });
    scale_taken();
    order_sources();
    return std::move(choice_);
  }

 private:
  /// Multiplies the columns of which the map gives no more than a factor.
  void scale_taken() {
    for (const auto& [name, mapped] : options_.map) {
      const std::optional<double> factor = factor_alone(mapped);
      if (!factor || (options_.only && std::ranges::count(*options_.only, name) == 0)) {
        continue;
      }
      bool found = false;
      for (BagSource& source : choice_.sources) {
        for (BagColumn& column : source.columns) {
          if (column.name == name) {
            column.factor *= *factor;
            found = true;
            choice_.notes.push_back(fmt::format("{} is {} times {:g}", name, column.fields.front(), column.factor));
          }
        }
      }
      if (!found && std::ranges::count(taken_, name) == 0) {
        throw InputError(
            fmt::format("{}: nothing was found for {}, which --map {}={} multiplies", path_, name, name, mapped));
      }
    }
  }

  [[nodiscard]] const BagTopic& topic(std::size_t k) const { return *topics_[k].topic; }

  [[nodiscard]] JointChoice joints_of_topic(std::size_t k) { return {topics_[k], options_, path_, choice_}; }

  void list_fields(std::size_t k) {
    if (!topic(k).definition || choice_.header.size() >= most_listed) {
      return;
    }
    for (const std::string& field : numeric_paths(*topic(k).definition, most_listed - choice_.header.size())) {
      choice_.header.push_back(topic(k).name + "." + field);
    }
    if (choice_.header.size() >= most_listed) {
      choice_.notes.push_back(
          fmt::format("its topics have many numbers: the first {} are listed, up to those of {}; --map takes any",
                      most_listed, topic(k).name));
    }
  }

  void take(std::size_t k, BagColumn column) {
    taken_.push_back(column.name);
    const auto source = std::ranges::find(choice_.sources, k, &BagSource::topic);
    if (source != choice_.sources.end()) {
      source->columns.push_back(std::move(column));
    } else {
      choice_.sources.push_back({k, {std::move(column)}});
    }
  }

  void take_mapped(const std::string& name, const std::string& mapped) {
    const auto [field, factor] = split_factor(mapped);
    if (const auto place = joint_place(field)) {
      take_joints(name, place->first, place->second, factor);
      return;
    }
    if (factor != 1.0) {
      choice_.notes.push_back(fmt::format("{} is {} times {:g}", name, field, factor));
    }
    std::optional<std::size_t> found;
    for (std::size_t k = 0; k < topics_.size(); ++k) {
      const std::string& own = topic(k).name;
      const bool fits = field.size() > own.size() && field.starts_with(own) && field[own.size()] == '.';
      if (fits && (!found || own.size() > topic(*found).name.size())) {
        found = k;
      }
    }
    if (!found) {
      std::vector<std::string> names;
      for (const BagTopicView& view : topics_) {
        names.push_back(view.topic->name);
      }
      throw InputError(
          fmt::format("{}: --map {}={}: no topic begins this field: expected TOPIC.FIELD with a topic of {}", path_,
                      name, field, core::listed(names)));
    }
    const BagTopic& own = topic(*found);
    if (!own.definition) {
      throw InputError(fmt::format("{}: --map {}={}: the messages of {} ({}) cannot be read: {}", path_, name, field,
                                   own.name, own.type, own.no_definition));
    }
    std::string path = field.substr(own.name.size() + 1);
    const bool yaw = path == "yaw" || path.ends_with(".yaw");
    check_element(*found, name, path);
    const std::vector<std::string> numbers = numeric_paths(*own.definition);
    if (yaw && std::ranges::find(numbers, path) == numbers.end()) {
      take(*found, {name, quaternion_fields(path.substr(0, path.size() - 4)), BagColumn::Rule::yaw, factor});
    } else {
      take(*found, {name, {path}, BagColumn::Rule::value, factor});
    }
  }

  /// Takes `name` of the topic that has these joints; says so where none has.
  void take_joints(const std::string& name, const std::string& array, const std::vector<std::string>& joints,
                   double factor) {
    bool known = false;
    std::vector<std::string> met;
    for (std::size_t k = 0; k < topics_.size(); ++k) {
      const BagTopicView& view = topics_[k];
      if (topic(k).type != "sensor_msgs/msg/JointState" || !topic(k).definition ||
          is_wished(plain_name(topic(k).name))) {
        continue;
      }
      met.insert(met.end(), view.names.begin(), view.names.end());
      if (!std::ranges::all_of(joints, [&](const auto& joint) { return std::ranges::count(view.names, joint) > 0; })) {
        continue;
      }
      known = true;
      std::vector<std::string> fields;
      for (const std::string& joint : driven_of(k, name, joints)) {
        fields.push_back(fmt::format("{}[{}]", array, joint));
      }
      const bool filled = std::ranges::all_of(fields, [&](const std::string& field) {
        return view.elements.empty() ? std::ranges::count(view.filled, array) > 0
                                     : std::ranges::count(view.elements, field) > 0;
      });
      if (filled) {
        take(k, {name, fields, rule_of(array, fields), factor});
        named_.push_back(name);
        return;
      }
    }
    if (known) {
      named_.push_back(name);  // no other joint stands for it
    } else if (!std::ranges::count(unknown_, joints)) {
      unknown_.push_back(joints);
      choice_.notes.push_back(fmt::format(
          "no JointState names {}, which the robot file's columns say: {}; joints are chosen by their names",
          core::listed(joints), met.empty() ? "there is none" : "they name " + core::listed(met)));
    }
  }

  /// Those of the joints of a side that the data say are driven, beside those that the map names for the other side.
  std::vector<std::string> driven_of(std::size_t k, const std::string& name, const std::vector<std::string>& joints) {
    const bool is_right = name.ends_with("_r");
    if (joints.size() == 1 || (!is_right && !name.ends_with("_l"))) {
      return joints;
    }
    const auto other = options_.map.find(name.substr(0, name.size() - 1) + (is_right ? "l" : "r"));
    const auto place = other == options_.map.end() ? std::nullopt : joint_place(split_factor(other->second).first);
    std::vector<std::string> own = joints, beside = place ? place->second : std::vector<std::string>();
    joints_of_topic(k).sort_out(true, is_right ? own : beside, is_right ? beside : own);
    return own;
  }

  static BagColumn::Rule rule_of(std::string_view array, const std::vector<std::string>& joints) {
    return joints.size() == 1  ? BagColumn::Rule::value
           : array == "effort" ? BagColumn::Rule::sum
                               : BagColumn::Rule::mean;
  }

  /// Throws where the path's element is named and the topic's first message does not name it.
  void check_element(std::size_t k, const std::string& name, const std::string& path) const {
    const std::size_t open = path.find('['), close = path.find(']');
    const std::vector<std::string>& names = topics_[k].names;
    if (names.empty() || open == std::string::npos || close == std::string::npos || close < open) {
      return;
    }
    const std::string element = path.substr(open + 1, close - open - 1);
    const bool index = !element.empty() && element.find_first_not_of("0123456789") == std::string::npos;
    if (!index && std::ranges::find(names, element) == names.end()) {
      throw InputError(fmt::format("{}: --map {}={}.{}: the messages name no {}: expected one of {}{}", path_, name,
                                   topic(k).name, path, files::shown(element), core::listed(names),
                                   files::did_you_mean(element, names)));
    }
  }

  void offer(std::size_t k, std::string name, std::vector<std::string> fields, int rank,
             BagColumn::Rule rule = BagColumn::Rule::value) {
    if (std::ranges::find(named_, name) != named_.end()) {
      return;
    }
    if (!options_.only || std::ranges::find(*options_.only, name) != options_.only->end()) {
      offers_.push_back({k, {std::move(name), std::move(fields), rule}, rank});
    }
  }

  void offer_from(std::size_t k) {
    const BagTopic& own = topic(k);
    if (!own.definition || topics_[k].silent) {
      return;
    }
    const std::string& type = own.type;
    const std::string pose(pose_of(type));
    const bool joints = type == "sensor_msgs/msg/JointState", odometry = type == "nav_msgs/msg/Odometry";
    const std::string& unreadable = topics_[k].unreadable;
    if (!unreadable.empty() && (!is_of_ros(type) ? !recognised_in(own.definition.get()).empty()
                                                 : joints || !pose.empty() || type == "sensor_msgs/msg/Imu")) {
      choice_.notes.push_back(
          fmt::format("{} ({}) was not taken: its first messages cannot be read ({}); --map NAME={}.FIELD takes it",
                      own.name, type, unreadable, own.name));
    } else if ((joints || (!pose.empty() && !odometry)) && is_wished(plain_name(own.name))) {
      choice_.notes.push_back(fmt::format(
          "{} ({}) was not taken: by its name it is what was wished for, no measurement; --map NAME={}.FIELD "
          "takes it",
          own.name, type, own.name));
    } else if (joints) {
      offer_joints(k);
    } else if (odometry) {
      offer_odometry(k);
    } else if (!pose.empty()) {
      offer_pose(k, pose, 1);
    } else if (type == "sensor_msgs/msg/Imu") {
      offer_imu(k);
    } else if (!is_of_ros(type)) {
      for (const auto& [column, field] : recognised_in(own.definition.get())) {
        offer(k, column->name, {field}, 0);
      }
    }
  }

  using Recognised = std::vector<std::pair<const LogColumn*, std::string>>;

  /// The columns that fields of a definition are by their names; looked for once, however many topics share it.
  const Recognised& recognised_in(const RosDefinition* definition) {
    const auto [place, added] = recognised_.try_emplace(definition);
    if (added) {
      for (const RosField& field : definition->messages.front().fields) {
        const bool number = field.shape == RosShape::single && ros::size_of(field.kind) > 0;
        const LogColumn* column = number ? recognise_log_column(field.name) : nullptr;
        if (column != nullptr && column->name != "t") {
          place->second.emplace_back(column, field.name);
        }
      }
    }
    return place->second;
  }

  static bool is_of_ros(const std::string& type) {
    constexpr std::array<std::string_view, 12> packages = {
        "std_msgs",        "builtin_interfaces", "geometry_msgs",   "sensor_msgs",
        "nav_msgs",        "tf2_msgs",           "trajectory_msgs", "control_msgs",
        "diagnostic_msgs", "rosgraph_msgs",      "stereo_msgs",     "visualization_msgs"};
    return std::ranges::any_of(packages, [&](std::string_view package) {
      return type.size() > package.size() && type.starts_with(package) && type[package.size()] == '/';
    });
  }

  void offer_pose(std::size_t k, const std::string& pose, int rank) {
    offer(k, "x", {pose + ".position.x"}, rank);
    offer(k, "y", {pose + ".position.y"}, rank);
    if (measures(k, "orientation")) {
      offer(k, "theta", quaternion_fields(pose + ".orientation"), rank, BagColumn::Rule::yaw);
    } else {
      choice_.notes.push_back(
          fmt::format("{} has no orientation (a quaternion of zeros): there is no column theta of it", topic(k).name));
    }
  }

  static bool is_wished(const std::string& plain) {
    constexpr std::array<std::string_view, 8> words = {"goal",    "target", "setpoint", "initialpose",
                                                       "command", "cmd",    "desired",  "initial_pose"};
    return std::ranges::any_of(words, [&](std::string_view word) { return contains(plain, word); });
  }

  [[nodiscard]] bool measures(std::size_t k, std::string_view what) const {
    return std::ranges::find(topics_[k].unmeasured, what) == topics_[k].unmeasured.end();
  }

  void offer_imu(std::size_t k) {
    for (const auto& [column, measured, field] :
         {std::tuple("gyro_z", "angular_velocity", "z"), {"accel_x", "linear_acceleration", "x"}}) {
      if (measures(k, measured)) {
        offer(k, column, {fmt::format("{}.{}", measured, field)}, 1);
      } else {
        choice_.notes.push_back(fmt::format("{} says that it does not measure {} (its covariance begins with -1)",
                                            topic(k).name, measured));
      }
    }
  }

  void offer_odometry(std::size_t k) {
    const std::string name = plain_name(topic(k).name);
    if (contains(name, "wheel") || contains(name, "controller") || contains(name, "encoder")) {
      choice_.notes.push_back(fmt::format(
          "{} ({}) was not taken as the pose: by its name it is computed from the wheels, which is no independent "
          "measurement; --map x={}.pose.pose.position.x and the like take it",
          topic(k).name, topic(k).type, topic(k).name));
      return;
    }
    const bool reference = contains(name, "truth") || contains(name, "mocap") || contains(name, "vicon") ||
                           contains(name, "optitrack") || contains(name, "slam");
    offer_pose(k, std::string(pose_of(topic(k).type)), reference ? 1 : 2);
  }

  void offer_joints(std::size_t k) {
    const BagTopicView& view = topics_[k];
    const auto filled = [&](std::string_view array) {
      return std::ranges::find(view.filled, array) != view.filled.end();
    };
    const auto give = [&](const std::vector<std::string>& joints, const std::string& angle, const std::string& speed,
                          const std::string& effort) {
      for (const auto& [array, column] : {std::pair("position", angle), {"velocity", speed}, {"effort", effort}}) {
        if (!filled(array)) {
          continue;
        }
        std::vector<std::string> fields, empty;
        for (const std::string& joint : joints) {
          fields.push_back(fmt::format("{}[{}]", array, joint));
          if (!view.elements.empty() && std::ranges::find(view.elements, fields.back()) == view.elements.end()) {
            empty.push_back(fields.back());
          }
        }
        if (!empty.empty()) {
          choice_.notes.push_back(fmt::format("{} has no number for {}: there is no column {} of it", view.topic->name,
                                              core::listed(empty), column));
          continue;
        }
        offer(k, column, std::move(fields), 1, rule_of(array, joints));
      }
    };
    const auto give_side = [&](const std::vector<std::string>& joints, const std::string& side) {
      give(joints, "phi_" + side, "omega_" + side, "tau_" + side);
    };
    JointChoice judged = joints_of_topic(k);
    judged.tell_unnamed();
    judged.tell_steering();
    if (view.names.size() == 1) {
      give(view.names, "position", "velocity", "effort");
      std::string side = side_of_joint(view.names.front());
      side = side.empty() ? side_of_joint(view.topic->name) : side;
      if (!side.empty()) {
        give_side(view.names, side);
      }
      return;
    }
    std::vector<std::string> wheels;
    std::ranges::copy_if(view.names, std::back_inserter(wheels), [](const std::string& name) {
      const std::string plain = plain_name(name);
      return names_wheel(plain) && !is_caster(plain) && !is_steering(plain);
    });
    const std::vector<std::string>& joints = wheels.empty() ? view.names : wheels;
    std::vector<std::string> right = joints_of("r", joints), left = joints_of("l", joints);
    if (const auto none = joints_of("", wheels); !none.empty() && right.size() != left.size()) {
      choice_.notes.push_back(fmt::format(
          "{} has wheels of no side by their names ({}), and {} on the right but {} on the left: none was taken; --map "
          "omega_r={}.velocity[…] and the like choose",
          view.topic->name, core::listed(none), right.size(), left.size(), view.topic->name));
      return;
    }
    if (!is_named("r") || !is_named("l")) {
      judged.sort_out(!wheels.empty(), right, left);
    }
    judged.tell_no_side(joints, right, left);
    const std::size_t before = offers_.size();
    for (const auto& [side, of_side] :
         {std::pair<std::string, const std::vector<std::string>&>("r", right), {"l", left}}) {
      if (of_side.size() == 1 || (of_side.size() > 1 && !wheels.empty())) {
        give_side(of_side, side);
      }
      if (of_side.size() > 1 && !is_named(side)) {
        tell_side(*view.topic, side, of_side, !wheels.empty());
      }
    }
    const bool driven = !wheels.empty() || std::ranges::all_of(view.names, [](const std::string& name) {
      const std::string plain = plain_name(name);
      return contains(plain, "motor") || contains(plain, "driv") || plain == "left" || plain == "right";
    });
    for (std::size_t at = before; at < offers_.size(); ++at) {
      offers_[at].other_joints = !driven;
    }
  }

  /// Whether all that is read of a side's wheel is named by the map.
  [[nodiscard]] bool is_named(const std::string& side) const {
    return std::ranges::all_of(std::array{"omega_" + side, "tau_" + side}, [&](const std::string& name) {
      const auto mapped = options_.map.find(name);
      return mapped != options_.map.end() && !factor_alone(mapped->second) &&
             (!joint_place(split_factor(mapped->second).first) || std::ranges::find(named_, name) != named_.end());
    });
  }

  static std::vector<std::string> joints_of(const std::string& side, const std::vector<std::string>& joints) {
    std::vector<std::string> found;
    std::ranges::copy_if(joints, std::back_inserter(found),
                         [&](const std::string& name) { return side_of_joint(name) == side; });
    return found;
  }

  void tell_side(const BagTopic& own, const std::string& side, const std::vector<std::string>& joints, bool wheels) {
    const char* const word = side == "r" ? "right" : "left";
    choice_.notes.push_back(
        wheels ? fmt::format("{}: the {} side is the mean motion and the sum of the efforts of {}", own.name, word,
                             core::listed(joints, " and "))
               : fmt::format("{} has {} {} joints ({}): none was taken; --map omega_{}={}.velocity[{}] and the like "
                             "choose one",
                             own.name, joints.size(), word, core::listed(joints), side, own.name, joints.front()));
  }

  /// Beside wheels, right and left joints of another topic that are named neither wheel, motor nor drive are an arm's
  /// or a gripper's.
  void leave_other_joints() {
    const bool wheels = std::ranges::any_of(offers_, [](const Offer& offer) {
      return !offer.other_joints && (offer.column.name.ends_with("_r") || offer.column.name.ends_with("_l"));
    });
    if (!wheels) {
      return;
    }
    const auto other = [](const Offer& offer) { return offer.other_joints; };
    leave(other, other, "other joints than wheels, by their names");
  }

  /// Beside wheels a topic with one joint is a gripper, an arm, a camera: its rows are no reason to interpolate wheels.
  void leave_other_axes() {
    const auto wheels = [&](std::string_view side) {
      return std::ranges::any_of(offers_, [&](const Offer& offer) { return offer.column.name.ends_with(side); });
    };
    if (options_.only || !wheels("_r") || !wheels("_l")) {
      return;
    }
    const auto axis = [](const Offer& offer) {
      const std::string& name = offer.column.name;
      return name == "position" || name == "velocity" || name == "effort";
    };
    const auto unused = [&](const Offer& offer) {
      return axis(offer) && std::ranges::none_of(offers_, [&](const Offer& other) {
               return other.topic == offer.topic && !axis(other);
             });
    };
    leave(axis, unused, "one axis, by its name no wheel");
  }

  /// Takes back the offers that are `left`, and says so of each topic that has one which is `said`: it is of `what`.
  template <typename Left, typename Said>
  void leave(const Left& left, const Said& said, std::string_view what) {
    std::map<std::size_t, const BagColumn*> first;
    for (const Offer& offer : offers_) {
      if (said(offer)) {
        first.try_emplace(offer.topic, &offer.column);
      }
    }
    for (const auto& [k, column] : first) {
      choice_.notes.push_back(fmt::format("{} is of {}, and was left out: --map {}={}.{} takes it", topic(k).name, what,
                                          column->name, topic(k).name, column->fields.front()));
    }
    std::erase_if(offers_, left);
  }

  void take_offers() {
    std::vector<std::string> names;
    for (const Offer& offer : offers_) {
      if (std::ranges::find(names, offer.column.name) == names.end() &&
          std::ranges::find(taken_, offer.column.name) == taken_.end()) {
        names.push_back(offer.column.name);
      }
    }
    for (const std::string& name : names) {
      int best = offers_.front().rank;
      std::vector<const Offer*> rivals;
      for (const Offer& offer : offers_) {
        if (offer.column.name != name || (!rivals.empty() && offer.rank > best)) {
          continue;
        }
        if (rivals.empty() || offer.rank < best) {
          rivals.clear();
          best = offer.rank;
        }
        rivals.push_back(&offer);
      }
      if (rivals.size() == 1) {
        take(rivals.front()->topic, rivals.front()->column);
        tell_passed_over(*rivals.front());
        continue;
      }
      std::vector<std::string> places;
      for (const Offer* offer : rivals) {
        places.push_back(topic(offer->topic).name);
      }
      choice_.notes.push_back(fmt::format(
          "{} was left out since several topics have it ({}): --map {}={}.{} takes one", name, core::listed(places),
          name, places.front(),
          rivals.front()->column.is_yaw()
              ? rivals.front()->column.fields.front().substr(0, rivals.front()->column.fields.front().size() - 1) +
                    "yaw"
              : rivals.front()->column.fields.front()));
    }
  }

  /// Says once for each topic that it was passed over for that of `taken`.
  void tell_passed_over(const Offer& taken) {
    for (const Offer& offer : offers_) {
      if (offer.column.name == taken.column.name && offer.topic != taken.topic &&
          std::ranges::find(passed_over_, offer.topic) == passed_over_.end()) {
        passed_over_.push_back(offer.topic);
        choice_.notes.push_back(fmt::format("{} of {} was taken before that of {}: --map {}={}.FIELD takes the other",
                                            taken.column.name, topic(taken.topic).name, topic(offer.topic).name,
                                            taken.column.name, topic(offer.topic).name));
      }
    }
  }

  /// Efforts before motion before the rest; in doubt the topic with more columns, then the one that is listed first.
  void order_sources() {
    const auto weight = [](const BagSource& source) {
      int sum = 0;
      for (const BagColumn& column : source.columns) {
        sum += row_weight(column.name);
      }
      return sum;
    };
    std::ranges::stable_sort(choice_.sources, [&](const BagSource& a, const BagSource& b) {
      return weight(a) != weight(b) ? weight(a) > weight(b) : a.topic < b.topic;
    });
  }

  const std::vector<BagTopicView>& topics_;
  const CsvOptions& options_;
  const std::string& path_;
  BagChoice choice_;
  std::vector<Offer> offers_;
  std::vector<std::string> taken_;
  std::vector<std::string> named_;                 ///< columns whose joints the map names, taken or not
  std::vector<std::vector<std::string>> unknown_;  ///< joints that it names and no topic has
  std::vector<std::size_t> passed_over_;
  std::map<const RosDefinition*, Recognised> recognised_;
};

}  // namespace

BagChoice choose_bag_columns(const std::vector<BagTopicView>& topics, const CsvOptions& options,
                             const std::string& path) {
  return Chooser(topics, options, path).choose();
}

}  // namespace wheelwright::logs
