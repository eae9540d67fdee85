#include "platform/sitl/world/file_bytes.hpp"

#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"

namespace roborun::sitl {

std::vector<unsigned char> read_bytes(const std::string& path, std::size_t most, const std::string& wanted) {
  const std::string text = input::read_text(path, wanted, most);
  return {text.begin(), text.end()};
}

void refuse(const std::string& name, const std::string& what) { throw InputError(name + ": " + what); }

}  // namespace roborun::sitl
