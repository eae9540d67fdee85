/// The guard of a slot, by all orders in which its steps can become visible: what a compiler or processor may exchange is left open, what a fence or an
/// acquire or release holds is not. Each rule is then left out once, and the model has to find the torn sample.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <set>
#include <vector>

namespace roborun::sensor_port {
namespace {

enum Place : std::uint8_t { kGuard, kFirst, kSecond, kPlaces };

struct Step {
  Place place;
  int value;                       ///< Of a write.
  std::vector<std::size_t> after;  ///< Steps of the same side that are visible before it.
};

struct Rules {
  bool fence_after_odd{true};    ///< Writer: the odd guard before new bytes.
  bool release_even{true};       ///< Writer: new bytes before the even guard.
  bool acquire_guard{true};      ///< Reader: the guard before the bytes.
  bool fence_before_look{true};  ///< Reader: the bytes before the second look.
};

/// Samples 0, 1, 2 in one slot: guards 1, 2, 3, 4, 5, 6; both words hold the sample's number plus one.
std::vector<Step> writer_of(const Rules& rules) {
  std::vector<Step> steps;
  for (int n = 0; n < 3; ++n) {
    const std::size_t odd = steps.size();
    const std::size_t before = odd == 0 ? 0 : odd - 1;  // what one place holds changes in the program's order
    steps.push_back({kGuard, 2 * n + 1, {}});
    steps.push_back({kFirst, n + 1, {}});
    steps.push_back({kSecond, n + 1, {}});
    steps.push_back({kGuard, 2 * n + 2, {odd}});
    if (n > 0) {
      steps[odd].after.push_back(before);
      steps[odd + 1].after.push_back(odd - 3);
      steps[odd + 2].after.push_back(odd - 2);
    }
    for (const std::size_t word : {odd + 1, odd + 2}) {
      if (rules.fence_after_odd) steps[word].after.push_back(odd);
      if (rules.release_even) steps[odd + 3].after.push_back(word);
    }
  }
  return steps;
}

/// Guard, both words, guard.
std::vector<Step> reader_of(const Rules& rules) {
  std::vector<Step> steps{{kGuard, 0, {}}, {kFirst, 0, {}}, {kSecond, 0, {}}, {kGuard, 0, {0}}};
  for (const std::size_t word : {1U, 2U}) {
    if (rules.acquire_guard) steps[word].after.push_back(0);
    if (rules.fence_before_look) steps[3].after.push_back(word);
  }
  return steps;
}

class Model {
 public:
  explicit Model(const Rules& rules) : writer_(writer_of(rules)), reader_(reader_of(rules)) {}
  /// How many different states were seen, and whether a torn sample was taken in one.
  struct Found {
    std::size_t states{};
    bool takes_torn{}, takes_whole{};
  };
  Found search() {
    visit({});
    found_.states = seen_.size();
    return found_;
  }

 private:
  struct State {
    std::uint32_t written{}, read{};  ///< Steps that are visible, as bits.
    std::array<int, kPlaces> memory{};
    std::array<int, 4> got{};
    auto operator<=>(const State&) const = default;
  };

  static bool may(const std::vector<Step>& steps, std::uint32_t done, std::size_t i) {
    if (((done >> i) & 1U) != 0) return false;
    for (const std::size_t before : steps[i].after)
      if (((done >> before) & 1U) == 0) return false;
    return true;
  }

  void visit(const State& s) {
    if (!seen_.insert(s).second) return;
    if (s.read == 0xFU) {
      const bool taken = s.got[0] == s.got[3] && s.got[0] > 0 && s.got[0] % 2 == 0;
      const bool whole = s.got[1] == s.got[2] && s.got[1] == s.got[0] / 2;
      found_.takes_torn = found_.takes_torn || (taken && !whole);
      found_.takes_whole = found_.takes_whole || (taken && whole);
    }
    for (std::size_t i = 0; i < writer_.size(); ++i) {
      if (!may(writer_, s.written, i)) continue;
      State next = s;
      next.written |= 1U << i;
      next.memory[writer_[i].place] = writer_[i].value;
      visit(next);
    }
    for (std::size_t i = 0; i < reader_.size(); ++i) {
      if (!may(reader_, s.read, i)) continue;
      State next = s;
      next.read |= 1U << i;
      next.got[i] = s.memory[reader_[i].place];
      visit(next);
    }
  }

  std::vector<Step> writer_, reader_;
  std::set<State> seen_;
  Found found_{};
};

TEST(PortModel, TakesNoTornSampleInAnyOrder) {
  const Model::Found found = Model(Rules{}).search();
  EXPECT_FALSE(found.takes_torn);
  EXPECT_TRUE(found.takes_whole) << "it has something to take";
  EXPECT_GT(found.states, 500U);
}

TEST(PortModel, FindsTheTornSampleWithoutAnyOneOfTheRules) {
  EXPECT_TRUE(Model({.fence_after_odd = false}).search().takes_torn);
  EXPECT_TRUE(Model({.release_even = false}).search().takes_torn);
  EXPECT_TRUE(Model({.acquire_guard = false}).search().takes_torn);
  EXPECT_TRUE(Model({.fence_before_look = false}).search().takes_torn);
}

}  // namespace
}  // namespace roborun::sensor_port
