#include "platform/dataset/depth_png.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstring>

#include "platform/input/input_error.hpp"
#include "stages/perception/depth_steps.hpp"

namespace roborun::dataset {
namespace {

constexpr std::size_t kLeastSide = 8, kMostSide = stages::kMaxImageSide;

/// libpng says what is wrong by longjmp: the functions that it may leave so (header, rows) hold nothing with a destructor.
class Decoder {
 public:
  explicit Decoder(std::span<const unsigned char> bytes) : bytes_(bytes) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, &Decoder::fail, &Decoder::warn);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~Decoder() { png_destroy_read_struct(&png_, &info_, nullptr); }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  /// False: why() says it.
  [[nodiscard]] bool header() {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp): libpng's way
    png_set_read_fn(png_, this, &Decoder::give);
    png_read_info(png_, info_);
    return true;
  }
  [[nodiscard]] bool rows(png_bytepp row) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp): libpng's way
    if (std::endian::native == std::endian::little) png_set_swap(png_);
    png_read_image(png_, row);
    png_read_end(png_, nullptr);
    return true;
  }
  [[nodiscard]] std::size_t width() const { return png_get_image_width(png_, info_); }
  [[nodiscard]] std::size_t height() const { return png_get_image_height(png_, info_); }
  [[nodiscard]] int bits() const { return png_get_bit_depth(png_, info_); }
  [[nodiscard]] int channels() const { return png_get_channels(png_, info_); }
  [[nodiscard]] const char* why() const { return why_.data(); }

 private:
  [[noreturn]] static void fail(png_structp png, png_const_charp why) {
    auto& self = *static_cast<Decoder*>(png_get_error_ptr(png));
    std::strncpy(self.why_.data(), why, self.why_.size() - 1);
    png_longjmp(png, 1);
  }
  static void warn(png_structp /*png*/, png_const_charp /*why*/) {}
  static void give(png_structp png, png_bytep to, std::size_t count) {
    auto& self = *static_cast<Decoder*>(png_get_io_ptr(png));
    if (count > self.bytes_.size() - self.at_) png_error(png, "it is cut off");
    std::memcpy(to, self.bytes_.data() + self.at_, count);
    self.at_ += count;
  }

  std::span<const unsigned char> bytes_;
  std::size_t at_{0};
  png_structp png_{nullptr};
  png_infop info_{nullptr};
  std::array<char, 120> why_{"no memory"};
};

}  // namespace

DepthPng parse_depth_png(std::span<const unsigned char> bytes, const std::string& name) {
  Decoder decoder(bytes);
  const auto refuse = [&] {
    throw InputError(fmt::format("{}: {}: must be a whole PNG file", name, decoder.why()));
  };
  if (!decoder.header()) refuse();
  if (decoder.bits() != 16 || decoder.channels() != 1)
    throw InputError(fmt::format("{}: {} bits in {} channel{}: must be 16 bits in one, depth", name,
                                 decoder.bits(), decoder.channels(), decoder.channels() == 1 ? "" : "s"));
  DepthPng image{decoder.width(), decoder.height(), {}};
  if (std::min(image.width, image.height) < kLeastSide || std::max(image.width, image.height) > kMostSide)
    throw InputError(fmt::format("{}: {} x {} pixels: must be {} to {} a side", name, image.width,
                                 image.height, kLeastSide, kMostSide));
  image.value.resize(image.width * image.height);
  std::vector<png_bytep> row(image.height);
  for (std::size_t v = 0; v < image.height; ++v)
    row[v] = reinterpret_cast<png_bytep>(image.value.data() + v * image.width);
  if (!decoder.rows(row.data())) refuse();
  return image;
}

}  // namespace roborun::dataset
