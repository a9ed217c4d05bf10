// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "formats/robots/simulator_document.hpp"

namespace wheelwright::robots {
namespace {

class UrdfDocument final : public SimulatorDocument {
 public:
  UrdfDocument(files::XmlText xml, RobotTree tree) : SimulatorDocument(std::move(xml)) {
    tree_ = std::move(tree);
    for (const Id element : xml_.children(0)) {
      if (xml_.name(element) == "link") {
        links_[*xml_.attribute(element, "name")] = element;
      } else if (xml_.name(element) == "joint") {
        joints_[*xml_.attribute(element, "name")] = element;
      }
    }
    for (const TreeLink& link : tree_.links) {
      frames_[link.name] = frame(link.name);
    }
  }

  [[nodiscard]] bool has(JointNumber number) const override { return number != JointNumber::armature; }

  [[nodiscard]] double joint_number(const TreeJoint& joint, JointNumber number) const override {
    const auto& value = number == JointNumber::dry_friction ? joint.friction : joint.damping;
    return value ? value->value : 0.0;
  }

  void set_joint_number(const TreeJoint& joint, JointNumber number, double value) override {
    const Id element = joints_.at(joint.name);
    if (value != joint_number(joint, number)) {
      write(xml_.child_or_new(element, "dynamics"), number == JointNumber::dry_friction ? "friction" : "damping", {},
            {value}, number == JointNumber::dry_friction ? "friction" : "damping");
    }
  }

  [[nodiscard]] std::string why_no_mass(const TreeLink& link) const override {
    // A link without shapes is a frame.
    return link.inertial || link.shapes.empty() ? "" : link.place.text() + " has a shape and no <inertial>";
  }

  void set_inertial(const TreeLink& link, const TreeInertial& wanted) override {
    const Id inertial = *xml_.child(links_.at(link.name), "inertial");
    const auto at = xml_.child(inertial, "origin");
    const std::vector<double> xyz = at ? numbers_of(*at, "xyz", {0, 0, 0}) : std::vector<double>{0, 0, 0};
    const std::vector<double> rpy = at ? numbers_of(*at, "rpy", {0, 0, 0}) : std::vector<double>{0, 0, 0};
    const Id mass = *xml_.child(inertial, "mass");
    write(mass, "value", {link.inertial->mass}, {wanted.mass}, "value");
    const Eigen::Isometry3d& in = frames_.at(link.name);
    const Eigen::Vector3d centre = in.inverse() * wanted.centre;
    if ((centre - vector(xyz)).cwiseAbs().maxCoeff() > kRounding) {
      write(xml_.child_or_new(inertial, "origin"), "xyz", xyz, {centre.x(), centre.y(), centre.z()}, "xyz", kRounding);
    }
    const Eigen::Matrix3d turn = in.linear() * pose({0, 0, 0}, vector(rpy)).linear();
    const Eigen::Matrix3d before = turn.transpose() * link.inertial->tensor * turn;
    const Eigen::Matrix3d after = turn.transpose() * wanted.tensor * turn;
    const Id tensor = *xml_.child(inertial, "inertia");
    const double slack = kRounding * after.cwiseAbs().maxCoeff();
    const char* names[] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
    constexpr Eigen::Index rows[] = {0, 1, 2, 0, 0, 1}, cols[] = {0, 1, 2, 1, 2, 2};
    for (std::size_t k = 0; k < 6; ++k) {
      write(tensor, names[k], {before(rows[k], cols[k])}, {after(rows[k], cols[k])}, names[k], slack);
    }
  }

  bool scale_radius(const TreeLink& link, double least, double factor) override {
    bool any = false;
    for (const char* kind : {"collision", "visual"}) {
      for (const Id shape : xml_.children(links_.at(link.name), kind)) {
        const auto geometry = xml_.child(shape, "geometry");
        for (const Id round : geometry ? xml_.children(*geometry) : std::vector<Id>{}) {
          if (xml_.name(round) != "cylinder" && xml_.name(round) != "sphere") {
            continue;
          }
          const double radius = numbers_of(round, "radius", {0.0}).front();
          if (radius >= least) {
            write(round, "radius", {radius}, {factor * radius}, "radius");
            any = true;
          }
        }
      }
    }
    return any;
  }

  void move(const TreeJoint& joint, const Eigen::Vector3d& shift) override {
    const Id origin = xml_.child_or_new(joints_.at(joint.name), "origin");
    const std::vector<double> before = numbers_of(origin, "xyz", {0, 0, 0});
    const Eigen::Vector3d after = vector(before) + frames_.at(joint.parent).linear().transpose() * shift;
    write(origin, "xyz", before, {after.x(), after.y(), after.z()}, "xyz", kRounding);
  }

  std::string scale_gain(const TreeJoint&, double) override { return "URDF has no gain between command and torque"; }

  std::string limit_effort(const TreeJoint& joint, double limit) override {
    const Id element = joints_.at(joint.name);
    if (!xml_.child(element, "limit")) {
      return joint.place.text() + " has no <limit>, which needs a limit of the speed, too";
    }
    write(*xml_.child(element, "limit"), "effort", {}, {limit}, "effort");
    return {};
  }

 private:
  [[nodiscard]] Eigen::Isometry3d frame(const std::string& link) const {
    for (const TreeJoint& joint : tree_.joints) {
      if (joint.child == link) {
        const auto at = xml_.child(joints_.at(joint.name), "origin");
        return frame(joint.parent) *
               (at ? pose(vector(numbers_of(*at, "xyz", {0, 0, 0})), vector(numbers_of(*at, "rpy", {0, 0, 0})))
                   : Eigen::Isometry3d(Eigen::Isometry3d::Identity()));
      }
    }
    return Eigen::Isometry3d::Identity();
  }

  std::map<std::string, Id> links_, joints_;
};

}  // namespace

std::unique_ptr<SimulatorDocument> open_urdf(std::string text, const std::string& file) {
  RobotTree tree = parse_urdf(text, file);
  return std::make_unique<UrdfDocument>(files::XmlText::parse(std::move(text), file), std::move(tree));
}

}  // namespace wheelwright::robots
