/// The command line as man pages and as completions of shells: everything is read from the parser's own tables.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace roborun::app {

struct ManualFile {
  std::string path;  ///< Below a folder such as /usr/share.
  std::string text;
};

/// One page per command, and one file per shell. Terminals and pagers get no byte of a description unescaped.
[[nodiscard]] std::vector<ManualFile> manual_files(const CLI::App& app, std::string_view version,
                                                   std::string_view date);

}  // namespace roborun::app
