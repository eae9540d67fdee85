/// What a test can say of an SVG text.
#pragma once

#include <string>
#include <vector>

namespace roborun::test {

/// Elements open and close in order, attributes are quoted, and no stray < or & is left in the text.
inline bool well_formed(const std::string& xml) {
  std::vector<std::string> open;
  for (std::size_t at = 0; at < xml.size(); ++at) {
    if (xml[at] == '&' && xml.find(';', at) > at + 6) return false;
    if (xml[at] != '<') continue;
    const std::size_t end = xml.find('>', at);
    if (end == std::string::npos) return false;
    std::string tag = xml.substr(at + 1, end - at - 1);
    at = end;
    if (tag[0] == '?' || tag[0] == '!') continue;
    if (tag[0] == '/') {
      if (open.empty() || open.back() != tag.substr(1)) return false;
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(tag.substr(0, tag.find_first_of(" \n")));
    }
  }
  return open.empty();
}

inline std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

/// As all pictures of this project: as wide as a page shows it, with a title and a description, for light and dark screens.
inline bool is_for_pages(const std::string& svg) {
  return svg.find("width=\"830\"") != std::string::npos && svg.find("<title></title>") == std::string::npos &&
         svg.find("<title>") != std::string::npos && svg.find("<desc></desc>") == std::string::npos &&
         svg.find("<desc>") != std::string::npos &&
         svg.find("prefers-color-scheme: dark") != std::string::npos;
}

}  // namespace roborun::test
