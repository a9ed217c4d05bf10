// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which joints of a topic of joint states are the drive wheels, and which of its messages are theirs.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "formats/logs/bag_log.hpp"
#include "formats/logs/joint_states.hpp"

namespace wheelwright::logs {

/// Whether a joint of this plain_name() is a caster's, or another that no motor turns.
[[nodiscard]] bool is_caster(const std::string& plain);
/// Whether a joint of this plain_name() steers.
[[nodiscard]] bool is_steering(const std::string& plain);

/// What the first messages of a topic say of its joints. Everything that is decided goes into the notes and
/// contradictions of a BagChoice, with the --map that decides otherwise. Where a topic was not surveyed nothing is
/// decided.
class JointChoice {
 public:
  /// All of them outlive this; `path` is for messages.
  JointChoice(const BagTopicView& view, const CsvOptions& options, const std::string& path, BagChoice& choice)
      : view_(view), options_(options), path_(path), choice_(choice) {}

  /// Says that messages name no joint.
  void tell_unnamed();
  /// Says where no name of the `joints` tells the right or the left wheel, with the --map that does.
  void tell_no_side(const std::vector<std::string>& joints, const std::vector<std::string>& right,
                    const std::vector<std::string>& left);
  /// Contradicts where steering joints move.
  void tell_steering();
  /// Takes joints away from sides that have several: those that stand still while others turn, have no effort that
  /// changes beside others that have one, or, unless they are `wheels` by their
  /// names, turn by less than a turn. Throws InputError where the joints are wheels of several robots that move.
  void sort_out(bool wheels, std::vector<std::string>& right, std::vector<std::string>& left);
  /// Of a source whose columns are chosen: contradicts where wheels of a side do not turn as one; takes away angles
  /// (speeds) that stand still beside speeds (angles), and motion in arrays that are not as long as the names; excludes
  /// messages of a second publisher. Throws InputError as choose_bag_columns().
  void settle(BagSource& source);

 private:
  using Motions = std::map<std::string, JointMotion>;

  void take_one_robot(std::vector<std::string>& right, std::vector<std::string>& left, Motions& motions);
  void say(std::string note);
  void tell_apart(const std::string& side, const std::vector<std::string>& joints);
  void refuse_twice(const JointPublisher& publisher, const std::vector<std::string>& joints) const;
  void drop_columns(BagSource& source, const JointPublisher& publisher);
  [[nodiscard]] bool wants_efforts() const;
  [[nodiscard]] std::string uneven_words(const JointPublisher& publisher, std::size_t array) const;
  [[nodiscard]] std::string cure(const BagSource& source, const JointPublisher& publisher, std::size_t array) const;
  void leave_publishers(BagSource& source, const std::vector<std::string>& joints, const JointPublisher*& publisher);
  void refuse_apart(const std::vector<std::string>& joints) const;
  [[nodiscard]] bool are_one_publisher(const std::vector<const JointPublisher*>& publishers,
                                       const std::vector<std::string>& joints) const;
  void leave_constant(BagSource& source, const std::vector<std::string>& joints, const JointPublisher& publisher);
  [[noreturn]] void refuse_publishers(const std::string& evidence) const;

  const BagTopicView& view_;
  const CsvOptions& options_;
  const std::string& path_;
  BagChoice& choice_;
};

}  // namespace wheelwright::logs
