#include "platform/sitl/world/cloud_file.hpp"

#include <cmath>
#include <cstdint>

#include "platform/sitl/world/byte_reader.hpp"
#include "platform/sitl/world/file_bytes.hpp"

namespace roborun::sitl {
namespace {

using Bytes = std::span<const unsigned char>;

/// A number type of PCD or PLY.
struct NumberType {
  char kind{};  ///< 'I' signed, 'U' unsigned, 'F' floating
  std::size_t bytes{};
};

double read_number(Bytes bytes, std::size_t at, NumberType type, bool swapped) {
  const auto as = [&]<typename T>(T) { return static_cast<double>(value_at<T>(bytes, at, swapped)); };
  if (type.kind == 'F') return type.bytes == 4 ? as(float{}) : as(double{});
  if (type.kind == 'I') switch (type.bytes) {
      case 1:
        return as(std::int8_t{});
      case 2:
        return as(std::int16_t{});
      case 4:
        return as(std::int32_t{});
      default:
        return as(std::int64_t{});
    }
  switch (type.bytes) {
    case 1:
      return as(std::uint8_t{});
    case 2:
      return as(std::uint16_t{});
    case 4:
      return as(std::uint32_t{});
    default:
      return as(std::uint64_t{});
  }
}

void add_if_finite(const Vector3& p, Geometry& to) {
  if (is_finite(p)) to.points.push_back(p);
}

// ---- PCD ----

struct PcdField {
  std::string name;
  NumberType type;
  std::size_t count{1};
  std::size_t offset{};  ///< In a record, bytes; ascii: words.
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::size_t points{};
  std::string encoding;
  std::size_t data{};
  std::size_t line{};
  std::array<std::size_t, 3> xyz{};  ///< Which fields.
  std::size_t record{};              ///< Bytes, ascii: words.
};

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::string_view word = WordReader::take_word(line); !word.empty(); word = WordReader::take_word(line))
    words.push_back(word);
  return words;
}

void read_pcd_line(const std::vector<std::string_view>& words, PcdHeader& header, const std::string& name) {
  const std::string_view key = words[0];
  const auto whole = [&](std::size_t i) {
    const auto value = number_of<std::uint64_t>(words[i]);
    if (!value) refuse(name, fmt::format("PCD header: {}: '{}' must be a whole number", key, words[i]));
    return static_cast<std::size_t>(*value);
  };
  const auto one_a_field = [&] {
    if (header.fields.empty() || words.size() != header.fields.size() + 1)
      refuse(name, fmt::format("PCD header: {}: must have one value per field", key));
  };
  if (key == "FIELDS") {
    for (std::size_t i = 1; i < words.size(); ++i) header.fields.push_back({std::string(words[i]), {'F', 4}});
  } else if (key == "SIZE") {
    one_a_field();
    for (std::size_t i = 1; i < words.size(); ++i) header.fields[i - 1].type.bytes = whole(i);
  } else if (key == "TYPE") {
    one_a_field();
    for (std::size_t i = 1; i < words.size(); ++i) header.fields[i - 1].type.kind = words[i][0];
  } else if (key == "COUNT") {
    one_a_field();
    for (std::size_t i = 1; i < words.size(); ++i) header.fields[i - 1].count = whole(i);
  } else if (key == "POINTS" && words.size() == 2) {
    header.points = whole(1);
  } else if (key == "DATA" && words.size() == 2) {
    header.encoding = words[1];
  }
}

PcdHeader read_pcd_header(Bytes bytes, const std::string& name) {
  PcdHeader header;
  WordReader reader(bytes, 0);
  std::string_view line;
  constexpr std::size_t kMostLines = 100;
  while (header.encoding.empty()) {
    if (reader.line_number() > kMostLines || !reader.next_line(line) || line.size() > 10000)
      refuse(name, "truncated PCD header: must hold FIELDS, SIZE, TYPE, COUNT, POINTS and DATA");
    const auto words = words_of(line);
    if (!words.empty() && words[0].front() != '#') read_pcd_line(words, header, name);
  }
  header.data = std::min(reader.at(), bytes.size());
  header.line = reader.line_number();
  const bool ascii = header.encoding == "ascii";
  if (!ascii && header.encoding != "binary" && header.encoding != "binary_compressed")
    refuse(name,
           fmt::format("PCD header: DATA: '{}' must be ascii, binary or binary_compressed", header.encoding));
  std::array<bool, 3> found{};
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    PcdField& field = header.fields[i];
    const auto [kind, size] = field.type;
    const bool known =
        kind == 'F' ? size == 4 || size == 8
                    : (kind == 'I' || kind == 'U') && (size == 1 || size == 2 || size == 4 || size == 8);
    if (!known || field.count == 0 || field.count > 100000)
      refuse(name,
             fmt::format("PCD header: field '{}': must have TYPE F, I or U, SIZE 1 to 8 and COUNT from 1",
                         field.name));
    field.offset = header.record;
    header.record += ascii ? field.count : field.count * size;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (field.name != std::string_view("xyz").substr(axis, 1)) continue;
      header.xyz[axis] = i;
      found[axis] = true;
    }
  }
  if (!(found[0] && found[1] && found[2])) refuse(name, "PCD header: FIELDS: must have x, y and z");
  return header;
}

void need_points(std::size_t there, std::size_t record, std::uint64_t points, const std::string& name) {
  if (points > there / record)
    refuse(name, fmt::format("truncated: {} points of {} bytes are announced, {} bytes are there", points,
                             record, there));
}

/// LZF, as PCL writes it: runs of literals, and copies from at most 8 KiB back.
std::vector<unsigned char> decompress(Bytes in, std::size_t size, const std::string& name) {
  std::vector<unsigned char> out;
  out.reserve(size);
  std::size_t at = 0;
  const auto broken = [&] { refuse(name, "binary_compressed data is damaged"); };
  while (at < in.size()) {
    const std::size_t control = in[at++];
    if (control < 32) {
      const std::size_t count = control + 1;
      if (in.size() - at < count || size - out.size() < count) broken();
      out.insert(out.end(), in.begin() + static_cast<std::ptrdiff_t>(at),
                 in.begin() + static_cast<std::ptrdiff_t>(at + count));
      at += count;
      continue;
    }
    std::size_t count = control >> 5U;
    if (count == 7) {
      if (at >= in.size()) broken();
      count += in[at++];
    }
    count += 2;
    if (at >= in.size()) broken();
    const std::size_t back = ((control & 31U) << 8U) + in[at++] + 1;
    if (back > out.size() || size - out.size() < count) broken();
    for (std::size_t i = 0; i < count; ++i) out.push_back(out[out.size() - back]);
  }
  if (out.size() != size) broken();
  return out;
}

// ---- PLY ----

struct PlyProperty {
  std::string name;
  NumberType type;
  std::optional<NumberType> count;  ///< Of a list.
};

struct PlyElement {
  std::string name;
  std::uint64_t count{};
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  bool ascii{};
  bool swapped{};
  std::vector<PlyElement> elements;
};

std::optional<NumberType> ply_type(std::string_view word) {
  if (word == "char" || word == "int8") return NumberType{'I', 1};
  if (word == "uchar" || word == "uint8") return NumberType{'U', 1};
  if (word == "short" || word == "int16") return NumberType{'I', 2};
  if (word == "ushort" || word == "uint16") return NumberType{'U', 2};
  if (word == "int" || word == "int32") return NumberType{'I', 4};
  if (word == "uint" || word == "uint32") return NumberType{'U', 4};
  if (word == "float" || word == "float32") return NumberType{'F', 4};
  if (word == "double" || word == "float64") return NumberType{'F', 8};
  return std::nullopt;
}

/// A line of the header; false: it is not one.
bool read_ply_line(const std::vector<std::string_view>& words, PlyHeader& header) {
  if (words.empty() || words[0] == "comment" || words[0] == "obj_info") return true;
  if (words[0] == "format" && words.size() == 3) {
    header.ascii = words[1] == "ascii";
    header.swapped = words[1] == "binary_big_endian";
    return header.ascii || header.swapped || words[1] == "binary_little_endian";
  }
  if (words[0] == "element" && words.size() == 3) {
    const auto count = number_of<std::uint64_t>(words[2]);
    if (count) header.elements.push_back({std::string(words[1]), *count, {}});
    return count.has_value();
  }
  if (words[0] != "property" || header.elements.empty()) return false;
  if (words.size() == 5 && words[1] == "list") {
    const auto count = ply_type(words[2]);
    const auto type = ply_type(words[3]);
    if (!count || !type || count->kind == 'F') return false;
    header.elements.back().properties.push_back({std::string(words[4]), *type, count});
    return true;
  }
  const auto type = words.size() == 3 ? ply_type(words[1]) : std::nullopt;
  if (type) header.elements.back().properties.push_back({std::string(words[2]), *type, std::nullopt});
  return type.has_value();
}

/// Values of a PLY file's data, one after the other, whatever their encoding.
class PlyValues {
 public:
  PlyValues(Bytes bytes, std::size_t data, const PlyHeader& header, const std::string& name)
      : bytes_(bytes), words_(bytes, data), at_(data), header_(header), name_(name) {}

  double next(NumberType type) {
    if (header_.ascii) {
      const auto value = number_of<double>(words_.next_word());
      if (!value) refuse(name_, "truncated, or a value that is no number");
      return *value;
    }
    if (bytes_.size() - at_ < type.bytes) refuse(name_, fmt::format("truncated at byte {}", bytes_.size()));
    const double value = read_number(bytes_, at_, type, header_.swapped);
    at_ += type.bytes;
    return value;
  }

 private:
  Bytes bytes_;
  WordReader words_;
  std::size_t at_;
  const PlyHeader& header_;
  const std::string& name_;
};

void read_vertices(const PlyElement& element, PlyValues& values, std::vector<Vector3>& vertices,
                   const std::string& name) {
  std::array<std::size_t, 3> xyz{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto found =
        std::find_if(element.properties.begin(), element.properties.end(), [axis](const PlyProperty& p) {
          return p.name == std::string_view("xyz").substr(axis, 1) && !p.count;
        });
    if (found == element.properties.end()) refuse(name, "PLY header: vertex: must have x, y and z");
    xyz[axis] = static_cast<std::size_t>(found - element.properties.begin());
  }
  for (std::uint64_t n = 0; n < element.count; ++n) {
    Vector3 p = Vector3::Zero();
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      const double count = property.count ? values.next(*property.count) : 1.0;
      for (double k = 0.0; k < count; ++k) {
        const double value = values.next(property.type);
        for (std::size_t axis = 0; axis < 3; ++axis)
          if (xyz[axis] == i) p[static_cast<Eigen::Index>(axis)] = value;
      }
    }
    vertices.push_back(p);
  }
}

void read_faces(const PlyElement& element, PlyValues& values, const std::vector<Vector3>& vertices,
                std::vector<Triangle>& triangles, const std::string& name) {
  const auto corner = [&](double index) -> const Vector3& {
    if (!(index >= 0.0 && index < static_cast<double>(vertices.size())))
      refuse(name, fmt::format("a face has corner {}, of {} vertices", index, vertices.size()));
    return vertices[static_cast<std::size_t>(index)];
  };
  for (std::uint64_t n = 0; n < element.count; ++n) {
    for (const PlyProperty& property : element.properties) {
      const bool face =
          element.name == "face" && (property.name == "vertex_indices" || property.name == "vertex_index");
      const double count = property.count ? values.next(*property.count) : 1.0;
      double first = 0.0;
      double last = 0.0;
      for (double k = 0.0; k < count; ++k) {
        const double index = values.next(property.type);
        if (!face) continue;
        if (k >= 2.0) {
          const Triangle t{corner(first), corner(last), corner(index)};
          if (is_finite(t[0]) && is_finite(t[1]) && is_finite(t[2])) triangles.push_back(t);
        }
        if (k == 0.0) first = index;
        last = index;
      }
    }
  }
}

}  // namespace

Geometry parse_pcd(Bytes bytes, const std::string& name) {
  const PcdHeader header = read_pcd_header(bytes, name);
  Geometry cloud;
  const auto& fields = header.fields;
  if (header.encoding == "ascii") {
    WordReader reader(bytes, header.data);
    std::string_view line;
    for (std::size_t n = 0; n < header.points; ++n) {
      if (!reader.next_line(line)) refuse(name, fmt::format("truncated: {} of {} points", n, header.points));
      const auto words = words_of(line);
      if (words.size() != header.record)
        refuse(name, fmt::format("line {}: must have {} values", header.line + reader.line_number(),
                                 header.record));
      Vector3 p;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto value = number_of<double>(words[fields[header.xyz[axis]].offset]);
        if (!value) refuse(name, fmt::format("line {}: not a number", header.line + reader.line_number()));
        p[static_cast<Eigen::Index>(axis)] = *value;
      }
      add_if_finite(p, cloud);
    }
    return cloud;
  }
  const bool packed = header.encoding == "binary_compressed";
  Bytes data = bytes.subspan(header.data);
  std::vector<unsigned char> unpacked;
  if (packed) {
    if (data.size() < 8) refuse(name, "truncated: binary_compressed data without its sizes");
    const auto size = value_at<std::uint32_t>(data, 0);
    const auto whole = value_at<std::uint32_t>(data, 4);
    data = data.subspan(8);
    // LZF cannot do better than 264 bytes from 3.
    if (size > data.size() || whole / 88 > size)
      refuse(name, fmt::format("truncated: {} compressed bytes for {} are announced, {} are there", size,
                               whole, data.size()));
    unpacked = decompress(data.first(size), whole, name);
    data = unpacked;
  }
  need_points(data.size(), header.record, header.points, name);
  cloud.points.reserve(header.points);
  for (std::size_t n = 0; n < header.points; ++n) {
    Vector3 p;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const PcdField& field = fields[header.xyz[axis]];
      // Compressed: all values of a field, then all of the next.
      const std::size_t at = packed ? field.offset * header.points + n * field.count * field.type.bytes
                                    : n * header.record + field.offset;
      p[static_cast<Eigen::Index>(axis)] = read_number(data, at, field.type, false);
    }
    add_if_finite(p, cloud);
  }
  return cloud;
}

Geometry parse_ply(Bytes bytes, const std::string& name) {
  PlyHeader header;
  WordReader reader(bytes, 0);
  std::string_view line;
  if (!reader.next_line(line) || line != "ply") refuse(name, "not a PLY file: line 1 must be 'ply'");
  for (;;) {
    if (reader.line_number() > 1000 || !reader.next_line(line))
      refuse(name, "truncated PLY header: no end_header");
    if (line == "end_header") break;
    if (line.size() > 10000 || !read_ply_line(words_of(line), header))
      refuse(name, fmt::format("line {}: not a line of a PLY header", reader.line_number()));
  }
  PlyValues values(bytes, std::min(reader.at(), bytes.size()), header, name);
  Geometry geometry;
  std::vector<Vector3> vertices;
  bool faces = false;
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty() && element.count > 0)
      refuse(name, fmt::format("PLY header: element {}: must have a property", element.name));
    if (element.name == "tristrips") refuse(name, "PLY header: element tristrips: must be faces");
    if (element.name == "vertex") {
      read_vertices(element, values, vertices, name);
    } else {
      // What it is not asked for is read over.
      faces = faces || (element.name == "face" && element.count > 0);
      read_faces(element, values, vertices, geometry.triangles, name);
    }
  }
  if (!faces)
    for (const Vector3& p : vertices) add_if_finite(p, geometry);
  return geometry;
}

Geometry parse_las(Bytes bytes, const std::string& name) {
  constexpr std::size_t kShortest = 227;
  constexpr std::size_t kHeader14 = 375;
  if (bytes.size() < kShortest) refuse(name, "truncated LAS header");
  const unsigned major = bytes[24];
  const unsigned minor = bytes[25];
  if (major != 1 || minor > 4) refuse(name, fmt::format("LAS {}.{}: only 1.0 to 1.4 are read", major, minor));
  const auto data = value_at<std::uint32_t>(bytes, 96);
  const unsigned format = bytes[104];
  const auto record = value_at<std::uint16_t>(bytes, 105);
  std::uint64_t points = value_at<std::uint32_t>(bytes, 107);
  if ((format & 0xC0U) != 0) refuse(name, "compressed (LAZ): must be unpacked first");
  if (format > 10 || record < 20)
    refuse(name, fmt::format("LAS point format {} of {} bytes is not known", format, record));
  if (minor == 4 && points == 0) {
    if (bytes.size() < kHeader14) refuse(name, "truncated LAS 1.4 header");
    points = value_at<std::uint64_t>(bytes, 247);
  }
  if (data < kShortest || data > bytes.size())
    refuse(name, "truncated: the LAS points begin after the end of the file");
  need_points(bytes.size() - data, record, points, name);
  Vector3 scale;
  Vector3 offset;
  for (int i = 0; i < 3; ++i) {
    scale[i] = value_at<double>(bytes, 131 + 8 * static_cast<std::size_t>(i));
    offset[i] = value_at<double>(bytes, 155 + 8 * static_cast<std::size_t>(i));
  }
  Geometry cloud;
  cloud.points.reserve(static_cast<std::size_t>(points));
  for (std::size_t n = 0; n < points; ++n) {
    Vector3 p;
    for (int i = 0; i < 3; ++i)
      p[i] = scale[i] * value_at<std::int32_t>(bytes, data + n * record + 4 * static_cast<std::size_t>(i)) +
             offset[i];
    add_if_finite(p, cloud);
  }
  return cloud;
}

}  // namespace roborun::sitl
