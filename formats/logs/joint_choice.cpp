// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/joint_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/interleaved.hpp"
#include "core/words.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::logs {
namespace {

constexpr double one_turn = 2.0 * std::numbers::pi;  ///< rad

bool has_one_of(const std::string& plain, std::initializer_list<std::string_view> words) {
  return std::ranges::any_of(words, [&](std::string_view word) { return plain.find(word) != std::string::npos; });
}

/// Whether messages of two publishers alternate, and not merely follow each other, as after a restart.
bool are_interleaved(const JointPublisher& a, const JointPublisher& b) {
  constexpr std::size_t fewest = 4;
  std::size_t changes = 0, i = 0, j = 0;
  bool of_a = false;
  while (i < a.order.size() && j < b.order.size()) {
    const bool next_of_a = a.order[i] < b.order[j];
    changes += i + j > 0 && next_of_a != of_a ? 1U : 0U;
    of_a = next_of_a;
    ++(next_of_a ? i : j);
  }
  return changes >= fewest;
}

std::vector<std::string> joints_of(const BagColumn& column) {
  std::vector<std::string> joints;
  for (const std::string& field : column.fields) {
    joints.push_back(joint_place(field)->second.front());
  }
  return joints;
}

}  // namespace

bool is_caster(const std::string& plain) { return has_one_of(plain, {"caster", "castor", "swivel", "passive"}); }

bool is_steering(const std::string& plain) {
  return has_one_of(plain, {"steer", "kingpin", "ackermann"}) && !is_caster(plain);
}

void JointChoice::say(std::string note) {
  if (std::ranges::find(choice_.notes, note) == choice_.notes.end()) {
    choice_.notes.push_back(std::move(note));
  }
}

void JointChoice::tell_unnamed() {
  if (!view_.names.empty() || view_.joints.unnamed == 0) {
    return;
  }
  const auto& lengths = view_.joints.unnamed_lengths;
  std::string found;
  for (std::size_t a = 0; a < joint_arrays.size(); ++a) {
    found += fmt::format("{}{} {}", a == 0 ? "" : ", ", lengths[a], joint_arrays[a]);
  }
  choice_.notes.push_back(fmt::format(
      "{}: {} of its first {} messages name no joint beside their numbers ({}): which wheel is which cannot be known; "
      "where the right one is the second, --map omega_r={}.velocity[1] --map tau_r={}.effort[1] --map "
      "omega_l={}.velocity[0] --map tau_l={}.effort[0]",
      view_.topic->name, view_.joints.unnamed, view_.joints.messages, found, view_.topic->name, view_.topic->name,
      view_.topic->name, view_.topic->name));
}

void JointChoice::tell_no_side(const std::vector<std::string>& joints, const std::vector<std::string>& right,
                               const std::vector<std::string>& left) {
  if (joints.size() < 2 || (!right.empty() && !left.empty())) {
    return;
  }
  const auto mapped = options_.map.find("omega_r");
  if (mapped != options_.map.end() && !factor_alone(mapped->second)) {
    return;
  }
  std::string one = right.empty() ? joints.front() : right.front(), other = left.empty() ? joints.back() : left.front();
  if (one == other || one.empty() || other.empty()) {
    const std::string& topic = view_.topic->name;
    choice_.notes.push_back(fmt::format(
        "{}: its messages name the joints {}, which does not tell one from another: elements by their place do not "
        "need names, where the right wheel is the second --map omega_r={}.velocity[1] --map tau_r={}.effort[1] --map "
        "omega_l={}.velocity[0] --map tau_l={}.effort[0]",
        topic, files::shown(core::listed(joints)), topic, topic, topic, topic));
    return;
  }
  choice_.notes.push_back(fmt::format(
      "the joints of {} are {}: their names do not say which wheel is right and which left; with the joints of both, "
      "--map \"omega_r=velocity[{}]\" --map \"tau_r=effort[{}]\" --map \"omega_l=velocity[{}]\" --map "
      "\"tau_l=effort[{}]\" reads them (the other way round where that is so; a gyro shows it)",
      view_.topic->name, core::listed(joints), one, one, other, other));
}

void JointChoice::tell_steering() {
  constexpr double still = 0.05;  // rad
  std::vector<std::string> moving;
  for (const std::string& name : view_.names) {
    const std::string plain = plain_name(name);
    const JointPublisher* const publisher = view_.joints.publisher_of({name});
    if (!is_steering(plain) || publisher == nullptr) {
      continue;
    }
    const JointMotion motion = motion_of(*publisher, name);
    if (motion.travel > still) {
      moving.push_back(fmt::format("{} by {:.2g} rad", name, motion.travel));
    }
  }
  if (!moving.empty()) {
    choice_.contradictions.push_back(fmt::format("steering joints move: in the first {} messages of {} {}",
                                                 view_.joints.messages, view_.topic->name, core::listed(moving)));
  }
}

void JointChoice::sort_out(bool wheels, std::vector<std::string>& right, std::vector<std::string>& left) {
  Motions motions;
  std::map<std::string, const JointPublisher*> publishers;
  for (const auto* side : {&right, &left}) {
    for (const std::string& joint : *side) {
      publishers[joint] = view_.joints.publisher_of({joint});
      if (publishers[joint] == nullptr) {
        return;
      }
      motions[joint] = motion_of(*publishers[joint], joint);
    }
  }
  const auto leave_where = [&](const auto& odd, const std::string& why) {
    for (auto* side : {&right, &left}) {
      if (side->size() < 2 || std::ranges::all_of(*side, odd)) {
        continue;
      }
      std::vector<std::string> gone;
      std::ranges::copy_if(*side, std::back_inserter(gone), odd);
      std::erase_if(*side, odd);
      const std::string of = side == &right ? "r" : "l";
      for (const std::string& joint : gone) {
        say(fmt::format(
            "{}: {} was left out beside {}: {}; --map \"omega_{}=velocity[{}]\" --map \"tau_{}=effort[{}]\" takes it",
            view_.topic->name, joint, core::listed(*side, " and "), why, of, joint, of, joint));
      }
    }
  };
  take_one_robot(right, left, motions);
  leave_where([&](const std::string& j) { return !motions[j].angle_moves && !motions[j].speed_moves; },
              "it stands still");
  if (std::ranges::any_of(right, [&](const auto& j) { return motions[j].effort_varies; }) &&
      std::ranges::any_of(left, [&](const auto& j) { return motions[j].effort_varies; })) {
    leave_where([&](const std::string& j) { return !motions[j].effort_varies; }, "it has no effort that changes");
  }
  if (!wheels) {
    leave_where([&](const std::string& j) { return motions[j].travel < one_turn; }, "it turns by less than a turn");
  }
  for (const auto* side : {&right, &left}) {
    for (std::size_t k = 1; k < side->size(); ++k) {
      const std::string& joint = (*side)[k];
      const auto other =
          std::find_if(side->begin(), side->begin() + static_cast<std::ptrdiff_t>(k), [&](const auto& o) {
            return publishers[o] == publishers[joint] && motions[joint].effort_varies &&
                   is_copy(*publishers[joint], o, joint);
          });
      if (other != side->begin() + static_cast<std::ptrdiff_t>(k)) {
        const char* of = side == &right ? "r" : "l";
        say(fmt::format(
            "{}: {} and {} hold the same numbers to the last digit: taken for two motors, whose efforts are added; "
            "where one motor drives both, --map \"tau_{}=effort[{}]\" takes it once",
            view_.topic->name, *other, joint, of, *other));
      }
    }
  }
}

/// Right and left wheels of two robots in one topic, which no message names together.
void JointChoice::take_one_robot(std::vector<std::string>& right, std::vector<std::string>& left, Motions& motions) {
  std::vector<std::string> all = right;
  all.insert(all.end(), left.begin(), left.end());
  if (right.size() < 2 || left.size() < 2 || view_.joints.publisher_of(all) != nullptr) {
    return;
  }
  std::vector<const JointPublisher*> robots;
  const auto of = [](const JointPublisher& p, const std::vector<std::string>& side) {
    std::vector<std::string> found;
    std::ranges::copy_if(side, std::back_inserter(found),
                         [&](const auto& joint) { return std::ranges::count(p.names, joint) > 0; });
    return found;
  };
  for (const JointPublisher& p : view_.joints.publishers) {
    if (!of(p, right).empty() && !of(p, left).empty()) {
      robots.push_back(&p);
    }
  }
  const auto moves = [&](const JointPublisher* p) {
    return std::ranges::any_of(p->names, [&](const std::string& joint) {
      return motions.contains(joint) && (motions[joint].angle_moves || motions[joint].speed_moves);
    });
  };
  std::vector<const JointPublisher*> moving;
  std::ranges::copy_if(robots, std::back_inserter(moving), moves);
  if (robots.size() < 2 || moving.empty()) {
    return;
  }
  if (moving.size() > 1) {
    std::string choices;
    for (const JointPublisher* p : moving) {
      choices += fmt::format(
          "\n  --map \"omega_r=velocity[{0}]\" --map \"tau_r=effort[{0}]\" --map "
          "\"omega_l=velocity[{1}]\" --map \"tau_l=effort[{1}]\"",
          fmt::join(of(*p, right), ","), fmt::join(of(*p, left), ","));
    }
    throw InputError(
        fmt::format("{}: {} has the wheels of {} robots, each in messages of its own, and all of them move ({}): "
                    "expected one robot; choose:{}",
                    path_, view_.topic->name, moving.size(), core::listed(all), choices));
  }
  choice_.notes.push_back(
      fmt::format("{} has the wheels of {} robots, each in messages of its own: those of {} were "
                  "taken, since the others stand still",
                  view_.topic->name, robots.size(), core::listed(of(*moving.front(), right))));
  right = of(*moving.front(), right);
  left = of(*moving.front(), left);
}

void JointChoice::tell_apart(const std::string& side, const std::vector<std::string>& joints) {
  constexpr double as_one = 0.2;  // of their motion: more than wheels slip that are driven alike
  const JointPublisher* const publisher = view_.joints.publisher_of(joints);
  if (publisher == nullptr) {
    return;
  }
  for (std::size_t k = 1; k < joints.size(); ++k) {
    const double apart = apart_in_motion(motion_of(*publisher, joints.front()), motion_of(*publisher, joints[k]));
    if (apart > as_one) {
      choice_.contradictions.push_back(fmt::format(
          "the wheels of the {} side do not turn together: in the first {} messages of {} {} and {} differ by {:.0f} % "
          "of their motion (root mean square over half seconds); where only one of them is driven, --map "
          "\"omega_{}=velocity[JOINT]\" --map \"tau_{}=effort[JOINT]\" takes it",
          side == "r" ? "right" : "left", view_.joints.messages, view_.topic->name, joints.front(), joints[k],
          100.0 * apart, side, side));
      return;
    }
  }
}

void JointChoice::settle(BagSource& source) {
  std::vector<std::string> joints;
  for (const BagColumn& column : source.columns) {
    for (const std::string& field : column.fields) {
      if (const auto place = joint_place(field);
          place && place->second.front().find_first_not_of("0123456789") != std::string::npos &&
          std::ranges::find(joints, place->second.front()) == joints.end()) {
        joints.push_back(place->second.front());
      }
    }
  }
  const JointPublisher* publisher = view_.joints.publisher_of(joints);
  if (!joints.empty() && publisher == nullptr) {
    refuse_apart(joints);
  }
  if (joints.empty() || publisher == nullptr) {
    return;
  }
  leave_publishers(source, joints, publisher);
  refuse_twice(*publisher, joints);
  for (const std::string side : {"r", "l"}) {
    for (const BagColumn& column : source.columns) {
      if (column.fields.size() > 1 && (column.name == "omega_" + side || column.name == "phi_" + side)) {
        tell_apart(side, joints_of(column));
        break;
      }
    }
  }
  drop_columns(source, *publisher);
}

/// Throws where each of the joints is in messages of one publisher, but no message has all of them.
void JointChoice::refuse_apart(const std::vector<std::string>& joints) const {
  std::string where;
  for (const std::string& joint : joints) {
    const JointPublisher* const own = view_.joints.publisher_of({joint});
    if (own == nullptr) {
      return;
    }
    where += fmt::format("{}{} in those that name {}", where.empty() ? "" : ", ", joint, core::listed(own->names));
  }
  throw InputError(fmt::format(
      "{}: no message of {} has all joints that are read ({}): expected both wheels in one message, as "
      "joint_state_publisher makes them of several: `ros2 bag play` the recording with --remap {}:=/wheels, run `ros2 "
      "run joint_state_publisher joint_state_publisher --ros-args -p source_list:=[/wheels] -p rate:=100`, which needs "
      "the robot description, and record its topic",
      path_, view_.topic->name, where, view_.topic->name));
}

void JointChoice::refuse_twice(const JointPublisher& publisher, const std::vector<std::string>& joints) const {
  for (const std::string& joint : joints) {
    if (std::ranges::count(publisher.names, joint) > 1) {
      throw InputError(fmt::format(
          "{}: {}: its messages name {} {} times ({}): expected each joint once, since which number is its own cannot "
          "be known; elements by their place do not need names: --map omega_r={}.velocity[1] and the like, for each "
          "column that is read",
          path_, view_.topic->name, files::shown(joint), std::ranges::count(publisher.names, joint),
          core::listed(publisher.names), view_.topic->name));
    }
  }
}

/// Takes away motion that stands still beside motion, and arrays that do not fit their names.
void JointChoice::drop_columns(BagSource& source, const JointPublisher& publisher) {
  const auto place_of = [](const BagColumn& column) {
    auto place = joint_place(column.fields.front());
    const bool index = place && place->second.front().find_first_not_of("0123456789") == std::string::npos;
    return index ? std::nullopt : place;
  };
  const auto array_of = [](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(joint_arrays, name) - joint_arrays.begin());
  };
  const auto still = [&](const BagColumn& column) {
    const auto place = place_of(column);
    const auto mapped = options_.map.find(column.name);
    const bool wanted = mapped != options_.map.end() && !factor_alone(mapped->second) &&
                        !joint_place(split_factor(mapped->second).first);
    if (!place || place->first == "effort" || wanted) {
      return false;
    }
    return std::ranges::all_of(column.fields, [&](const std::string& field) {
      const JointMotion motion = motion_of(publisher, joint_place(field)->second.front());
      return place->first == "position" ? motion.speed_moves && !motion.angle_moves
                                        : motion.angle_moves && !motion.speed_moves;
    });
  };
  const std::vector<BagColumn> all = source.columns;
  const auto motion_beside = [&](const BagColumn& column, const auto& bad) {
    return std::ranges::any_of(all, [&](const BagColumn& other) {
      return other.name != column.name && other.name.back() == column.name.back() && !bad(other) && place_of(other) &&
             place_of(other)->first != "effort";
    });
  };
  const auto uneven = [&](const BagColumn& column) {
    const auto place = place_of(column);
    return place && 2 * publisher.uneven[array_of(place->first)] > publisher.order.size();
  };
  if (const auto a = array_of("effort"); 2 * publisher.uneven[a] > publisher.order.size() && wants_efforts()) {
    throw InputError(path_ + ": " + uneven_words(publisher, a) + cure(source, publisher, a));
  }
  for (const BagColumn& column : all) {
    if (uneven(column)) {
      const std::string array = place_of(column)->first;
      const std::string what = uneven_words(publisher, array_of(array));
      if (array == "effort" || !motion_beside(column, uneven)) {
        throw InputError(path_ + ": " + what + cure(source, publisher, array_of(array)));
      }
      choice_.notes.push_back(fmt::format("{}: {} was left out", what, column.name));
    } else if (still(column) && motion_beside(column, still)) {
      const bool angle = place_of(column)->first == "position";
      choice_.notes.push_back(fmt::format(
          "{}: {} stand{} still although {} moves: {} was left out, and {} are read; --map {}={}.{} takes it all the "
          "same",
          view_.topic->name, core::listed(column.fields, " and "), column.fields.size() == 1 ? "s" : "",
          angle ? "velocity" : "position", column.name, angle ? "speeds" : "angles", column.name, view_.topic->name,
          column.fields.front()));
    } else {
      continue;
    }
    std::erase_if(source.columns, [&](const BagColumn& own) { return own.name == column.name; });
  }
}

// Whether efforts of wheels are read, and not by their places.
bool JointChoice::wants_efforts() const {
  return std::ranges::all_of(std::array<std::string, 2>{"tau_r", "tau_l"}, [&](const std::string& name) {
    const auto mapped = options_.map.find(name);
    const bool wanted = !options_.only || std::ranges::count(*options_.only, name) > 0;
    return mapped != options_.map.end() && !factor_alone(mapped->second)
               ? joint_place(split_factor(mapped->second).first).has_value()
               : wanted;
  });
}

std::string JointChoice::uneven_words(const JointPublisher& publisher, std::size_t a) const {
  return fmt::format("{}: message {} has {} number{} in {} for {} names ({}), as {} of the first {}: expected as many",
                     view_.topic->name, publisher.uneven_message[a], publisher.uneven_length[a],
                     publisher.uneven_length[a] == 1 ? "" : "s", joint_arrays[a], publisher.names.size(),
                     core::listed(publisher.names), publisher.uneven[a], publisher.order.size());
}

/// What can be done about an array that is not as long as the names.
std::string JointChoice::cure(const BagSource& source, const JointPublisher& publisher, std::size_t a) const {
  const std::string array = joint_arrays[a];
  std::string out = "; whose each number is cannot be known from the recording";
  constexpr std::array<std::string_view, 3> columns = {"phi_", "omega_", "tau_"};
  std::vector<std::pair<std::string, std::string>> wheels;  // column, joint
  for (const std::string side : {"r", "l"}) {
    const auto own = std::ranges::find_if(source.columns, [&](const BagColumn& column) {
      return column.fields.size() == 1 && column.name.ends_with("_" + side) && joint_place(column.fields.front());
    });
    if (own != source.columns.end()) {
      wheels.emplace_back(std::string(columns[a]) + side, joints_of(*own).front());
    }
  }
  std::ranges::sort(wheels, {}, [&](const auto& wheel) {
    return std::ranges::find(publisher.names, wheel.second) - publisher.names.begin();
  });
  if (wheels.size() == publisher.uneven_length[a]) {
    std::string map, joints;
    for (std::size_t k = 0; k < wheels.size(); ++k) {
      map += fmt::format(" --map {}={}.{}[{}]", wheels[k].first, view_.topic->name, array, k);
      joints += (k == 0 ? "" : ", ") + wheels[k].second;
    }
    return out + fmt::format(": if they are those of {} in this order,{} reads them so", joints, map);
  }
  return out + fmt::format(": --map {}={}.{}[PLACE] with the place of each wheel's number, from 0, reads it",
                           wheels.empty() ? "tau_r" : wheels.front().first, view_.topic->name, array);
}

/// Whether messages that differ in nothing but the order of their joints go on from each other.
bool JointChoice::are_one_publisher(const std::vector<const JointPublisher*>& publishers,
                                    const std::vector<std::string>& joints) const {
  const auto sorted = [](std::vector<std::string> names) {
    std::ranges::sort(names);
    return names;
  };
  struct Message {
    std::size_t order = 0, at = 0;
    const JointPublisher* of = nullptr;
  };
  std::vector<Message> messages;
  for (const JointPublisher* p : publishers) {
    if (p->frame != publishers.front()->frame || p->filled != publishers.front()->filled ||
        sorted(p->names) != sorted(publishers.front()->names)) {
      return false;
    }
    for (std::size_t k = 0; k < p->order.size(); ++k) {
      messages.push_back({p->order[k], k, p});
    }
  }
  std::ranges::sort(messages, {}, &Message::order);
  std::vector<std::vector<double>> columns;
  for (std::size_t a = 0; a < joint_arrays.size(); ++a) {
    for (const std::string& joint : joints) {
      std::vector<double>& column = columns.emplace_back();
      for (const Message& message : messages) {
        column.push_back((*message.of->numbers(a, joint))[message.at]);
      }
    }
  }
  std::vector<const std::vector<double>*> numbers;
  for (const std::vector<double>& column : columns) {
    numbers.push_back(&column);
  }
  return core::interleaved_rows(numbers).rows.empty();
}

/// Leaves out what comes from a second publisher of the same joints; throws where it cannot be told which is which.
void JointChoice::leave_publishers(BagSource& source, const std::vector<std::string>& joints,
                                   const JointPublisher*& publisher) {
  std::vector<const JointPublisher*> rivals, moving, driving;
  for (const JointPublisher& p : view_.joints.publishers) {
    const bool has = std::ranges::all_of(joints, [&](const auto& j) { return std::ranges::count(p.names, j) > 0; });
    if (!has || (&p != publisher && !are_interleaved(p, *publisher))) {
      continue;
    }
    rivals.push_back(&p);
    const auto any = [&](const auto& what) {
      return std::ranges::any_of(joints, [&](const std::string& j) { return what(motion_of(p, j)); });
    };
    if (any([](const JointMotion& m) { return m.angle_moves || m.speed_moves; })) {
      moving.push_back(&p);
      if (any([](const JointMotion& m) { return m.effort_varies; })) {
        driving.push_back(&p);
      }
    }
  }
  if (rivals.size() > 1 && !moving.empty()) {
    const std::vector<const JointPublisher*>& taken = moving.size() > 1 && driving.size() == 1 ? driving : moving;
    if (taken.size() > 1 && are_one_publisher(taken, joints)) {
      choice_.notes.push_back(
          fmt::format("{}: its messages name the joints in different orders: each number was read by "
                      "its own name",
                      view_.topic->name));
      leave_constant(source, joints, *publisher);
      return;
    }
    if (taken.size() > 1) {
      std::vector<std::string> shown;
      for (const JointPublisher* p : moving) {
        shown.push_back(
            fmt::format("{} with frame '{}' and names {}", p->order.size(), p->frame, core::listed(p->names)));
      }
      refuse_publishers(fmt::format("of its first {} messages {}, and the wheels of each of them move",
                                    view_.joints.messages, core::listed(shown, "; ")));
    }
    publisher = taken.front();
    for (const JointPublisher* p : rivals) {
      if (p != publisher) {
        source.without.push_back({p->frame, p->names, p->filled});
        choice_.notes.push_back(fmt::format(
            "{}: two publishers name its wheels: messages with frame '{}' and names {} were taken, since {}; stop the "
            "other for the next recording (`ros2 topic info -v {}` names it)",
            view_.topic->name, publisher->frame, core::listed(publisher->names),
            moving.size() > 1 ? "only they have efforts that change" : "only in them the wheels move",
            view_.topic->name));
      }
    }
  }
  leave_constant(source, joints, *publisher);
}

/// A second publisher with the frame and names of the first.
void JointChoice::leave_constant(BagSource& source, const std::vector<std::string>& joints,
                                 const JointPublisher& publisher) {
  std::vector<const std::vector<double>*> numbers;
  std::vector<std::string> shown;
  for (std::size_t a = 0; a < joint_arrays.size(); ++a) {
    for (const std::string& joint : joints) {
      numbers.push_back(publisher.numbers(a, joint));
      shown.push_back(fmt::format("{}[{}]", joint_arrays[a], joint));
    }
  }
  const core::InterleavedRows other = core::interleaved_rows(numbers);
  if (other.rows.empty()) {
    return;
  }
  const std::size_t first = other.rows.front();
  if (!other.constant) {
    refuse_publishers(fmt::format("{} goes from {:.4g} to {:.4g} and back and the like in {} of its first {} messages",
                                  shown[other.column], (*numbers[other.column])[first - 1],
                                  (*numbers[other.column])[first], other.rows.size(), publisher.times.size()));
  }
  JointExclusion rule{publisher.frame, publisher.names, publisher.filled, std::array<std::vector<double>, 3>{}};
  for (std::size_t a = 0; a < joint_arrays.size(); ++a) {
    for (std::size_t j = 0; j < publisher.names.size(); ++j) {
      const double number = publisher.series[a * publisher.names.size() + j][first];
      if (!std::isnan(number)) {
        (*rule.numbers)[a].push_back(number);
      }
    }
  }
  source.without.push_back(std::move(rule));
  choice_.notes.push_back(fmt::format(
      "{}: two publishers: {} of its first {} messages hold the same numbers ({} = {:.4g}) between others that move, "
      "and were left out; stop the second publisher for the next recording (`ros2 topic info -v {}` names it)",
      view_.topic->name, other.rows.size(), publisher.times.size(), shown[other.column],
      (*numbers[other.column])[first], view_.topic->name));
}

void JointChoice::refuse_publishers(const std::string& evidence) const {
  throw InputError(fmt::format(
      "{}: {} has messages of two publishers: {}: expected those of one, since no column tells which is the robot's; "
      "`ros2 topic info -v {}` names the publishers: stop one, or remap its topic, and record anew",
      path_, view_.topic->name, evidence, view_.topic->name));
}

}  // namespace wheelwright::logs
