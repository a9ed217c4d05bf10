// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/simulator_document.hpp"

namespace wheelwright::robots {
namespace {

constexpr double kEndless = 1e8;  // rad: Gazebo writes 1e16 for a joint that turns without end

class SdfDocument final : public SimulatorDocument {
 public:
  explicit SdfDocument(files::XmlText xml) : SimulatorDocument(std::move(xml)) {
    if (xml_.name(0) != "sdf") {
      xml_.place(0).fail("is no SDF: expected the root element <sdf>");
    }
    const Id model = the_model();
    if (const auto bad = find_any(xml_, model, {"include"})) {
      xml_.place(*bad).fail("an include: expected one file (gz sdf -p FILE prints it whole)");
    }
    for (const Id inside : xml_.children(model, "model")) {
      xml_.place(inside).fail("a model inside a model: expected links and joints of one");
    }
    for (const Id element : xml_.children(model)) {
      if (xml_.name(element) == "link" || xml_.name(element) == "joint") {
        auto& all = xml_.name(element) == "link" ? links_ : joints_;
        if (!all.emplace(name_of_element(element), element).second) {
          xml_.place(element).fail("stands there twice: expected each name once");
        }
      }
    }
    tree_.name = xml_.attribute(model, "name").value_or("");
    tree_.place = xml_.place(model);
    for (const Id element : xml_.children(model, "link")) {
      read_link(element);
    }
    for (const Id element : xml_.children(model, "joint")) {
      read_joint(element);
    }
    for (const Id plugin : xml_.children(model, "plugin")) {
      if (xml_.child(plugin, "wheel_radius") || xml_.child(plugin, "wheel_separation")) {
        DriveFacts facts;
        facts.place = xml_.place(plugin);
        tree_.plugins.push_back(std::move(facts));
      }
    }
    require_tree(tree_);
  }

  [[nodiscard]] bool has(JointNumber number) const override { return number != JointNumber::armature; }

  [[nodiscard]] double joint_number(const TreeJoint& joint, JointNumber number) const override {
    const auto& value = number == JointNumber::dry_friction ? joint.friction : joint.damping;
    return value ? value->value : 0.0;
  }

  void set_joint_number(const TreeJoint& joint, JointNumber number, double value) override {
    if (value != joint_number(joint, number)) {
      const std::string name = number == JointNumber::dry_friction ? "friction" : "damping";
      const Id dynamics = xml_.child_or_new(xml_.child_or_new(joints_.at(joint.name), "axis"), "dynamics");
      write(xml_.child_or_new(dynamics, name), "", {}, {value}, name);
    }
  }

  [[nodiscard]] std::string why_no_mass(const TreeLink& link) const override {
    return link.inertial ? "" : link.place.text() + " has no <inertial> with mass and moments";
  }

  void set_inertial(const TreeLink& link, const TreeInertial& wanted) override {
    const Id inertial = *xml_.child(links_.at(link.name), "inertial");
    const std::vector<double> at = pose_numbers(inertial);
    write(*xml_.child(inertial, "mass"), "", {link.inertial->mass}, {wanted.mass}, "mass");
    const Eigen::Isometry3d& in = frames_.at(link.name);
    const Eigen::Vector3d centre = in.inverse() * wanted.centre;
    if ((centre - vector(at)).cwiseAbs().maxCoeff() > kRounding) {
      std::vector<double> after = at;
      std::copy_n(centre.data(), 3, after.begin());
      write(xml_.child_or_new(inertial, "pose"), "", at, after, "pose", kRounding);
    }
    const Eigen::Matrix3d turn = in.linear() * isometry(inertial, at).linear();
    const Eigen::Matrix3d before = turn.transpose() * link.inertial->tensor * turn;
    const Eigen::Matrix3d after = turn.transpose() * wanted.tensor * turn;
    const Id tensor = *xml_.child(inertial, "inertia");
    const double slack = kRounding * after.cwiseAbs().maxCoeff();
    constexpr Eigen::Index rows[] = {0, 1, 2, 0, 0, 1}, cols[] = {0, 1, 2, 1, 2, 2};
    for (std::size_t k = 0; k < 6; ++k) {
      if (std::abs(after(rows[k], cols[k]) - before(rows[k], cols[k])) > slack) {
        write(xml_.child_or_new(tensor, kMoments[k]), "", {before(rows[k], cols[k])}, {after(rows[k], cols[k])},
              kMoments[k], slack);
      }
    }
  }

  bool scale_radius(const TreeLink& link, double least, double factor) override {
    bool any = false;
    for (const Id round : rounds(links_.at(link.name))) {
      const Id radius = *xml_.child(round, "radius");
      const double value = number(radius);
      if (value >= least) {
        write(radius, "", {value}, {factor * value}, "radius");
        any = true;
      }
    }
    return any;
  }

  void move(const TreeJoint& joint, const Eigen::Vector3d& shift) override {
    const Id element = joints_.at(joint.name);
    if (const auto at = xml_.child(element, "pose");
        at && !xml_.attribute(*at, "relative_to").value_or(joint.child).empty() &&
        xml_.attribute(*at, "relative_to").value_or(joint.child) != joint.child) {
      xml_.place(*at).fail("is relative to another frame than the wheel: expected a wheel that its joint moves with");
    }
    std::vector<std::string> moved = {joint.child};
    for (std::size_t k = 0; k < moved.size(); ++k) {
      for (const TreeJoint& below : tree_.joints) {
        if (below.parent == moved[k] && below.type == "fixed") {
          moved.push_back(below.child);
        }
      }
    }
    const std::vector<std::string> hanging = moved;
    for (const std::string& name : hanging) {
      const std::string relative = relative_to(links_.at(name), "");
      if (std::ranges::find(hanging, relative) != hanging.end() || relative == joint.name) {
        continue;
      }
      const std::vector<double> before = pose_numbers(links_.at(name));
      const Eigen::Vector3d at = vector(before) + frame_of(relative, 0).linear().transpose() * shift;
      std::vector<double> after = before;
      std::copy_n(at.data(), 3, after.begin());
      write(xml_.child_or_new(links_.at(name), "pose"), "", before, after, "pose", kRounding);
    }
  }

  std::string scale_gain(const TreeJoint&, double) override { return "SDF has no gain between command and torque"; }

  std::string limit_effort(const TreeJoint& joint, double limit) override {
    const Id axis = xml_.child_or_new(joints_.at(joint.name), "axis");
    write(xml_.child_or_new(xml_.child_or_new(axis, "limit"), "effort"), "", {}, {limit}, "effort");
    return {};
  }

 private:
  static constexpr const char* kMoments[] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};

  [[nodiscard]] Id the_model() const {
    std::vector<Id> models = xml_.children(0, "model"), moving;
    for (const Id world : xml_.children(0, "world")) {
      const std::vector<Id> inside = xml_.children(world, "model");
      models.insert(models.end(), inside.begin(), inside.end());
    }
    std::ranges::copy_if(models, std::back_inserter(moving), [&](Id m) { return xml_.child(m, "joint").has_value(); });
    if (moving.size() != 1) {
      xml_.place(moving.empty() ? 0 : moving[1])
          .fail(fmt::format("{} models have joints: expected one robot in the file", moving.size()));
    }
    return moving.front();
  }

  [[nodiscard]] std::string name_of_element(Id element) const {
    const auto name = xml_.attribute(element, "name");
    if (!name || name->empty()) {
      xml_.place(element).fail("has no attribute name: expected one");
    }
    return *name;
  }

  [[nodiscard]] double number(Id element) const {
    return numbers(xml_.text(element), 1, xml_.place(element), xml_.name(element)).front();
  }
  [[nodiscard]] Id need(Id element, const char* name) const {
    const auto found = xml_.child(element, name);
    if (!found) {
      xml_.place(element).fail(fmt::format("holds no <{}>: expected one", name));
    }
    return *found;
  }

  [[nodiscard]] std::vector<double> pose_numbers(Id element) const {
    const auto at = xml_.child(element, "pose");
    if (!at || xml_.text(*at).empty()) {
      return {0, 0, 0, 0, 0, 0};
    }
    if (xml_.attribute(*at, "rotation_format").value_or("euler_rpy") != "euler_rpy") {
      xml_.place(*at).fail("has another rotation_format: expected x y z roll pitch yaw");
    }
    return numbers(xml_.text(*at), 6, xml_.place(*at), "pose");
  }
  [[nodiscard]] Eigen::Isometry3d isometry(Id element, const std::vector<double>& at) const {
    const auto written = xml_.child(element, "pose");
    const bool degrees = written && xml_.attribute(*written, "degrees").value_or("false") == "true";
    return pose(vector(at), (degrees ? std::numbers::pi / 180.0 : 1.0) * Eigen::Vector3d(at[3], at[4], at[5]));
  }
  [[nodiscard]] std::string relative_to(Id element, const std::string& otherwise) const {
    const auto at = xml_.child(element, "pose");
    const std::string name = at ? xml_.attribute(*at, "relative_to").value_or("") : "";
    return name.empty() ? otherwise : name == "__model__" ? "" : name;
  }
  // Of a link or joint in the model's frame; the model's own where `name` is empty.
  [[nodiscard]] Eigen::Isometry3d frame_of(const std::string& name, std::size_t depth) const {
    if (name.empty()) {
      return Eigen::Isometry3d::Identity();
    }
    const auto link = links_.find(name);
    const auto joint = joints_.find(name);
    if (link == links_.end() && joint == joints_.end()) {
      tree_.place.fail(
          fmt::format("a pose is relative to {}, which is no link or joint: expected one that is", files::shown(name)));
    }
    const Id element = link != links_.end() ? link->second : joint->second;
    if (depth > links_.size() + joints_.size()) {
      xml_.place(element).fail("its pose is relative to itself: expected an end");
    }
    const std::string otherwise = link != links_.end() ? "" : xml_.text(need(element, "child"));
    return frame_of(relative_to(element, otherwise), depth + 1) * isometry(element, pose_numbers(element));
  }

  [[nodiscard]] std::vector<Id> rounds(Id link) const {
    std::vector<Id> out;
    for (const char* kind : {"collision", "visual"}) {
      for (const Id shape : xml_.children(link, kind)) {
        const auto geometry = xml_.child(shape, "geometry");
        for (const Id round : geometry ? xml_.children(*geometry) : std::vector<Id>{}) {
          if ((xml_.name(round) == "cylinder" || xml_.name(round) == "sphere") && xml_.child(round, "radius")) {
            out.push_back(round);
          }
        }
      }
    }
    return out;
  }

  void read_link(Id element) {
    TreeLink link{name_of_element(element), {}, {}, xml_.place(element)};
    const Eigen::Isometry3d frame = frame_of(link.name, 0);
    frames_[link.name] = frame;
    const auto inertial = xml_.child(element, "inertial");
    if (inertial && xml_.child(*inertial, "mass") && xml_.child(*inertial, "inertia")) {
      const Id inertia = *xml_.child(*inertial, "inertia");
      double moments[6] = {1, 1, 1, 0, 0, 0};
      for (std::size_t k = 0; k < 6; ++k) {
        if (const auto at = xml_.child(inertia, kMoments[k])) {
          moments[k] = number(*at);
        }
      }
      const Eigen::Isometry3d at = isometry(*inertial, pose_numbers(*inertial));
      const Eigen::Matrix3d tensor =
          symmetric({moments[0], moments[1], moments[2]}, {moments[3], moments[4], moments[5]});
      link.inertial = TreeInertial{number(*xml_.child(*inertial, "mass")), at.translation(),
                                   at.linear() * tensor * at.linear().transpose(), xml_.place(*inertial)};
      require_possible(*link.inertial);
    }
    for (const char* kind : {"collision", "visual"}) {
      for (const Id shape : xml_.children(element, kind)) {
        const Eigen::Isometry3d at = isometry(shape, pose_numbers(shape));
        const auto geometry = xml_.child(shape, "geometry");
        for (const Id body : geometry ? xml_.children(*geometry) : std::vector<Id>{}) {
          TreeShape out{xml_.name(body), kind == std::string("collision"), 0.0, at.translation(), at.linear().col(2),
                        xml_.place(body)};
          if (const auto radius = xml_.child(body, "radius");
              radius && (out.kind == "cylinder" || out.kind == "sphere")) {
            out.radius = number(*radius);
            if (!(out.radius > 0.0)) {
              xml_.place(*radius).fail("expected metres, > 0");
            }
          }
          link.shapes.push_back(std::move(out));
        }
      }
    }
    robots::move(link, frame);
    tree_.links.push_back(std::move(link));
  }

  void read_joint(Id element) {
    TreeJoint joint;
    joint.name = name_of_element(element);
    joint.type = xml_.attribute(element, "type").value_or("");
    joint.parent = xml_.text(need(element, "parent"));
    joint.child = xml_.text(need(element, "child"));
    joint.place = xml_.place(element);
    if (joint.parent == "world") {
      return;
    }
    if (!links_.contains(joint.child)) {
      joint.place.fail(fmt::format("there is no link {}", files::shown(joint.child)));
    }
    const Eigen::Isometry3d at = frame_of(joint.name, 0);
    joint.origin = at.translation();
    const auto axis = xml_.child(element, "axis");
    if (axis) {
      const auto xyz = xml_.child(*axis, "xyz");
      Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
      std::string in = joint.name;
      if (xyz) {
        direction = vector(numbers(xml_.text(*xyz), 3, xml_.place(*xyz), "xyz"));
        if (!(direction.norm() > 1e-9)) {
          xml_.place(*xyz).fail("a direction of length 0: expected an axis");
        }
        in = xml_.attribute(*xyz, "expressed_in").value_or(joint.name);
      }
      const auto of_model = xml_.child(*axis, "use_parent_model_frame");
      if (in == "__model__" || (of_model && (xml_.text(*of_model) == "1" || xml_.text(*of_model) == "true"))) {
        in.clear();
      }
      joint.axis = (frame_of(in, 0).linear() * direction).normalized();
      read_axis(*axis, joint);
    }
    tree_.joints.push_back(std::move(joint));
  }

  void read_axis(Id axis, TreeJoint& joint) const {
    const auto limit = xml_.child(axis, "limit");
    const auto lower = limit ? xml_.child(*limit, "lower") : std::nullopt;
    if (joint.type == "revolute" && (!lower || number(*lower) < -kEndless)) {
      joint.type = "continuous";
    }
    if (const auto dynamics = xml_.child(axis, "dynamics")) {
      for (const auto& [name, value] : {std::pair{"damping", &joint.damping}, {"friction", &joint.friction}}) {
        if (const auto at = xml_.child(*dynamics, name)) {
          *value = files::OriginNumber{number(*at), xml_.place(*at)};
        }
      }
    }
  }

  std::map<std::string, Id> links_, joints_;
};

}  // namespace

std::unique_ptr<SimulatorDocument> open_sdf(std::string text, const std::string& file) {
  return std::make_unique<SdfDocument>(files::XmlText::parse(std::move(text), file));
}

}  // namespace wheelwright::robots
