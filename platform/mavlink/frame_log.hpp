/// Recorded MAVLink: raw streams of bytes, and .tlog files of ground stations.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "firmware_if/mavlink/receiver.hpp"
#include "platform/input/input_file.hpp"

namespace roborun::mavlink {

/// `time_us`: of the ground station (us since 1970 UTC), in .tlog files only. The frame is valid in the call.
using FrameVisit = std::function<void(firmware_if::mavlink::Event, const firmware_if::mavlink::Frame& frame,
                                      std::optional<std::uint64_t> time_us)>;

/// Visits every event of a stream, to its end: what is pending there is searched as well. Returns the counters.
/// `verifier`: nullptr, or as Receiver has it. Throws InputError if the file cannot be read.
[[nodiscard]] firmware_if::mavlink::Receiver::Counters read_stream(input::InputFile& file,
                                                                   firmware_if::mavlink::Verifier* verifier,
                                                                   const FrameVisit& visit);
/// The same for a .tlog: records of a time (8 bytes, high byte first) and a frame. The time stamps are no part
/// of the stream, so that their bytes start no false frames. After a damaged record the search goes on byte by
/// byte for a time before 4253 and a frame whose checksum is right.
[[nodiscard]] firmware_if::mavlink::Receiver::Counters read_tlog(input::InputFile& file,
                                                                 firmware_if::mavlink::Verifier* verifier,
                                                                 const FrameVisit& visit);

}  // namespace roborun::mavlink
