// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/robot_description.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include "formats/files/bytes.hpp"
#include "formats/files/place.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/controller_file.hpp"

namespace wheelwright::robots {

using files::XmlPlace;

namespace {

constexpr std::size_t most_parts = 5000;  // links, and joints: work grows with their number and how deep they hang
constexpr std::size_t deepest = 200;      // joints between a link and the root
constexpr double rounding = 1e-3;         // of the largest moment: files are written with three digits

template <typename Items>
auto* named(Items& items, const std::string& name) {
  const auto found = std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  return found == items.end() ? nullptr : &*found;
}

template <typename Items>
void require_unique(const Items& items) {
  std::map<std::string, const files::FilePlace*> seen;
  for (const auto& item : items) {
    const auto [before, fresh] = seen.emplace(item.name, &item.place);
    if (!fresh) {
      item.place.fail("has the name of " + before->second->text() + ": expected each name once");
    }
  }
}

}  // namespace

const TreeLink* RobotTree::link(const std::string& wanted) const { return named(links, wanted); }

const TreeJoint* RobotTree::joint(const std::string& wanted) const { return named(joints, wanted); }

void require_possible(const TreeInertial& inertial) {
  const double m = inertial.mass;
  const Eigen::Matrix3d& t = inertial.tensor;
  if (!std::isfinite(m) || !t.allFinite() || !inertial.centre.allFinite()) {
    inertial.place.fail("not finite: expected finite numbers");
  }
  if (!(m >= 0.0)) {
    inertial.place.fail(fmt::format("mass {}: expected a mass > 0 in kg", m));
  }
  if (m == 0.0 && !t.isZero(0.0)) {
    inertial.place.fail("mass 0 with an inertia: expected a mass > 0 in kg");
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(t, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d& p = solver.eigenvalues();  // in rising order
  if (!p.allFinite()) {
    inertial.place.fail("moments of inertia beyond reckoning: expected kg·m²");
  }
  const std::string moments = fmt::format("principal moments of inertia {:.6g}, {:.6g}, {:.6g}", p[0], p[1], p[2]);
  const double slack = rounding * p.cwiseAbs().maxCoeff();
  if (p[0] < -slack) {
    inertial.place.fail(moments + ": expected none below 0");
  }
  if (p[2] > p[0] + p[1] + slack) {
    inertial.place.fail(moments + ": expected none larger than the sum of the others, as those of any body are");
  }
}

void require_tree(const RobotTree& tree) {
  if (tree.links.empty()) {
    tree.place.fail("holds no link: expected links with their masses");
  }
  if (std::max(tree.links.size(), tree.joints.size()) > most_parts) {
    tree.place.fail(fmt::format("{} links and {} joints: expected at most {} of each", tree.links.size(),
                                tree.joints.size(), most_parts));
  }
  require_unique(tree.links);
  require_unique(tree.joints);
  std::map<std::string, const TreeJoint*> above;
  std::vector<std::string> names;
  for (const TreeLink& link : tree.links) {
    names.push_back(link.name);
    above[link.name] = nullptr;
  }
  for (const TreeJoint& joint : tree.joints) {
    for (const std::string& link : {joint.parent, joint.child}) {
      if (!above.contains(link)) {
        joint.place.fail(fmt::format("there is no link {}{}", files::shown(link), files::did_you_mean(link, names)));
      }
    }
    const TreeJoint*& parent = above[joint.child];
    if (parent != nullptr) {
      joint.place.fail(fmt::format("its child {} is that of {} too: expected a tree", files::shown(joint.child),
                                   parent->place.text()));
    }
    parent = &joint;
  }
  std::string root;
  for (const TreeLink& link : tree.links) {
    std::size_t steps = 0;
    std::string top = link.name;
    for (const TreeJoint* up = above[top]; up != nullptr; up = above[top]) {
      top = up->parent;
      if (++steps > tree.joints.size()) {
        up->place.fail("is part of a ring of joints: expected a tree");
      }
    }
    if (steps > deepest) {
      link.place.fail(fmt::format("hangs on {} joints in a row: expected at most {}", steps, deepest));
    }
    if (root.empty()) {
      root = top;
    } else if (top != root) {
      link.place.fail(
          fmt::format("hangs on {}, and other links on {}: expected one tree", files::shown(top), files::shown(root)));
    }
  }
}

Eigen::Isometry3d pose(const Eigen::Vector3d& translation, const Eigen::Vector3d& roll_pitch_yaw) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translation() = translation;
  out.linear() = (Eigen::AngleAxisd(roll_pitch_yaw.z(), Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(roll_pitch_yaw.y(), Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(roll_pitch_yaw.x(), Eigen::Vector3d::UnitX()))
                     .toRotationMatrix();
  return out;
}

Eigen::Matrix3d symmetric(const Eigen::Vector3d& moments, const Eigen::Vector3d& products) {
  Eigen::Matrix3d out = moments.asDiagonal();
  out(0, 1) = out(1, 0) = products.x();
  out(0, 2) = out(2, 0) = products.y();
  out(1, 2) = out(2, 1) = products.z();
  return out;
}

TreeShape read_shape(const XmlPlace& body, bool collision, const Eigen::Isometry3d& at,
                     const std::function<double(const XmlPlace&)>& radius) {
  TreeShape out{body.name(), collision, 0.0, at.translation(), at.linear().col(2), body.place()};
  out.place.element = std::string(collision ? "collision " : "visual ") + out.place.element;
  if (out.kind == "cylinder" || out.kind == "sphere") {
    out.radius = radius(body);
    if (!(out.radius > 0.0)) {
      body.fail("radius " + std::to_string(out.radius) + ": expected metres, > 0");
    }
  }
  return out;
}

void move(TreeLink& link, const Eigen::Isometry3d& frame) {
  if (link.inertial) {
    link.inertial->centre = frame * link.inertial->centre;
    link.inertial->tensor = frame.linear() * link.inertial->tensor * frame.linear().transpose();
  }
  for (TreeShape& shape : link.shapes) {
    shape.centre = frame * shape.centre;
    shape.axis = frame.linear() * shape.axis;
  }
}

namespace {

using Eigen::Isometry3d;

constexpr std::size_t longest_urdf = std::size_t{1} << 24;

/// Reads elements into a RobotTree whose places are still those of the links and joints themselves.
struct UrdfReader {
  RobotTree tree;
  std::vector<Isometry3d> origins;  ///< of the joints, in the order of the tree's

  static Isometry3d origin(const XmlPlace& element) {
    const auto at = element.child("origin");
    if (!at) {
      return Isometry3d::Identity();
    }
    const auto vector = [&](const char* name) {
      return at->attribute(name) ? at->vector(name) : Eigen::Vector3d(0.0, 0.0, 0.0);
    };
    return pose(vector("xyz"), vector("rpy"));
  }

  void read(const XmlPlace& root) {
    if (root.name() != "robot") {
      root.fail("is no URDF: expected the root element <robot>");
    }
    tree.place = root.place();
    tree.name = root.attribute("name").value_or("");
    for (const XmlPlace& element : root.children()) {
      const std::string name = element.name();
      if (name == "link") {
        tree.links.push_back(link(element));
      } else if (name == "joint") {
        tree.joints.push_back(joint(element));
      } else if (name == "gazebo") {
        for (const XmlPlace& plugin : element.children("plugin")) {
          if (auto facts = read_drive_plugin(plugin)) {
            tree.plugins.push_back(std::move(*facts));
          }
        }
      } else if (name == "transmission") {
        transmission(element);
      } else if (name == "ros2_control") {
        ros2_control(element);
      }
    }
  }

  static TreeLink link(const XmlPlace& element) {
    TreeLink out{element.need_attribute("name"), {}, {}, element.place()};
    if (const auto inertial = element.child("inertial")) {
      const XmlPlace inertia = inertial->need("inertia");
      const Eigen::Matrix3d tensor = symmetric({inertia.number("ixx"), inertia.number("iyy"), inertia.number("izz")},
                                               {inertia.number("ixy"), inertia.number("ixz"), inertia.number("iyz")});
      const Isometry3d at = origin(*inertial);
      out.inertial = TreeInertial{inertial->need("mass").number("value"), at.translation(),
                                  at.linear() * tensor * at.linear().transpose(), inertial->place()};
      require_possible(*out.inertial);
    }
    for (const char* kind : {"collision", "visual"}) {
      for (const XmlPlace& shape : element.children(kind)) {
        const Isometry3d at = origin(shape);
        const XmlPlace geometry = shape.need("geometry");
        for (const XmlPlace& body : geometry.children()) {
          out.shapes.push_back(read_shape(body, kind == std::string("collision"), at,
                                          [](const XmlPlace& round) { return round.number("radius"); }));
        }
      }
    }
    return out;
  }

  static std::optional<files::OriginNumber> number(const std::optional<XmlPlace>& element, const std::string& name) {
    if (!element || !element->attribute(name)) {
      return std::nullopt;
    }
    const double value = element->number(name);
    if (!(value >= 0.0)) {
      element->fail(fmt::format("{} {}: expected a number >= 0", name, files::shown(*element->attribute(name))));
    }
    files::FilePlace place = element->place();
    place.element = name + " in " + place.element;
    return files::OriginNumber{value, place};
  }

  TreeJoint joint(const XmlPlace& element) {
    TreeJoint out;
    out.name = element.need_attribute("name");
    out.type = element.need_attribute("type");
    out.parent = element.need("parent").need_attribute("link");
    out.child = element.need("child").need_attribute("link");
    out.place = element.place();
    if (const auto axis = element.child("axis")) {
      out.axis = axis->vector("xyz");
      if (!(out.axis.norm() > 1e-9)) {
        axis->fail("xyz: a direction of length 0: expected an axis");
      }
    }
    out.damping = number(element.child("dynamics"), "damping");
    out.friction = number(element.child("dynamics"), "friction");
    out.effort = number(element.child("limit"), "effort");
    out.velocity = number(element.child("limit"), "velocity");
    origins.push_back(origin(element));
    return out;
  }

  // As ROS 1 has it: the joint's interface, and the gear of the actuator.
  void transmission(const XmlPlace& element) {
    for (const XmlPlace& at : element.children("joint")) {
      JointInterfaces out;
      out.joint = at.need_attribute("name");
      out.place = element.place();
      for (const XmlPlace& interface : at.children("hardwareInterface")) {
        const std::string text = interface.text();
        for (const char* kind : {"Effort", "Velocity", "Position"}) {
          if (text.find(kind) != std::string::npos) {
            std::string word = kind;
            word[0] = static_cast<char>(word[0] - 'A' + 'a');
            out.commands.push_back(word);
          }
        }
      }
      reductions(at, out);
      for (const XmlPlace& actuator : element.children("actuator")) {
        reductions(actuator, out);
      }
      tree.interfaces.push_back(std::move(out));
    }
  }

  static void reductions(const XmlPlace& element, JointInterfaces& out) {
    for (const char* name : {"mechanicalReduction", "mechanical_reduction"}) {
      if (const auto at = element.child(name)) {
        const double value = at->number();
        if (!(value != 0.0)) {
          at->fail("0: expected motor turns per turn of the joint");
        }
        out.reduction = files::OriginNumber{std::abs(value), at->place()};
      }
    }
  }

  void ros2_control(const XmlPlace& element) {
    if (const auto hardware = element.child("hardware")) {
      for (const XmlPlace& param : hardware->children("param")) {
        static const std::vector<std::string> counts = {"enc_counts_per_rev", "encoder_counts_per_rev",
                                                        "encoder_counts_per_turn", "encoder_counts_per_revolution"};
        if (std::find(counts.begin(), counts.end(), param.attribute("name").value_or("")) != counts.end()) {
          const double value = param.number();
          if (!(value > 0.0)) {
            param.fail(files::shown(param.text()) + ": expected counts of the encoder per turn, > 0");
          }
          tree.encoder_counts = files::OriginNumber{value, param.place()};
        }
      }
    }
    for (const XmlPlace& at : element.children("joint")) {
      JointInterfaces out;
      out.joint = at.need_attribute("name");
      out.place = at.place();
      for (const XmlPlace& interface : at.children("command_interface")) {
        out.commands.push_back(interface.need_attribute("name"));
      }
      for (const XmlPlace& interface : at.children("state_interface")) {
        out.states.push_back(interface.need_attribute("name"));
      }
      tree.interfaces.push_back(std::move(out));
    }
    for (const XmlPlace& at : element.children("transmission")) {
      transmission(at);
    }
  }

  /// Puts everything into the frame of the root link.
  void compose() {
    require_tree(tree);
    std::map<std::string, std::size_t> above;
    for (std::size_t k = 0; k < tree.joints.size(); ++k) {
      above[tree.joints[k].child] = k;
    }
    const auto frame = [&](std::string link) {
      Isometry3d out = Isometry3d::Identity();
      for (auto up = above.find(link); up != above.end(); up = above.find(link)) {
        out = origins[up->second] * out;
        link = tree.joints[up->second].parent;
      }
      return out;
    };
    for (TreeLink& link : tree.links) {
      move(link, frame(link.name));
    }
    for (TreeJoint& joint : tree.joints) {
      const Isometry3d at = frame(joint.child);
      joint.origin = at.translation();
      joint.axis = (at.linear() * joint.axis).normalized();
    }
  }
};

}  // namespace

RobotTree parse_urdf(std::string_view text, const std::string& file) {
  UrdfReader reader;
  reader.read(XmlPlace::parse(text, file));
  reader.compose();
  return reader.tree;
}

RobotTree read_urdf(const std::filesystem::path& path) {
  return parse_urdf(files::read_bytes(path, longest_urdf), path.string());
}

}  // namespace wheelwright::robots
