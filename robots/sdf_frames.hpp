// SPDX-License-Identifier: Apache-2.0
/// \file
/// The frames of an SDF model and what their poses are relative to.
#pragma once

#include <map>
#include <set>
#include <string>

#include <Eigen/Geometry>

#include <wheelwright/files/xml_place.hpp>

namespace wheelwright {

/// Frames of links, joints and <frame>s of one model.
class SdfFrames {
 public:
  /// Collects those of `model`. Throws InputError for poses that cannot be read and for names that stand there twice.
  explicit SdfFrames(const XmlPlace& model);

  /// The frame called `name` in the model's frame ("" and "__model__" are the model's own). Throws InputError at `user`
  /// where there is none, or where it is relative to itself in the end.
  [[nodiscard]] Eigen::Isometry3d frame(const std::string& name, const XmlPlace& user) const;

  /// The <pose> inside `element`, in the frame that it is relative to; the identity where there is none.
  [[nodiscard]] static Eigen::Isometry3d own_pose(const XmlPlace& element);
  /// What the <pose> inside `element` is relative to; `otherwise` where it does not say.
  [[nodiscard]] static std::string relative_to(const XmlPlace& element, const std::string& otherwise);

 private:
  struct Frame {
    Eigen::Isometry3d pose;
    std::string relative_to;
    XmlPlace place;
  };
  void add(const XmlPlace& element, const std::string& otherwise);
  [[nodiscard]] Eigen::Isometry3d resolved(const std::string& name, const XmlPlace& user,
                                           std::set<std::string>& on_the_way) const;

  std::map<std::string, Frame> frames_;
};

}  // namespace wheelwright
