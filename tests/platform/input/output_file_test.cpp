#include "platform/input/output_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::input {
namespace {

namespace fs = std::filesystem;

template <typename Action>
std::string complaint(Action&& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

std::string content(const std::string& path) { return read_text(path, "readable"); }

std::size_t files_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// A folder of this test alone.
fs::path folder(const std::string& name) {
  const fs::path path = test::scratch_folder() / name;
  fs::create_directories(path);
  return path;
}

TEST(OutputFile, TheFileBeforeStaysUntilAllIsThere) {
  const fs::path in = folder("before");
  const std::string path = in / "flight.rec";
  write_file(path, "before");
  {
    OutputFile dropped(path);
    dropped.write(std::string(200000, 'x'));
    EXPECT_EQ(content(path), "before");
  }
  EXPECT_EQ(content(path), "before");
  EXPECT_EQ(files_in(in), 1U);
  OutputFile kept(path);
  kept.write("after");
  kept.write(std::string(200000, 'x'));
  EXPECT_EQ(content(path), "before");
  kept.commit();
  EXPECT_EQ(content(path), "after" + std::string(200000, 'x'));
  EXPECT_EQ(files_in(in), 1U);
}

TEST(OutputFile, AKilledWriterLeavesTheFileBefore) {
  const std::string path = folder("killed") / "map.bt";
  write_file(path, "before");
  const pid_t child = fork();
  if (child == 0) {
    OutputFile file(path);
    file.write(std::string(1U << 20U, 'x'));
    (void)raise(SIGKILL);
  }
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  EXPECT_EQ(content(path), "before");
  const fs::path in = fs::path(path).parent_path();
  EXPECT_EQ(files_in(in), 2U);
  for (const char* name :
       {"map.bt.notes.part", "map.bt.1.part.txt", "map.bt2.1.part", "map.bt.1-.part", "map.bt.part"})
    write_file(in / name, "somebody's");
  write_file(path, "after");
  EXPECT_EQ(content(path), "after");
  EXPECT_EQ(files_in(in), 6U) << "the dead one's part is gone, and nothing else";
}

TEST(OutputFile, TwoWritersOfOneNameDoNotTakeEachOthersParts) {
  const fs::path in = folder("two");
  const std::string path = in / "x";
  OutputFile first(path);
  first.write("first");
  write_file(path, "second");
  EXPECT_EQ(content(path), "second");
  EXPECT_EQ(files_in(in), 2U);
  first.commit();
  EXPECT_EQ(content(path), "first");
  EXPECT_EQ(files_in(in), 1U);
}

TEST(OutputFile, KeepsThePermissionsOfTheFileBefore) {
  const std::string path = folder("mode") / "secret";
  write_file(path, "x");
  fs::permissions(path, fs::perms{0640});
  write_file(path, "y");
  EXPECT_EQ(fs::status(path).permissions(), fs::perms{0640});
}

TEST(OutputFile, WritesTheTargetOfALink) {
  const fs::path in = folder("link");
  fs::create_directories(in / "deep");
  write_file(in / "deep" / "target", "before");
  fs::create_symlink("deep/target", in / "name");
  write_file(in / "name", "after");
  EXPECT_TRUE(fs::is_symlink(in / "name"));
  EXPECT_EQ(content(in / "deep" / "target"), "after");
  fs::create_symlink("deep/new", in / "dangling");
  write_file(in / "dangling", "new");
  EXPECT_TRUE(fs::is_symlink(in / "dangling"));
  EXPECT_EQ(content(in / "deep" / "new"), "new");
}

TEST(OutputFile, WritesThroughWhatIsNoRegularFile) {
  write_file("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  const std::string fifo = folder("fifo") / "pipe";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = content(fifo); });
  write_file(fifo, "through");
  reader.join();
  EXPECT_EQ(got, "through");
  EXPECT_TRUE(fs::is_fifo(fifo));
}

TEST(OutputFile, StandardOutputGoesOnWhereItWas) {
  const std::string path = folder("stdout") / "out.txt";
  (void)std::fflush(stdout);  // or the child would print it again
  const pid_t child = fork();
  if (child == 0) {
    const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    (void)dup2(fd, STDOUT_FILENO);
    (void)std::printf("first\n");
    write_file("/dev/stdout", "second\n");
    (void)std::printf("third\n");
    (void)std::fflush(stdout);
    _exit(complaint([&] {
            check_outputs({{"--trace", path}}, {});
          }).find("standard output") == std::string::npos);
  }
  int status = 1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(content(path), "first\nsecond\nthird\n");
  EXPECT_EQ(status, 0) << "by its own name it is refused";
}

TEST(OutputFile, SaysWhyItCannotWriteAndLeavesNothing) {
  const fs::path in = folder("refused");
  fs::create_directories(in / "is_a_folder.csv");
  for (const auto& [path, why] : {std::pair<std::string, std::string>{"/nonexistent/x.csv", "No such file"},
                                  {in / "is_a_folder.csv", "Is a directory"},
                                  {in / "no" / "x", "No such file"},
                                  {"/dev/null/x", "Not a directory"}}) {
    for (const std::string& line : {complaint([&] { write_file(path, "x"); }), complaint([&] {
                                      check_outputs({{"--trace", path}}, {});
                                    })}) {
      EXPECT_NE(line.find(path + ": cannot be written: " + why), std::string::npos) << line;
    }
  }
  EXPECT_NE(
      complaint([&] { write_file("/dev/full", "x"); }).find("/dev/full: cannot be written: No space left"),
      std::string::npos);
  OutputFile full("/dev/full");
  full.write(std::string(200000, 'x'));
  EXPECT_NE(complaint([&] { full.check(); }).find("No space left"), std::string::npos);
  EXPECT_EQ(files_in(in), 1U);
}

TEST(CheckOutputs, RefusesAnOutputThatIsReadOrWrittenTwice) {
  const fs::path in = folder("check");
  const std::string world = in / "w.toml";
  write_file(world, "x");
  fs::create_symlink("w.toml", in / "link");
  fs::create_hard_link(world, in / "hard");
  const auto line = [](const std::vector<NamedOutput>& outputs, const std::vector<std::string>& inputs) {
    return complaint([&] { check_outputs(outputs, inputs); });
  };
  for (const std::string& name : {world, (in / "link").string(), (in / "hard").string(),
                                  (in / "." / ".." / "check" / "w.toml").string()})
    EXPECT_EQ(line({{"--trace", name}}, {world}),
              "--trace: " + name + ": is " + world + ", which is read: must be another file");
  EXPECT_NE(line({{"--trace", world}}, {in / "link"}), "");
  const std::string fresh = in / "new";
  EXPECT_EQ(line({{"--trace", fresh}, {"--plot", in / "." / "new"}}, {}),
            "--plot: " + (in / "." / "new").string() + ": is the file of --trace: must be another file");
  EXPECT_NE(line({{"--trace", world}, {"--plot", in / "hard"}}, {}), "");
  EXPECT_EQ(line({{"--trace", "/dev/null"}, {"--plot", "/dev/null"}}, {"/dev/null"}), "");
  EXPECT_EQ(line({{"--trace", ""}, {"--plot", ""}}, {"", "paper"}), "");
  EXPECT_EQ(line({{"--trace", fresh}}, {world, "paper"}), "");
  EXPECT_FALSE(fs::exists(fresh));
}

}  // namespace
}  // namespace roborun::input
