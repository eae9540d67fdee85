#include "platform/app/manual_command.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "platform/app/exit_code.hpp"
#include "platform/app/manual_pages.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/report/build_identity.hpp"

namespace roborun::app {
namespace {

int write_manual(const CLI::App& app, const std::string& out) {
  const report::BuildIdentity build = report::build_identity();
  for (const ManualFile& file : manual_files(app, build.version, build.commit_date)) {
    const std::filesystem::path path = std::filesystem::path(out) / file.path;
    std::error_code failed;
    std::filesystem::create_directories(path.parent_path(), failed);
    if (failed) throw InputError(fmt::format("--out: {}: {}", path.parent_path().string(), failed.message()));
    input::OutputFile written(path.string());
    written.write(file.text);
    written.commit();
  }
  return kDone;
}

}  // namespace

void add_manual_command(CLI::App& app, std::function<int()>& run) {
  const auto out = std::make_shared<std::string>();
  CLI::App* command =
      app.add_subcommand("manual", "Write the man pages and the completions of bash, zsh and fish");
  command->footer(
      "What is written: man/man1/roborun.1 and one page per command, bash-completion/completions/roborun,\n"
      "zsh/vendor-completions/_roborun and fish/vendor_completions.d/roborun.fish; where the package "
      "installs them.\n\n"
      "Example, for you alone:\n"
      "  roborun manual --out ~/.local/share && man -M ~/.local/share/man roborun-fly\n\n"
      "Exit code: 0, 2 a file cannot be written.");
  command->add_option("--out", *out, "Folder, made if it is not there")->required();
  command->callback([&app, out, &run] { run = [&app, out] { return write_manual(app, *out); }; });
}

}  // namespace roborun::app
