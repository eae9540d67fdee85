#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "core/geometry/math.hpp"
#include "platform/input/input_error.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::sitl {
namespace {

template <typename T>
void put(std::string& to, T value) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  to.append(raw.data(), raw.size());
}

template <typename T>
void put_at(std::string& to, std::size_t at, T value) {
  std::memcpy(to.data() + at, &value, sizeof(T));
}

/// A floor of points every 0.1 m from (0, 0, 0) to (8, 4, 0), and a post of points at (4, 2) up to 3 m.
std::vector<Vector3> hall() {
  std::vector<Vector3> points;
  for (int x = 0; x <= 80; ++x)
    for (int y = 0; y <= 40; ++y) points.emplace_back(0.1 * x, 0.1 * y, 0.05);
  for (int z = 0; z <= 30; ++z) points.emplace_back(4.05, 2.05, 0.1 * z + 0.05);
  return points;
}

class ForeignWorld : public testing::Test {
 protected:
  static World load(const std::string& name, const std::string& bytes, WorldOptions options) {
    return load_world(test::scratch_file(name, bytes), options);
  }
  static std::string complaint(const std::string& name, const std::string& bytes,
                               const WorldOptions& options) {
    try {
      (void)load(name, bytes, options);
      return {};
    } catch (const InputError& error) {
      return error.what();
    }
  }
  static WorldOptions ends(const Vector3& start_W, const Vector3& goal_W) {
    WorldOptions options;
    options.start_W = start_W;
    options.goal_W = goal_W;
    return options;
  }
  /// What the hall must be, whatever file it came from: 0.1 m cells.
  static void expect_hall(const World& world) {
    EXPECT_NEAR(world.hit_distance_m({1.0, 2.05, 1.5}, Vector3::UnitX(), 50.0), 3.0, 1e-6);
    EXPECT_NEAR(world.clearance_m({3.0, 2.05, 1.5}, 3.0), 1.0, 1e-6);
    EXPECT_NEAR(world.ground_below_m(world.start_W()), 0.1, 1e-6);
  }
  WorldOptions hall_options() const {
    WorldOptions options = ends({1.0, 2.05, 1.5}, {7.0, 2.05, 1.5});
    options.cell_m = 0.1;
    return options;
  }
};

std::string sdf(const std::string& models) {
  return "<?xml version='1.0'?>\n<sdf version='1.7'><world name='w'>\n"
         "<model name='ground'><link name='l'><collision name='c'><geometry><plane><normal>0 0 1</normal>"
         "<size>40 20</size></plane></geometry></collision></link></model>\n" +
         models + "</world></sdf>\n";
}

std::string collision(const std::string& shape, const std::string& pose = "") {
  return "<collision name='c'>" + (pose.empty() ? "" : "<pose>" + pose + "</pose>") + "<geometry>" + shape +
         "</geometry></collision>";
}

TEST_F(ForeignWorld, SdfShapesStayExactThroughNestedPoses) {
  const std::string models =
      "<model name='a'><pose>10 0 0 0 0 1.5707963267948966</pose><link name='l'><pose>2 0 1 0 0 0</pose>" +
      collision("<cylinder><radius>0.5</radius><length>2</length></cylinder>") +
      collision("<box><size>4 1 2</size></box>", "3 0 0 0 0 0") +
      "</link>"
      "<model name='inner'><pose>-4 0 3 0 0 0</pose><link name='l'>" +
      collision("<sphere><radius>1</radius></sphere>") + "</link></model></model>\n";
  const World world = load("shapes.world", sdf(models), ends({-5, -5, 2}, {-5, 5, 2}));
  // The model's x is the world's y: link at (10, 2, 1), box 3 m further, sphere at (10, -4, 3).
  ASSERT_EQ(world.pillars().size(), 1U);
  EXPECT_NEAR(world.pillars()[0].x_m, 10.0, 1e-9);
  EXPECT_NEAR(world.pillars()[0].y_m, 2.0, 1e-9);
  EXPECT_NEAR(world.pillars()[0].bottom_m, 0.0, 1e-9);
  EXPECT_NEAR(world.pillars()[0].top_m, 2.0, 1e-9);
  ASSERT_EQ(world.boxes().size(), 1U);
  EXPECT_TRUE(world.boxes()[0].min_W.isApprox(Vector3(9.5, 3.0, 0.0), 1e-9) ||
              world.boxes()[0].min_W.z() < 1e-9);
  EXPECT_NEAR(world.boxes()[0].min_W.y(), 3.0, 1e-9);
  EXPECT_NEAR(world.boxes()[0].max_W.y(), 7.0, 1e-9);
  EXPECT_NEAR(world.boxes()[0].size().x(), 1.0, 1e-9);
  ASSERT_EQ(world.balls().size(), 1U);
  EXPECT_TRUE(world.balls()[0].center_W.isApprox(Vector3(10, -4, 3), 1e-9));
  EXPECT_NEAR(world.clearance_m({10, -4, 5.0}, 3.0), 1.0, 1e-9);
  EXPECT_EQ(world.ground_m(), 0.0);
}

TEST_F(ForeignWorld, SdfTurnedShapesAreExactToo) {
  const std::string models = "<model name='a'><pose>10 0 2 0 0 0.7853981633974483</pose><link name='l'>" +
                             collision("<box><size>2 2 2</size></box>") + "</link></model>" +
                             "<model name='b'><pose>0 8 2 0 1.5707963267948966 0</pose><link name='l'>" +
                             collision("<cylinder><radius>0.5</radius><length>6</length></cylinder>") +
                             "</link></model>\n";
  const World world = load("turned.sdf", sdf(models), ends({-5, -5, 2}, {-5, 5, 2}));
  ASSERT_EQ(world.turned().size(), 2U);
  // The corner of the box is sqrt(2) from its middle; the lying cylinder reaches from x = -3 to 3.
  EXPECT_NEAR(world.hit_distance_m({5, 0, 2}, Vector3::UnitX(), 50.0), 5.0 - std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(world.clearance_m({10, -2.0, 2}, 3.0), 2.0 - std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(world.clearance_m({-4, 8, 2}, 3.0), 1.0, 1e-9);
  EXPECT_NEAR(world.clearance_m({2, 8, 3}, 3.0), 0.5, 1e-9);
}

TEST_F(ForeignWorld, SdfStateGoesForThePoses) {
  const std::string models = "<model name='a'><pose>10 0 1 0 0 0</pose><link name='l'>" +
                             collision("<sphere><radius>1</radius></sphere>") +
                             "</link></model><state world_name='w'><model name='a'><pose>5 5 1 0 0 0</pose>"
                             "</model></state>\n";
  const World world = load("state.world", sdf(models), ends({-5, -5, 1}, {-5, 5, 1}));
  EXPECT_TRUE(world.balls()[0].center_W.isApprox(Vector3(5, 5, 1), 1e-9));
}

/// A cube of side 2 about the origin as text of an OBJ file; `faces` fewer leaves it open.
std::string cube_obj(int faces = 6) {
  std::string text = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n";
  const char* const face[] = {"f 4 3 2 1\n", "f 5 6 7 8\n", "f 1 2 6 5\n",
                              "f 2 3 7 6\n", "f 3 4 8 7\n", "f -8 -4 -1 -5\n"};
  for (int i = 0; i < faces; ++i) text += face[i];
  return text;
}

TEST_F(ForeignWorld, SdfMeshesAreReadBesideTheFile) {
  (void)test::scratch_file("cube.obj", cube_obj());
  const std::string models = "<model name='a'><pose>10 0 2 0 0 0</pose><link name='l'>" +
                             collision("<mesh><uri>cube.obj</uri><scale>1 2 1</scale></mesh>") +
                             "</link></model>\n";
  const World world = load("mesh.world", sdf(models), ends({-5, -5, 2}, {-5, 5, 2}));
  EXPECT_EQ(world.mesh().triangles().size(), 12U);
  EXPECT_NEAR(world.hit_distance_m({0, 0.3, 2.1}, Vector3::UnitX(), 50.0), 9.0, 1e-9);
  EXPECT_NEAR(world.clearance_m({10, 3.0, 2}, 3.0), 1.0, 1e-9);
}

TEST_F(ForeignWorld, SdfIncludesModelsThatAreThereAndNoneInThemselves) {
  std::filesystem::create_directories(test::scratch_folder() / "models" / "post");
  (void)test::scratch_file("models/post/model.sdf",
                           "<sdf version='1.6'><model name='post'><pose>0 0 1 0 0 0</pose><link name='l'>" +
                               collision("<cylinder><radius>0.2</radius><length>2</length></cylinder>") +
                               "</link></model></sdf>");
  const std::string ground =
      "<include><uri>model://ground_plane</uri></include><include><uri>model://sun</uri></include>";
  const auto at = [](const std::string& pose) {
    return "<include><uri>model://post</uri>" + (pose.empty() ? "" : "<pose>" + pose + "</pose>") +
           "</include>";
  };
  const World world =
      load("included.world",
           "<sdf version='1.6'><world name='w'>" + ground + at("") + at("4 2 1.5 0 0 0") + "</world></sdf>",
           ends({-5, -5, 2}, {-5, 5, 2}));
  ASSERT_EQ(world.pillars().size(), 2U);
  EXPECT_NEAR(world.pillars()[0].top_m, 2.0, 1e-9) << "the model's own pose";
  EXPECT_NEAR(world.pillars()[1].top_m, 2.5, 1e-9) << "that of the include goes for it";
  EXPECT_NEAR(world.pillars()[1].x_m, 4.0, 1e-9);

  std::filesystem::create_directories(test::scratch_folder() / "models" / "loop");
  (void)test::scratch_file("models/loop/model.sdf",
                           "<sdf version='1.6'><model name='loop'><include><uri>model://loop</uri></include>"
                           "<include><uri>model://loop</uri></include></model></sdf>");
  EXPECT_NE(complaint("loop.world",
                      "<sdf version='1.6'><world name='w'>" + ground +
                          "<include><uri>model://loop</uri></include></world></sdf>",
                      ends({-5, -5, 2}, {-5, 5, 2}))
                .find("more than"),
            std::string::npos);
}

TEST_F(ForeignWorld, MeshesOfAllKindsAreTheSameCube) {
  WorldOptions options = ends({-3, 0, 3}, {3, 0, 3});
  options.ground_m = -1.0;
  const auto expect_cube = [](const World& world) {
    EXPECT_NEAR(world.hit_distance_m({-4, 0.3, 0.1}, Vector3::UnitX(), 50.0), 3.0, 1e-6);
    EXPECT_NEAR(world.clearance_m({0, 0, 2.5}, 3.0), 1.5, 1e-6);
  };
  expect_cube(load("cube.obj", cube_obj(), options));

  // Binary STL from the same triangles, and its ascii form.
  const World cube = load("cube.obj", cube_obj(), options);
  std::string stl(80, ' ');
  std::string text = "solid cube\n";
  put(stl, static_cast<std::uint32_t>(cube.mesh().triangles().size()));
  for (const Triangle& t : cube.mesh().triangles()) {
    for (int i = 0; i < 3; ++i) put(stl, 0.0F);
    text += "facet normal 0 0 0\nouter loop\n";
    for (const Vector3& p : t) {
      for (int i = 0; i < 3; ++i) put(stl, static_cast<float>(p[i]));
      text += fmt::format("vertex {} {} {}\n", p.x(), p.y(), p.z());
    }
    put(stl, std::uint16_t{0});
    text += "endloop\nendfacet\n";
  }
  expect_cube(load("cube.stl", stl, options));
  expect_cube(load("ascii.stl", text + "endsolid\n", options));
  EXPECT_NE(complaint("short.stl", stl.substr(0, stl.size() - 1), options).find("not an STL file"),
            std::string::npos);

  // PLY with faces, big-endian would be the same reader; ascii here.
  expect_cube(
      load("cube.ply",
           "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
           "-1 -1 -1\n1 -1 -1\n1 1 -1\n-1 1 -1\n-1 -1 1\n1 -1 1\n1 1 1\n-1 1 1\n"
           "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 0 4 7 3\n",
           options));

  // COLLADA: y up, in centimetres, the geometry moved by a node there and back.
  const std::string dae =
      "<?xml version='1.0'?>\n<COLLADA><asset><unit meter='0.01'/><up_axis>Y_UP</up_axis></asset>"
      "<library_geometries><geometry id='g'><mesh><source id='p'><float_array id='a' count='24'>"
      "-100 -100 -100 100 -100 -100 100 100 -100 -100 100 -100 -100 -100 100 100 -100 100 100 100 100 -100 "
      "100 100"
      "</float_array></source><vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
      "<polylist count='6'><input semantic='VERTEX' source='#v' offset='0'/><vcount>4 4 4 4 4 4</vcount>"
      "<p>3 2 1 0 4 5 6 7 0 1 5 4 1 2 6 5 2 3 7 6 0 4 7 "
      "3</p></polylist></mesh></geometry></library_geometries>"
      "<library_visual_scenes><visual_scene><node><translate>50 0 0</translate><node>"
      "<matrix>1 0 0 -50 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url='#g'/></node></node>"
      "</visual_scene></library_visual_scenes></COLLADA>";
  expect_cube(load("cube.dae", dae, options));
}

TEST_F(ForeignWorld, AMeshThatIsNotClosedIsRefusedUnlessSurfacesDo) {
  WorldOptions options = ends({-3, 0, 3}, {3, 0, 3});
  options.ground_m = -1.0;
  EXPECT_NE(complaint("open.obj", cube_obj(5), options).find("not closed (4 open edges)"), std::string::npos);
  options.surfaces = true;
  EXPECT_EQ(complaint("open.obj", cube_obj(5), options), "");
}

// ---- clouds ----

std::string pcd_header(std::size_t points, const std::string& data) {
  return fmt::format(
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z i\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1\n"
      "WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA {1}\n",
      points, data);
}

std::string ascii_pcd(const std::vector<Vector3>& points) {
  std::string text = pcd_header(points.size(), "ascii");
  for (const Vector3& p : points) text += fmt::format("{} {} {} 7\n", p.x(), p.y(), p.z());
  return text;
}

/// Runs of one byte as copies, the rest as literals.
std::string lzf(const std::string& in) {
  std::string out;
  for (std::size_t i = 0; i < in.size();) {
    std::size_t run = 0;
    while (i > 0 && i + run < in.size() && run < 8 && in[i + run] == in[i - 1]) ++run;
    if (run >= 3) {
      out += static_cast<char>((run - 2) << 5U);
      out += '\0';
      i += run;
    } else {
      out += '\0';
      out += in[i++];
    }
  }
  return out;
}

TEST_F(ForeignWorld, PcdOfAllEncodingsIsTheSameHall) {
  const auto points = hall();
  expect_hall(load("hall.pcd", ascii_pcd(points), hall_options()));

  std::string binary = pcd_header(points.size(), "binary");
  for (const Vector3& p : points) {
    for (int i = 0; i < 3; ++i) put(binary, static_cast<float>(p[i]));
    binary += 'i';
  }
  expect_hall(load("binary.pcd", binary, hall_options()));
  EXPECT_NE(complaint("cut.pcd", binary.substr(0, binary.size() - 1), hall_options()).find("truncated"),
            std::string::npos);

  std::string fields;
  for (int i = 0; i < 3; ++i)
    for (const Vector3& p : points) put(fields, static_cast<float>(p[i]));
  fields += std::string(points.size(), 'i');
  const std::string packed = lzf(fields);
  std::string compressed = pcd_header(points.size(), "binary_compressed");
  put(compressed, static_cast<std::uint32_t>(packed.size()));
  put(compressed, static_cast<std::uint32_t>(fields.size()));
  expect_hall(load("compressed.pcd", compressed + packed, hall_options()));
  EXPECT_NE(complaint("cut.pcd", compressed + packed.substr(0, packed.size() - 9), hall_options()), "");
  std::string damaged = packed;
  damaged[0] = '\x7F';
  EXPECT_NE(complaint("damaged.pcd", compressed + damaged, hall_options()).find("damaged"),
            std::string::npos);
}

TEST_F(ForeignWorld, PlyOfEitherByteOrderIsTheSameHall) {
  const auto points = hall();
  for (const bool big : {false, true}) {
    std::string text = fmt::format(
        "ply\nformat binary_{}_endian 1.0\nelement vertex {}\nproperty double x\n"
        "property double y\nproperty double z\nproperty uchar red\nend_header\n",
        big ? "big" : "little", points.size());
    for (const Vector3& p : points) {
      for (int i = 0; i < 3; ++i) {
        std::string number;
        put(number, p[i]);
        if (big) std::reverse(number.begin(), number.end());
        text += number;
      }
      text += 'r';
    }
    expect_hall(load("hall.ply", text, hall_options()));
    EXPECT_NE(complaint("cut.ply", text.substr(0, text.size() - 2), hall_options()).find("truncated"),
              std::string::npos);
  }
}

/// LAS 1.4, format 6, of points counted from `offset`.
std::string las(const std::vector<Vector3>& points, const Vector3& offset) {
  std::string bytes(375, '\0');
  bytes.replace(0, 4, "LASF");
  bytes[24] = 1;
  bytes[25] = 4;
  put_at(bytes, 94, std::uint16_t{375});
  put_at(bytes, 96, std::uint32_t{375});
  bytes[104] = 6;
  put_at(bytes, 105, std::uint16_t{30});
  put_at(bytes, 247, static_cast<std::uint64_t>(points.size()));
  for (std::size_t i = 0; i < 3; ++i) {
    put_at(bytes, 131 + 8 * i, 0.001);
    put_at(bytes, 155 + 8 * i, offset[static_cast<Eigen::Index>(i)]);
  }
  for (const Vector3& p : points) {
    for (int i = 0; i < 3; ++i) put(bytes, static_cast<std::int32_t>(std::lround(p[i] / 0.001)));
    bytes += std::string(18, '\0');
  }
  return bytes;
}

TEST_F(ForeignWorld, LasIsTheSameHallAndNationalGridsAreCountedFromTheirLowestCorner) {
  expect_hall(load("hall.las", las(hall(), Vector3::Zero()), hall_options()));
  // The lowest corner is (0, 0, 0.05): everything is 5 cm lower.
  const World far = load("far.las", las(hall(), {512000.0, 5400000.0, 240.0}), hall_options());
  EXPECT_NEAR(far.hit_distance_m({1.0, 2.05, 1.5}, Vector3::UnitX(), 50.0), 3.0, 1e-6);
  std::string zipped = las(hall(), Vector3::Zero());
  zipped[104] = static_cast<char>(0x86);
  EXPECT_NE(complaint("zipped.las", zipped, hall_options()).find("LAZ"), std::string::npos);
}

TEST_F(ForeignWorld, ScaleAndBoundsGoForAll) {
  WorldOptions options = hall_options();
  options.start_W = Vector3(2.0, 4.1, 3.0);
  options.goal_W = Vector3(14.0, 4.1, 3.0);
  options.cell_m = 0.2;
  options.scale = 2.0;
  options.bounds_W = Aabb{{0, 0, 1}, {16, 8, 5}};
  const World world = load("hall.pcd", ascii_pcd(hall()), options);
  EXPECT_NEAR(world.hit_distance_m({2.0, 4.1, 3.0}, Vector3::UnitX(), 50.0), 6.0, 1e-6);
  EXPECT_EQ(world.bounds_W().max_W, Vector3(16, 8, 5));
}

TEST_F(ForeignWorld, BadInputIsOneLine) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::string all_nan = pcd_header(9, "binary");
  for (int i = 0; i < 9; ++i) {
    for (int k = 0; k < 3; ++k) put(all_nan, nan);
    all_nan += 'i';
  }
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  const std::string ball = "<model name='a'><pose>10 0 2 0 0 0</pose><link name='l'>" +
                           collision("<sphere><radius>1</radius></sphere>") + "</link></model>";
  const WorldOptions ok = ends({-5, -5, 2}, {-5, 5, 2});
  const auto with = [&](auto&& change) {
    WorldOptions options = ok;
    change(options);
    return options;
  };
  struct Case {
    std::string name, bytes;
    WorldOptions options;
    std::string says;
  };
  const Case cases[] = {
      {"a.pcd", all_nan, hall_options(), "no finite point"},
      {"a.ply", ascii_pcd(hall()), hall_options(), "holds PCD, not .ply"},
      {"a.pcd", las(hall(), Vector3::Zero()), hall_options(), "holds LAS, not .pcd"},
      {"a.bt", sdf(ball), ok, "holds SDF, not .bt"},
      {"a.toml", sdf(ball), ok, "holds SDF, not .toml"},
      {"a.world", "ply\nformat ascii 1.0\n", ok, "holds PLY, not .world"},
      {"a.las", "[world]\n", ok, "must begin with LASF"},
      {"a.world", "[world]\nbounds = 1\n", ok, "not valid XML"},
      {"a.world", "<?xml version='1.0'?><html/>", ok, "must have <sdf> as its root"},
      {"a.world", "<sdf>" + deep, ok, "not valid XML"},
      {"a.world", sdf(ball).substr(0, 300), ok, "not valid XML"},
      {"a.world",
       "<!DOCTYPE x [<!ENTITY a 'aaaa'><!ENTITY b '&a;&a;'>]><sdf version='1.6'><world name='&b;'/></sdf>",
       ok, ""},
      {"a.world",
       sdf("<model name='a'><link name='l'>" + collision("<sphere><radius>nan</radius></sphere>") +
           "</link></model>"),
       ok, "must be 1 finite number"},
      {"a.world",
       sdf("<model name='a'><link name='l'>" + collision("<sphere><radius>-1</radius></sphere>") +
           "</link></model>"),
       ok, "must be above 0"},
      {"a.world", sdf("<model name='a'><link name='l'>" + collision("<heightmap/>") + "</link></model>"), ok,
       "<heightmap>: is not read"},
      {"a.world",
       sdf("<model name='a'><link name='l'>" + collision("<mesh><uri>no.stl</uri></mesh>") +
           "</link></model>"),
       ok, "'no.stl' is not there"},
      {"a.world", sdf(ball + "<actor name='x'/>"), ok, "<actor>: is not read"},
      {"a.world", sdf(ball), ends({10, 0, 2.5}, {-5, 5, 2}),
       "start (10.00, 0.00, 2.50) is closer than 0.6 m"},
      {"a.world", sdf(ball), ends({-5, -5, 2}, {10, 1.5, 2}),
       "goal (10.00, 1.50, 2.00) is closer than 0.6 m"},
      {"a.world", sdf(ball), with([](WorldOptions& o) {
         o.bounds_W = Aabb{{0, 0, 1}, {9, 9, 9}};
       }),
       "is outside the bounds"},
      {"a.world", sdf(ball), with([](WorldOptions& o) { o.cell_m = 0.1; }), "--cell goes with point clouds"},
      {"a.pcd", ascii_pcd(hall()), with([](WorldOptions& o) { o.cell_m = 1e-9; }), "--cell"},
      {"a.pcd", ascii_pcd({{1, 1, 1}, {2, 2, 3}, {3, 3, 9}}), ends({1, 3, 4}, {1, 3, 5}),
       "no ground below the start"},
      {"a.pcd", ascii_pcd({{0, 0, 0}, {15e3, 15e3, 15e3}}), ends({1, 3, 4}, {1, 3, 5}),
       "must be at most 4e+09"},
      {"a.pcd", pcd_header(std::size_t{1} << 60U, "binary") + "xyz", hall_options(), "truncated"},
      {"a.pcd", pcd_header(std::size_t{1} << 60U, "ascii") + "1 2 3 4\n", hall_options(), "truncated: 1 of"},
      {"a.ply",
       "ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nproperty float y\n"
       "property float z\nend_header\n1 2 3\n",
       hall_options(), "truncated"},
      {"a.ply", "ply\nformat ascii 1.0\nelement vertex 99999999999\nend_header\n", hall_options(),
       "must have a property"},
      {"a.ply",
       "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int vertex_indices\n"
       "end_header\n\xFF\xFF\xFF\xFF",
       hall_options(), "truncated"},
      {"a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n", ok, "line 3: '9' is no corner"},
      {"a.obj", "hello\n", ok, "not an OBJ file"},
      {"a.las", "LASF" + std::string(400, '\xFF'), ok, "only 1.0 to 1.4"},
      {"a.dae",
       "<COLLADA><library_visual_scenes><visual_scene><node><instance_geometry url='#x'/></node>"
       "</visual_scene></library_visual_scenes></COLLADA>",
       ok, "no geometry 'x'"},
      {"a.xyz", "1 2 3\n", ok, "must end in .toml, .bt or .ot"},
  };
  for (const Case& c : cases) {
    const std::string line = complaint(c.name, c.bytes, c.options);
    EXPECT_NE(line, "") << c.name << " is taken; should say " << c.says;
    EXPECT_NE(line.find(c.says), std::string::npos)
        << c.name << ": '" << line << "' does not say '" << c.says << "'";
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

TEST_F(ForeignWorld, EveryCutOfAFileIsRefusedOrRead) {
  // No cut crashes, hangs, or ends in anything but an InputError.
  const std::string files[] = {ascii_pcd({{0, 0, 0}, {4, 4, 4}}),
                               las({{0, 0, 0}, {4, 4, 4}}, Vector3::Zero()), cube_obj(),
                               sdf("<model name='a'><link name='l'>" +
                                   collision("<sphere><radius>1</radius></sphere>") + "</link></model>")};
  const char* const names[] = {"cut.pcd", "cut.las", "cut.obj", "cut.world"};
  int refused = 0;
  for (std::size_t i = 0; i < std::size(files); ++i)
    for (std::size_t size = 0; size < files[i].size(); size += 3)
      refused += complaint(names[i], files[i].substr(0, size), ends({-5, -5, 2}, {-5, 5, 2})).empty() ? 0 : 1;
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace roborun::sitl
