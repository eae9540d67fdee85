/// A chip of the kernel's gpio-sim: real lines whose far ends the test moves and reads.
/// Source: Documentation/admin-guide/gpio/gpio-sim.rst of Linux.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace roborun::test {

class GpioSim {
 public:
  /// Needs the module, configfs mounted, and root.
  [[nodiscard]] static bool there() { return access(kFolder, W_OK) == 0; }
  static constexpr const char* kWhyNot = "no gpio-sim: /sys/kernel/config/gpio-sim cannot be written";

  /// Plugged in, with one line for each name; every far end is low.
  explicit GpioSim(const std::vector<std::string>& names) : line_count_(names.size()) {
    std::filesystem::create_directories(bank_);
    write(bank_ / "num_lines", std::to_string(line_count_));
    for (std::size_t i = 0; i < line_count_; ++i) {
      std::filesystem::create_directory(line(i));
      write(line(i) / "name", names[i]);
    }
    plug();
  }
  ~GpioSim() {
    unplug();
    std::error_code ignored;
    std::filesystem::remove(line(0) / "hog", ignored);
    for (std::size_t i = 0; i < line_count_; ++i) std::filesystem::remove(line(i), ignored);
    std::filesystem::remove(bank_, ignored);
    std::filesystem::remove(device_, ignored);
  }
  GpioSim(const GpioSim&) = delete;
  GpioSim& operator=(const GpioSim&) = delete;

  /// Pulls the far end; the line follows unless it is an output.
  void drive(std::size_t i, bool high) const {
    const std::string pull = high ? "pull-up" : "pull-down";
    EXPECT_EQ(pwrite(pulls_.at(i), pull.data(), pull.size(), 0), static_cast<ssize_t>(pull.size()));
  }
  /// The wire's level, whatever the line's owner calls active.
  [[nodiscard]] bool high(std::size_t i) const {
    std::string text;
    std::ifstream(wire(i) / "value") >> text;
    EXPECT_TRUE(text == "0" || text == "1") << text;
    return text == "1";
  }
  void rename(std::size_t i, const std::string& name) {
    unplug();
    write(line(i) / "name", name);
    plug();
  }
  /// Another driver of the kernel owns line 0 from now on.
  void hog(const std::string& consumer) {
    unplug();
    std::filesystem::create_directory(line(0) / "hog");
    write(line(0) / "hog" / "name", consumer);
    write(line(0) / "hog" / "direction", "input");
    plug();
  }
  /// The chip is gone. Linux 6.1 warns and leaks if one of its inputs is still open.
  void unplug() {
    for (const int pull : pulls_) close(pull);
    if (!pulls_.empty()) write(device_ / "live", "0");
    pulls_.clear();
  }

 private:
  static constexpr const char* kFolder = "/sys/kernel/config/gpio-sim";

  static void write(const std::filesystem::path& path, const std::string& text) {
    std::ofstream out(path);
    out << text << std::flush;
    EXPECT_TRUE(out.good()) << path;
  }
  static std::string read(const std::filesystem::path& path) {
    std::string text;
    std::ifstream(path) >> text;
    return text;
  }
  void plug() {
    write(device_ / "live", "1");
    for (std::size_t i = 0; i < line_count_; ++i) {
      // NOLINTNEXTLINE(cppcoreguidelines-pro-type-vararg): POSIX
      pulls_.push_back(open((wire(i) / "pull").c_str(), O_WRONLY | O_CLOEXEC));
      EXPECT_GE(pulls_.back(), 0) << wire(i);
    }
  }
  [[nodiscard]] std::filesystem::path line(std::size_t i) const {
    return bank_ / ("line" + std::to_string(i));
  }
  [[nodiscard]] std::filesystem::path wire(std::size_t i) const {
    return std::filesystem::path("/sys/devices/platform") / read(device_ / "dev_name") /
           read(bank_ / "chip_name") / ("sim_gpio" + std::to_string(i));
  }

  std::size_t line_count_;
  std::filesystem::path device_{std::string(kFolder) + "/roborun_test." + std::to_string(getpid())};
  std::filesystem::path bank_{device_ / "bank0"};
  std::vector<int> pulls_;
};

}  // namespace roborun::test
