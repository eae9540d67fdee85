#include "platform/report/folder_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <tuple>

#include "platform/report/page_parts.hpp"
#include "platform/report/svg.hpp"

namespace roborun::report {
namespace {

// Signs beside colours: a verdict is read without seeing colours.
constexpr std::array<const char*, 4> kSign{"\u2717 failed", "? unknown", "\u2713 reached", "\u2713 passed"};
constexpr std::array<const char*, 4> kClass{"bad", "quiet", "good", "good"};

constexpr const char* kStyle =
    R"(td,th{border-bottom:1px solid var(--line);padding:4px 14px 4px 0}
td:nth-child(n+4),th:nth-child(n+4){text-align:right}td small{display:block;color:var(--quiet);max-width:60ch})";

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.2f}", value) : std::string("\u2013");
}

/// Of a path, for a link: a name may hold what an address reads otherwise.
std::string address_of(const std::string& path) {
  std::string address;
  for (const char c : path) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
    if (plain || std::string_view("-._~/").find(c) != std::string_view::npos)
      address += c;
    else
      address += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return address;
}

std::string row_of(const FolderRow& row) {
  const auto verdict = static_cast<std::size_t>(row.verdict);
  const std::string name =
      row.page.empty() ? xml_escape(row.name)
                       : fmt::format("<a href=\"{}\">{}</a>", address_of(row.page), xml_escape(row.name));
  const std::string note = row.note.empty() ? "" : fmt::format("<small>{}</small>", xml_escape(row.note));
  std::string complaints;
  for (const std::string& line : row.complaints)
    complaints += fmt::format("<small>{}</small>", xml_escape(line));
  return fmt::format(
      "<tr><td>{}{}</td><td class=\"{}\">{}</td><td>{}{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", name,
      note, kClass[verdict], kSign[verdict], xml_escape(row.reason), complaints, number(row.time_s),
      number(row.mean_mps), number(row.closest_m));
}

}  // namespace

std::string folder_page_html(const std::string& title, std::vector<FolderRow> rows,
                             const std::vector<std::string>& skipped) {
  std::stable_sort(rows.begin(), rows.end(), [](const FolderRow& a, const FolderRow& b) {
    return std::tie(a.verdict, a.name) < std::tie(b.verdict, b.name);
  });
  std::array<std::size_t, 4> count{};
  for (const FolderRow& row : rows) ++count[static_cast<std::size_t>(row.verdict)];
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'\">"
      "<meta name=\"viewport\" "
      "content=\"width=device-width\"><title>{0}</title>\n<style>\n{1}{2}</style></head>"
      "<body>\n<h1>{0}</h1>\n<p>{3} flights: {4} failed, {5} unknown, {6} reached the goal{7}.</p>\n"
      "<table><thead><tr><th scope=\"col\">flight</th><th scope=\"col\">verdict</th>"
      "<th scope=\"col\">why it ended</th><th scope=\"col\">time s</th><th scope=\"col\">mean m/s</th>"
      "<th scope=\"col\">nearest obstacle m</th></tr></thead><tbody>\n",
      xml_escape(title), kPageStyle, kStyle, rows.size(), count[0], count[1], count[2],
      count[3] == 0 ? std::string() : fmt::format(", {} passed as their scenarios ask", count[3]));
  for (const FolderRow& row : rows) html += row_of(row);
  html +=
      "</tbody></table>\n<p class=\"quiet\">Nearest obstacle: the nearest that the vehicle has seen when it "
      "decided.</p>\n";
  if (!skipped.empty()) html += "<h2>Not flights</h2>\n<ul class=\"quiet\">\n";
  for (const std::string& line : skipped) html += fmt::format("<li>{}</li>\n", xml_escape(line));
  if (!skipped.empty()) html += "</ul>\n";
  return html + "</body></html>\n";
}

}  // namespace roborun::report
