// SPDX-License-Identifier: Apache-2.0
/// \file
/// The frame of a report: one HTML file with its style, its script and uPlot inside.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <wheelwright/core/warrant.hpp>
#include <wheelwright/report/chart.hpp>
#include <wheelwright/report/context.hpp>

namespace wheelwright::report {

/// A part of a page. `heading` is text, `body` is HTML.
struct Section {
  std::string id;
  std::string heading;
  std::string body;
};

/// A whole page. It loads nothing: its content security policy forbids every request. `status` (one of "good",
/// "caution", "bad") and `verdict` (text) head it, followed by `sentences` (text).
struct PageContent {
  std::string title;
  std::string status;
  std::string verdict;
  std::vector<std::string> sentences;
  std::vector<Section> sections;
  std::string software;                    ///< for the footer
  std::optional<core::Warrant> warrant{};  ///< of the page's numbers, told beneath the verdict
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
