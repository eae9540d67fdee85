#include "platform/sensor_port/port_names.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace roborun::sensor_port {

std::string port_path(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  std::string path(kPortFolder);
  return path.append("/").append(kPortPrefix).append(name);
}

bool is_written_to(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool is_free = flock(file, LOCK_SH | LOCK_NB) == 0;
  close(file);
  return !is_free;
}

}  // namespace roborun::sensor_port
