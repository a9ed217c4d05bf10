// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/simulator_file.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/simulator_document.hpp"
#include "formats/robots/wheel_geometry.hpp"

namespace wheelwright::robots {

using model::SimulatorChange;

namespace {

constexpr double kSameModel = 0.02;  // of a number: file and robot file say the same
constexpr double kTyre = 0.8;        // of the rolling radius: smaller round shapes are hubs

class Editor {
 public:
  Editor(SimulatorDocument& document, const SimulatorChange& change, const Robot& robot, const SimulatorHints& hints,
         EditedSimulator& out)
      : document_(document), change_(change), robot_(robot), out_(out) {
    NamedWheels named;
    if (!hints.left.empty() || !hints.right.empty()) {
      named.by = "--left and --right";
      if (!hints.left.empty()) {
        named.left = {hints.left};
      }
      if (!hints.right.empty()) {
        named.right = {hints.right};
      }
    }
    wheels_ = driven_wheels(document.tree(), named);
    axle_ = axle(document.tree(), wheels_);
    out.right = wheels_.right.name;
    out.left = wheels_.left.name;
    body_ = body();
  }

  void edit() {
    compare();
    joints();
    inertia();
    geometry();
    actuators();
  }

 private:
  [[nodiscard]] const TreeJoint& joint(std::size_t side) const { return side == 0 ? wheels_.right : wheels_.left; }
  [[nodiscard]] std::string causes(const char* member) const {
    const auto found = change_.because.find(member);
    return found == change_.because.end() ? std::string() : found->second;
  }
  void tell(const char* member, const std::string& why, const std::string& instead) {
    out_.not_expressed.push_back({causes(member), why, instead});
  }

  // The heaviest link that is fixed to the wheels' parent; nullptr where none has a mass.
  const TreeLink* body() {
    const RobotTree& tree = document_.tree();
    std::vector<std::string> names = {wheels_.right.parent};
    for (std::size_t k = 0; k < names.size(); ++k) {
      for (const TreeJoint& j : tree.joints) {
        const std::string& other = j.parent == names[k] ? j.child : j.parent;
        if (j.type == "fixed" && (j.parent == names[k] || j.child == names[k]) &&
            std::ranges::find(names, other) == names.end()) {
          names.push_back(other);
        }
      }
    }
    const TreeLink* out = nullptr;
    for (const std::string& name : names) {
      const TreeLink* const link = tree.link(name);
      if (link->inertial && (out == nullptr || link->inertial->mass > out->inertial->mass)) {
        out = link;
      }
    }
    return out != nullptr ? out : tree.link(wheels_.right.parent);
  }

  // Where file and robot file disagree, what was diagnosed is another model's than this file's.
  void compare() {
    const auto differ = [&](const char* what, double in_file, double in_robot, const char* unit) {
      if (in_robot > 0.0 && std::abs(in_file - in_robot) > kSameModel * in_robot) {
        out_.remarks.push_back(fmt::format(
            "{}: {:.4g} {} by this file and {:.4g} {} by the robot file: what was diagnosed is what {:.4g} {} lacks; "
            "`wheelwright robot` makes a robot file of a URDF",
            what, in_file, unit, in_robot, unit, in_robot, unit));
      }
    };
    differ("track width", axle_.track_width, robot_.track_width, "m");
    const double shape = radius(0);
    if (shape > 0.0) {
      differ("wheel radius", shape, robot_.wheel_radius, "m");
    }
    const double r = robot_.wheel_radius;
    const bool known = std::ranges::none_of(document_.tree().links, [&](const TreeLink& link) {
      return !link.inertial && !document_.why_no_mass(link).empty();
    });
    const auto mass = robot_.nominal.find("mass");
    if (known && r > 0.0 && mass != robot_.nominal.end()) {
      double sum = 0.0;
      for (const TreeLink& link : document_.tree().links) {
        sum += link.inertial ? link.inertial->mass : 0.0;
      }
      for (std::size_t side = 0; side < 2; ++side) {
        double spin =
            document_.has(JointNumber::armature) ? document_.joint_number(joint(side), JointNumber::armature) : 0.0;
        for (const std::string& name : turning_links(document_.tree(), joint(side))) {
          if (const TreeLink& link = *document_.tree().link(name); link.inertial) {
            spin += axle_.left.dot(link.inertial->tensor * axle_.left);
          }
        }
        sum += spin / (r * r);
      }
      differ("mass with the wheels' 2J/r²", sum, mass->second, "kg");
    }
  }

  // Of the shapes that roll; 0 where there is none.
  [[nodiscard]] double radius(std::size_t side) const {
    double out = 0.0;
    for (const std::string& name : turning_links(document_.tree(), joint(side))) {
      for (const TreeShape& shape : document_.tree().link(name)->shapes) {
        const bool round =
            shape.kind == "sphere" || (shape.kind == "cylinder" && std::abs(shape.axis.dot(joint(side).axis)) > 0.99);
        out = round && shape.collision ? std::max(out, shape.radius) : out;
      }
    }
    return out;
  }

  void joints() {
    const auto add = [&](const char* member, JointNumber number, const Eigen::Vector2d& more) {
      if (causes(member).empty() || !document_.has(number)) {
        return;
      }
      document_.because(causes(member));
      for (std::size_t side = 0; side < 2; ++side) {
        const double before = document_.joint_number(joint(side), number);
        const double after = before + more[static_cast<Eigen::Index>(side)];
        if (after < 0.0) {
          tell(member, fmt::format("{} would be {:.4g}, below 0", joint(side).place.text(), after),
               "it was set to 0: the file has less than what was found missing");
        }
        document_.set_joint_number(joint(side), number, std::max(after, 0.0));
      }
    };
    add("dry_friction", JointNumber::dry_friction, change_.dry_friction);
    add("damping", JointNumber::damping, change_.damping);
    add("armature", JointNumber::armature, change_.armature);
  }

  void inertia() {
    double yaw = change_.yaw_inertia;
    const bool rotors = !causes("armature").empty() && !document_.has(JointNumber::armature);
    if (rotors) {
      document_.because(causes("armature"));
      for (std::size_t side = 0; side < 2; ++side) {
        const double more = change_.armature[static_cast<Eigen::Index>(side)];
        const TreeLink& wheel = *document_.tree().link(joint(side).child);
        if (!wheel.inertial) {
          tell("armature", wheel.place.text() + " has no mass, and this format no armature",
               fmt::format("add {:.4g} kg·m² to the wheel's inertia about its axle", more));
          continue;
        }
        TreeInertial wanted = *wheel.inertial;
        const Eigen::Vector3d axis = joint(side).axis;
        wanted.tensor += 0.5 * more * (Eigen::Matrix3d::Identity() + axis * axis.transpose());
        if (!possible(wanted)) {
          tell("armature", wheel.place.text() + ": what is left would be no body's inertia", "change it by hand");
          continue;
        }
        document_.set_inertial(wheel, wanted);
        yaw -= 0.5 * more;
      }
    }
    std::string reasons;
    for (const char* member : {"mass", "yaw_inertia", "moment_ahead", "moment_left"}) {
      std::string names = causes(member);
      std::erase_if(names, [](char c) { return c == ' '; });
      for (std::size_t from = 0; from < names.size();) {
        const std::size_t comma = std::min(names.find(',', from), names.size());
        const std::string name = names.substr(from, comma - from);
        if (reasons.find(name) == std::string::npos) {
          reasons += (reasons.empty() ? "" : ", ") + name;
        }
        from = comma + 1;
      }
    }
    if (reasons.empty() && rotors) {
      reasons = causes("armature");
    }
    if (reasons.empty()) {
      return;
    }
    const std::string wanted = fmt::format(
        "add {:.4g} kg, {:.4g} kg·m² about the vertical through the middle of the "
        "axle, and first moments of {:.4g} kg·m ahead and {:.4g} kg·m to the left",
        change_.mass, yaw, change_.moment_ahead, change_.moment_left);
    if (const std::string why = document_.why_no_mass(*body_); !why.empty()) {
      out_.not_expressed.push_back({reasons, why, wanted});
      return;
    }
    if (!body_->inertial) {
      out_.not_expressed.push_back({reasons, body_->place.text() + " has no mass", wanted});
      return;
    }
    document_.because(reasons);
    TreeInertial body = *body_->inertial;
    const double mass = body.mass + change_.mass;
    if (!(mass > 0.0)) {
      out_.not_expressed.push_back(
          {reasons, fmt::format("{} would have a mass of {:.4g} kg", body_->place.text(), mass), wanted});
      return;
    }
    const Eigen::Vector3d before = body.centre - axle_.middle;
    const double height = axle_.up.dot(before);
    const Eigen::Vector3d along = before - height * axle_.up;
    const Eigen::Vector3d after =
        (body.mass * along + change_.moment_ahead * axle_.ahead + change_.moment_left * axle_.left) / mass;
    const double moment = axle_.up.dot(body.tensor * axle_.up);
    const double about = moment + yaw - mass * after.squaredNorm() + body.mass * along.squaredNorm();
    TreeInertial wish = body;
    wish.mass = mass;
    wish.centre = axle_.middle + height * axle_.up + after;
    if (!std::isfinite(about) || !wish.centre.allFinite()) {
      out_.not_expressed.push_back(
          {reasons, body_->place.text() + " has its mass so far away that its moments are no numbers", wanted});
      return;
    }
    if (about >= moment) {
      wish.tensor += (about - moment) * Eigen::Matrix3d::Identity();
    } else if (about > 0.0) {
      wish.tensor *= about / moment;
    } else {
      out_.not_expressed.push_back(
          {reasons,
           fmt::format("{} would have a moment of {:.4g} kg·m² about its own centre", body_->place.text(), about),
           "mass and centre were written, the moment was left"});
    }
    document_.set_inertial(*body_, wish);
  }

  static bool possible(const TreeInertial& inertial) {
    try {
      require_possible(inertial);
    } catch (const InputError&) {
      return false;
    }
    return true;
  }

  void geometry() {
    std::array<Eigen::Vector3d, 2> shift = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    std::string reasons;
    if (!causes("radius_factor").empty()) {
      reasons = causes("radius_factor");
      document_.because(reasons);
      for (std::size_t side = 0; side < 2; ++side) {
        const double factor = change_.radius_factor[static_cast<Eigen::Index>(side)];
        const double r = radius(side);
        if (factor == 1.0) {
          continue;
        }
        if (!(r > 0.0) || !(factor > 0.0)) {
          tell("radius_factor", joint(side).place.text() + ": its wheel has no round collision shape",
               fmt::format("scale its shape by {:.6g} and raise its axle by as much", factor));
          continue;
        }
        for (const std::string& name : turning_links(document_.tree(), joint(side))) {
          document_.scale_radius(*document_.tree().link(name), kTyre * r, factor);
        }
        shift[side] += (factor - 1.0) * r * axle_.up;
      }
    }
    if (!causes("track_factor").empty()) {
      reasons += (reasons.empty() ? "" : ", ") + causes("track_factor");
      const double half = 0.5 * (change_.track_factor - 1.0) * axle_.track_width;
      shift[0] -= half * axle_.left;
      shift[1] += half * axle_.left;
    }
    document_.because(reasons);
    for (std::size_t side = 0; side < 2; ++side) {
      if (!shift[side].isZero(0.0)) {
        document_.move(joint(side), shift[side]);
      }
    }
    if (!reasons.empty() && !document_.tree().plugins.empty()) {
      out_.remarks.push_back(document_.tree().plugins.front().place.text() +
                             ": its wheel radius and separation are what the controller believes, and were left");
    }
  }

  void actuators() {
    for (std::size_t side = 0; side < 2; ++side) {
      const double gain = change_.gain[static_cast<Eigen::Index>(side)];
      if (!causes("gain").empty() && gain != 1.0) {
        document_.because(causes("gain"));
        if (const std::string why = document_.scale_gain(joint(side), gain); !why.empty()) {
          tell("gain", why,
               fmt::format("multiply the torques of {} by {:.6g} where they are set", joint(side).name, gain));
        }
      }
      if (change_.effort_limit) {
        document_.because(causes("effort_limit"));
        if (const std::string why = document_.limit_effort(joint(side), *change_.effort_limit); !why.empty()) {
          tell("effort_limit", why,
               fmt::format("limit the torques of {} to ±{:.6g} N·m where they are set", joint(side).name,
                           *change_.effort_limit));
        }
      }
    }
  }

  SimulatorDocument& document_;
  const SimulatorChange& change_;
  const Robot& robot_;
  EditedSimulator& out_;
  WheelJoints wheels_;
  Axle axle_;
  const TreeLink* body_ = nullptr;
};

}  // namespace

std::string number_list(const std::vector<double>& values) {
  std::string out;
  for (const double value : values) {
    out += fmt::format("{}{:.9g}", out.empty() ? "" : " ", value == 0.0 ? 0.0 : value);
  }
  return out;
}

std::optional<files::XmlText::Id> find_any(const files::XmlText& xml, files::XmlText::Id element,
                                           const std::vector<std::string>& names) {
  std::vector<files::XmlText::Id> open = {element};
  while (!open.empty()) {
    const files::XmlText::Id at = open.back();
    open.pop_back();
    if (std::ranges::find(names, xml.name(at)) != names.end()) {
      return at;
    }
    const auto inside = xml.children(at);
    open.insert(open.end(), inside.rbegin(), inside.rend());
  }
  return std::nullopt;
}

std::vector<double> SimulatorDocument::numbers(const std::string& text, std::size_t count, const files::FilePlace& at,
                                               const std::string& name) {
  constexpr const char* kBlanks = " \t\r\n";
  std::vector<double> out;
  std::size_t from = text.find_first_not_of(kBlanks);
  bool good = true;
  while (good && from != std::string::npos) {
    const std::size_t to = std::min(text.find_first_of(kBlanks, from), text.size());
    const auto value = files::to_number(std::string_view(text).substr(from, to - from));
    good = value && std::isfinite(*value);
    out.push_back(value.value_or(0.0));
    from = text.find_first_not_of(kBlanks, to);
  }
  if (!good || out.empty() || (count > 0 && out.size() != count)) {
    at.fail(fmt::format("{} {}: expected {}", name, files::shown(text),
                        count == 1  ? "a finite number"
                        : count > 1 ? fmt::format("{} finite numbers", count)
                                    : "finite numbers"));
  }
  return out;
}

std::vector<double> SimulatorDocument::numbers_of(Id element, const std::string& name,
                                                  std::vector<double> otherwise) const {
  const auto text = xml_.attribute(element, name);
  return text ? numbers(*text, otherwise.size(), xml_.place(element), name) : std::move(otherwise);
}

void SimulatorDocument::write(Id element, const std::string& name, const std::vector<double>& before,
                              const std::vector<double>& after, const std::string& shown, double slack) {
  bool same = before.size() == after.size();
  for (std::size_t k = 0; same && k < after.size(); ++k) {
    same = std::abs(after[k] - before[k]) <= slack;
  }
  if (same) {
    return;
  }
  const std::string old = name.empty() ? xml_.text(element) : xml_.attribute(element, name).value_or("");
  std::string text = number_list(after);
  if (!old.empty() && before.size() == after.size()) {
    // Numbers of a list that stay keep their digits.
    std::string kept;
    std::size_t from = 0;
    for (std::size_t k = 0; k < after.size(); ++k) {
      from = old.find_first_not_of(" \t\r\n", from);
      const std::size_t to =
          from == std::string::npos ? from : std::min(old.find_first_of(" \t\r\n", from), old.size());
      const bool stays = from != std::string::npos && std::abs(after[k] - before[k]) <= slack;
      kept += (k > 0 ? " " : "") + (stays ? old.substr(from, to - from) : number_list({after[k]}));
      from = to;
    }
    text = kept;
  }
  if (text == old) {
    return;
  }
  record(element, shown, old, text);
  if (name.empty()) {
    xml_.set_text(element, text);
  } else {
    xml_.set_attribute(element, name, text);
  }
}

void SimulatorDocument::record(Id element, const std::string& number, const std::string& before,
                               const std::string& after) {
  const files::FilePlace at = xml_.place(element);
  for (NumberChanged& old : changed_) {
    if (old.where == at.where && old.element == at.element && old.number == number) {
      old.after = after;
      if (old.because.find(because_) == std::string::npos) {
        old.because += ", " + because_;
      }
      return;
    }
  }
  changed_.push_back({at.where, at.element, number, before, after, because_});
}

const char* name_of(SimulatorFormat format) {
  return format == SimulatorFormat::mjcf ? "mjcf" : format == SimulatorFormat::urdf ? "urdf" : "sdf";
}

EditedSimulator edit_simulator(SimulatorFormat format, std::string text, const std::string& file,
                               const model::SimulatorChange& change, const Robot& robot, const SimulatorHints& hints) {
  const std::unique_ptr<SimulatorDocument> document = format == SimulatorFormat::mjcf ? open_mjcf(std::move(text), file)
                                                      : format == SimulatorFormat::urdf
                                                          ? open_urdf(std::move(text), file)
                                                          : open_sdf(std::move(text), file);
  EditedSimulator out;
  out.format = format;
  out.not_expressed = change.not_expressed;
  Editor(*document, change, robot, hints, out).edit();
  out.text = document->edited();
  out.changed = document->changed();
  return out;
}

Json to_json(const EditedSimulator& edit, const std::string& source, const std::string& file) {
  Json out{{"format", name_of(edit.format)},
           {"source", source},
           {"file", file.empty() ? Json(nullptr) : Json(file)},
           {"wheels", {{"right", edit.right}, {"left", edit.left}}},
           {"changed", Json::array()},
           {"not_expressed", Json::array()},
           {"remarks", edit.remarks}};
  for (const NumberChanged& c : edit.changed) {
    out["changed"].push_back({{"where", c.where},
                              {"element", c.element},
                              {"number", c.number},
                              {"before", c.before.empty() ? Json(nullptr) : Json(c.before)},
                              {"after", c.after},
                              {"because", c.because}});
  }
  for (const model::NotExpressed& n : edit.not_expressed) {
    out["not_expressed"].push_back({{"cause", n.cause}, {"why", n.why}, {"instead", n.instead}});
  }
  return out;
}

}  // namespace wheelwright::robots
