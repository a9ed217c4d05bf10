// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/sdf.hpp>

#include <cmath>

#include <fmt/format.h>

#include <wheelwright/files/byte_source.hpp>
#include <wheelwright/files/number.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/files/xml_place.hpp>
#include <wheelwright/robots/controller_file.hpp>
#include <wheelwright/robots/robot_description.hpp>
#include <wheelwright/robots/sdf_frames.hpp>

namespace wheelwright {
namespace {

using Eigen::Isometry3d;

constexpr std::size_t longest_sdf = std::size_t{1} << 24;
constexpr double no_limit = 1e16;  // SDF's own word for it

XmlPlace model_of(const XmlPlace& root) {
  if (root.name() != "sdf") {
    root.fail("is no SDF: expected the root element <sdf>");
  }
  std::vector<XmlPlace> models = root.children("model");
  for (const XmlPlace& world : root.children("world")) {
    for (const XmlPlace& include : world.children("include")) {
      include.fail("is another file: expected the robot's own model file, or one file with everything in it");
    }
    for (const XmlPlace& model : world.children("model")) {
      if (const auto fixed = model.child("static"); !fixed || (fixed->text() != "true" && fixed->text() != "1")) {
        models.push_back(model);
      }
    }
  }
  if (models.empty()) {
    root.fail("holds no model that can move: expected a <model>");
  }
  if (models.size() > 1) {
    models[1].fail("a second model beside " + models[0].place().text() + ": expected the robot alone");
  }
  const XmlPlace& model = models.front();
  for (const char* nested : {"include", "model"}) {
    if (const std::vector<XmlPlace> inside = model.children(nested); !inside.empty()) {
      inside.front().fail("is a model inside the model: expected links and joints of one model, flattened");
    }
  }
  if (const auto fixed = model.child("static"); fixed && (fixed->text() == "true" || fixed->text() == "1")) {
    fixed->fail("a model that cannot move: expected a robot that drives");
  }
  return model;
}

struct SdfReader {
  XmlPlace model;
  double version;
  SdfFrames frames{model};
  RobotTree tree{};

  void read() {
    tree.place = model.place();
    tree.name = model.need_attribute("name");
    for (const XmlPlace& element : model.children("link")) {
      tree.links.push_back(link(element));
    }
    for (const XmlPlace& element : model.children("joint")) {
      tree.joints.push_back(joint(element));
    }
    for (const XmlPlace& plugin : model.children("plugin")) {
      if (auto facts = read_drive_plugin(plugin)) {
        tree.plugins.push_back(std::move(*facts));
      }
    }
    require_tree(tree);
  }

  /// The pose of what stands inside the link `name`, in the model's frame.
  [[nodiscard]] Isometry3d inside(const XmlPlace& element, const std::string& name) const {
    return frames.frame(SdfFrames::relative_to(element, name), element) * SdfFrames::own_pose(element);
  }

  [[nodiscard]] TreeLink link(const XmlPlace& element) const {
    TreeLink out{element.need_attribute("name"), {}, {}, element.place()};
    if (const auto inertial = element.child("inertial")) {
      if (inertial->attribute("auto").value_or("false") == "true") {
        inertial->fail("auto: is found from densities by the simulator: expected <mass> and <inertia>");
      }
      const XmlPlace inertia = inertial->need("inertia");
      const auto product = [&](const char* name) {
        const auto at = inertia.child(name);
        return at ? at->number() : 0.0;
      };
      const auto moment = [&](const char* name) { return inertia.need(name).number(); };
      const Eigen::Matrix3d tensor =
          symmetric({moment("ixx"), moment("iyy"), moment("izz")}, {product("ixy"), product("ixz"), product("iyz")});
      const Isometry3d at = inside(*inertial, out.name);
      out.inertial = TreeInertial{inertial->need("mass").number(), at.translation(),
                                  at.linear() * tensor * at.linear().transpose(), inertial->place()};
      require_possible(*out.inertial);
    }
    for (const char* kind : {"collision", "visual"}) {
      for (const XmlPlace& shape : element.children(kind)) {
        const Isometry3d at = inside(shape, out.name);
        const XmlPlace geometry = shape.need("geometry");
        for (const XmlPlace& body : geometry.children()) {
          out.shapes.push_back(read_shape(body, kind == std::string("collision"), at,
                                          [](const XmlPlace& round) { return round.need("radius").number(); }));
        }
      }
    }
    return out;
  }

  static std::optional<OriginNumber> number(const XmlPlace& axis, const char* group, const char* name) {
    const auto inside = axis.child(group);
    const auto at = inside ? inside->child(name) : std::nullopt;
    if (!at) {
      return std::nullopt;
    }
    const bool limit = group == std::string("limit");
    const auto value = to_number(at->text());
    if (limit && value && !std::isnan(*value) && !(*value >= 0.0 && *value < no_limit)) {
      return std::nullopt;
    }
    const double finite = at->number();
    if (!(finite >= 0.0)) {
      at->fail(shown(at->text()) + ": expected a number >= 0");
    }
    return OriginNumber{finite, at->place()};
  }

  static bool turns_freely(const XmlPlace& axis) {
    const auto limit = axis.child("limit");
    for (const char* name : {"lower", "upper"}) {
      const auto at = limit ? limit->child(name) : std::nullopt;
      const auto value = at ? to_number(at->text()) : std::optional(no_limit);
      if (!value || std::isnan(*value)) {
        at->fail(shown(at->text()) + ": expected a limit in rad");
      }
      if (std::abs(*value) < no_limit) {
        return false;
      }
    }
    return true;
  }

  [[nodiscard]] TreeJoint joint(const XmlPlace& element) const {
    TreeJoint out;
    out.name = element.need_attribute("name");
    out.type = element.need_attribute("type");
    out.parent = element.need("parent").text();
    out.child = element.need("child").text();
    out.place = element.place();
    if (out.parent == "world") {
      element.need("parent").fail("holds the robot to the world: expected a robot that drives");
    }
    const Isometry3d at = frames.frame(out.name, element);
    out.origin = at.translation();
    const auto axis = element.child("axis");
    if (!axis) {
      if (out.type != "fixed" && out.type != "ball") {
        element.fail("holds no <axis>: expected one");
      }
      return out;
    }
    const XmlPlace xyz = axis->need("xyz");
    const auto in_model = axis->child("use_parent_model_frame");
    const bool of_model = version < 1.5 || (in_model && (in_model->text() == "true" || in_model->text() == "1"));
    const auto named = xyz.attribute("expressed_in");
    const Isometry3d frame = named && !named->empty() ? frames.frame(*named, xyz)
                             : of_model               ? Isometry3d::Identity()
                                                      : at;
    out.axis = frame.linear() * xyz.vector("");
    if (!(out.axis.norm() > 1e-9)) {
      xyz.fail("a direction of length 0: expected an axis");
    }
    out.axis.normalize();
    if (out.type == "revolute" && turns_freely(*axis)) {
      out.type = "continuous";
    }
    out.damping = number(*axis, "dynamics", "damping");
    out.friction = number(*axis, "dynamics", "friction");
    out.effort = number(*axis, "limit", "effort");
    out.velocity = number(*axis, "limit", "velocity");
    return out;
  }
};

}  // namespace

RobotTree parse_sdf(std::string_view text, const std::string& file) {
  const XmlPlace root = XmlPlace::parse(text, file);
  const XmlPlace model = model_of(root);
  const double version = root.number("version");
  if (!(version >= 1.4)) {
    root.fail("version " + shown(root.need_attribute("version")) + ": expected 1.4 or later");
  }
  SdfReader reader{model, version};
  reader.read();
  return reader.tree;
}

RobotTree read_sdf(const std::filesystem::path& path) {
  return parse_sdf(read_bytes(path, longest_sdf), path.string());
}

}  // namespace wheelwright
