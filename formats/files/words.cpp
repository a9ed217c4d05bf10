// SPDX-License-Identifier: Apache-2.0
#include "formats/files/words.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "core/words.hpp"

namespace wheelwright::files {
namespace {

constexpr std::array<double, 23> powers_of_ten = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                  1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                  1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/// Whether the decimal number in [first, last), known to be out of range, is too large and not too small: its leading
/// non-zero digit stands at 10^k with k > 0.
bool is_too_large(const char* first, const char* last) {
  const char* const mantissa_end = std::find_if(first, last, [](char c) { return c == 'e' || c == 'E'; });
  const char* const point = std::find(first, mantissa_end, '.');
  const char* const leading = std::find_if(first, mantissa_end, [](char c) { return c != '0' && c != '.'; });
  long exponent = 0;
  if (mantissa_end != last) {
    const char* digits = mantissa_end + 1;
    const bool below = *digits == '-';
    digits += below || *digits == '+' ? 1 : 0;
    if (std::from_chars(digits, last, exponent).ec == std::errc::result_out_of_range) {
      return !below;
    }
    exponent = below ? -exponent : exponent;
  }
  return (point - leading) + exponent > 0;
}

const char* parse_general(const char* start, const char* digits, const char* last, bool negative, double& value) {
  const auto [end, error] = std::from_chars(digits, last, value);
  if (error == std::errc::invalid_argument || end == digits || (start != digits && *digits == '-')) {
    return nullptr;
  }
  if (error == std::errc::result_out_of_range) {
    value = is_too_large(digits, end) ? std::numeric_limits<double>::infinity() : 0.0;
  }
  if (negative) {
    value = -value;
  }
  return end;
}

}  // namespace

const char* parse_number(const char* first, const char* last, double& value) {
  const char* p = first;
  if (p == last) {
    return nullptr;
  }
  const bool negative = *p == '-';
  if (negative || *p == '+') {
    ++p;
  }
  const char* const digits = p;
  std::uint64_t mantissa = 0;
  for (; p != last && core::is_digit(*p); ++p) {
    mantissa = 10 * mantissa + static_cast<std::uint64_t>(*p - '0');
  }
  std::ptrdiff_t count = p - digits;
  std::ptrdiff_t exponent = 0;
  if (p != last && *p == '.') {
    const char* const fraction = ++p;
    for (; p != last && core::is_digit(*p); ++p) {
      mantissa = 10 * mantissa + static_cast<std::uint64_t>(*p - '0');
    }
    exponent = fraction - p;
    count -= exponent;
  }
  if (count == 0 || count > 18) {
    return parse_general(first, digits, last, negative, value);
  }
  if (p != last && (*p == 'e' || *p == 'E')) {
    const char* q = p + 1;
    const bool below = q != last && *q == '-';
    if (q != last && (*q == '-' || *q == '+')) {
      ++q;
    }
    const char* const power = q;
    int shift = 0;
    for (; q != last && core::is_digit(*q) && q - power < 4; ++q) {
      shift = 10 * shift + (*q - '0');
    }
    if (q == power || q - power == 4) {
      return parse_general(first, digits, last, negative, value);
    }
    exponent += below ? -shift : shift;
    p = q;
  }
  // An integer up to 2^53 and a power of ten up to 10^22 are exact: one operation rounds correctly (Clinger 1990).
  constexpr std::uint64_t exact = std::uint64_t{1} << 53;
  if (mantissa > exact || exponent < -22 || exponent > 22) {
    return parse_general(first, digits, last, negative, value);
  }
  const double magnitude = static_cast<double>(mantissa);
  const double result = exponent < 0 ? magnitude / powers_of_ten[static_cast<std::size_t>(-exponent)]
                                     : magnitude * powers_of_ten[static_cast<std::size_t>(exponent)];
  value = negative ? -result : result;
  return p;
}

std::optional<double> to_number(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) {
    return std::nullopt;
  }
  text = text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
  double value = 0.0;
  if (parse_number(text.data(), text.data() + text.size(), value) != text.data() + text.size()) {
    return std::nullopt;
  }
  return value;
}

std::string number_text(double value) {
  std::array<char, 32> buffer;
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return std::string(buffer.data(), end);
}

namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), previous(b.size() + 1), current(b.size() + 1);
  const auto same = [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  };
  for (std::size_t j = 0; j <= b.size(); ++j) {
    previous[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = previous[j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1);
      current[j] = std::min({previous[j] + 1, current[j - 1] + 1, substituted});
      if (i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1])) {
        current[j] = std::min(current[j], before[j - 2] + 1);
      }
    }
    before.swap(previous);
    previous.swap(current);
  }
  return previous[b.size()];
}

}  // namespace

std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates) {
  name = name.substr(0, 64);
  std::string best;
  std::size_t best_distance = 0;
  for (const std::string& candidate : candidates) {
    if (candidate.empty() || candidate.size() > 64) {
      continue;
    }
    const std::size_t distance = edit_distance(name, candidate);
    if (3 * distance <= std::max(name.size(), candidate.size()) && (best.empty() || distance < best_distance)) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates) {
  const std::string nearest = nearest_name(name, candidates);
  return nearest.empty() ? "" : "; did you mean " + shown(nearest) + "?";
}

std::string shown(std::string_view text) {
  constexpr std::size_t longest = 40;
  std::string out = "'";
  for (const char c : text.substr(0, longest)) {
    out += c >= ' ' && c <= '~' ? c : '?';
  }
  return out + (text.size() > longest ? "...'" : "'");
}

namespace {

/// Bytes of the character at the beginning of `text`, and its number; 0 bytes where it is no UTF-8 (Unicode 15, table
/// 3-7).
std::pair<std::size_t, std::uint32_t> first_character(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char head = byte(0);
  if (head < 0x80) {
    return {1, head};
  }
  const std::size_t size = head >= 0xC2 && head < 0xE0   ? 2
                           : head >= 0xE0 && head < 0xF0 ? 3
                           : head >= 0xF0 && head < 0xF5 ? 4
                                                         : 0;
  if (size == 0 || text.size() < size) {
    return {0, 0};
  }
  std::uint32_t number = head & (0xFFU >> (size + 1));
  for (std::size_t k = 1; k < size; ++k) {
    if ((byte(k) & 0xC0) != 0x80) {
      return {0, 0};
    }
    number = number << 6 | (byte(k) & 0x3FU);
  }
  constexpr std::array<std::uint32_t, 5> least = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = number >= 0xD800 && number < 0xE000;
  return number < least[size] || number > 0x10FFFF || surrogate ? std::pair<std::size_t, std::uint32_t>{0, 0}
                                                                : std::pair{size, number};
}

/// True for a character that a terminal obeys instead of showing it.
bool is_command(std::uint32_t c) {
  return (c < 0x20 && c != '\n' && c != '\t') || (c >= 0x7F && c < 0xA0) || (c >= 0x202A && c <= 0x202E) ||
         (c >= 0x2066 && c <= 0x2069);
}

}  // namespace

namespace {

/// `text` with "\\x1B" for the bytes of what is no UTF-8 and of characters that `hidden` holds for.
template <typename Hidden>
std::string shown_bytes(std::string_view text, const Hidden& hidden) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const auto [size, number] = first_character(text);
    const std::size_t taken = std::max<std::size_t>(size, 1);
    if (size == 0 || hidden(number)) {
      for (const char c : text.substr(0, taken)) {
        out += fmt::format("\\x{:02X}", static_cast<unsigned char>(c));
      }
    } else {
      out += text.substr(0, size);
    }
    text.remove_prefix(taken);
  }
  return out;
}

}  // namespace

std::string printable(std::string_view text) { return shown_bytes(text, is_command); }

std::string one_line(std::string_view text) {
  return shown_bytes(text, [](std::uint32_t c) { return c == '\n' || c == '\t' || is_command(c); });
}

bool has_commands(std::string_view text) {
  while (!text.empty()) {
    const auto [size, number] = first_character(text);
    if (size > 0 && is_command(number)) {
      return true;
    }
    text.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return false;
}

std::string printable_json(std::string_view json) {
  std::string out;
  out.reserve(json.size());
  const auto is_plain = [](char c) { return static_cast<unsigned char>(c) < 0x7F; };
  while (!json.empty()) {
    const auto plain = static_cast<std::size_t>(std::ranges::find_if_not(json, is_plain) - json.begin());
    out += json.substr(0, plain);
    json.remove_prefix(plain);
    if (json.empty()) {
      break;
    }
    const auto [size, number] = first_character(json);
    const std::size_t taken = std::max<std::size_t>(size, 1);
    if (size > 0 && is_command(number)) {
      out += fmt::format("\\u{:04x}", number);
    } else {
      out += json.substr(0, taken);
    }
    json.remove_prefix(taken);
  }
  return out;
}

std::string valid_utf8(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t size = first_character(text).first;
    out += size == 0 ? std::string_view("\xEF\xBF\xBD") : text.substr(0, size);
    text.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return out;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = first_character(text).first;
    if (size == 0) {
      return false;
    }
    text.remove_prefix(size);
  }
  return true;
}

}  // namespace wheelwright::files
