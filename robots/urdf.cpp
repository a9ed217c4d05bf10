// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/urdf.hpp>

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include <wheelwright/files/byte_source.hpp>
#include <wheelwright/files/suggest.hpp>
#include <wheelwright/files/xml_place.hpp>
#include <wheelwright/robots/drive_plugin.hpp>
#include <wheelwright/robots/robot_shapes.hpp>

namespace wheelwright {
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

  static std::optional<OriginNumber> number(const std::optional<XmlPlace>& element, const std::string& name) {
    if (!element || !element->attribute(name)) {
      return std::nullopt;
    }
    const double value = element->number(name);
    if (!(value >= 0.0)) {
      element->fail(fmt::format("{} {}: expected a number >= 0", name, shown(*element->attribute(name))));
    }
    FilePlace place = element->place();
    place.element = name + " in " + place.element;
    return OriginNumber{value, place};
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
        out.reduction = OriginNumber{std::abs(value), at->place()};
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
            param.fail(shown(param.text()) + ": expected counts of the encoder per turn, > 0");
          }
          tree.encoder_counts = OriginNumber{value, param.place()};
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
  return parse_urdf(read_bytes(path, longest_urdf), path.string());
}

}  // namespace wheelwright
