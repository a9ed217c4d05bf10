// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/ros_messages.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::logs {
namespace {

std::vector<std::string> field_names(const RosMessage& message) {
  std::vector<std::string> names;
  for (const RosField& field : message.fields) {
    names.push_back(field.name);
  }
  return names;
}

/// Reads a path from the left.
struct PathReader {
  const RosDefinition& definition;
  const std::string& whole;
  std::string_view rest = whole;
  ros::Path path{};
  std::vector<std::size_t> messages{};  ///< in which the steps are

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: {}: {}", definition.name(), files::shown(whole), what));
  }

  std::size_t take_field(const RosMessage& message) {
    const std::size_t end = std::min(rest.find_first_of(".["), rest.size());
    const std::string_view name = rest.substr(0, end);
    rest.remove_prefix(end);
    const auto found = std::find_if(message.fields.begin(), message.fields.end(),
                                    [&](const RosField& field) { return field.name == name; });
    if (found == message.fields.end()) {
      const auto names = field_names(message);
      fail(fmt::format("{} has no field {}{}{}", message.name, files::shown(name), files::did_you_mean(name, names),
                       files::nearest_name(name, names).empty() ? "; it has " + core::listed(names) : ""));
    }
    return static_cast<std::size_t>(found - message.fields.begin());
  }

  void take_element(const RosField& field, ros::PathStep& step) {
    const bool given = rest.starts_with('[');
    if (field.shape == RosShape::single) {
      if (given) {
        fail(fmt::format("{} is no list", files::shown(field.name)));
      }
      return;
    }
    const std::string expected = fmt::format("{0}[0] or {0}[NAME]", field.name);
    const std::size_t end = rest.find(']');
    if (!given || end == std::string_view::npos || end < 2) {
      fail(fmt::format("{} is a list: expected an element of it as {}", files::shown(field.name), expected));
    }
    const std::string_view element = rest.substr(1, end - 1);
    rest.remove_prefix(end + 1);
    std::uint32_t index = 0;
    const auto [last, error] = std::from_chars(element.data(), element.data() + element.size(), index);
    if (error == std::errc() && last == element.data() + element.size()) {
      if (field.count > 0 && index >= field.count) {
        fail(fmt::format("{} has at most {} elements, from [0] on", files::shown(field.name), field.count));
      }
      step.index = index;
      return;
    }
    step.element = std::string(element);
    for (std::size_t level = messages.size(); level-- > 0;) {
      const std::size_t place = level == path.size() ? step.field : path[level].field;
      if (ros::names_of(definition.messages[messages[level]], place)) {
        return;
      }
    }
    fail(
        fmt::format("no field name, names, joint_names or interface_names of strings says which element of {} that is: "
                    "expected its index, as {}[0]",
                    files::shown(field.name), field.name));
  }

  ros::Path read() {
    std::size_t message = 0;
    while (true) {
      messages.push_back(message);
      const RosMessage& in = definition.messages[message];
      ros::PathStep step{take_field(in), {}, {}};
      const RosField& field = in.fields[step.field];
      take_element(field, step);
      path.push_back(std::move(step));
      if (rest.empty()) {
        demand_number(field);
        return std::move(path);
      }
      if (rest.front() != '.') {
        fail("expected '.' or the end behind ']'");
      }
      if (field.kind != RosKind::message) {
        fail(fmt::format("{} has no fields", files::shown(field.name)));
      }
      rest.remove_prefix(1);
      message = field.message;
    }
  }

  void demand_number(const RosField& field) const {
    if (field.kind == RosKind::string || field.kind == RosKind::wstring) {
      fail("is text: expected a number");
    }
    if (field.kind == RosKind::message) {
      const RosMessage& inner = definition.messages[field.message];
      fail(fmt::format("is a {}: expected one of its numbers, such as {}.{}", inner.name, whole,
                       inner.fields.front().name));
    }
  }
};

/// Lists the paths of a definition. Types without a number are not entered: a definition whose types double thirty
/// times has few lines and 10^9 texts.
class PathLister {
 public:
  PathLister(const RosDefinition& definition, std::size_t most)
      : definition_(definition), most_(most), numbers_(definition.messages.size(), Numbers::unknown) {}

  std::vector<std::string> list() {
    if (has_numbers(0)) {
      add(0, "");
    }
    return std::move(paths_);
  }

 private:
  enum class Numbers : std::uint8_t { unknown, none, some };

  bool has_numbers(std::size_t message) {
    if (numbers_[message] == Numbers::unknown) {
      const bool some = std::ranges::any_of(definition_.messages[message].fields,
                                            [this](const RosField& field) { return leads_to_numbers(field); });
      numbers_[message] = some ? Numbers::some : Numbers::none;
    }
    return numbers_[message] == Numbers::some;
  }

  bool leads_to_numbers(const RosField& field) {
    return field.kind == RosKind::message ? has_numbers(field.message)
                                          : field.kind != RosKind::string && field.kind != RosKind::wstring;
  }

  void add(std::size_t message, const std::string& before) {
    for (const RosField& field : definition_.messages[message].fields) {
      if (paths_.size() >= most_) {
        return;
      }
      if (!leads_to_numbers(field)) {
        continue;
      }
      const std::string path = before + field.name + (field.shape == RosShape::single ? "" : "[]");
      if (field.kind == RosKind::message) {
        add(field.message, path + ".");
      } else {
        paths_.push_back(path);
      }
    }
  }

  const RosDefinition& definition_;
  std::size_t most_;
  std::vector<Numbers> numbers_;  ///< of each message
  std::vector<std::string> paths_;
};

}  // namespace

ros::Path ros::find_path(const RosDefinition& definition, const std::string& path) {
  return PathReader{definition, path}.read();
}

std::optional<std::size_t> ros::names_of(const RosMessage& message, std::size_t list) {
  const auto texts = [&](std::string_view name) -> std::optional<std::size_t> {
    const auto found = std::find_if(message.fields.begin(), message.fields.end(), [&](const RosField& field) {
      return field.name == name && field.kind == RosKind::string && field.shape != RosShape::single;
    });
    return found == message.fields.end() ? std::nullopt
                                         : std::optional(static_cast<std::size_t>(found - message.fields.begin()));
  };
  if (list < message.fields.size() && message.fields[list].name.starts_with("multi_dof_")) {
    if (const auto found = texts("multi_dof_joint_names")) {
      return found;
    }
  }
  for (const std::string_view name : {"name", "names", "joint_names", "interface_names"}) {
    if (const auto found = texts(name)) {
      return found;
    }
  }
  return std::nullopt;
}

std::vector<std::string> numeric_paths(const RosDefinition& definition, std::size_t most) {
  return PathLister(definition, most).list();
}

}  // namespace wheelwright::logs

namespace wheelwright::logs::ros {
namespace {

constexpr std::size_t most_steps = 100'000;

/// A path from some message on, and the slot of its number.
struct Want {
  const Path* path;
  std::size_t slot;
};

/// A message that is being walked through: what its lists' names are found in.
struct Scope {
  const RosMessage* message;
  std::size_t field;
  std::map<std::pair<std::size_t, std::string>, std::size_t>
      wanted;  ///< (field of names, name): place in MessagePlan::names
};

struct Planner {
  const RosDefinition& definition;
  MessagePlan plan{};
  std::vector<Scope> scopes{};  ///< as many as steps of the path so far: every message on the way opens one
  std::size_t steps = 0;
  std::map<std::size_t, std::size_t> skipping{};  ///< block that skips a message
  bool lost = false;                              ///< behind a wstring

  Step& append(Block& block, Step step) {
    if (++steps > most_steps) {
      throw InputError(fmt::format("{}: its definition has more than {} parts", definition.name(), most_steps));
    }
    if (step.code == Step::Code::skip && !block.empty() && block.back().code == Step::Code::skip) {
      Step& before = block.back();
      if (step.align <= before.align && before.bytes % step.align == 0) {
        before.bytes += step.bytes;
        return before;
      }
    }
    return block.emplace_back(step);
  }

  void message(std::size_t place, const std::vector<Want>& wants, Block& block) {
    const RosMessage& message = definition.messages[place];
    const std::size_t level = scopes.size();
    scopes.push_back({&message, 0, {}});
    register_names(place, wants);
    for (std::size_t f = 0; f < message.fields.size(); ++f) {
      scopes[level].field = f;
      std::vector<Want> here;
      std::copy_if(wants.begin(), wants.end(), std::back_inserter(here),
                   [&](const Want& want) { return (*want.path)[level].field == f; });
      field(message.fields[f], f, here, block);
    }
    scopes.pop_back();
  }

  /// Notes the names that are looked for in this message, before its fields are walked: they may come first.
  void register_names(std::size_t place, const std::vector<Want>& wants) {
    const std::size_t level = scopes.size() - 1;
    for (const Want& want : wants) {
      const std::size_t list = (*want.path)[level].field;
      for (std::size_t step = level; step < want.path->size(); ++step) {
        const std::string& element = (*want.path)[step].element;
        if (!element.empty() && owner_of(*want.path, step, place, level) == level) {
          const std::size_t names = *names_of(definition.messages[place], list);
          const auto [entry, added] = scopes[level].wanted.try_emplace({names, element}, plan.names.size());
          if (added) {
            plan.names.push_back(element);
          }
          plan.twice = plan.twice || names > list;
        }
      }
    }
  }

  /// The level whose message names the element of step `step`: the innermost that can. Levels from `level` on are those
  /// of the path below the message `place`.
  [[nodiscard]] std::size_t owner_of(const Path& path, std::size_t step, std::size_t place, std::size_t level) const {
    std::vector<std::size_t> below = {place};
    for (std::size_t k = level; k < step; ++k) {
      below.push_back(definition.messages[below.back()].fields[path[k].field].message);
    }
    for (std::size_t k = step + 1; k-- > 0;) {
      const RosMessage& message = k >= level ? definition.messages[below[k - level]] : *scopes[k].message;
      if (names_of(message, path[k].field)) {
        return k;
      }
    }
    return ~std::size_t{0};
  }

  /// Which element a want wants.
  WantedElement selection(const Want& want, std::size_t target) const {
    const std::size_t level = scopes.size() - 1;
    const PathStep& step = (*want.path)[level];
    if (step.index) {
      return {false, *step.index, target};
    }
    for (std::size_t k = level + 1; k-- > 0;) {
      if (const auto names = names_of(*scopes[k].message, scopes[k].field)) {
        return {true, scopes[k].wanted.at({*names, step.element}), target};
      }
    }
    return {};  // find_path has seen to it
  }

  void field(const RosField& field, std::size_t place, const std::vector<Want>& wants, Block& block) {
    if (lost && !wants.empty()) {
      throw InputError(fmt::format("{}: {} comes behind a wstring, whose bytes differ between implementations",
                                   definition.name(), field.name));
    }
    if (lost) {
      return;
    }
    if (field.kind == RosKind::wstring) {
      lost = true;
      append(block, {.code = Step::Code::unknown, .field = &field});
    } else if (field.kind == RosKind::message) {
      messages(field, wants, block);
    } else if (field.kind == RosKind::string) {
      strings(field, place, block);
    } else {
      numbers(field, wants, block);
    }
  }

  void numbers(const RosField& field, const std::vector<Want>& wants, Block& block) {
    const std::size_t size = size_of(field.kind);
    const auto align = static_cast<std::uint8_t>(size);
    if (wants.empty() && field.shape != RosShape::sequence) {
      const std::uint64_t count = field.shape == RosShape::array ? field.count : 1;
      append(block, {.align = align, .bytes = count * size, .field = &field});
    } else {
      const bool single = field.shape == RosShape::single;
      Step step = list(single ? Step::Code::value : Step::Code::numbers, field);
      step.align = align;
      step.bytes = size;
      for (const Want& want : wants) {
        plan.selections.push_back(single ? WantedElement{false, 0, want.slot} : selection(want, want.slot));
      }
      step.last = plan.selections.size();
      append(block, step);
    }
  }

  void strings(const RosField& field, std::size_t place, Block& block) {
    if (field.shape == RosShape::single) {
      append(block, {.code = Step::Code::text, .align = 4, .field = &field});
      return;
    }
    Step step = list(Step::Code::texts, field);
    for (const auto& [wanted, name] : scopes.back().wanted) {
      if (wanted.first == place) {
        plan.selections.push_back({true, name, 0});
      }
    }
    step.last = plan.selections.size();
    append(block, step);
  }

  void messages(const RosField& field, const std::vector<Want>& wants, Block& block) {
    if (field.shape == RosShape::single) {
      message(field.message, wants, block);
      return;
    }
    const std::size_t skip = skipping_block(field.message);
    std::vector<WantedElement> selections;
    if (!lost) {
      // Paths to the same element share a block.
      std::vector<std::pair<const PathStep*, std::vector<Want>>> groups;
      for (const Want& want : wants) {
        const PathStep& step = (*want.path)[scopes.size() - 1];
        const auto same =
            std::find_if(groups.begin(), groups.end(), [&](const auto& group) { return *group.first == step; });
        if (same == groups.end()) {
          groups.push_back({&step, {want}});
        } else {
          same->second.push_back(want);
        }
      }
      for (const auto& [step, group] : groups) {
        Block inner;
        message(field.message, group, inner);
        plan.blocks.push_back(std::move(inner));
        selections.push_back(selection(group.front(), plan.blocks.size() - 1));
      }
    } else if (!wants.empty()) {
      throw InputError(fmt::format("{}: {} has a wstring, whose bytes differ between implementations",
                                   definition.name(), field.name));
    }
    Step step = list(Step::Code::messages, field);
    step.target = skip;
    plan.selections.insert(plan.selections.end(), selections.begin(), selections.end());
    step.last = plan.selections.size();
    append(block, step);
  }

  std::size_t skipping_block(std::size_t place) {
    const auto known = skipping.find(place);
    if (known != skipping.end()) {
      return known->second;
    }
    Block block;
    message(place, {}, block);
    plan.blocks.push_back(std::move(block));
    return skipping[place] = plan.blocks.size() - 1;
  }

  Step list(Step::Code code, const RosField& field) const {
    return {.code = code,
            .kind = field.kind,
            .counted = field.shape == RosShape::sequence,
            .count = field.count,
            .first = plan.selections.size(),
            .field = &field};
  }
};

}  // namespace

std::size_t size_of(RosKind kind) {
  constexpr std::array<std::size_t, 14> sizes = {1, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 0, 0, 0};
  return sizes[static_cast<std::size_t>(kind)];
}

MessagePlan make_plan(const RosDefinition& definition, const std::vector<Path>& paths) {
  Planner planner{definition};
  planner.plan.blocks.emplace_back();
  std::vector<Want> wants;
  for (std::size_t slot = 0; slot < paths.size(); ++slot) {
    wants.push_back({&paths[slot], slot});
  }
  Block block;
  planner.message(0, wants, block);
  planner.plan.blocks.front() = std::move(block);
  return std::move(planner.plan);
}

}  // namespace wheelwright::logs::ros
