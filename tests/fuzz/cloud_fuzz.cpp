/// Point clouds and meshes: the first byte chooses the format. Oracle: all numbers are finite, and there are no more points and
/// triangles than the bytes justify (a point in a run of PCD's compression can be a fraction of a byte; a fan of OBJ two bytes a corner).
#include "platform/sitl/world/cloud_file.hpp"
#include "platform/sitl/world/mesh_file.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun;
  fuzz::Choices choices(data, size);
  const std::uint8_t format = choices.byte() % 6U;
  const auto bytes = choices.rest();
  fuzz::refuse_or([&] {
    sitl::Geometry geometry;
    switch (format) {
      case 0:
        geometry = sitl::parse_pcd(bytes, "memory");
        break;
      case 1:
        geometry = sitl::parse_ply(bytes, "memory");
        break;
      case 2:
        geometry = sitl::parse_las(bytes, "memory");
        break;
      case 3:
        geometry.triangles = sitl::parse_stl(bytes, "memory");
        break;
      case 4:
        geometry.triangles = sitl::parse_obj(bytes, "memory");
        break;
      default:
        geometry.triangles = sitl::parse_dae(bytes, "memory");
    }
    fuzz::require(geometry.points.size() + geometry.triangles.size() <= 256 * bytes.size(),
                  "memory follows the bytes");
    for (const Vector3& point : geometry.points) fuzz::require(point.allFinite(), "points are finite");
    for (const sitl::Triangle& triangle : geometry.triangles) {
      for (const Vector3& corner : triangle) fuzz::require(corner.allFinite(), "corners are finite");
    }
    (void)sitl::open_edges(geometry.triangles);
  });
  return 0;
}
