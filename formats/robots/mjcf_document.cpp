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

constexpr double kMujocoDensity = 1000.0;  // kg/m³, the engine's default
const std::vector<std::string> kActuators = {"general", "motor",  "position", "velocity", "intvelocity",
                                             "damper",  "muscle", "cylinder", "adhesion"};
const std::vector<std::string> kJoint = {"joint"};
const std::vector<std::string> kGeom = {"geom"};

// A geom that has a mass: where it is in its body.
struct Solid {
  double mass = 0.0;
  Eigen::Vector3d moments = Eigen::Vector3d::Zero();  // principal, kg·m²
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
};

class MjcfDocument final : public SimulatorDocument {
 public:
  explicit MjcfDocument(files::XmlText xml) : SimulatorDocument(std::move(xml)) {
    if (xml_.name(0) != "mujoco") {
      xml_.place(0).fail("is no MJCF: expected the root element <mujoco>");
    }
    if (const auto bad = find_any(xml_, 0, {"include", "attach", "replicate", "composite", "flexcomp"})) {
      refuse(*bad);
    }
    read_compiler();
    for (const Id element : xml_.children(0, "default")) {
      read_defaults(element, "");
    }
    std::vector<Id> tops;
    for (const Id world : xml_.children(0, "worldbody")) {
      if (const auto bad = find_any(xml_, world, {"frame"})) {
        refuse(*bad);
      }
      for (const Id body : xml_.children(world, "body")) {
        if (hinges(body) >= 2) {
          tops.push_back(body);
        }
      }
    }
    if (tops.size() != 1) {
      xml_.place(tops.empty() ? 0 : tops[1])
          .fail(fmt::format("{} bodies of the world have two hinges or more: expected one robot", tops.size()));
    }
    tree_.name = xml_.attribute(0, "model").value_or("");
    tree_.place = xml_.place(tops.front());
    read_body(tops.front(), "", Eigen::Isometry3d::Identity(), "main");
    require_tree(tree_);
  }

  [[nodiscard]] bool has(JointNumber) const override { return true; }

  [[nodiscard]] double joint_number(const TreeJoint& joint, JointNumber number) const override {
    const Id element = joints_.at(joint.name);
    const auto text = resolved(element, kJoint, attribute_of(number));
    return text ? numbers(*text, 1, xml_.place(element), attribute_of(number)).front() : 0.0;
  }

  void set_joint_number(const TreeJoint& joint, JointNumber number, double value) override {
    if (value != joint_number(joint, number)) {
      write(joints_.at(joint.name), attribute_of(number), {}, {value}, attribute_of(number));
    }
  }

  [[nodiscard]] std::string why_no_mass(const TreeLink& link) const override {
    const auto why = massless_.find(link.name);
    return why != massless_.end() ? why->second : std::string();
  }

  void set_inertial(const TreeLink& link, const TreeInertial& wanted) override {
    const Eigen::Isometry3d& in = frames_.at(link.name);
    const Eigen::Vector3d centre = in.inverse() * wanted.centre;
    const Id body = links_.at(link.name);
    const auto there = xml_.child(body, "inertial");
    if (!there) {
      const Eigen::Matrix3d tensor = in.linear().transpose() * wanted.tensor * in.linear();
      const Id fresh = xml_.add_child(body, "inertial");
      xml_.set_attribute(fresh, "pos", number_list({centre.x(), centre.y(), centre.z()}));
      xml_.set_attribute(fresh, "mass", number_list({wanted.mass}));
      const double slack = kRounding * tensor.cwiseAbs().maxCoeff();
      const bool diagonal = std::max({std::abs(tensor(0, 1)), std::abs(tensor(0, 2)), std::abs(tensor(1, 2))}) <= slack;
      std::vector<double> moments = {tensor(0, 0), tensor(1, 1), tensor(2, 2)};
      if (!diagonal) {
        moments.insert(moments.end(), {tensor(0, 1), tensor(0, 2), tensor(1, 2)});
      }
      xml_.set_attribute(fresh, diagonal ? "diaginertia" : "fullinertia", number_list(moments));
      record(fresh, "inertial", fmt::format("mass {:.9g} of the geoms", link.inertial->mass),
             fmt::format("mass {:.9g}, and centre and moments as numbers", wanted.mass));
      return;
    }
    write(*there, "mass", {link.inertial->mass}, {wanted.mass}, "mass");
    const std::vector<double> pos = numbers_of(*there, "pos", {0, 0, 0});
    if ((centre - vector(pos)).cwiseAbs().maxCoeff() > kRounding) {
      write(*there, "pos", pos, {centre.x(), centre.y(), centre.z()}, "pos", kRounding);
    }
    const Eigen::Matrix3d turn = in.linear() * orientation(*there, {});
    const Eigen::Matrix3d before = turn.transpose() * link.inertial->tensor * turn;
    const Eigen::Matrix3d after = turn.transpose() * wanted.tensor * turn;
    const double slack = kRounding * after.cwiseAbs().maxCoeff();
    const auto listed = [](const Eigen::Matrix3d& t, bool full) {
      std::vector<double> out = {t(0, 0), t(1, 1), t(2, 2)};
      if (full) {
        out.insert(out.end(), {t(0, 1), t(0, 2), t(1, 2)});
      }
      return out;
    };
    const bool full = xml_.attribute(*there, "fullinertia").has_value();
    write(*there, full ? "fullinertia" : "diaginertia", listed(before, full), listed(after, full),
          full ? "fullinertia" : "diaginertia", slack);
  }

  bool scale_radius(const TreeLink& link, double least, double factor) override {
    bool any = false;
    bool of_mass = false;
    for (const Id geom : xml_.children(links_.at(link.name), "geom")) {
      const std::string type = geom_type(geom);
      const std::vector<double> size = geom_size(geom);
      if ((type != "sphere" && type != "cylinder" && type != "capsule" && type != "ellipsoid") || size.empty()) {
        continue;
      }
      std::vector<double> after = size;
      if (type == "ellipsoid" && size.size() == 3) {
        // The two that are equal roll.
        for (std::size_t k = 0; k < 3; ++k) {
          const bool rolls = size[k] == size[(k + 1) % 3] || size[k] == size[(k + 2) % 3];
          after[k] *= rolls && size[k] >= least ? factor : 1.0;
        }
      } else if (size[0] >= least) {
        after[0] *= factor;
      }
      if (after != size) {
        write(geom, "size", size, after, "size");
        any = true;
        const auto solid = solid_of(geom, nullptr);
        of_mass = of_mass || (solid && solid->mass > 0.0);
      }
    }
    if (any && of_mass && link.inertial && !xml_.child(links_.at(link.name), "inertial")) {
      set_inertial(link, *link.inertial);
    }
    return any;
  }

  void move(const TreeJoint& joint, const Eigen::Vector3d& shift) override {
    const Id body = links_.at(joint.child);
    const std::vector<double> before = numbers_of(body, "pos", {0, 0, 0});
    const Eigen::Vector3d after = vector(before) + frames_.at(joint.parent).linear().transpose() * shift;
    write(body, "pos", before, {after.x(), after.y(), after.z()}, "pos", kRounding);
  }

  std::string scale_gain(const TreeJoint& joint, double factor) override {
    const std::vector<Id> actuators = actuators_of(joint);
    for (const Id actuator : actuators) {
      if (std::string why = not_scaled(actuator); !why.empty()) {
        return why;
      }
    }
    if (actuators.empty()) {
      return no_actuator(joint);
    }
    for (const Id actuator : actuators) {
      const std::string kind = xml_.name(actuator);
      const auto scale = [&](const std::string& name, std::vector<double> otherwise) {
        const auto text = resolved(actuator, kActuators, name);
        const std::vector<double> before = text ? numbers(*text, 0, xml_.place(actuator), name) : std::move(otherwise);
        std::vector<double> after = before;
        std::ranges::transform(after, after.begin(), [&](double v) { return factor * v; });
        write(actuator, name, xml_.attribute(actuator, name) ? before : std::vector<double>{}, after, name);
      };
      if (kind == "motor") {
        scale_gear(actuator, factor);
      } else if (kind == "velocity") {
        scale("kv", {1.0});
      } else if (kind == "position") {
        scale("kp", {1.0});
        if (resolved(actuator, kActuators, "kv")) {
          scale("kv", {0.0});
        }
      } else {
        scale("gainprm", {1.0});
        if (resolved(actuator, kActuators, "biasprm")) {
          scale("biasprm", {0.0});
        }
      }
    }
    return {};
  }

  std::string limit_effort(const TreeJoint& joint, double limit) override {
    const std::vector<Id> actuators = actuators_of(joint);
    if (actuators.size() != 1) {
      return actuators.empty() ? no_actuator(joint) : joint.place.text() + " has several actuators";
    }
    const Id actuator = actuators.front();
    const double gear = std::abs(gear_of(actuator).front());
    if (!(gear > 0.0)) {
      return xml_.place(actuator).text() + " has a gear of 0";
    }
    const auto text = resolved(actuator, kActuators, "forcerange");
    const std::vector<double> before =
        text ? numbers(*text, 2, xml_.place(actuator), "forcerange") : std::vector<double>{};
    write(actuator, "forcerange", xml_.attribute(actuator, "forcerange") ? before : std::vector<double>{},
          {-limit / gear, limit / gear}, "forcerange");
    if (const auto limited = resolved(actuator, kActuators, "forcelimited"); limited.value_or("") != "true") {
      record(actuator, "forcelimited", xml_.attribute(actuator, "forcelimited").value_or(""), "true");
      xml_.set_attribute(actuator, "forcelimited", "true");
    }
    return {};
  }

 private:
  [[noreturn]] void refuse(Id element) const {
    xml_.place(element).fail(
        fmt::format("<{}> makes bodies that do not stand in the file: expected MJCF without it (MuJoCo's compile, or "
                    "mj_saveLastXML, writes the whole model)",
                    xml_.name(element)));
  }

  static const char* attribute_of(JointNumber number) {
    return number == JointNumber::dry_friction ? "frictionloss"
           : number == JointNumber::damping    ? "damping"
                                               : "armature";
  }

  void read_compiler() {
    for (const Id element : xml_.children(0, "compiler")) {
      const auto is = [&](const char* name, const char* value) {
        return xml_.attribute(element, name).value_or("") == value;
      };
      degrees_ = is("angle", "radian") ? false : is("angle", "degree") ? true : degrees_;
      from_geoms_ = xml_.attribute(element, "inertiafromgeom").value_or(from_geoms_);
      unlimited_ = unlimited_ || is("autolimits", "false");
      euler_ = xml_.attribute(element, "eulerseq").value_or(euler_);
      if (is("coordinate", "global")) {
        xml_.place(element).fail("coordinate=\"global\": expected local coordinates");
      }
      if (const auto total = xml_.attribute(element, "settotalmass"); total && *total != "-1") {
        rescaled_ = xml_.place(element).text() + " has settotalmass, which scales all masses";
      }
      if (xml_.attribute(element, "inertiagrouprange")) {
        groups_ = true;
      }
    }
    if (euler_.size() != 3 || euler_.find_first_not_of("xyzXYZ") != std::string::npos) {
      xml_.place(0).fail(fmt::format("eulerseq {}: expected three of x, y, z, X, Y, Z", files::shown(euler_)));
    }
  }

  void read_defaults(Id element, const std::string& parent) {
    const std::string name = xml_.attribute(element, "class").value_or(parent.empty() ? "main" : "");
    if (name.empty()) {
      xml_.place(element).fail("a <default> without a class: expected one");
    }
    Class& own = classes_[name];
    own.elements.push_back(element);
    if (name != parent && !parent.empty()) {
      own.parent = parent;
    }
    for (const Id inside : xml_.children(element, "default")) {
      read_defaults(inside, name);
    }
  }

  // The attribute of an element called as one of `kinds`, its own or of its class.
  [[nodiscard]] std::optional<std::string> resolved(Id element, const std::vector<std::string>& kinds,
                                                    const std::string& name) const {
    if (auto own = xml_.attribute(element, name)) {
      return own;
    }
    const auto within = class_within_.find(element);
    std::string in = xml_.attribute(element, "class").value_or(within != class_within_.end() ? within->second : "main");
    for (std::size_t depth = 0; !in.empty() && depth <= classes_.size(); ++depth) {
      const auto found = classes_.find(in);
      if (found == classes_.end()) {
        if (in == "main") {
          break;
        }
        xml_.place(element).fail(fmt::format("there is no default class {}", files::shown(in)));
      }
      for (const Id defaults : found->second.elements) {
        for (const Id inside : xml_.children(defaults)) {
          if (std::ranges::find(kinds, xml_.name(inside)) != kinds.end()) {
            if (auto value = xml_.attribute(inside, name)) {
              return value;
            }
          }
        }
      }
      in = found->second.parent;
    }
    return std::nullopt;
  }

  // Joints of type hinge in the body and below.
  [[nodiscard]] std::size_t hinges(Id body) const {
    std::size_t out = 0;
    for (const Id inside : xml_.children(body)) {
      if (xml_.name(inside) == "body") {
        out += hinges(inside);
      } else if (xml_.name(inside) == "joint") {
        out += resolved_type(inside) == "hinge" ? 1 : 0;
      }
    }
    return out;
  }
  // Before bodies are read their classes are not known: a joint of another type says so itself, or by its own class.
  [[nodiscard]] std::string resolved_type(Id joint) const { return resolved(joint, kJoint, "type").value_or("hinge"); }

  [[nodiscard]] std::optional<std::string> text_of(Id element, const std::vector<std::string>& kinds,
                                                   const std::string& name) const {
    return kinds.empty() ? xml_.attribute(element, name) : resolved(element, kinds, name);
  }

  // R of quat, axisangle, xyaxes, zaxis or euler.
  [[nodiscard]] Eigen::Matrix3d orientation(Id element, const std::vector<std::string>& kinds) const {
    const files::FilePlace at = xml_.place(element);
    const double unit = degrees_ ? std::numbers::pi / 180.0 : 1.0;
    const auto list = [&](const char* name, std::size_t count) {
      const auto text = text_of(element, kinds, name);
      return text ? numbers(*text, count, at, name) : std::vector<double>{};
    };
    const auto direction = [&](const Eigen::Vector3d& v) {
      if (!(v.norm() > 1e-9)) {
        at.fail("a direction of length 0: expected an orientation");
      }
      return v.normalized().eval();
    };
    if (const auto q = list("quat", 4); !q.empty()) {
      const Eigen::Quaterniond quat(q[0], q[1], q[2], q[3]);
      if (!(quat.norm() > 1e-9)) {
        at.fail("quat of length 0: expected an orientation");
      }
      return quat.normalized().toRotationMatrix();
    }
    if (const auto a = list("axisangle", 4); !a.empty()) {
      return Eigen::AngleAxisd(unit * a[3], direction(vector(a))).toRotationMatrix();
    }
    if (const auto a = list("xyaxes", 6); !a.empty()) {
      const Eigen::Vector3d x = direction({a[0], a[1], a[2]}), y0(a[3], a[4], a[5]);
      Eigen::Matrix3d out;
      out.col(0) = x;
      out.col(1) = direction(y0 - x.dot(y0) * x);
      out.col(2) = x.cross(out.col(1));
      return out;
    }
    if (const auto a = list("zaxis", 3); !a.empty()) {
      return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), direction(vector(a))).toRotationMatrix();
    }
    Eigen::Matrix3d out = Eigen::Matrix3d::Identity();
    if (const auto a = list("euler", 3); !a.empty()) {
      for (std::size_t k = 0; k < 3; ++k) {
        const bool fixed = euler_[k] < 'a';
        const auto axis = static_cast<Eigen::Index>(euler_[k] - (fixed ? 'X' : 'x'));
        const Eigen::Matrix3d turn =
            Eigen::AngleAxisd(unit * a[k], Eigen::Vector3d(Eigen::Vector3d::Unit(axis))).toRotationMatrix();
        out = fixed ? Eigen::Matrix3d(turn * out) : Eigen::Matrix3d(out * turn);
      }
    }
    return out;
  }

  [[nodiscard]] Eigen::Isometry3d pose_of(Id element, const std::vector<std::string>& kinds) const {
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    const auto pos = text_of(element, kinds, "pos");
    out.translation() = pos ? vector(numbers(*pos, 3, xml_.place(element), "pos")) : Eigen::Vector3d(0, 0, 0);
    out.linear() = orientation(element, kinds);
    return out;
  }

  [[nodiscard]] std::string geom_type(Id geom) const {
    return resolved(geom, kGeom, "type").value_or(resolved(geom, kGeom, "mesh") ? "mesh" : "sphere");
  }
  [[nodiscard]] std::vector<double> geom_size(Id geom) const {
    const auto text = resolved(geom, kGeom, "size");
    return text ? numbers(*text, 0, xml_.place(geom), "size") : std::vector<double>{};
  }

  // Place and half length of a geom that goes from a point to another.
  [[nodiscard]] Eigen::Isometry3d geom_pose(Id geom, double* half_length) const {
    const auto ends = resolved(geom, kGeom, "fromto");
    if (!ends) {
      return pose_of(geom, kGeom);
    }
    const std::vector<double> e = numbers(*ends, 6, xml_.place(geom), "fromto");
    const Eigen::Vector3d from(e[0], e[1], e[2]), to(e[3], e[4], e[5]);
    if (!((to - from).norm() > 1e-9)) {
      xml_.place(geom).fail("fromto of length 0: expected two points");
    }
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    out.translation() = 0.5 * (from + to);
    out.linear() = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), to - from).toRotationMatrix();
    *half_length = 0.5 * (to - from).norm();
    return out;
  }

  // The mass of a geom; nothing, with the reason, where it cannot be reckoned.
  [[nodiscard]] std::optional<Solid> solid_of(Id geom, std::string* why) const {
    const std::string type = geom_type(geom);
    const files::FilePlace at = xml_.place(geom);
    const auto mass = resolved(geom, kGeom, "mass");
    const auto density = resolved(geom, kGeom, "density");
    const double given = mass ? numbers(*mass, 1, at, "mass").front() : -1.0;
    const double rho = density ? numbers(*density, 1, at, "density").front() : kMujocoDensity;
    Solid out;
    if (type == "plane" || given == 0.0 || (given < 0.0 && rho == 0.0)) {
      return out;
    }
    std::vector<double> size = geom_size(geom);
    double half = 0.0;
    out.at = geom_pose(geom, &half);
    if (half > 0.0) {
      size.resize(1);
      size.push_back(half);
      if (type == "box" || type == "ellipsoid") {
        size.insert(size.begin(), size[0]);
      }
    }
    const std::size_t needed = type == "sphere" ? 1 : type == "capsule" || type == "cylinder" ? 2 : 3;
    const bool solid =
        type == "sphere" || type == "capsule" || type == "cylinder" || type == "ellipsoid" || type == "box";
    if (!solid || resolved(geom, kGeom, "mesh") || resolved(geom, kGeom, "shellinertia").value_or("false") == "true") {
      if (why != nullptr) {
        *why = fmt::format(
            "{} is a {} whose mass is reckoned by the engine: give its body an <inertial> "
            "(mj_saveLastXML writes it)",
            at.text(), solid ? "shell or mesh" : type);
      }
      return std::nullopt;
    }
    if (size.size() < needed || std::ranges::any_of(size.begin(), size.begin() + static_cast<std::ptrdiff_t>(needed),
                                                    [](double s) { return !(s > 0.0); })) {
      at.fail(fmt::format("size: expected {} numbers > 0 for a {}", needed, type));
    }
    const double a = size[0], b = needed > 1 ? size[1] : 0.0, c = needed > 2 ? size[2] : 0.0, pi = std::numbers::pi;
    double volume = 0.0;
    Eigen::Vector3d per_mass;
    if (type == "sphere") {
      volume = 4.0 / 3.0 * pi * a * a * a;
      per_mass.setConstant(0.4 * a * a);
    } else if (type == "cylinder") {
      volume = 2.0 * pi * a * a * b;
      per_mass = {(3.0 * a * a + 4.0 * b * b) / 12.0, (3.0 * a * a + 4.0 * b * b) / 12.0, 0.5 * a * a};
    } else if (type == "capsule") {
      const double tube = 2.0 * pi * a * a * b, ends = 4.0 / 3.0 * pi * a * a * a;
      volume = tube + ends;
      const double across = tube * (3.0 * a * a + 4.0 * b * b) / 12.0 + ends * (0.4 * a * a + 0.75 * a * b + b * b);
      per_mass = Eigen::Vector3d(across, across, tube * 0.5 * a * a + ends * 0.4 * a * a) / volume;
    } else if (type == "ellipsoid") {
      volume = 4.0 / 3.0 * pi * a * b * c;
      per_mass = 0.2 * Eigen::Vector3d(b * b + c * c, a * a + c * c, a * a + b * b);
    } else {
      volume = 8.0 * a * b * c;
      per_mass = Eigen::Vector3d(b * b + c * c, a * a + c * c, a * a + b * b) / 3.0;
    }
    out.mass = given >= 0.0 ? given : rho * volume;
    out.moments = out.mass * per_mass;
    return out;
  }

  // The inertial of a body in its own frame; nothing where it has none, with the reason in massless_ where that is
  // not because it has no mass.
  std::optional<TreeInertial> inertial_of(Id body, const std::string& name) {
    const auto there = xml_.child(body, "inertial");
    if (!rescaled_.empty()) {
      massless_[name] = rescaled_;
    }
    if (there && from_geoms_ != "true") {
      const Eigen::Isometry3d at = pose_of(*there, {});
      const auto mass = xml_.attribute(*there, "mass");
      if (!mass) {
        xml_.place(*there).fail("has no attribute mass: expected one");
      }
      TreeInertial out;
      out.mass = numbers(*mass, 1, xml_.place(*there), "mass").front();
      out.centre = at.translation();
      Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
      if (xml_.attribute(*there, "fullinertia")) {
        const std::vector<double> f = numbers_of(*there, "fullinertia", {0, 0, 0, 0, 0, 0});
        tensor = symmetric({f[0], f[1], f[2]}, {f[3], f[4], f[5]});
      } else if (xml_.attribute(*there, "diaginertia")) {
        tensor = vector(numbers_of(*there, "diaginertia", {0, 0, 0})).asDiagonal();
      } else {
        xml_.place(*there).fail("has no diaginertia and no fullinertia: expected one of them");
      }
      out.tensor = at.linear() * tensor * at.linear().transpose();
      out.place = xml_.place(*there);
      require_possible(out);
      return out;
    }
    if (from_geoms_ == "true") {
      massless_[name] = "the compiler has inertiafromgeom=\"true\": an <inertial> is not read";
    } else if (from_geoms_ == "false") {
      return std::nullopt;
    }
    if (groups_) {
      massless_[name] = "the compiler has inertiagrouprange: which geoms have a mass is not read";
    }
    TreeInertial out;
    out.place = xml_.place(body);
    std::vector<Solid> solids;
    for (const Id geom : xml_.children(body, "geom")) {
      std::string why;
      const auto solid = solid_of(geom, &why);
      if (!solid) {
        massless_[name] = why;
        return std::nullopt;
      }
      out.mass += solid->mass;
      out.centre += solid->mass * solid->at.translation();
      solids.push_back(*solid);
    }
    if (!(out.mass > 0.0)) {
      return std::nullopt;
    }
    out.centre /= out.mass;
    for (const Solid& solid : solids) {
      const Eigen::Vector3d d = solid.at.translation() - out.centre;
      out.tensor += solid.at.linear() * solid.moments.asDiagonal() * solid.at.linear().transpose() +
                    solid.mass * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
    }
    return out;
  }

  void read_body(Id body, const std::string& parent, const Eigen::Isometry3d& frame, const std::string& above,
                 std::size_t depth = 0) {
    if (depth > 200) {
      xml_.place(body).fail("bodies inside bodies more than 200 deep");
    }
    const std::string within = xml_.attribute(body, "childclass").value_or(above);
    std::string name = xml_.attribute(body, "name").value_or("");
    if (name.empty() || links_.contains(name)) {
      name = fmt::format("{}#{}", name.empty() ? "body" : name, body);
    }
    links_[name] = body;
    frames_[name] = frame;
    std::vector<Id> joints;
    for (const Id inside : xml_.children(body)) {
      class_within_[inside] = within;
      if (xml_.name(inside) == "joint" || xml_.name(inside) == "freejoint") {
        joints.push_back(inside);
      }
    }
    TreeLink link{name, inertial_of(body, name), {}, xml_.place(body)};
    for (const Id geom : xml_.children(body, "geom")) {
      link.shapes.push_back(shape_of(geom));
    }
    robots::move(link, frame);
    tree_.links.push_back(std::move(link));
    if (!parent.empty()) {
      read_joints(joints, parent, name, frame, body);
    }
    for (const Id inside : xml_.children(body, "body")) {
      read_body(inside, name, frame * pose_of(inside, {}), within, depth + 1);
    }
  }

  [[nodiscard]] TreeShape shape_of(Id geom) const {
    double half = 0.0;
    const Eigen::Isometry3d at = geom_pose(geom, &half);
    const std::vector<double> size = geom_size(geom);
    TreeShape out{geom_type(geom), true, 0.0, at.translation(), at.linear().col(2), xml_.place(geom)};
    const auto zero = [&](const char* name) { return resolved(geom, kGeom, name).value_or("1") == "0"; };
    out.collision = !(zero("contype") && zero("conaffinity"));
    if (out.kind == "capsule") {
      out.kind = "cylinder";
    }
    if (out.kind == "ellipsoid" && size.size() == 3) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        const double one = size[static_cast<std::size_t>((k + 1) % 3)],
                     other = size[static_cast<std::size_t>((k + 2) % 3)];
        if (one == other) {
          out.kind = size[static_cast<std::size_t>(k)] == one ? "sphere" : "cylinder";
          out.axis = at.linear().col(k);
          out.radius = one;
        }
      }
    } else if ((out.kind == "cylinder" || out.kind == "sphere") && !size.empty()) {
      out.radius = size[0];
    }
    if ((out.kind == "cylinder" || out.kind == "sphere") && !(out.radius > 0.0)) {
      out.place.fail("size: expected a radius > 0");
    }
    return out;
  }

  void read_joints(const std::vector<Id>& joints, const std::string& parent, const std::string& child,
                   const Eigen::Isometry3d& frame, Id body) {
    TreeJoint out;
    out.parent = parent;
    out.child = child;
    out.origin = frame.translation();
    if (joints.empty()) {
      out.name = "fixed " + child;
      out.type = "fixed";
      out.place = xml_.place(body);
      tree_.joints.push_back(std::move(out));
      return;
    }
    const Id joint = joints.front();
    out.name = xml_.attribute(joint, "name").value_or("");
    if (out.name.empty() || joints_.contains(out.name)) {
      out.name = "joint of " + child;
    }
    joints_[out.name] = joint;
    out.place = xml_.place(joint);
    const std::string type = xml_.name(joint) == "freejoint" ? "free" : resolved_type(joint);
    const auto limited = resolved(joint, kJoint, "limited");
    const bool range =
        resolved(joint, kJoint, "range").has_value() && !unlimited_ && limited.value_or("auto") == "auto";
    out.type = joints.size() > 1 || type == "free" || type == "ball" ? "floating"
               : type == "slide"                                     ? "prismatic"
               : limited.value_or("") == "true" || range             ? "revolute"
                                                                     : "continuous";
    const auto pos = resolved(joint, kJoint, "pos");
    const auto axis = resolved(joint, kJoint, "axis");
    const Eigen::Vector3d along = axis ? vector(numbers(*axis, 3, out.place, "axis")) : Eigen::Vector3d(0, 0, 1);
    if (!(along.norm() > 1e-9)) {
      out.place.fail("axis of length 0: expected a direction");
    }
    out.origin = frame * (pos ? vector(numbers(*pos, 3, out.place, "pos")) : Eigen::Vector3d(0, 0, 0));
    out.axis = (frame.linear() * along).normalized();
    tree_.joints.push_back(std::move(out));
  }

  [[nodiscard]] std::vector<Id> actuators_of(const TreeJoint& joint) const {
    std::vector<Id> out;
    for (const Id section : xml_.children(0, "actuator")) {
      for (const Id actuator : xml_.children(section)) {
        if (xml_.attribute(actuator, "joint").value_or("") == joint.name ||
            xml_.attribute(actuator, "jointinparent").value_or("") == joint.name) {
          out.push_back(actuator);
        }
      }
    }
    return out;
  }
  static std::string no_actuator(const TreeJoint& joint) {
    return joint.place.text() + " has no actuator of its own in the file";
  }
  // Why the force of an actuator cannot be scaled by its numbers.
  [[nodiscard]] std::string not_scaled(Id actuator) const {
    const std::string kind = xml_.name(actuator);
    if (kind == "motor" || kind == "velocity" || kind == "position") {
      return {};
    }
    const bool plain = kind == "general" && resolved(actuator, kActuators, "gaintype").value_or("fixed") != "muscle" &&
                       resolved(actuator, kActuators, "gaintype").value_or("fixed") != "user" &&
                       resolved(actuator, kActuators, "biastype").value_or("none") != "muscle" &&
                       resolved(actuator, kActuators, "biastype").value_or("none") != "user";
    return plain ? std::string() : xml_.place(actuator).text() + " has a gain of another law";
  }
  [[nodiscard]] std::vector<double> gear_of(Id actuator) const {
    const auto text = resolved(actuator, kActuators, "gear");
    return text ? numbers(*text, 0, xml_.place(actuator), "gear") : std::vector<double>{1.0};
  }
  void scale_gear(Id actuator, double factor) {
    const std::vector<double> before = gear_of(actuator);
    std::vector<double> after = before;
    after[0] *= factor;
    write(actuator, "gear", xml_.attribute(actuator, "gear") ? before : std::vector<double>{}, after, "gear");
  }

  struct Class {
    std::vector<Id> elements;
    std::string parent;
  };
  std::map<std::string, Class> classes_;
  std::map<Id, std::string> class_within_;  // of the elements in bodies
  std::map<std::string, Id> links_, joints_;
  std::map<std::string, std::string> massless_;  // link -> why its mass cannot be set
  bool degrees_ = true, unlimited_ = false, groups_ = false;
  std::string from_geoms_ = "auto", euler_ = "xyz", rescaled_;
};

}  // namespace

std::unique_ptr<SimulatorDocument> open_mjcf(std::string text, const std::string& file) {
  return std::make_unique<MjcfDocument>(files::XmlText::parse(std::move(text), file));
}

}  // namespace wheelwright::robots
