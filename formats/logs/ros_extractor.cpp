// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/ros_messages.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/limits.hpp"

namespace wheelwright::logs::ros {
namespace {

/// A transport may fill the last bytes up to a multiple of 4.
constexpr std::size_t most_padding = 3;
constexpr std::size_t encapsulation = 4;

template <typename Unsigned>
Unsigned swapped(Unsigned value) {
  if constexpr (sizeof value == 2) {
    return __builtin_bswap16(value);
  } else if constexpr (sizeof value == 4) {
    return __builtin_bswap32(value);
  } else if constexpr (sizeof value == 8) {
    return __builtin_bswap64(value);
  } else {
    return value;
  }
}

template <typename Number>
double number_at(const char* from, bool swap) {
  using Unsigned =
      std::conditional_t<sizeof(Number) == 1, std::uint8_t,
                         std::conditional_t<sizeof(Number) == 2, std::uint16_t,
                                            std::conditional_t<sizeof(Number) == 4, std::uint32_t, std::uint64_t>>>;
  Unsigned bits;
  std::memcpy(&bits, from, sizeof bits);
  return static_cast<double>(std::bit_cast<Number>(swap ? swapped(bits) : bits));
}

double number_at(RosKind kind, const char* from, bool swap) {
  switch (kind) {
    case RosKind::boolean:
    case RosKind::uint8: return number_at<std::uint8_t>(from, swap);
    case RosKind::int8: return number_at<std::int8_t>(from, swap);
    case RosKind::int16: return number_at<std::int16_t>(from, swap);
    case RosKind::uint16: return number_at<std::uint16_t>(from, swap);
    case RosKind::int32: return number_at<std::int32_t>(from, swap);
    case RosKind::uint32: return number_at<std::uint32_t>(from, swap);
    case RosKind::int64: return number_at<std::int64_t>(from, swap);
    case RosKind::uint64: return number_at<std::uint64_t>(from, swap);
    case RosKind::float32: return number_at<float>(from, swap);
    default: return number_at<double>(from, swap);
  }
}

/// A way through the bytes of one message.
struct Walk {
  enum class End : std::uint8_t { whole, unknown, failed };

  const MessagePlan& plan;
  std::vector<std::size_t>& places;  ///< of the names, nowhere where not found
  const WalkTargets& to;
  std::string& error;
  std::string_view body{};
  bool swap = false;
  std::size_t at = 0;

  [[nodiscard]] std::size_t left() const { return body.size() - at; }

  End fail(const Step& step, const std::string& what) {
    error = fmt::format("at byte {} of {}, in '{}': {}", at + encapsulation, body.size() + encapsulation,
                        step.field != nullptr ? step.field->name : "", what);
    return End::failed;
  }

  bool align(std::size_t size) {
    const std::size_t aligned = (at + size - 1) & ~(size - 1);
    at = std::min(aligned, body.size());
    return aligned <= body.size();
  }

  /// Moves over `bytes` bytes that are aligned to `size`; false where the message does not have them.
  bool skip(std::size_t size, std::uint64_t bytes) {
    if (!align(size) || bytes > left()) {
      return false;
    }
    at += bytes;
    return true;
  }

  void put(std::size_t slot, double value) {
    (slot < to.values.size() ? to.values[slot] : to.more[slot - to.values.size()]) = value;
  }

  bool length(std::uint32_t& count) {
    if (!skip(4, 4)) {
      return false;
    }
    std::memcpy(&count, body.data() + at - 4, 4);
    count = swap ? swapped(count) : count;
    return true;
  }

  /// The number of elements of a list, each of at least `least` bytes.
  End elements(const Step& step, std::size_t least, std::uint32_t& count) {
    count = step.count;
    if (step.counted) {
      if (!length(count)) {
        return fail(step, "the message ends in front of a list");
      }
      if (step.count > 0 && count > step.count) {
        return fail(step, fmt::format("a list of {} elements, which may have {} at most", count, step.count));
      }
    }
    if (std::uint64_t{count} * least > left()) {
      return fail(step, fmt::format("a list of {} elements goes beyond the end", count));
    }
    return End::whole;
  }

  End text(const Step& step, std::string_view& found) {
    std::uint32_t count = 0;
    if (!length(count)) {
      return fail(step, "the message ends in front of a string");
    }
    if (count > left()) {
      return fail(step, fmt::format("a string of {} bytes goes beyond the end", count));
    }
    if (count > 0 && body[at + count - 1] != '\0') {
      return fail(step, "a string that does not end with a zero byte");
    }
    found = body.substr(at, count > 0 ? count - 1 : 0);
    at += count;
    return End::whole;
  }

  [[nodiscard]] std::size_t place_of(const WantedElement& selection) const {
    return selection.named ? places[selection.element] : selection.element;
  }

  End numbers(const Step& step) {
    std::uint32_t count = 0;
    if (const End end = elements(step, step.bytes, count); end != End::whole || count == 0) {
      return end;
    }
    if (!skip(step.align, count * step.bytes)) {
      return fail(step, fmt::format("a list of {} elements goes beyond the end", count));
    }
    const char* const first = body.data() + at - count * step.bytes;
    for (std::size_t k = step.first; k < step.last; ++k) {
      const std::size_t place = place_of(plan.selections[k]);
      if (place < count) {
        put(plan.selections[k].target, number_at(step.kind, first + place * step.bytes, swap));
      }
    }
    return End::whole;
  }

  End texts(const Step& step, bool capture) {
    std::uint32_t count = 0;
    if (const End end = elements(step, 4, count); end != End::whole) {
      return end;
    }
    for (std::size_t k = step.first; k < step.last; ++k) {
      places[plan.selections[k].element] = nowhere;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      std::string_view found;
      if (const End end = text(step, found); end != End::whole) {
        return end;
      }
      for (std::size_t k = step.first; k < step.last; ++k) {
        const std::size_t name = plan.selections[k].element;
        if (places[name] == nowhere && found == plan.names[name]) {
          places[name] = i;
        }
      }
      if (capture) {
        to.strings->emplace_back(found);
      }
    }
    return End::whole;
  }

  End messages(const Step& step) {
    std::uint32_t count = 0;
    if (const End end = elements(step, 1, count); end != End::whole || count == 0) {
      return end;
    }
    const Block& over = plan.blocks[step.target];
    if (step.first == step.last && over.size() == 1 && over[0].code == Step::Code::skip &&
        over[0].bytes % over[0].align == 0) {
      return skip(over[0].align, over[0].bytes * count) ? End::whole
                                                        : fail(step, "the message ends inside a list of messages");
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::size_t start = at;
      bool read = false;
      for (std::size_t k = step.first; k < step.last; ++k) {
        if (place_of(plan.selections[k]) == i) {
          at = start;
          read = true;
          if (const End end = block(plan.blocks[plan.selections[k].target]); end != End::whole) {
            return end;
          }
        }
      }
      if (!read) {
        if (const End end = block(over); end != End::whole) {
          return end;
        }
      }
    }
    return End::whole;
  }

  End one(const Step& step, bool capture) {
    switch (step.code) {
      case Step::Code::skip:
        return skip(step.align, step.bytes) ? End::whole : fail(step, "the message ends too early");
      case Step::Code::value: {
        if (!skip(step.align, step.bytes)) {
          return fail(step, "the message ends too early");
        }
        const double value = number_at(step.kind, body.data() + at - step.bytes, swap);
        for (std::size_t k = step.first; k < step.last; ++k) {
          put(plan.selections[k].target, value);
        }
        return End::whole;
      }
      case Step::Code::text: {
        std::string_view unused;
        return text(step, unused);
      }
      case Step::Code::numbers: return numbers(step);
      case Step::Code::texts: return texts(step, capture);
      case Step::Code::messages: return messages(step);
      case Step::Code::unknown: break;
    }
    return End::unknown;
  }

  End block(const Block& steps) {
    const bool outer = to.strings != nullptr && &steps == plan.blocks.data();
    for (const Step& step : steps) {
      const bool capture = outer && static_cast<std::size_t>(&step - steps.data()) == to.strings_step;
      if (const End end = one(step, capture); end != End::whole) {
        return end;
      }
    }
    return End::whole;
  }

  /// Whether `cdr` is a message of the type.
  bool read(std::string_view cdr, const std::string& type) {
    if (cdr.size() < encapsulation || cdr[0] != 0 || (cdr[1] != 0 && cdr[1] != 1)) {
      error = cdr.size() < encapsulation
                  ? fmt::format("only {} bytes: expected a message in CDR", cdr.size())
                  : fmt::format("at byte 0: begins with {:02x} {:02x}: expected 00 00 or 00 01, which CDR begins with",
                                static_cast<unsigned char>(cdr[0]), static_cast<unsigned char>(cdr[1]));
      return false;
    }
    swap = (cdr[1] == 1) != (std::endian::native == std::endian::little);
    body = cdr.substr(encapsulation);
    std::fill(places.begin(), places.end(), nowhere);
    End end = End::whole;
    for (int pass = plan.twice ? 0 : 1; pass < 2 && end == End::whole; ++pass) {
      at = 0;
      end = block(plan.blocks.front());
    }
    if (end == End::whole && left() > most_padding) {
      error = fmt::format("at byte {} of {}: {} bytes are left behind the last field: these are not the bytes of {}",
                          at + encapsulation, cdr.size(), left(), type);
      return false;
    }
    return end != End::failed;
  }
};

}  // namespace

bool walk(const MessagePlan& plan, const std::string& type, std::string_view cdr, std::vector<std::size_t>& places,
          const WalkTargets& to, std::string& error) {
  return Walk{.plan = plan, .places = places, .to = to, .error = error}.read(cdr, type);
}

}  // namespace wheelwright::logs::ros

namespace wheelwright::logs {
namespace {

/// The path to the seconds and to the nanoseconds of the stamp; empty where the type has none.
std::vector<ros::Path> stamp_paths(const RosDefinition& definition) {
  const auto find = [&](std::size_t message, std::string_view name) -> std::optional<std::size_t> {
    const auto& fields = definition.messages[message].fields;
    for (std::size_t k = 0; k < fields.size(); ++k) {
      if (fields[k].name == name && fields[k].kind == RosKind::message && fields[k].shape == RosShape::single) {
        return k;
      }
    }
    return std::nullopt;
  };
  ros::Path path;
  std::size_t message = 0;
  if (const auto header = find(0, "header")) {
    path.push_back({*header, {}, {}});
    message = definition.messages[0].fields[*header].message;
    if (!find(message, "stamp")) {
      path.clear();
      message = 0;
    }
  }
  const auto stamp = find(message, "stamp");
  if (!stamp) {
    return {};
  }
  path.push_back({*stamp, {}, {}});
  const auto& fields = definition.messages[definition.messages[message].fields[*stamp].message].fields;
  const RosField seconds{"sec", RosKind::int32}, nanoseconds{"nanosec", RosKind::uint32};
  if (fields.size() != 2 || !(fields[0] == seconds) || !(fields[1] == nanoseconds)) {
    return {};
  }
  std::vector<ros::Path> both(2, path);
  both[0].push_back({0, {}, {}});
  both[1].push_back({1, {}, {}});
  return both;
}

}  // namespace

struct RosExtractor::Impl {
  Impl(const RosDefinition& type, const std::vector<std::string>& paths) : definition(type), count(paths.size()) {
    std::vector<ros::Path> found;
    for (const std::string& path : paths) {
      found.push_back(ros::find_path(definition, path));
    }
    for (ros::Path& path : stamp_paths(definition)) {
      found.push_back(std::move(path));
      stamped = true;
    }
    plan = ros::make_plan(definition, found);
    places.resize(plan.names.size());
  }

  RosDefinition definition;
  std::size_t count;
  ros::MessagePlan plan;
  std::vector<std::size_t> places;
  std::array<double, 2> time{};
  bool stamped = false;
  std::optional<std::int64_t> stamp;
  std::string error;
};

RosExtractor::RosExtractor(const RosDefinition& definition, const std::vector<std::string>& paths)
    : impl_(std::make_unique<Impl>(definition, paths)) {}
RosExtractor::~RosExtractor() = default;
RosExtractor::RosExtractor(RosExtractor&&) noexcept = default;
RosExtractor& RosExtractor::operator=(RosExtractor&&) noexcept = default;

bool RosExtractor::read(std::string_view cdr, std::span<double> values) {
  Impl& own = *impl_;
  if (values.size() != own.count) {
    check::that(false, "RosExtractor::read", fmt::format("as many values as paths, {}", own.count));
  }
  std::fill(values.begin(), values.end(), core::kNan);
  own.stamp.reset();
  own.error.clear();
  const ros::WalkTargets to{.values = values, .more = own.time};
  if (!ros::walk(own.plan, own.definition.name(), cdr, own.places, to, own.error)) {
    std::fill(values.begin(), values.end(), core::kNan);
    return false;
  }
  if (own.stamped) {
    const auto time = static_cast<std::int64_t>(own.time[0]) * 1'000'000'000 + static_cast<std::int64_t>(own.time[1]);
    if (time != 0) {
      own.stamp = time;
    }
  }
  return true;
}

std::optional<std::int64_t> RosExtractor::stamp() const { return impl_->stamp; }
const std::string& RosExtractor::error() const { return impl_->error; }

std::optional<std::vector<std::string>> read_names(const RosDefinition& definition, std::string_view cdr) {
  const RosMessage& message = definition.messages.front();
  const auto names = ros::names_of(message, message.fields.size());
  if (!names) {
    return std::nullopt;
  }
  const ros::MessagePlan plan = ros::make_plan(definition, {});
  const ros::Block& steps = plan.blocks.front();
  const auto step = std::find_if(steps.begin(), steps.end(), [&](const ros::Step& one) {
    return one.code == ros::Step::Code::texts && one.field == &message.fields[*names];
  });
  if (step == steps.end()) {
    return std::nullopt;
  }
  std::vector<std::size_t> places;
  std::string error;
  std::vector<std::string> found;
  const ros::WalkTargets to{.strings = &found, .strings_step = static_cast<std::size_t>(step - steps.begin())};
  return ros::walk(plan, definition.name(), cdr, places, to, error) ? std::optional(std::move(found)) : std::nullopt;
}

}  // namespace wheelwright::logs
