/// One flight as a page that opens offline: 3D view and charts over one time slider, and the reasons of each decision.
#pragma once

#include <string>

namespace roborun::report {

struct FlightPage {
  std::string title;
  std::string footer;  ///< One line: what flew, where it is from.
  /// A JSON object, as page/flight_page.js reads it; all times in seconds since the start of the flight, ascending, world
  /// frame ENU, metres; null for what is not known:
  ///   facts [[name, text]], notes [text], bounds [[x, y, z], [x, y, z]] or null, start and goal [x, y, z] or null,
  ///   fence [[[x, y], ...]] (outlines from above),
  ///   state {time_s, x_m, y_m, z_m, speed_mps, ref_speed_mps, battery_ratio, phase}: arrays of one length, at least 1,
  ///   decision {time_s, speed_limit_mps, STAGE_s of the six stages, deadline_s, p0_m, p1_m, demand_m, v0_m3, v1_m3, v2_m3,
  ///     why}: arrays of one length,
  ///   plan [{time_s, points_m [x, y, z, x, ...]}],
  ///   map [{time_s, x_m, y_m, z_m, cell_m, columns, rows, runs [value, count, ...]}] with 0 unknown, 1 free, 2 occupied,
  ///     row by row from the lowest corner,
  ///   world {height_m, circles [[x, y, radius]], rings [[[x, y], ...]]}: what stands at that height; may be missing,
  ///   camera [{time_s, camera, name, wide, high, range_m, pixels}]: ascending for each camera (from 0); pixels as letters, row by
  ///     row: page/flight_cameras.js,
  ///   verdict {passed, complaints [text], moment_s or null}: of the flight of a scenario; may be missing,
  ///   live: true if the page shall ask its server for what follows; may be missing,
  ///   failsafe [{time_s, action, phase, conditions [], sensor}], events [{time_s, text}].
  std::string story;
  bool live{false};  ///< It may ask the server that it came from.
};

/// A complete HTML file: no request (but if it is live), no script of others. The story is compressed in it (deflate, base64).
[[nodiscard]] std::string flight_page_html(const FlightPage& page);

}  // namespace roborun::report
