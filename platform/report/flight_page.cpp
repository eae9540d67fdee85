#include "platform/report/flight_page.hpp"

#include <zlib.h>

#include <array>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "platform/input/base64.hpp"
#include "platform/report/page_parts.hpp"
#include "platform/report/svg.hpp"

namespace roborun::report {
namespace {

std::string deflated(const std::string& text) {
  uLongf size = compressBound(text.size());
  std::string bytes(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(bytes.data()), &size, reinterpret_cast<const Bytef*>(text.data()),
                text.size(), Z_BEST_COMPRESSION) != Z_OK)
    throw std::runtime_error("the page could not be compressed");
  bytes.resize(size);
  return bytes;
}

}  // namespace

std::string flight_page_html(const FlightPage& page) {
  const std::array<std::pair<std::string_view, std::string>, 6> parts{
      {{"@TITLE@", xml_escape(page.title)},
       {"@POLICY@", page.live ? "; connect-src 'self'" : ""},
       {"@STYLE@", std::string(kPageStyle) + kFlightPageStyle},
       {"@FOOTER@", xml_escape(page.footer)},
       {"@STORY@", input::to_base64(deflated(page.story))},
       {"@SCRIPT@", kFlightPageScript}}};
  // In one pass: what is put in is not looked at again.
  std::string html;
  std::string_view rest = kFlightPageHtml;
  while (!rest.empty()) {
    std::size_t next = rest.size();
    const std::pair<std::string_view, std::string>* found = nullptr;
    for (const auto& part : parts) {
      if (const std::size_t at = rest.find(part.first); at < next) {
        next = at;
        found = &part;
      }
    }
    html += rest.substr(0, next);
    if (found == nullptr) break;
    html += found->second;
    rest.remove_prefix(next + found->first.size());
  }
  return html;
}

}  // namespace roborun::report
