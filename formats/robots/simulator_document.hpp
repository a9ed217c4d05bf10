// SPDX-License-Identifier: Apache-2.0
/// \file
/// A simulator's file as links and joints whose numbers can be set, whatever the format.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "formats/files/xml_text.hpp"
#include "formats/robots/robot_description.hpp"
#include "formats/robots/simulator_file.hpp"

namespace wheelwright::robots {

/// What turning frames there and back leaves, of a metre or of the largest moment: such a number is as it was.
inline constexpr double kRounding = 1e-12;

/// A number of a joint.
enum class JointNumber { dry_friction, damping, armature };

/// An open file. Places and tensors are in the frame of `tree`; what is set is recorded in `changed`.
class SimulatorDocument {
 public:
  virtual ~SimulatorDocument() = default;
  SimulatorDocument(const SimulatorDocument&) = delete;
  SimulatorDocument& operator=(const SimulatorDocument&) = delete;

  [[nodiscard]] const RobotTree& tree() const { return tree_; }
  [[nodiscard]] std::string edited() const { return xml_.edited(); }
  [[nodiscard]] const std::vector<NumberChanged>& changed() const { return changed_; }
  /// What is set from here on is set for these causes.
  void because(std::string causes) { because_ = std::move(causes); }

  /// True if joints have this number.
  [[nodiscard]] virtual bool has(JointNumber number) const = 0;
  /// The number as the file has it, defaults included.
  [[nodiscard]] virtual double joint_number(const TreeJoint& joint, JointNumber number) const = 0;
  virtual void set_joint_number(const TreeJoint& joint, JointNumber number, double value) = 0;
  /// Why the mass of a link cannot be set; empty: it can.
  [[nodiscard]] virtual std::string why_no_mass(const TreeLink& link) const = 0;
  /// Writes what differs from the link's inertial.
  virtual void set_inertial(const TreeLink& link, const TreeInertial& wanted) = 0;
  /// Scales the round shapes of a link with at least the radius `least`; true if there was one.
  virtual bool scale_radius(const TreeLink& link, double least, double factor) = 0;
  /// Moves the child of `joint`, and what hangs on it.
  virtual void move(const TreeJoint& joint, const Eigen::Vector3d& shift) = 0;
  /// Torque of the joint per command; why not, or nothing.
  virtual std::string scale_gain(const TreeJoint& joint, double factor) = 0;
  /// Largest torque of the joint, N·m, in total: why not, or nothing.
  virtual std::string limit_effort(const TreeJoint& joint, double limit) = 0;

 protected:
  using Id = files::XmlText::Id;
  explicit SimulatorDocument(files::XmlText xml) : xml_(std::move(xml)) {}

  /// `count` finite numbers, apart by blanks; throws, naming `at`, for anything else. 0: any number of them.
  [[nodiscard]] static std::vector<double> numbers(const std::string& text, std::size_t count,
                                                   const files::FilePlace& at, const std::string& name);
  /// The attribute as numbers; `otherwise` where it is not there.
  [[nodiscard]] std::vector<double> numbers_of(Id element, const std::string& name,
                                               std::vector<double> otherwise) const;
  [[nodiscard]] static Eigen::Vector3d vector(const std::vector<double>& values) {
    return {values[0], values[1], values[2]};
  }
  /// Sets an attribute, or the text inside where `name` is empty, to numbers, unless they are those that are there
  /// (within `slack`); records it as `shown`.
  void write(Id element, const std::string& name, const std::vector<double>& before, const std::vector<double>& after,
             const std::string& shown, double slack = 0.0);
  /// Records an element that was added as a whole.
  void record(Id element, const std::string& number, const std::string& before, const std::string& after);

  files::XmlText xml_;
  RobotTree tree_;
  std::map<std::string, Eigen::Isometry3d> frames_;  ///< of links
  std::vector<NumberChanged> changed_;
  std::string because_;
};

/// Numbers as they are written: nine digits.
[[nodiscard]] std::string number_list(const std::vector<double>& values);

/// Whether `element` or anything inside it is called as one of `names`; the first such element.
[[nodiscard]] std::optional<files::XmlText::Id> find_any(const files::XmlText& xml, files::XmlText::Id element,
                                                         const std::vector<std::string>& names);

/// Opens a file; they throw InputError as edit_simulator does.
/// @{
[[nodiscard]] std::unique_ptr<SimulatorDocument> open_mjcf(std::string text, const std::string& file);
[[nodiscard]] std::unique_ptr<SimulatorDocument> open_urdf(std::string text, const std::string& file);
[[nodiscard]] std::unique_ptr<SimulatorDocument> open_sdf(std::string text, const std::string& file);
/// @}

}  // namespace wheelwright::robots
