/// What toolchain/mutation writes into a copy of a source: every change of it is there, and the environment says which one counts.
/// Included by force, in no build of ours.
#pragma once

#include <algorithm>
#include <chrono>
#include <type_traits>

namespace rbm {

struct Choice {
  Choice();
  int id;  ///< $ROBORUN_MUTANT, 0: none.
};
extern const Choice active;
extern unsigned char state[];  ///< By mutant: 1 reached, 2 reached with a type that it does not change.

// Nothing here is constexpr: a compiler that may work a mutant's place out for itself does so without asking which one counts.
template <int N>
bool on() {
  if (state[N] == 0) state[N] = 1;
  return active.id == N;
}
template <int N>
void is_none() {
  state[N] = 2;
}

template <typename T>
inline constexpr bool kIsTime = false;
template <typename Rep, typename Period>
inline constexpr bool kIsTime<std::chrono::duration<Rep, Period>> = true;

/// Mutant N: true; N + 1: false.
template <int N, typename T>
bool cond(const T& value) {
  const bool is_true = on<N>();
  return on<N + 1>() ? false : is_true || static_cast<bool>(value);
}

/// Mutant N: with or without equality; N + 1: the opposite.
template <int N, char kOp, typename A, typename B>
bool compare(const A& a, const B& b) {
  const bool edge = on<N>();
  const bool opposite = on<N + 1>();
  bool holds = false;
  if constexpr (kOp == '<') holds = edge ? a <= b : a < b;
  if constexpr (kOp == '>') holds = edge ? a >= b : a > b;
  if constexpr (kOp == 'l') holds = edge ? a < b : a <= b;
  if constexpr (kOp == 'g') holds = edge ? a > b : a >= b;
  return holds != opposite;
}
/// Mutant N: the opposite.
template <int N, bool kEqual, typename A, typename B>
bool equal(const A& a, const B& b) {
  return kEqual != on<N>() ? a == b : !(a == b);
}

/// Mutant N: + for -, * for /, and the other way round. Of numbers and times.
template <int N, char kOp, typename A, typename B>
decltype(auto) arith(const A& a, const B& b) {
  constexpr bool kNumbers = std::is_arithmetic_v<A> && std::is_arithmetic_v<B>;
  if constexpr (kOp == '+' || kOp == '-') {
    if constexpr (kNumbers || (kIsTime<A> && kIsTime<B>)) {
      return (kOp == '+') != on<N>() ? a + b : a - b;
    } else {
      is_none<N>();
      if constexpr (kOp == '+') {
        return a + b;
      } else {
        return a - b;
      }
    }
  } else {
    if constexpr (kNumbers) {
      return (kOp == '*') != on<N>() ? a * b : a / b;
    } else {
      is_none<N>();
      if constexpr (kOp == '*') {
        return a * b;
      } else {
        return a / b;
      }
    }
  }
}

/// Mutant N: the other one.
template <int N, bool kMin>
struct Extreme {
  template <typename T>
  static T of(const T& a, const T& b) {
    return kMin != on<N>() ? std::min(a, b) : std::max(a, b);
  }
};

/// Mutant N: another constant. A whole number one more, others doubled (zero: one), an enumerator its neighbour, a truth the other one.
template <int N, typename T>
decltype(auto) constant(const T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value != on<N>();
  } else if constexpr (std::is_enum_v<T>) {
    using U = std::underlying_type_t<T>;
    return on<N>() ? static_cast<T>(static_cast<U>(static_cast<U>(value) ^ U{1})) : T{value};
  } else if constexpr (std::is_integral_v<T>) {
    return on<N>() ? static_cast<T>(value + 1) : T{value};
  } else if constexpr (std::is_floating_point_v<T>) {
    return on<N>() ? (value == T{0} ? T{1} : value + value) : T{value};
  } else if constexpr (kIsTime<T>) {
    return on<N>() ? value + value + T{1} : T{value};
  } else {
    is_none<N>();
    return value;
  }
}

}  // namespace rbm
