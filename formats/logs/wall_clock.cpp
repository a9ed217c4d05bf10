// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/wall_clock.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "formats/files/words.hpp"

namespace wheelwright::logs {
namespace {

constexpr std::int64_t ns_of_second = 1'000'000'000;

bool is_decimal(char c) { return c >= '0' && c <= '9'; }

std::string small_letters(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return out;
}

/// What is left of a text that is read piece by piece.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : rest_(text) {}

  [[nodiscard]] bool done() const { return rest_.empty(); }
  [[nodiscard]] char peek() const { return rest_.empty() ? '\0' : rest_.front(); }
  [[nodiscard]] std::string_view rest() const { return rest_; }

  char take_one_of(std::string_view characters) {
    if (rest_.empty() || characters.find(rest_.front()) == std::string_view::npos) {
      return '\0';
    }
    const char c = rest_.front();
    rest_.remove_prefix(1);
    return c;
  }
  void blanks() {
    while (take_one_of(" \t") != '\0') {
    }
  }
  /// The digits that follow, from `least` to `most` of them; empty where there are fewer or more.
  std::string_view digits(std::size_t least, std::size_t most) {
    std::size_t n = 0;
    while (n < rest_.size() && is_decimal(rest_[n])) {
      ++n;
    }
    if (n < least || n > most) {
      return {};
    }
    const std::string_view out = rest_.substr(0, n);
    rest_.remove_prefix(n);
    return out;
  }
  std::string word() {
    std::size_t n = 0;
    while (n < rest_.size() &&
           (std::isalpha(static_cast<unsigned char>(rest_[n])) != 0 || static_cast<unsigned char>(rest_[n]) >= 0x80U)) {
      ++n;
    }
    std::string out = small_letters(rest_.substr(0, n));
    rest_.remove_prefix(n);
    return out;
  }

 private:
  std::string_view rest_;
};

int number_of(std::string_view digits) {
  int value = 0;
  for (const char c : digits) {
    value = 10 * value + (c - '0');
  }
  return value;
}

int month_of(const std::string& word) {
  constexpr std::array<std::string_view, 12> names = {"jan", "feb", "mar", "apr", "may", "jun",
                                                      "jul", "aug", "sep", "oct", "nov", "dec"};
  const auto at = std::ranges::find(names, std::string_view(word).substr(0, 3));
  return word.size() < 3 || at == names.end() ? 0 : static_cast<int>(at - names.begin()) + 1;
}

/// Reads a date into `days` since 1970 and marks one whose day and month could change places; false where there is
/// none.
bool read_date(Scanner& in, std::int64_t& days, bool& day_or_month) {
  int year = 0, month = 0, day = 0;
  const std::string_view first = in.digits(1, 8);
  if (first.size() == 8) {
    year = number_of(first.substr(0, 4));
    month = number_of(first.substr(4, 2));
    day = number_of(first.substr(6, 2));
  } else {
    const char mark = in.take_one_of("-/.");
    const bool named = mark != '\0' && std::isalpha(static_cast<unsigned char>(in.peek())) != 0;
    const std::string_view second = named ? std::string_view() : in.digits(1, 2);
    const int by_name = named ? month_of(in.word()) : 0;
    if (mark == '\0' || (!named && second.empty()) || in.take_one_of(std::string_view(&mark, 1)) == '\0') {
      return false;
    }
    const std::string_view third = in.digits(1, 4);
    if (first.size() == 4) {
      year = number_of(first);
      month = named ? by_name : number_of(second);
      day = number_of(third);
    } else if (first.size() <= 2 && third.size() == 4) {
      year = number_of(third);
      day = number_of(first);
      month = named ? by_name : number_of(second);
      if (mark != '.' && !named) {
        day_or_month = day <= 12 && month <= 12 && day != month;
        if (month > 12) {
          std::swap(day, month);
        }
      }
    } else {
      return false;
    }
  }
  const std::chrono::year_month_day date(std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day)));
  if (!date.ok() || year < 1900 || year > 2200) {
    return false;
  }
  days = std::chrono::sys_days(date).time_since_epoch().count();
  return true;
}

/// Reads "08:40:00.123" (of a basic date "084000.123") in ns; false where there is none.
bool read_time(Scanner& in, bool basic, bool dated, std::int64_t& ns) {
  int hours = 0, minutes = 0, seconds = 0;
  if (const std::string_view packed = basic ? in.digits(6, 6) : std::string_view(); !packed.empty()) {
    hours = number_of(packed.substr(0, 2));
    minutes = number_of(packed.substr(2, 2));
    seconds = number_of(packed.substr(4, 2));
  } else {
    const std::string_view h = in.digits(1, 4);
    if (h.empty() || in.take_one_of(":") == '\0') {
      return false;
    }
    const std::string_view m = in.digits(2, 2);
    if (m.empty() || in.take_one_of(":") == '\0') {
      return false;
    }
    const std::string_view s = in.digits(1, 2);
    if (s.empty()) {
      return false;
    }
    hours = number_of(h);
    minutes = number_of(m);
    seconds = number_of(s);
  }
  if ((dated && hours > 23) || minutes > 59 || seconds > 60) {
    return false;
  }
  ns = (static_cast<std::int64_t>(hours) * 3600 + minutes * 60 + seconds) * ns_of_second;
  if (in.take_one_of(".,") != '\0') {
    const std::string_view fraction = in.digits(1, 18);
    std::int64_t unit = ns_of_second;
    if (fraction.empty()) {
      return false;
    }
    for (const char c : fraction.substr(0, 9)) {
      unit /= 10;
      ns += unit * (c - '0');
    }
  }
  return true;
}

/// Reads what may stand behind a time: AM or PM, and the zone. False where something else follows.
bool read_ending(Scanner& in, Moment& moment, std::int64_t& time) {
  constexpr std::int64_t half_a_day = 12 * 3600 * ns_of_second;
  in.blanks();
  std::string word = in.word();
  if (word == "am" || word == "pm") {
    const bool twelve = time / (3600 * ns_of_second) == 12;
    time += word == "pm" ? (twelve ? 0 : half_a_day) : (twelve ? -half_a_day : 0);
    in.blanks();
    word = in.word();
  }
  if (word == "z" || word == "utc" || word == "gmt") {
    moment.utc = true;
  } else if (!word.empty()) {
    return false;
  }
  if (const char sign = in.take_one_of("+-"); sign != '\0') {
    const std::string_view hours = in.digits(2, 4);
    std::string_view minutes = hours.size() == 4 ? hours.substr(2) : std::string_view();
    if (hours.empty() || hours.size() == 3) {
      return false;
    }
    if (in.take_one_of(":") != '\0') {
      minutes = in.digits(2, 2);
    }
    const std::int64_t offset = number_of(hours.substr(0, 2)) * 3600 + number_of(minutes) * 60;
    moment.utc = true;
    time -= (sign == '+' ? offset : -offset) * ns_of_second;
  }
  in.blanks();
  return in.done();
}

/// "0.01 sec", as MATLAB writes durations.
std::optional<Moment> parse_duration(std::string_view text) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const char* const stop = files::parse_number(text.data(), end, value);
  if (stop == nullptr || stop == end) {
    return std::nullopt;
  }
  Scanner in(text.substr(static_cast<std::size_t>(stop - text.data())));
  in.blanks();
  const std::string unit = in.word();
  constexpr std::array<std::pair<std::string_view, double>, 12> units = {{{"s", 1.0},
                                                                          {"sec", 1.0},
                                                                          {"secs", 1.0},
                                                                          {"ms", 1e-3},
                                                                          {"us", 1e-6},
                                                                          {"µs", 1e-6},
                                                                          {"ns", 1e-9},
                                                                          {"min", 60.0},
                                                                          {"h", 3600.0},
                                                                          {"hr", 3600.0},
                                                                          {"day", 86400.0},
                                                                          {"days", 86400.0}}};
  const auto found = std::ranges::find(units, unit, &std::pair<std::string_view, double>::first);
  in.blanks();
  if (found == units.end() || !in.done() || !(std::abs(value * found->second) < 9e9)) {
    return std::nullopt;
  }
  return Moment{.ns = std::llround(value * found->second * 1e9)};
}

}  // namespace

std::optional<Moment> parse_moment(std::string_view text) {
  Moment moment;
  std::int64_t days = 0, time = 0;
  Scanner in(text);
  if (read_date(in, days, moment.day_or_month)) {
    const bool basic = in.take_one_of("Tt") != '\0';
    if (!basic) {
      in.take_one_of(",");
      in.blanks();
    }
    moment.since_1970 = true;
    if (!read_time(in, basic, true, time) || !read_ending(in, moment, time)) {
      return std::nullopt;
    }
    moment.ns = days * 86400 * ns_of_second + time;
    return moment;
  }
  in = Scanner(text);
  if (const std::string_view count = in.digits(1, 5); !count.empty()) {
    in.blanks();
    const std::string word = in.word();
    if (word == "day" || word == "days") {
      in.take_one_of(",");
      in.blanks();
      days = number_of(count);
    } else {
      in = Scanner(text);
    }
  }
  if (read_time(in, false, false, time)) {
    moment.ns = days * 86400 * ns_of_second + time;
    std::int64_t whole = moment.ns;
    if (!read_ending(in, moment, whole)) {
      return std::nullopt;
    }
    moment.ns = whole;
    moment.utc = false;
    return moment;
  }
  return parse_duration(text);
}

bool is_since_1970(double seconds) { return seconds >= 946'684'800.0 && seconds < 4'102'444'800.0; }

std::string moment_text(std::int64_t second, double beyond, std::string_view zone) {
  const std::int64_t ms = second * 1000 + std::llround(beyond * 1e3);
  const std::int64_t of_day = ((ms % 86'400'000) + 86'400'000) % 86'400'000;
  const std::chrono::year_month_day date(
      std::chrono::sys_days(std::chrono::days(static_cast<int>((ms - of_day) / 86'400'000))));
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02}.{:03}{}{}", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()), of_day / 3'600'000,
                     of_day / 60'000 % 60, of_day / 1000 % 60, of_day % 1000, zone.empty() ? "" : " ", zone);
}

}  // namespace wheelwright::logs
