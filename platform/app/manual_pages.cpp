#include "platform/app/manual_pages.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>

namespace roborun::app {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

/// "fly", "can decode": without the program's name, which is empty.
std::string words_of(const CLI::App& app) {
  std::string words;
  for (const CLI::App* at = &app; at->get_parent() != nullptr; at = at->get_parent())
    words = words.empty() ? at->get_name() : fmt::format("{} {}", at->get_name(), words);
  return words;
}

/// Text of roff: no backslash is a command, no line a request, no hyphen a typographer's.
std::string roff(std::string_view text) {
  std::string out;
  bool begins = true;
  for (const char c : text) {
    if (begins && (c == '.' || c == '\'')) out += "\\&";
    begins = c == '\n';
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

/// As a single-quoted word of a shell. `quote`: how that shell writes one inside.
std::string quoted(std::string_view text, std::string_view quote) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'')
      out += quote;
    else
      out += c;
  }
  return out + "'";
}

std::vector<std::string> flags_of(const CLI::Option& option) {
  std::vector<std::string> flags;
  for (const std::string& name : option.get_snames()) flags.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) flags.push_back("--" + name);
  return flags;
}

std::string option_of(const CLI::Option& option) {
  const std::vector<std::string> flags = flags_of(option);
  std::string text = flags.empty()
                         ? fmt::format("\\fI{}\\fR", roff(option.get_name(true)))
                         : fmt::format("\\fB{}\\fR", roff(fmt::format("{}", fmt::join(flags, ", "))));
  if (!flags.empty() && option.get_type_size() != 0)
    text += fmt::format(" \\fI{}\\fR", roff(option.get_type_name()));
  if (option.get_required()) text += " (required)";
  if (!option.get_default_str().empty()) text += fmt::format(" [{}]", roff(option.get_default_str()));
  return fmt::format(".TP\n{}\n{}\n", text, roff(option.get_description()));
}

std::string options_of(const CLI::App& app) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) text += option_of(*option);
  return text;
}

/// Subcommands in the page of their command, each before those below it.
std::string sections_of(const CLI::App& app) {
  std::string text;
  std::vector<const CLI::App*> todo;
  const auto push_commands_of = [&todo](const CLI::App& of) {
    const std::vector<const CLI::App*> below = commands_of(of);
    todo.insert(todo.end(), below.rbegin(), below.rend());
  };
  push_commands_of(app);
  while (!todo.empty()) {
    const CLI::App& sub = *todo.back();
    todo.pop_back();
    text +=
        fmt::format(".SH \"{}\"\n{}\n{}", roff(words_of(sub)), roff(sub.get_description()), options_of(sub));
    if (!sub.get_footer().empty()) text += fmt::format(".PP\n.nf\n{}\n.fi\n", roff(sub.get_footer()));
    push_commands_of(sub);
  }
  return text;
}

std::string page_of(const CLI::App& app, std::string_view version, std::string_view date) {
  const std::string words = words_of(app);
  const bool is_program = words.empty();
  const std::string name = is_program ? "roborun" : "roborun-" + words;
  std::string text = fmt::format(".TH {} 1 {} \"roborun {}\" \"roborun\"\n.SH NAME\n{} \\- {}\n", name, date,
                                 version, roff(name), roff(app.get_description()));
  text += fmt::format(".SH SYNOPSIS\n\\fBroborun{}{}\\fR [\\fIoptions\\fR]{}\n", is_program ? "" : " ",
                      roff(words), commands_of(app).empty() ? "" : " \\fIcommand\\fR");
  text += ".SH OPTIONS\n" + options_of(app);
  if (is_program) {
    text += ".SH COMMANDS\n";
    for (const CLI::App* sub : commands_of(app))
      text += fmt::format(".TP\n\\fBroborun\\-{}\\fR(1)\n{}\n", roff(sub->get_name()),
                          roff(sub->get_description()));
  } else {
    text += sections_of(app);
  }
  if (!app.get_footer().empty()) text += fmt::format(".SH NOTES\n.nf\n{}\n.fi\n", roff(app.get_footer()));
  if (!is_program) text += ".SH SEE ALSO\n\\fBroborun\\fR(1)\n";
  return text;
}

struct Word {
  std::string word, about;
};

/// By the words before ("", "can", "can decode"): what may follow.
std::map<std::string, std::vector<Word>> words_after(const CLI::App& app) {
  std::map<std::string, std::vector<Word>> after;
  std::vector<const CLI::App*> todo{&app};
  while (!todo.empty()) {
    const CLI::App* at = todo.back();
    todo.pop_back();
    std::vector<Word>& words = after[words_of(*at)];
    for (const CLI::App* sub : commands_of(*at)) {
      words.push_back({sub->get_name(), sub->get_description()});
      todo.push_back(sub);
    }
    for (const CLI::Option* option : at->get_options()) {
      for (const std::string& flag : flags_of(*option)) words.push_back({flag, option->get_description()});
    }
  }
  return after;
}

/// The lines of a `case` over the words so far: what may follow. bash and zsh read them alike.
std::string cases_of(const std::map<std::string, std::vector<Word>>& after) {
  std::string text;
  for (const auto& [words, next] : after) {
    std::string list;
    for (const Word& w : next) list += (list.empty() ? "" : " ") + w.word;
    text += fmt::format("    '{}') next='{}' ;;\n", words, list);
  }
  return text;
}

std::string bash_of(const std::map<std::string, std::vector<Word>>& after) {
  std::string paths;
  for (const auto& [words, next] : after) paths += fmt::format("|{}", words);
  return fmt::format(R"(# Written by roborun manual.
_roborun() {{
  local at='' next word
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case '{}|' in *"|${{at:+$at }}$word|"*) at="${{at:+$at }}$word" ;; esac
  done
  case "$at" in
{}  esac
  mapfile -t COMPREPLY < <(compgen -W "$next" -- "${{COMP_WORDS[COMP_CWORD]}}")
}}
complete -o default -F _roborun roborun
)",
                     paths, cases_of(after));
}

std::string zsh_of(const std::map<std::string, std::vector<Word>>& after) {
  std::string paths;
  for (const auto& [words, next] : after) paths += fmt::format("|{}", words);
  return fmt::format(R"(#compdef roborun
# Written by roborun manual.
local at='' next word
for word in "${{(@)words[2,CURRENT-1]}}"; do
  case '{}|' in *"|${{at:+$at }}$word|"*) at="${{at:+$at }}$word" ;; esac
done
case "$at" in
{}esac
compadd -- ${{=next}}
_files
)",
                     paths, cases_of(after));
}

std::string fish_of(const std::map<std::string, std::vector<Word>>& after) {
  std::string text = "# Written by roborun manual.\n";
  for (const auto& [words, next] : after) {
    std::string when = words.empty() ? "__fish_use_subcommand" : "";
    std::string rest = words;
    while (!rest.empty()) {
      const std::size_t end = rest.find(' ');
      when +=
          fmt::format("{}__fish_seen_subcommand_from {}", when.empty() ? "" : "; and ", rest.substr(0, end));
      rest = end == std::string::npos ? "" : rest.substr(end + 1);
    }
    for (const Word& w : next) {
      const std::string what = w.word.starts_with("--")  ? "-l " + w.word.substr(2)
                               : w.word.starts_with('-') ? "-s " + w.word.substr(1)
                                                         : "-f -a " + w.word;
      text += fmt::format("complete -c roborun -n {} {} -d {}\n", quoted(when, "\\'"), what,
                          quoted(w.about.substr(0, w.about.find('\n')), "\\'"));
    }
  }
  return text;
}

}  // namespace

std::vector<ManualFile> manual_files(const CLI::App& app, std::string_view version, std::string_view date) {
  std::vector<ManualFile> files{{"man/man1/roborun.1", page_of(app, version, date)}};
  for (const CLI::App* sub : commands_of(app))
    files.push_back({fmt::format("man/man1/roborun-{}.1", sub->get_name()), page_of(*sub, version, date)});
  const auto after = words_after(app);
  files.push_back({"bash-completion/completions/roborun", bash_of(after)});
  files.push_back({"zsh/vendor-completions/_roborun", zsh_of(after)});
  files.push_back({"fish/vendor_completions.d/roborun.fish", fish_of(after)});
  return files;
}

}  // namespace roborun::app
