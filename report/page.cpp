// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/page.hpp>

#include <fmt/format.h>

#include <wheelwright/report/data_sections.hpp>
#include <wheelwright/words/text.hpp>

#include "report_assets.hpp"

namespace wheelwright::report {
using namespace words;
namespace {

void append_definition(std::string& out, std::string_view term, const std::vector<std::string>& values) {
  if (values.empty()) {
    return;
  }
  out += fmt::format("<dt>{}</dt>", term);
  for (const std::string& value : values) {
    out += "<dd>" + value + "</dd>";
  }
}

std::string navigation(const std::vector<Section>& sections) {
  std::string out = "<nav aria-label=\"Sections\">";
  for (const Section& section : sections) {
    out += fmt::format("<a href=\"#{}\">{}</a>", section.id, escape(section.heading));
  }
  return out + "</nav>\n";
}

}  // namespace

std::string page(const PageContent& content) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en-GB\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
      "script-src 'unsafe-inline'\">\n<meta name=\"color-scheme\" content=\"light dark\">\n";
  out += "<title>" + escape(content.title) + "</title>\n<style>";
  out += embedded::uplot_css;
  out += "\n";
  out += embedded::page_css;
  out += "</style>\n</head>\n<body>\n<header>\n<h1>" + escape(content.title) + "</h1>\n";
  out += navigation(content.sections) + "</header>\n<main>\n";
  out += fmt::format("<section id=\"result\" class=\"result {}\"><p class=\"verdict\">{}</p>\n", content.status,
                     escape(content.verdict));
  if (content.warrant) {
    out += warrant_note(*content.warrant);
  }
  for (const std::string& sentence : content.sentences) {
    out += paragraph(escape_with_code(sentence));
  }
  out += "<noscript><p class=\"warning\">The charts need JavaScript; all words and tables are here.</p></noscript>\n";
  out += "</section>\n";
  for (const Section& section : content.sections) {
    out += fmt::format("<section id=\"{}\"><h2>{}</h2>\n", section.id, escape(section.heading));
    out += section.body + "</section>\n";
  }
  out += "</main>\n<footer>" + escape(content.software) + "</footer>\n";
  out += "<div id=\"zoom\" role=\"toolbar\" aria-label=\"Zoom\" hidden></div>\n";
  for (const std::string_view script :
       {embedded::uplot_js, embedded::series_js, embedded::charts_js, embedded::links_js}) {
    out += "<script>";
    out += script;
    out += "</script>\n";
  }
  return out + "</body>\n</html>\n";
}

std::string table(const std::vector<Cell>& header, const std::vector<std::vector<Cell>>& rows) {
  const auto append = [](std::string& out, std::string_view tag, std::string_view attributes, const Cell& cell) {
    out += fmt::format("<{0}{1}{2}>{3}</{0}>", tag, attributes, cell.is_number ? " class=\"n\"" : "", cell.html);
  };
  std::string out =
      rows.size() > 14 ? "<div class=\"wide tall\"><table><thead><tr>" : "<div class=\"wide\"><table><thead><tr>";
  for (const Cell& cell : header) {
    append(out, "th", " scope=\"col\"", cell);
  }
  out += "</tr></thead><tbody>\n";
  for (const std::vector<Cell>& row : rows) {
    out += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) {
      append(out, i == 0 ? "th" : "td", i == 0 ? " scope=\"row\"" : "", row[i]);
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string paragraph(std::string_view html) { return fmt::format("<p>{}</p>\n", html); }

std::string note(std::string_view html) { return paragraph("<span class=\"note\">" + std::string(html) + "</span>"); }

std::string bullets(const std::vector<std::string>& items) {
  if (items.empty()) {
    return {};
  }
  std::string out = "<ul>";
  for (const std::string& item : items) {
    out += "<li>" + escape_with_code(item) + "</li>";
  }
  return out + "</ul>\n";
}

std::string definitions(const std::vector<std::pair<std::string, std::string>>& items) {
  std::string out = "<dl>";
  for (const auto& [term, value] : items) {
    append_definition(out, escape(term), {escape(value)});
  }
  return out + "</dl>\n";
}

std::string time_button(double from, double to, std::string_view text, const TimeAxis& axis) {
  if (axis.repeats()) {
    return escape(text);
  }
  return fmt::format("<button type=\"button\" class=\"time\" data-from=\"{:.6f}\" data-to=\"{:.6f}\">{}</button>",
                     axis.shown(from), axis.shown(to), escape(text));
}

std::string provenance(const ReportContext& context, const TimeAxis& axis) {
  std::vector<std::string> files, seeds, clock;
  for (const std::string& file : context.log_files) {
    files.push_back("<code>" + escape(file) + "</code>");
  }
  for (const ReportSeed& seed : context.seeds) {
    seeds.push_back(escape(seed.purpose) + " " + std::to_string(seed.value));
  }
  if (axis.origin() != 0.0) {
    clock.push_back(fmt::format("times on this page count from {:.0f} s of the log's clock", axis.origin()));
  }
  if (axis.repeats()) {
    clock.push_back("the log's time goes back: its runs are drawn end to end, and times are those of each run");
  }
  std::string out;
  append_definition(out, "Log", files);
  append_definition(out, "Clock", clock);
  append_definition(out, "Seeds", seeds);
  if (!context.command_line.empty()) {
    append_definition(out, "Command", {"<code>" + escape(context.command_line) + "</code>"});
  }
  if (!context.software.empty()) {
    append_definition(out, "Software", {escape(context.software)});
  }
  return out.empty() ? out : "<dl>" + out + "</dl>\n";
}

}  // namespace wheelwright::report
