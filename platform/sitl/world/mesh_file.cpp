#include "platform/sitl/world/mesh_file.hpp"

#include <cmath>
#include <cstdint>
#include <utility>

#include "core/geometry/math.hpp"
#include "platform/sitl/world/byte_reader.hpp"
#include "platform/sitl/world/file_bytes.hpp"
#include "platform/sitl/world/xml.hpp"

namespace roborun::sitl {
namespace {

using Bytes = std::span<const unsigned char>;
using Element = Xml::Element;

/// Three numbers of a text file, all finite.
Vector3 point_of(std::string_view& line, std::size_t number, const std::string& name) {
  Vector3 p;
  for (int i = 0; i < 3; ++i) {
    const auto value = number_of<double>(WordReader::take_word(line));
    if (!value || !std::isfinite(*value))
      refuse(name, fmt::format("line {}: must have three finite coordinates", number));
    p[i] = *value;
  }
  return p;
}

std::vector<Triangle> parse_ascii_stl(Bytes bytes, const std::string& name) {
  std::vector<Triangle> triangles;
  WordReader reader(bytes, 0);
  std::string_view line;
  std::size_t corner = 0;
  Triangle triangle;
  bool ended = false;
  while (reader.next_line(line)) {
    const std::string_view word = WordReader::take_word(line);
    if (word == "endsolid") ended = true;
    if (word == "vertex") {
      triangle[corner++ % 3] = point_of(line, reader.line_number(), name);
      if (corner % 3 == 0) triangles.push_back(triangle);
    }
    if (word == "endfacet" && corner % 3 != 0)
      refuse(name, fmt::format("line {}: a facet must have three corners", reader.line_number()));
  }
  if (!ended || corner % 3 != 0) refuse(name, "truncated: no endsolid");
  return triangles;
}

// ---- COLLADA ----

using Matrix4 = Eigen::Matrix4d;

/// One COLLADA document: its geometries and where the scene puts them.
class Collada {
 public:
  Collada(Bytes bytes, const std::string& name) : xml_(bytes, name, "COLLADA") {}

  std::vector<Triangle> triangles() {
    const Element& root = xml_.root();
    Matrix4 to_world = Matrix4::Identity();
    if (const Element* asset = root.FirstChildElement("asset")) {
      if (const Element* unit = asset->FirstChildElement("unit")) {
        const double meter = unit->DoubleAttribute("meter", 1.0);
        if (!(meter > 0.0 && meter <= 1e6)) xml_.refuse(*unit, "meter: must be above 0, at most 1e6");
        to_world.topLeftCorner<3, 3>() *= meter;
      }
      const Element* up = asset->FirstChildElement("up_axis");
      Matrix3 R = Matrix3::Identity();
      if (up == nullptr || Xml::text(*up) == "Y_UP") R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
      if (up != nullptr && Xml::text(*up) == "X_UP") R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
      to_world.topLeftCorner<3, 3>() = Matrix3(R * to_world.topLeftCorner<3, 3>());
    }
    for (const Element* library = root.FirstChildElement("library_visual_scenes"); library != nullptr;
         library = library->NextSiblingElement("library_visual_scenes"))
      for (const Element* scene = library->FirstChildElement("visual_scene"); scene != nullptr;
           scene = scene->NextSiblingElement("visual_scene"))
        add_nodes(*scene, to_world);
    return std::move(triangles_);
  }

 private:
  static constexpr std::size_t kMost = 20'000'000;

  [[nodiscard]] static std::string_view target(const Element& element, const char* attribute) {
    const char* text = element.Attribute(attribute);
    if (text == nullptr) return {};
    return text[0] == '#' ? std::string_view(text + 1) : std::string_view(text);
  }
  [[nodiscard]] const Element& geometry(const Element& instance) const {
    const std::string_view url = target(instance, "url");
    for (const Element* library = xml_.root().FirstChildElement("library_geometries"); library != nullptr;
         library = library->NextSiblingElement("library_geometries"))
      for (const Element* g = library->FirstChildElement("geometry"); g != nullptr;
           g = g->NextSiblingElement("geometry"))
        if (target(*g, "id") == url) return *g;
    xml_.refuse(instance, fmt::format("url: there is no geometry '{}'", url));
  }
  [[nodiscard]] Matrix4 transform(const Element& of) const {
    Matrix4 X = Matrix4::Identity();
    for (const Element* e = of.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view kind = e->Name();
      Matrix4 next = Matrix4::Identity();
      if (kind == "matrix") {
        const auto m = xml_.numbers<16>(*e);
        for (int i = 0; i < 16; ++i) next(i / 4, i % 4) = m[static_cast<std::size_t>(i)];
      } else if (kind == "translate") {
        const auto t = xml_.numbers<3>(*e);
        next.topRightCorner<3, 1>() = Vector3(t[0], t[1], t[2]);
      } else if (kind == "scale") {
        const auto s = xml_.numbers<3>(*e);
        for (int i = 0; i < 3; ++i) next(i, i) = s[static_cast<std::size_t>(i)];
      } else if (kind == "rotate") {
        const auto r = xml_.numbers<4>(*e);
        const Vector3 axis(r[0], r[1], r[2]);
        if (!(axis.norm() > 0.0)) xml_.refuse(*e, "must have an axis");
        next.topLeftCorner<3, 3>() =
            Eigen::AngleAxisd(r[3] * core::kPi / 180.0, axis.normalized()).toRotationMatrix();
      } else if (kind == "lookat" || kind == "skew") {
        xml_.refuse(*e, "is not read");
      }
      X *= next;
    }
    return X;
  }
  void add_nodes(const Element& scene, const Matrix4& X_W) {
    std::vector<std::pair<const Element*, Matrix4>> waiting{{&scene, X_W}};
    while (!waiting.empty()) {
      const auto [of, X_of] = waiting.back();
      waiting.pop_back();
      for (const Element* node = of->FirstChildElement("node"); node != nullptr;
           node = node->NextSiblingElement("node")) {
        const Matrix4 here = X_of * transform(*node);
        for (const char* kind : {"instance_node", "instance_controller"})
          if (const Element* e = node->FirstChildElement(kind)) xml_.refuse(*e, "is not read");
        for (const Element* e = node->FirstChildElement("instance_geometry"); e != nullptr;
             e = e->NextSiblingElement("instance_geometry"))
          add_geometry(geometry(*e), here);
        waiting.emplace_back(node, here);
      }
    }
  }
  [[nodiscard]] std::vector<Vector3> positions(const Element& mesh, std::string_view id) const {
    for (const Element* v = mesh.FirstChildElement("vertices"); v != nullptr;
         v = v->NextSiblingElement("vertices")) {
      if (target(*v, "id") != id) continue;
      for (const Element* in = v->FirstChildElement("input"); in != nullptr;
           in = in->NextSiblingElement("input"))
        if (target(*in, "semantic") == "POSITION") return source(mesh, target(*in, "source"));
    }
    return source(mesh, id);
  }
  [[nodiscard]] std::vector<Vector3> source(const Element& mesh, std::string_view id) const {
    for (const Element* s = mesh.FirstChildElement("source"); s != nullptr;
         s = s->NextSiblingElement("source")) {
      if (target(*s, "id") != id) continue;
      const Element& array = xml_.need(*s, "float_array");
      std::size_t stride = 3;
      if (const Element* common = s->FirstChildElement("technique_common"))
        if (const Element* accessor = common->FirstChildElement("accessor"))
          stride = accessor->UnsignedAttribute("stride", 3);
      if (stride < 3 || stride > 16) xml_.refuse(*s, "stride: must be 3 to 16");
      std::vector<Vector3> points;
      std::string_view rest = Xml::text(array);
      std::size_t n = 0;
      for (std::string_view word = WordReader::take_word(rest); !word.empty();
           word = WordReader::take_word(rest), ++n) {
        const auto value = number_of<double>(word);
        if (!value || !std::isfinite(*value))
          xml_.refuse(array, fmt::format("'{}' is no finite number", word));
        if (n % stride == 0) points.emplace_back(Vector3::Zero());
        if (n % stride < 3) points.back()[static_cast<Eigen::Index>(n % stride)] = *value;
      }
      return points;
    }
    xml_.refuse(mesh, fmt::format("there is no source '{}'", id));
  }
  void add_geometry(const Element& of, const Matrix4& X_W) {
    const Element& mesh = xml_.need(of, "mesh");
    for (const Element* e = mesh.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view kind = e->Name();
      if (kind == "triangles" || kind == "polylist" || kind == "polygons") add_faces(mesh, *e, X_W);
      if (kind == "trifans" || kind == "tristrips") xml_.refuse(*e, "is not read: must be triangles");
    }
  }
  void add_faces(const Element& mesh, const Element& faces, const Matrix4& X_W) {
    std::size_t stride = 0;
    std::size_t offset = 0;
    std::vector<Vector3> points;
    for (const Element* in = faces.FirstChildElement("input"); in != nullptr;
         in = in->NextSiblingElement("input")) {
      const std::size_t at = in->UnsignedAttribute("offset", 0);
      if (at > 16) xml_.refuse(*in, "offset: must be at most 16");
      stride = std::max(stride, at + 1);
      if (target(*in, "semantic") != "VERTEX") continue;
      offset = at;
      points = positions(mesh, target(*in, "source"));
    }
    if (stride == 0) xml_.refuse(faces, "must have an <input>");
    for (Vector3& p : points) p = X_W.topLeftCorner<3, 3>() * p + X_W.topRightCorner<3, 1>();
    // The corners of each face: <vcount> says how many there are, <polygons> has a <p> for each.
    const bool list = std::string_view(faces.Name()) == "polylist";
    std::string_view counts = list ? Xml::text(xml_.need(faces, "vcount")) : std::string_view();
    for (const Element* p = faces.FirstChildElement("p"); p != nullptr; p = p->NextSiblingElement("p")) {
      std::vector<std::size_t> corners;
      std::string_view rest = Xml::text(*p);
      std::size_t n = 0;
      for (std::string_view word = WordReader::take_word(rest); !word.empty();
           word = WordReader::take_word(rest), ++n) {
        if (n % stride != offset) continue;
        const auto index = number_of<std::size_t>(word);
        if (!index || *index >= points.size())
          xml_.refuse(*p, fmt::format("corner '{}' of {} points", word, points.size()));
        corners.push_back(*index);
      }
      const std::size_t whole = std::string_view(faces.Name()) == "triangles" ? 3 : corners.size();
      std::size_t at = 0;
      while (at < corners.size()) {
        std::size_t count = whole;
        if (list) {
          const auto next = number_of<std::size_t>(WordReader::take_word(counts));
          if (!next || *next == 0) xml_.refuse(faces, "vcount: too few, or not a number");
          count = *next;
        }
        if (count > corners.size() - at) xml_.refuse(*p, "too few corners");
        for (std::size_t i = 2; i < count; ++i)
          triangles_.push_back({points[corners[at]], points[corners[at + i - 1]], points[corners[at + i]]});
        at += count;
        if (triangles_.size() > kMost) xml_.refuse(faces, fmt::format("more than {} triangles", kMost));
      }
    }
  }

  Xml xml_;
  std::vector<Triangle> triangles_;
};

}  // namespace

std::vector<Triangle> parse_stl(Bytes bytes, const std::string& name) {
  constexpr std::size_t kHeader = 84;
  constexpr std::size_t kFacet = 50;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t facets = bytes.size() >= kHeader ? value_at<std::uint32_t>(bytes, 80) : 0;
  // Some binary files begin with "solid", too.
  if (bytes.size() < kHeader || bytes.size() != kHeader + kFacet * facets) {
    if (text.starts_with("solid")) return parse_ascii_stl(bytes, name);
    refuse(name,
           fmt::format("not an STL file: {} facets are announced, {} bytes are there", facets, bytes.size()));
  }
  std::vector<Triangle> triangles;
  triangles.reserve(facets);
  for (std::size_t i = 0; i < facets; ++i) {
    Triangle t;
    for (std::size_t corner = 0; corner < 3; ++corner)
      for (std::size_t axis = 0; axis < 3; ++axis)
        t[corner][static_cast<Eigen::Index>(axis)] =
            static_cast<double>(value_at<float>(bytes, kHeader + kFacet * i + 12 + 12 * corner + 4 * axis));
    if (!is_finite(t[0]) || !is_finite(t[1]) || !is_finite(t[2]))
      refuse(name, fmt::format("facet {}: must have finite corners", i + 1));
    triangles.push_back(t);
  }
  return triangles;
}

std::vector<Triangle> parse_obj(Bytes bytes, const std::string& name) {
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
  WordReader reader(bytes, 0);
  std::string_view line;
  while (reader.next_line(line)) {
    const std::size_t number = reader.line_number();
    const std::string_view kind = WordReader::take_word(line);
    if (kind == "v") points.push_back(point_of(line, number, name));
    if (kind != "f") continue;
    std::vector<std::size_t> corners;
    for (std::string_view word = WordReader::take_word(line); !word.empty();
         word = WordReader::take_word(line)) {
      const auto index = number_of<std::int64_t>(word.substr(0, word.find('/')));
      const auto count = static_cast<std::int64_t>(points.size());
      // Counted from 1, or back from the last with a minus.
      const std::int64_t at = !index ? -1 : *index > 0 ? *index - 1 : count + *index;
      if (!index || *index == 0 || at < 0 || at >= count)
        refuse(name, fmt::format("line {}: '{}' is no corner: there are {}", number, word, count));
      corners.push_back(static_cast<std::size_t>(at));
    }
    if (corners.size() < 3) refuse(name, fmt::format("line {}: a face must have three corners", number));
    for (std::size_t i = 2; i < corners.size(); ++i)
      triangles.push_back({points[corners[0]], points[corners[i - 1]], points[corners[i]]});
  }
  if (triangles.empty()) refuse(name, "not an OBJ file with faces");
  return triangles;
}

std::vector<Triangle> parse_dae(Bytes bytes, const std::string& name) {
  return Collada(bytes, name).triangles();
}

std::vector<Triangle> parse_mesh(Bytes bytes, const std::string& name) {
  std::string end = name.size() < 4 ? name : name.substr(name.size() - 4);
  std::transform(end.begin(), end.end(), end.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  if (end == ".stl") return parse_stl(bytes, name);
  if (end == ".obj") return parse_obj(bytes, name);
  if (end == ".dae") return parse_dae(bytes, name);
  refuse(name, "unknown kind of mesh: must end in .stl, .obj or .dae");
}

std::size_t open_edges(const std::vector<Triangle>& triangles) {
  const auto less = [](const Vector3& a, const Vector3& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::vector<Vector3> points;
  points.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) points.insert(points.end(), t.begin(), t.end());
  std::sort(points.begin(), points.end(), less);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  const auto index_of = [&](const Vector3& p) {
    return static_cast<std::uint32_t>(std::lower_bound(points.begin(), points.end(), p, less) -
                                      points.begin());
  };
  std::vector<std::uint64_t> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    const std::array<std::uint64_t, 3> corner{index_of(t[0]), index_of(t[1]), index_of(t[2])};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t a = corner[i];
      const std::uint64_t b = corner[(i + 1) % 3];
      if (a != b) edges.push_back(std::min(a, b) << 32U | std::max(a, b));
    }
  }
  std::sort(edges.begin(), edges.end());
  std::size_t open = 0;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t k = i;
    while (k < edges.size() && edges[k] == edges[i]) ++k;
    open += (k - i) % 2;
    i = k;
  }
  return open;
}

}  // namespace roborun::sitl
