/// zstd, with its contexts kept.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

struct ZSTD_CCtx_s;
struct ZSTD_DCtx_s;

namespace roborun::log {

/// Levels of zstd (DECISIONS.md): of noise, where a higher one finds nothing, and of all else.
inline constexpr int kLevelOfNoise = 1, kLevel = 7;

class Compressor {
 public:
  Compressor();
  /// One frame, valid until the next call; empty if there is no memory.
  [[nodiscard]] std::string_view run(std::string_view bytes, int level);

 private:
  std::unique_ptr<ZSTD_CCtx_s, void (*)(ZSTD_CCtx_s*)> context_;
  std::string out_;
};

class Decompressor {
 public:
  Decompressor();
  /// A frame of exactly `bytes`, which are allocated: the caller has judged their number. Replaces `to`. Throws InputError.
  void run(std::string& to, std::string_view frame, std::size_t bytes);

 private:
  std::unique_ptr<ZSTD_DCtx_s, void (*)(ZSTD_DCtx_s*)> context_;
};

}  // namespace roborun::log
