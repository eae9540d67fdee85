#include "platform/sitl/world/sdf_file.hpp"

#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>

#include "core/geometry/math.hpp"
#include "platform/sitl/world/file_bytes.hpp"
#include "platform/sitl/world/mesh_file.hpp"
#include "platform/sitl/world/xml.hpp"

namespace roborun::sitl {
namespace {

namespace fs = std::filesystem;
using Element = Xml::Element;

constexpr std::size_t kMostShapes = 1'000'000;
constexpr std::size_t kMostTriangles = 20'000'000;
constexpr std::size_t kMostBytes = std::size_t{1} << 30U;
constexpr int kMostIncludes = 1000;
constexpr int kDeepest = 20;  // models in models, included or not

Pose operator*(const Pose& a, const Pose& b) { return {Matrix3(a.R_RT * b.R_RT), a * b.p_RT}; }

class SdfReader {
 public:
  SdfReader(const std::string& path, double scale, SdfWorld& out) : path_(path), scale_(scale), out_(out) {}

  void read(std::span<const unsigned char> bytes) {
    const auto document = std::make_shared<const Xml>(bytes, path_, "sdf");
    const Xml& xml = *document;
    const Element* world = xml.root().FirstChildElement("world");
    if (world == nullptr) {
      if (xml.root().FirstChildElement("model") == nullptr) xml.refuse(xml.root(), "must have a <world>");
      add_all({document, &xml.root(), {}, 0}, {});
      return;
    }
    if (const Element* second = world->NextSiblingElement("world"))
      xml.refuse(*second, "a second world: must be one");
    for (const char* kind : {"actor", "population"})
      if (const Element* e = world->FirstChildElement(kind)) xml.refuse(*e, "is not read: must be models");
    // What the file says of a paused simulation goes for the models' own poses.
    std::map<std::string, Pose> state;
    if (const Element* saved = world->FirstChildElement("state"))
      for (const Element* m = saved->FirstChildElement("model"); m != nullptr;
           m = m->NextSiblingElement("model"))
        if (m->Attribute("name") != nullptr && m->FirstChildElement("pose") != nullptr)
          state.emplace(m->Attribute("name"), pose_of(xml, *m));
    add_all({document, world, {}, 0}, state);
  }

 private:
  /// Something that holds models, and where it is.
  struct Holder {
    std::shared_ptr<const Xml> xml;
    const Element* of;
    Pose X_W;
    int depth;
  };

  [[nodiscard]] Pose pose_of(const Xml& xml, const Element& of) const {
    const Element* element = of.FirstChildElement("pose");
    Pose pose;
    if (element == nullptr || Xml::text(*element).empty()) return pose;
    const char* relative = element->Attribute("relative_to");
    if (relative == nullptr) relative = element->Attribute("frame");
    const std::string_view frame = relative == nullptr ? "" : relative;
    if (!frame.empty() && frame != "world" && frame != "__model__")
      xml.refuse(*element, fmt::format("relative_to: '{}' is not read: must be the element it is in", frame));
    const auto p = xml.numbers<6>(*element);
    const double unit = element->BoolAttribute("degrees", false) ? core::kDegree : 1.0;
    pose.p_RT = scale_ * Vector3(p[0], p[1], p[2]);
    pose.R_RT =
        (Eigen::AngleAxisd(unit * p[5], Vector3::UnitZ()) * Eigen::AngleAxisd(unit * p[4], Vector3::UnitY()) *
         Eigen::AngleAxisd(unit * p[3], Vector3::UnitX()))
            .toRotationMatrix();
    return pose;
  }

  void add_all(const Holder& world, const std::map<std::string, Pose>& state) {
    waiting_.push_back(world);
    while (!waiting_.empty()) {
      const Holder holder = waiting_.back();
      waiting_.pop_back();
      // A saved state is that of the world's own models.
      static const std::map<std::string, Pose> kNone;
      const auto& saved = holder.depth == 0 ? state : kNone;
      const Xml& xml = *holder.xml;
      for (const Element* model = holder.of->FirstChildElement("model"); model != nullptr;
           model = model->NextSiblingElement("model")) {
        const char* name = model->Attribute("name");
        const auto found = name == nullptr ? saved.end() : saved.find(name);
        const Pose X_M = found == saved.end() ? pose_of(xml, *model) : found->second;
        add_model({holder.xml, model, holder.X_W * X_M, holder.depth + 1});
      }
      for (const Element* include = holder.of->FirstChildElement("include"); include != nullptr;
           include = include->NextSiblingElement("include"))
        add_include(holder, *include, saved);
    }
  }

  void add_model(const Holder& model) {
    const Xml& xml = *model.xml;
    if (model.depth > kDeepest)
      xml.refuse(*model.of, fmt::format("more than {} models in each other", kDeepest));
    for (const Element* link = model.of->FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      const Pose X_WL = model.X_W * pose_of(xml, *link);
      for (const Element* c = link->FirstChildElement("collision"); c != nullptr;
           c = c->NextSiblingElement("collision"))
        add_geometry(xml, xml.need(*c, "geometry"), X_WL * pose_of(xml, *c));
    }
    waiting_.push_back(model);
  }

  void add_include(const Holder& holder, const Element& include, const std::map<std::string, Pose>& state) {
    const Xml& xml = *holder.xml;
    const Element& uri = xml.need(include, "uri");
    const std::string name(Xml::text(uri));
    // The two models that nearly every world includes, and that come with Gazebo.
    if (name == "model://sun") return;
    const Element* own_name = include.FirstChildElement("name");
    const auto saved = own_name == nullptr ? state.end() : state.find(std::string(Xml::text(*own_name)));
    Pose X_WM = holder.X_W * (saved == state.end() ? pose_of(xml, include) : saved->second);
    if (name == "model://ground_plane") {
      add_plane(xml, include, {1.0, 1.0, 0.0}, Vector3::UnitZ(), X_WM);
      return;
    }
    if (++includes_ > kMostIncludes)
      xml.refuse(include, fmt::format("more than {} included models", kMostIncludes));
    std::string file = found(xml, uri, name);
    if (fs::is_directory(file)) file += "/model.sdf";
    const auto bytes = read_bytes(file, kMostBytes, "the model.sdf of an included model");
    const auto document = std::make_shared<const Xml>(bytes, file, "sdf");
    const Element& root = document->need(document->root(), "model");
    // An include's own pose goes for that of the model.
    const bool placed = include.FirstChildElement("pose") != nullptr || saved != state.end();
    if (!placed) X_WM = X_WM * pose_of(*document, root);
    add_model({document, &root, X_WM, holder.depth + 1});
  }

  /// A file or folder of the disk for "model://NAME/...", "file://..." or a path.
  [[nodiscard]] std::string found(const Xml& xml, const Element& at, const std::string& uri) const {
    const std::size_t scheme = uri.find("://");
    const std::string name = scheme == std::string::npos ? uri : uri.substr(scheme + 3);
    const fs::path here = fs::path(xml.name()).parent_path();
    const fs::path world = fs::path(path_).parent_path();
    for (const fs::path& folder : {here, world, world / "models", world / ".." / "models", here / ".."}) {
      std::error_code ignored;
      const fs::path candidate = folder / name;
      if (!name.empty() && fs::exists(candidate, ignored)) return candidate.string();
    }
    xml.refuse(
        at, fmt::format("'{}' is not there: must be beside the world file, or in models or ../models", uri));
  }

  [[nodiscard]] double above_zero(const Xml& xml, const Element& of, const char* child) const {
    const Element& element = xml.need(of, child);
    const double value = xml.numbers<1>(element)[0];
    if (!(value > 0.0)) xml.refuse(element, "must be above 0");
    return scale_ * value;
  }

  void add_geometry(const Xml& xml, const Element& geometry, const Pose& X_WG) {
    WorldDescription& shapes = out_.shapes;
    if (shapes.pillars.size() + shapes.boxes.size() + shapes.balls.size() + shapes.turned.size() >
        kMostShapes)
      xml.refuse(geometry, fmt::format("more than {} shapes", kMostShapes));
    const Element* shape = geometry.FirstChildElement();
    if (shape == nullptr) return;
    const std::string_view kind = shape->Name();
    if (kind == "box") {
      const Element& element = xml.need(*shape, "size");
      const auto size = xml.numbers<3>(element);
      const Vector3 half_m = 0.5 * scale_ * Vector3(size[0], size[1], size[2]);
      if (!(half_m.minCoeff() > 0.0)) xml.refuse(element, "must be above 0 on every axis");
      add_box(half_m, X_WG);
    } else if (kind == "cylinder") {
      add_cylinder(above_zero(xml, *shape, "radius"), 0.5 * above_zero(xml, *shape, "length"), X_WG);
    } else if (kind == "sphere") {
      out_.shapes.balls.push_back({X_WG.p_RT, above_zero(xml, *shape, "radius")});
    } else if (kind == "capsule") {
      const double radius_m = above_zero(xml, *shape, "radius");
      const double half_m = 0.5 * above_zero(xml, *shape, "length");
      add_cylinder(radius_m, half_m, X_WG);
      out_.shapes.balls.push_back({X_WG * Vector3(0.0, 0.0, half_m), radius_m});
      out_.shapes.balls.push_back({X_WG * Vector3(0.0, 0.0, -half_m), radius_m});
    } else if (kind == "plane") {
      const Element* normal = shape->FirstChildElement("normal");
      const Element* size = shape->FirstChildElement("size");
      const auto n = normal == nullptr ? std::array<double, 3>{0.0, 0.0, 1.0} : xml.numbers<3>(*normal);
      const auto s = size == nullptr ? std::array<double, 2>{1.0, 1.0} : xml.numbers<2>(*size);
      add_plane(xml, *shape, scale_ * Vector3(s[0], s[1], 0.0), Vector3(n[0], n[1], n[2]), X_WG);
    } else if (kind == "mesh") {
      add_mesh(xml, *shape, X_WG);
    } else if (kind != "empty") {
      xml.refuse(*shape, "is not read: must be box, cylinder, sphere, capsule, plane or mesh");
    }
  }

  void add_box(const Vector3& half_m, const Pose& X) {
    constexpr double kExact = 1e-12;
    const Matrix3 turn = X.R_RT.cwiseAbs();
    // Each axis along one of the world's: every number of the matrix is 0 or 1.
    const bool along = ((turn.array() < kExact) || (turn.array() > 1.0 - kExact)).all();
    const Vector3 half_W = turn * half_m;
    if (along) {
      out_.shapes.boxes.push_back({X.p_RT - half_W, X.p_RT + half_W});
    } else {
      out_.shapes.turned.push_back({X, Aabb{-half_m, half_m}});
    }
  }

  void add_cylinder(double radius_m, double half_m, const Pose& X) {
    constexpr double kUpright = 1.0 - 1e-12;
    if (std::fabs(X.R_RT(2, 2)) > kUpright) {
      out_.shapes.pillars.push_back(
          {X.p_RT.x(), X.p_RT.y(), radius_m, X.p_RT.z() - half_m, X.p_RT.z() + half_m});
    } else {
      out_.shapes.turned.push_back({X, Pillar{0.0, 0.0, radius_m, -half_m, half_m}});
    }
  }

  void add_plane(const Xml& xml, const Element& at, const Vector3& size_m, const Vector3& normal,
                 const Pose& X) {
    const Vector3 n_W = X.R_RT * normal;
    if (!(n_W.z() > (1.0 - 1e-9) * n_W.norm())) xml.refuse(at, "must be horizontal, with its normal up");
    out_.shapes.ground_m = std::max(out_.shapes.ground_m, X.p_RT.z());
    const Vector3 half_m = X.R_RT.cwiseAbs() * (0.5 * size_m);
    out_.planes_W.push_back({X.p_RT - half_m, X.p_RT + half_m});
  }

  void add_mesh(const Xml& xml, const Element& mesh, const Pose& X) {
    if (const Element* sub = mesh.FirstChildElement("submesh"))
      xml.refuse(*sub, "is not read: must be the whole mesh");
    const Element& uri = xml.need(mesh, "uri");
    const std::string file = found(xml, uri, std::string(Xml::text(uri)));
    auto known = meshes_.find(file);
    if (known == meshes_.end()) {
      const auto bytes = read_bytes(file, kMostBytes, "a mesh");
      known = meshes_.emplace(file, parse_mesh(bytes, file)).first;
      const std::size_t open = open_edges(known->second);
      if (open > 0 && out_.open_edges == 0) out_.open_mesh = file;
      out_.open_edges += open;
    }
    Vector3 scale = Vector3::Constant(scale_);
    if (const Element* element = mesh.FirstChildElement("scale")) {
      const auto s = xml.numbers<3>(*element);
      scale = scale_ * Vector3(s[0], s[1], s[2]);
    }
    if (out_.triangles.size() + known->second.size() > kMostTriangles)
      xml.refuse(mesh, fmt::format("more than {} triangles", kMostTriangles));
    for (const Triangle& t : known->second)
      out_.triangles.push_back(
          {X * scale.cwiseProduct(t[0]), X * scale.cwiseProduct(t[1]), X * scale.cwiseProduct(t[2])});
  }

  std::string path_;
  double scale_;
  SdfWorld& out_;
  std::map<std::string, std::vector<Triangle>> meshes_;
  std::vector<Holder> waiting_;
  int includes_{0};
};

}  // namespace

SdfWorld parse_sdf(std::span<const unsigned char> bytes, const std::string& path, double scale) {
  SdfWorld world;
  world.shapes.ground_m = -std::numeric_limits<double>::infinity();
  SdfReader(path, scale, world).read(bytes);
  return world;
}

}  // namespace roborun::sitl
