/// What a bad name, key, file or number is answered with: one line that says what, where, and what would be
/// right.
#pragma once

#include <stdexcept>

namespace roborun {

class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace roborun
