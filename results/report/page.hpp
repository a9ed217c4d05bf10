// SPDX-License-Identifier: Apache-2.0
/// \file
/// The frame of a report: one HTML file with its style, its script and uPlot inside; where its result comes from; and
/// charts over time as data, which the page's script draws with uPlot: the time axis that all charts and tables of a
/// page share, and series as text that a page unpacks (series.js): differences of integers, deflated, in base64.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/log.hpp"
#include "core/warrant.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

/// A seed that was used, and for what.
struct ReportSeed {
  std::string purpose;
  std::uint64_t value = 0;
};

/// A part of a page. `heading` is text, `body` is HTML.
struct Section {
  std::string id;
  std::string heading;
  std::string body;
};

/// Where a result came from. Every text may hold anything: it is escaped on the page.
struct ReportContext {
  std::string title;                   ///< heading of the page; empty: a default with the robot's name
  std::vector<std::string> log_files;  ///< as the user gave them
  std::vector<ReportSeed> seeds;
  std::string software;               ///< name and version, e.g. "wheelwright 0.1.0"
  std::string command_line;           ///< what makes this page again
  std::vector<std::string> warnings;  ///< what the log reader repaired or split, one sentence each
  std::optional<LogTable> signals;    ///< raw signals; more than 2·10⁶ rows are thinned on the page, peaks kept
  std::size_t rows = 0;               ///< of the log, where it has more of them than `signals`
};

using words::TimeAxis;

/// A series on a grid of at most 10 000 steps: value = low + step · code, within half a step of what it was made from.
/// Code 65 535 is a gap.
///
/// `text` is a zlib stream (RFC 1950) in base64 of 2n bytes: the low bytes of all n differences, then their high bytes.
/// Differences of codes are taken `order` times modulo 2¹⁶ and stored as zigzag, 0, −1, 1, −2 … as 0, 1, 2, 3 …
struct PackedSeries {
  double low = 0.0;
  double step = 0.0;
  int order = 0;  ///< 0, 1 or 2
  std::string text;
};

/// Packs `values` to 1/20 000 of their span, or of `span` where that is larger; what is not finite becomes a gap.
[[nodiscard]] PackedSeries pack(std::span<const double> values, double span = 0.0);

/// Times as integers: t = start + tick · k. A tick is a microsecond; less where the median step is below 100 µs, more
/// where a step inside a segment exceeds 500 s.
///
/// Every segment begins with a jump {index, k}. `text` is a zlib stream in base64 of 4n bytes: second differences of k
/// as 32-bit zigzag, all lowest bytes first; at a jump 0, and the step before it counts on.
struct PackedTimes {
  double start = 0.0;  ///< s
  double tick = 1e-6;  ///< s
  std::vector<std::pair<std::size_t, std::int64_t>> jumps;
  std::string text;
};

/// Packs `t` (s, finite). `breaks`: ascending indices at which a segment starts; 0 may be among them.
[[nodiscard]] PackedTimes pack_times(std::span<const double> t, const std::vector<std::size_t>& breaks);

/// Style of a line. Styles differ in dash and width as well as in colour, so that they tell without colour.
enum class Line {
  first,   ///< solid
  second,  ///< dashed
  third,   ///< dotted
  bound,   ///< thin, a limit of what may be
};

/// One line of a chart. What `y` looks at must outlive the call of figure().
struct ChartSeries {
  std::string label;
  std::span<const double> y;  ///< one for each time of the chart's clock; what is not finite is left out
  Line line = Line::first;
  double span = 0.0;  ///< to 1/20 000 of this is enough, where it exceeds the span of `y`
};

/// The area between two series.
struct ChartBand {
  std::size_t upper = 0;  ///< index of a series
  std::size_t lower = 0;
  bool tolerance = false;  ///< pale: where the residual may be; else the residual's own spread
};

/// A stretch (or, with from == to, a moment) of time that stands out.
struct ChartMark {
  double from = 0.0;  ///< s, log time
  double to = 0.0;    ///< s, log time
  std::string label;  ///< short, drawn beside it
  bool pin = false;   ///< a small triangle at the time axis instead of a shaded stretch
};

/// A chart over time.
struct Chart {
  std::string title;
  std::string unit;
  std::string clock;  ///< id of its times, which clock() put on the page
  std::vector<ChartSeries> series;
  std::vector<ChartBand> bands;
  std::vector<ChartMark> marks;
};

/// Points of a series that a page holds at most: longer ones are thinned before, peaks kept.
inline constexpr std::size_t most_chart_points = 2'000'000;

/// The times (s, log time) of one or more charts, which stand once on a page under `id`. No line is drawn across
/// `breaks` (ascending indices of `t` at which a segment starts). Empty for no times.
[[nodiscard]] std::string clock(std::string_view id, const std::vector<double>& t,
                                const std::vector<std::size_t>& breaks, const TimeAxis& axis);

/// The chart as a <figure> that holds its data, packed: to 1/20 000 of each series' span, or of
/// ChartSeries::span.
[[nodiscard]] std::string figure(const Chart& chart, const TimeAxis& axis);

/// `text` as a JSON string that may stand inside a <script> element.
[[nodiscard]] std::string json_string(std::string_view text);

/// A whole page. It loads nothing: its content security policy forbids every request. `status` (one of "good",
/// "caution", "bad") and `verdict` (text) head it, followed by `first` (HTML) and `sentences` (text).
struct PageContent {
  std::string title;
  std::string status;
  std::string verdict;
  std::vector<std::string> sentences;
  std::vector<Section> sections;
  std::string software;                    ///< for the footer
  std::optional<core::Warrant> warrant{};  ///< of the page's numbers, told beneath the verdict
  std::string first{};                     ///< what everybody wants to know, before all else is said
};

/// The page as HTML.
[[nodiscard]] std::string page(const PageContent& content);

/// A cell of a table.
struct Cell {
  std::string html;
  bool is_number = false;  ///< set to the right

  Cell(std::string content, bool number = false) : html(std::move(content)), is_number(number) {}
  Cell(const char* content) : html(content) {}
};

/// A cell that holds a number.
[[nodiscard]] inline Cell numeric(std::string text) { return {std::move(text), true}; }

/// A table that scrolls sideways where the window is narrow, and in itself where it is long; the first cell of a row is
/// its heading.
[[nodiscard]] std::string table(const std::vector<Cell>& header, const std::vector<std::vector<Cell>>& rows);

/// <p> of HTML.
[[nodiscard]] std::string paragraph(std::string_view html);

/// <p> of HTML that is an aside.
[[nodiscard]] std::string note(std::string_view html);

/// <ul> of texts; empty for no item.
[[nodiscard]] std::string bullets(const std::vector<std::string>& items);

/// Terms and what is said of each (texts), as a <dl>.
[[nodiscard]] std::string definitions(const std::vector<std::pair<std::string, std::string>>& items);

/// A time as a button that zooms the charts to [from, to] (s, log time); plain text where the axis repeats.
[[nodiscard]] std::string time_button(double from, double to, std::string_view text, const TimeAxis& axis);

/// Files, seeds, software, command line and warnings of a context, as rows of a list. HTML.
[[nodiscard]] std::string provenance(const ReportContext& context, const TimeAxis& axis);

}  // namespace wheelwright::report
