// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/ros_plan.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>

namespace wheelwright::ros {
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

}  // namespace wheelwright::ros
