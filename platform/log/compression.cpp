#include "platform/log/compression.hpp"

#include <zstd.h>

#include "platform/input/input_error.hpp"

namespace roborun::log {

Compressor::Compressor()
    : context_(ZSTD_createCCtx(), [](ZSTD_CCtx* context) { (void)ZSTD_freeCCtx(context); }) {}

std::string_view Compressor::run(std::string_view bytes, int level) {
  if (!context_) return {};
  out_.resize(ZSTD_compressBound(bytes.size()));
  const std::size_t n =
      ZSTD_compressCCtx(context_.get(), out_.data(), out_.size(), bytes.data(), bytes.size(), level);
  return ZSTD_isError(n) != 0 ? std::string_view() : std::string_view(out_).substr(0, n);
}

Decompressor::Decompressor()
    : context_(ZSTD_createDCtx(), [](ZSTD_DCtx* context) { (void)ZSTD_freeDCtx(context); }) {}

void Decompressor::run(std::string& to, std::string_view frame, std::size_t bytes) {
  const unsigned long long said = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (said != ZSTD_CONTENTSIZE_UNKNOWN && said != bytes)
    throw InputError("a frame of zstd of another size than was said");
  to.resize(bytes);
  const std::size_t n = ZSTD_decompressDCtx(context_.get(), to.data(), to.size(), frame.data(), frame.size());
  if (ZSTD_isError(n) != 0 || n != bytes) throw InputError("a frame that zstd does not read");
}

}  // namespace roborun::log
