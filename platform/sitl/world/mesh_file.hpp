/// Triangle meshes in memory: STL, OBJ, COLLADA (.dae). What is truncated, has impossible counts, or is of another format
/// throws InputError with one line.
/// Sources: Wavefront OBJ; COLLADA 1.4.1 (Khronos).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "platform/sitl/world/triangle_mesh.hpp"

namespace roborun::sitl {

/// ascii and binary.
[[nodiscard]] std::vector<Triangle> parse_stl(std::span<const unsigned char> bytes, const std::string& name);
/// Faces of any number of corners, as fans.
[[nodiscard]] std::vector<Triangle> parse_obj(std::span<const unsigned char> bytes, const std::string& name);
/// Triangles, polygons and their lists, placed by the nodes of the scene; metres, z up. No skins, no nodes from
/// elsewhere.
[[nodiscard]] std::vector<Triangle> parse_dae(std::span<const unsigned char> bytes, const std::string& name);
/// By the name's end: .stl, .obj or .dae.
[[nodiscard]] std::vector<Triangle> parse_mesh(std::span<const unsigned char> bytes, const std::string& name);

/// Edges that do not belong to an even number of triangles, corners at one place being one: 0 where the mesh is closed.
/// O(n log n).
[[nodiscard]] std::size_t open_edges(const std::vector<Triangle>& triangles);

}  // namespace roborun::sitl
