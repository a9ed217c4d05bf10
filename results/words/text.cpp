// SPDX-License-Identifier: Apache-2.0
#include "results/words/text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace wheelwright::words {
namespace {

constexpr std::string_view minus = "−";
constexpr std::string_view missing = "–";
constexpr std::string_view group_space = "\u202f";  // narrow, no break

std::string superscript(int n) {
  static constexpr std::string_view digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = n < 0 ? "⁻" : "";
  for (const char c : std::to_string(std::abs(n))) {
    text += digits[c - '0'];
  }
  return text;
}

// Position of the first significant digit: 21.3 → 1, 0.02 → −2.
int magnitude(double x) { return x == 0.0 ? 0 : static_cast<int>(std::floor(std::log10(std::abs(x)))); }

std::string grouped(const std::string& digits) {
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) {
      text += group_space;
    }
    text += digits[i];
  }
  return text;
}

// Fixed-point text of a non-negative number, integer part grouped.
std::string fixed(double x, int decimals) {
  const std::string text = fmt::format("{:.{}f}", x, std::max(decimals, 0));
  const std::size_t point = std::min(text.find('.'), text.size());
  return (point > 4 ? grouped(text.substr(0, point)) : text.substr(0, point)) + text.substr(point);
}

std::string with_sign(double x, int decimals) {
  const double unit = std::pow(10.0, -decimals);
  const bool negative = x < 0.0 && std::round(std::abs(x) / unit) > 0.0;
  return (negative ? std::string(minus) : std::string()) + fixed(std::abs(x), decimals);
}

// A number of decimals, or of digits in scientific notation: the same for everything in one interval.
struct Style {
  int decimals = 0;
  int exponent = 0;  // 0: no power of ten

  [[nodiscard]] double unit() const { return std::pow(10.0, exponent - decimals); }
  [[nodiscard]] std::string print(double x) const {
    const std::string text = with_sign(x / std::pow(10.0, exponent), decimals);
    return exponent == 0 ? text : text + "·10" + superscript(exponent);
  }
};

// The last digit shown is 10^last; the number's first one 10^first.
Style style_for(int first, int last) {
  if (first < -4 || first > 5) {
    return {std::clamp(first - last, 0, 12), first};
  }
  return {std::clamp(-last, 0, 12), 0};
}

// Position of the digit that resolves the width of an interval to two digits, and its larger end to three at least.
int last_digit(double lower, double upper) {
  const int first = magnitude(std::max(std::abs(lower), std::abs(upper)));
  return std::clamp(magnitude(upper - lower) - 1, first - 7, first - 2);
}

Style interval_style(double lower, double upper) {
  return style_for(magnitude(std::max(std::abs(lower), std::abs(upper))), last_digit(lower, upper));
}

bool has_width(double lower, double upper) { return std::isfinite(lower) && std::isfinite(upper) && lower < upper; }

}  // namespace

std::string escape(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      case '\'': out += "&#39;"; break;
      default:
        if ((static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\n') || c == 0x7f) {
          out += "\ufffd";
        } else {
          out += c;
        }
    }
  }
  return out;
}

std::string escape_with_code(std::string_view text) {
  std::string out;
  while (true) {
    const std::size_t open = text.find('`'), close = open == text.npos ? text.npos : text.find('`', open + 1);
    if (close == text.npos) {
      return out + escape(text);
    }
    out += escape(text.substr(0, open)) + "<code>" + escape(text.substr(open + 1, close - open - 1)) + "</code>";
    text.remove_prefix(close + 1);
  }
}

std::string spaced(std::string_view identifier) {
  std::string text(identifier);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string number(double x, int digits) {
  if (!std::isfinite(x)) {
    return std::string(missing);
  }
  if (x == 0.0) {
    return "0";
  }
  // Rounding may carry into a new digit: 9.996 → 10.0.
  const double unit = std::pow(10.0, magnitude(x) - digits + 1);
  const int first = magnitude(std::round(x / unit) * unit * (1.0 + 1e-14));
  return style_for(first, first - digits + 1).print(x);
}

std::string count(std::size_t n) {
  const std::string digits = std::to_string(n);
  return digits.size() > 4 ? grouped(digits) : digits;
}

std::string plural(std::size_t n, std::string_view noun) {
  return (n == 0 ? "no" : count(n)) + " " + std::string(noun) + (n == 1 ? "" : "s");
}

std::string unit_of(const std::string& unit) { return unit == "1" ? "" : unit; }

std::string percent(double share, int digits) {
  if (!std::isfinite(share)) {
    return std::string(missing);
  }
  if (share == 0.0 || share == 1.0) {
    return share == 0.0 ? "0 %" : "100 %";
  }
  // A share that is not whole never reads as 100 %.
  const double size = 100.0 * share;
  if (size < 100.0 && size > 99.0) {
    const int decimals = std::clamp(-magnitude((100.0 - size) * (1.0 + 1e-9)), 1, 9);
    const double unit = std::pow(10.0, -decimals);
    return fmt::format("{:.{}f} %", std::floor(size / unit * (1.0 + 1e-14)) * unit, decimals);
  }
  return number(size, digits) + " %";
}

std::string with_unit(std::string text, std::string_view unit) {
  if (!unit.empty()) {
    text += "\u00a0";
    text += unit;
  }
  return text;
}

std::pair<std::string, std::string> outward(double lower, double upper) {
  if (!has_width(lower, upper)) {
    return {number(lower, 6), number(upper, 6)};
  }
  const Style style = interval_style(lower, upper);
  const double unit = style.unit();
  // A bound that is a decimal but for its rounding to binary is printed as that decimal.
  constexpr double slack = 1e-9;
  return {style.print(std::floor(lower / unit + slack) * unit), style.print(std::ceil(upper / unit - slack) * unit)};
}

std::string beside(double x, double lower, double upper) {
  if (!std::isfinite(x) || x == 0.0 || !has_width(lower, upper)) {
    return number(x, 4);
  }
  constexpr int fewest = 3;
  const int first = magnitude(x);
  const int last = std::min(last_digit(lower, upper), first - fewest + 1);
  return style_for(first, std::max(last, first - 7)).print(x);
}

std::string decimal(double x, int decimals) { return std::isfinite(x) ? with_sign(x, decimals) : std::string(missing); }

TimeAxis::TimeAxis(const std::vector<double>& t) : offsets_{0.0} {
  if (t.empty()) {
    return;
  }
  if (std::isfinite(t[0]) && std::abs(t[0]) > 1e6) {
    origin_ = std::floor(t[0]);
  }
  double run_start = t[0];
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i] < t[i - 1]) {
      const double gap = 0.02 * (t[i - 1] - run_start);
      offsets_.push_back(offsets_.back() + (t[i - 1] - t[i]) + gap);
      run_start = t[i];
    }
  }
}

std::string TimeAxis::text(double t) const { return with_unit(decimal(shown(t), 3), "s"); }

std::vector<double> TimeAxis::lay(const std::vector<double>& t) const {
  std::vector<double> laid(t.size());
  std::size_t run = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (i > 0 && t[i] < t[i - 1]) {
      run = std::min(run + 1, offsets_.size() - 1);
    }
    laid[i] = shown(t[i]) + offsets_[run];
    if (i > 0) {
      laid[i] = std::max(laid[i], laid[i - 1]);
    }
  }
  return laid;
}

}  // namespace wheelwright::words
