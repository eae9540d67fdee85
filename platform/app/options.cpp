#include "platform/app/options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::app {
namespace {

/// Letters to change, add, leave out or swap with their neighbour.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  std::iota(d[0].begin(), d[0].end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    d[i][0] = i;
    for (std::size_t k = 1; k <= b.size(); ++k) {
      d[i][k] =
          std::min({d[i - 1][k] + 1, d[i][k - 1] + 1, d[i - 1][k - 1] + (a[i - 1] == b[k - 1] ? 0 : 1)});
      if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1])
        d[i][k] = std::min(d[i][k], d[i - 2][k - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

/// ": did you mean 'NAME'?", or nothing if none is near.
std::string suggestion(const std::string& given, const std::vector<std::string>& names) {
  constexpr std::size_t kLongest = 64;
  const std::size_t most = given.size() < 4 ? 1 : 2;
  std::size_t least = most + 1;
  const std::string* nearest = nullptr;
  for (const std::string& name : names) {
    if (given.size() > kLongest) break;
    const std::size_t n = given.size() > 2 && name.starts_with(given) ? 1 : edits(given, name);
    if (n >= least) continue;
    least = n;
    nearest = &name;
  }
  return nearest == nullptr ? "" : fmt::format(": did you mean '{}'?", *nearest);
}

/// The subcommand that the command line chose, as deep as it goes.
const CLI::App& chosen(const CLI::App& app) {
  const CLI::App* at = &app;
  while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
  return *at;
}

std::string path_of(const CLI::App& app) {
  std::string path = app.get_name();
  for (const CLI::App* at = app.get_parent(); at != nullptr; at = at->get_parent())
    path = fmt::format("{} {}", at->get_name(), path);
  return path;
}

}  // namespace

CLI::Option* add_number(CLI::App& app, const std::string& name, double& value, double low, double high,
                        const std::string& text) {
  return app
      .add_option_function<std::string>(
          name,
          [name, &value, low, high](const std::string& given) {
            value = input::number_of(name, given, low, high);
          },
          text)
      ->type_name("NUMBER")
      ->default_str(fmt::format("{}", value));
}

CLI::Option* add_whole(CLI::App& app, const std::string& name, int& value, int low, int high,
                       const std::string& text) {
  return app
      .add_option_function<std::string>(
          name,
          [name, &value, low, high](const std::string& given) {
            value = input::whole_of(name, given, low, high);
          },
          text)
      ->type_name("WHOLE")
      ->default_str(fmt::format("{}", value));
}

void refuse_alone(const CLI::Option& option, bool with_partner, const std::string& partner) {
  if (option.count() > 0 && !with_partner)
    throw InputError(fmt::format("{}: goes with {}", option.get_name(), partner));
}

void refuse_before_subcommand(const CLI::App& app) {
  for (const CLI::App* at = &app; !at->get_subcommands().empty(); at = at->get_subcommands().front()) {
    for (const CLI::Option* option : at->get_options()) {
      if (option->count() > 0)
        throw InputError(fmt::format("{}: is not of '{}': must come after it, if it has such an option",
                                     option->get_name(), path_of(*at->get_subcommands().front())));
    }
  }
}

std::string complaint_of(const CLI::App& app, const CLI::ParseError& error) {
  // What is left over before the command: a mistyped one, whose subcommand has the name of a command.
  const std::vector<std::string> before = app.remaining(false);
  const bool is_mistyped = !before.empty() && !before.front().starts_with('-');
  const CLI::App& at = is_mistyped ? app : chosen(app);
  const std::string help = fmt::format("(see {} --help)", path_of(at));
  const std::vector<std::string> extras = is_mistyped ? before : app.remaining(true);
  if (extras.empty()) return fmt::format("{} {}", error.what(), help);
  std::string given = extras.front();
  std::vector<std::string> names;
  if (given.starts_with('-')) {
    given = given.substr(0, given.find('='));
    for (const CLI::Option* option : at.get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
    return fmt::format("'{}' is no option of {}{} {}", given, path_of(at), suggestion(given, names), help);
  }
  for (const CLI::App* sub : at.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(sub->get_name());
  if (names.empty()) return fmt::format("'{}' is one argument too many for {} {}", given, path_of(at), help);
  return fmt::format("'{}' is no command{} {}", given, suggestion(given, names), help);
}

}  // namespace roborun::app
